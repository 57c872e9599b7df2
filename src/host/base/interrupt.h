// Signals that end the process: they are noted, and the work stops at the next point where it can.
#pragma once
#include <string>

namespace wisp {

// From now on the first SIGINT, SIGTERM or SIGHUP is noted; a second one of the same kind ends the process at once. A
// signal that the process ignores (nohup) stays ignored.
void install_signal_handlers();

// The signal that was noted, or 0.
int received_signal();

// Its name.
const char *signal_name(int signal);

// As long as it lives, a signal ends the process at once, with the line `before` SIGNAL `after` on standard error and
// the status that exit_signal gives. So reading and preparing need not ask. Nothing of the process may be half made
// then: files are written with signals held (files.cpp), and standard output is flushed here.
class EndAtOnce {
  public:
    EndAtOnce(const std::string &before, const std::string &after);
    ~EndAtOnce();
    EndAtOnce(const EndAtOnce &) = delete;
    EndAtOnce &operator=(const EndAtOnce &) = delete;

  private:
    friend void install_signal_handlers();
    static void note(int signal);
    void end(int signal) const;

    std::string before_, after_;
};

} // namespace wisp
