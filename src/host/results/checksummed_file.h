// What files of sums have in common, parts of which are made apart and added up: `.passes` and `.map`. Lines of text
// (what it is, the SHA-256 of all behind that line, more lines), then 64-bit words, little-endian.
#pragma once
#include "host/base/byte_reader.h"
#include "host/base/files.h"
#include <utility>

namespace wisp {

// Parts that are done, by number: half-open, ascending, apart.
using Ranges = std::vector<std::pair<uint32_t, uint32_t>>;

// " A:B C:D"
std::string ranges_text(const Ranges &ranges);

// Adds parts of the kind `what`; those that touch become one range, so that the same parts are the same text. Throws
// InputError with `name` in front, and changes nothing, when some are there already.
void add_ranges(Ranges &ranges, const Ranges &more, const char *what, const std::string &name);

// The rest of the line as ranges of parts below `end`.
Ranges read_ranges(ByteReader &reader, const char *what, int64_t end);

// The next word as a whole number; `what` is expected.
int64_t read_integer(ByteReader &reader, const char *what, int64_t low, int64_t high);

// A file that begins with the line `first`; `about` are more whole lines.
Bytes seal(const std::string &first, const std::string &about, const Bytes &words);

// The reader steps over the first two lines; fails unless the first is `first`, that of `kind`, and the SHA-256 is
// right.
void unseal(ByteReader &reader, const std::string &first, const char *kind);

void put_word(Bytes &bytes, uint64_t word);
uint64_t read_word(ByteReader &reader);

} // namespace wisp
