// Lines on standard error, as compilers write them: `PLACE: error: TEXT` and `PLACE: warning: TEXT`, where PLACE is
// `FILE`, `FILE:LINE` or `FILE: byte N`, or the program where no file is at fault. Each is one line, whatever bytes a
// file or an argument put into it.
#pragma once
#include "host/base/error.h"
#include <set>

namespace wisp {

void print_error(const Error &error, const std::string &program = "wisp");

// A line that is neither: what was done.
void print_note(const std::string &text);

struct Warning {
    std::string kind;  // of which a run says the first alone
    std::string place; // as that of an Error
    std::string text;
};

// The warnings of a run, which is quiet with --quiet.
class Warnings {
  public:
    explicit Warnings(bool quiet) : quiet_(quiet) {}
    void print(const Warning &warning);

  private:
    bool quiet_;
    std::set<std::string> said_; // kinds
};

} // namespace wisp
