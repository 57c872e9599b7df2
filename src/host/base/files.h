// Whole files in and out, with errors that name the file. No half-written output is ever left behind.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace wisp {

using Bytes = std::vector<uint8_t>;

// All bytes of `path`. Throws InputError `PATH: cannot be opened: REASON` or `PATH: cannot be read: REASON`, and
// Error(exit_memory) for a file that does not fit in memory.
Bytes read_file(const std::string &path);
// The first bytes, `most` of them or all, with the same errors.
Bytes read_beginning(const std::string &path, size_t most);
// The same as read_file() for files that another file names: devices and pipes, which may never end, are refused.
Bytes read_plain_file(const std::string &path);

// Writes `bytes` to PATH.part and renames it, so that `path` holds either exactly `bytes` or what it held before, after
// a power cut, too. A device or a pipe is written directly. Throws Error(exit_output) `PATH: could not be written:
// REASON`. Neither an error nor an interrupt leaves PATH.part; the one of a killed process is overwritten.
void write_file(const std::string &path, const Bytes &bytes);
void write_file(const std::string &path, const std::string &text);

// Throws what write_file() would where `path` cannot be written, as far as this can be told without writing: its folder
// is not there or not writable, it is a folder. Leaves nothing, and what is there as it is.
void check_writable(const std::string &path);

// The numbers of the files that a name with `%04d` stands for, in ascending order. Throws InputError where their folder
// is there and cannot be read.
std::vector<int64_t> numbers_of_files(const std::string &pattern);

// Removes the PATH.part that a killed process has left, but not one that another process is writing.
void tidy_up(const std::string &path);

} // namespace wisp
