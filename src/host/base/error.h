// The one exception of the host: it becomes the line that the user sees (messages.h) and the exit status.
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

// What is wrong, and where: in `FILE`, at `FILE:LINE` or `FILE: byte N`; an empty place where no file is at fault.
struct Error : std::runtime_error {
    Error(Exit status_, const std::string &place_, const std::string &text_)
        : std::runtime_error(place_.empty() ? text_ : place_ + ": " + text_), status(status_), place(place_),
          text(text_) {}
    Error(Exit status_, const std::string &text_) : Error(status_, "", text_) {}
    Exit status;
    std::string place, text;
};

// A file that cannot be read, or whose contents are wrong: the text says what is wrong and what was expected.
struct InputError : Error {
    InputError(const std::string &place_, const std::string &text_) : Error(exit_input, place_, text_) {}
};

// What `read` reads: a fault of the file that a statement names is one of the statement, at `where`.
template <class Read> auto named_at(const std::string &where, Read read) {
    try {
        return read();
    } catch (const InputError &error) {
        throw InputError(where, error.what());
    }
}

} // namespace wisp
