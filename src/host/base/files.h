// Whole files in and out, with errors that name the file. No half-written output is ever left behind.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace wisp {

using Bytes = std::vector<uint8_t>;

// All bytes of `path`. Throws InputError `PATH: cannot be opened: REASON` or `PATH: cannot be read: REASON`.
Bytes read_file(const std::string &path);
// The same for files that another file names: devices and pipes, which may never end, are refused.
Bytes read_plain_file(const std::string &path);

// `path` holds exactly `bytes` afterwards, or what it held before: they are written aside, to PATH.part, and renamed.
// What is not a plain file (a device, a pipe) is written directly. Throws Error(exit_output) `PATH: could not be
// written: REASON`; nothing is left aside then, nor by an interrupt, and what a killed process left is overwritten.
void write_file(const std::string &path, const Bytes &bytes);
void write_file(const std::string &path, const std::string &text);

// Removes the PATH.part of a process that was killed, not one that is being written.
void tidy_up(const std::string &path);

} // namespace wisp
