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

// `path` holds exactly `bytes` afterwards, or what it held before: they are written aside in the same folder and
// renamed. What is not a plain file (a device, a pipe) is written directly. Throws Error(exit_output) `PATH: could not
// be written: REASON`; nothing is left aside then.
void write_file(const std::string &path, const Bytes &bytes);
void write_file(const std::string &path, const std::string &text);

} // namespace wisp
