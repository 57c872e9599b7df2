// The file format that `.passes`, `.map` and records of pictures share: a line that names the kind, a line with the
// SHA-256 of all bytes after it, more lines of text, then 64-bit words, little-endian. Files of sums also share ranges:
// which parts of the work are in a file.
#pragma once
#include "host/base/byte_reader.h"
#include "host/base/files.h"
#include <utility>

namespace wisp {

// Parts of the work that are done, by number: half-open, ascending, with gaps between them.
using Ranges = std::vector<std::pair<uint32_t, uint32_t>>;

// " A:B C:D"
std::string ranges_text(const Ranges &ranges);

// Adds parts of the kind `what`; ranges that touch become one, so that the same parts are always the same text. Throws
// InputError with `name` in front, and changes nothing, when some parts are in `ranges` already.
void add_ranges(Ranges &ranges, const Ranges &more, const char *what, const std::string &name);

// The rest of the line as ranges of parts below `end`.
Ranges read_ranges(ByteReader &reader, const char *what, int64_t end);

// The next word as a whole number from `low` to `high`; an error says that `what` was expected.
int64_t read_integer(ByteReader &reader, const char *what, int64_t low, int64_t high);

// A file of the line `first`, the checksum, `lines` (whole lines) and `words`.
Bytes checksummed_bytes(const std::string &first, const std::string &lines, const Bytes &words);

// Whether the first line is `first`.
bool has_first_line(const Bytes &bytes, const std::string &first);

// Reads the first two lines. Fails unless the first line is `first`, which files of `kind` have, and the SHA-256 is
// right.
void read_checksum(ByteReader &reader, const std::string &first, const char *kind);

void put_word(Bytes &bytes, uint64_t word);
uint64_t read_word(ByteReader &reader);

} // namespace wisp
