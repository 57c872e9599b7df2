#include "host/base/interrupt.h"
#include <csignal>
#include <initializer_list>

namespace wisp {

namespace {

volatile std::sig_atomic_t noted = 0;

void note(int signal) { noted = signal; }

} // namespace

void install_signal_handlers() {
    for (int signal : {SIGHUP, SIGINT, SIGTERM}) {
        struct sigaction action = {};
        if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) continue;
        action.sa_handler = note;
        action.sa_flags = SA_RESTART | SA_RESETHAND; // reading and writing go on; the next one is not noted
        sigaction(signal, &action, nullptr);
    }
}

int received_signal() { return noted; }

const char *signal_name(int signal) { return signal == SIGHUP ? "SIGHUP" : signal == SIGINT ? "SIGINT" : "SIGTERM"; }

} // namespace wisp
