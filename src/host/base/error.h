// The one exception of the host: its text is the line that the user sees, its code the exit status.
#pragma once
#include <stdexcept>
#include <string>

namespace wisp {

// Exit statuses of the command line.
enum Exit {
    exit_done = 0,
    exit_difference = 1,
    exit_usage = 2,
    exit_input = 3,
    exit_memory = 4,
    exit_output = 5,
    exit_signal = 128 // and the signal's number, as shells say it
};

struct Error : std::runtime_error {
    Error(Exit status_, const std::string &line) : std::runtime_error(line), status(status_) {}
    Exit status;
};

// A file that cannot be read, or whose contents are wrong: `FILE:LINE: what is wrong, what was expected` or `FILE: byte
// N: ...`.
struct InputError : Error {
    explicit InputError(const std::string &line) : Error(exit_input, line) {}
};

} // namespace wisp
