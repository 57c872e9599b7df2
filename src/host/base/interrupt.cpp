#include "host/base/interrupt.h"
#include "host/base/error.h"
#include <atomic>
#include <csignal>
#include <cstdio>
#include <initializer_list>
#include <string_view>
#include <unistd.h>

namespace wisp {

namespace {

volatile std::sig_atomic_t noted = 0;
std::atomic<const EndAtOnce *> living = nullptr;

} // namespace

void EndAtOnce::note(int signal) {
    noted = signal;
    if (const EndAtOnce *now = living) now->end(signal);
}

void install_signal_handlers() {
    for (int signal : {SIGHUP, SIGINT, SIGTERM}) {
        struct sigaction action = {};
        if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) continue;
        action.sa_handler = EndAtOnce::note;
        action.sa_flags = SA_RESTART | SA_RESETHAND; // reading and writing go on; the next one is not noted
        sigaction(signal, &action, nullptr);
    }
}

int received_signal() { return noted; }

EndAtOnce::EndAtOnce(const std::string &before, const std::string &after) : before_(before), after_(after + "\n") {
    std::fflush(stdout);
    living = this;
    if (noted) end(noted);
}

EndAtOnce::~EndAtOnce() { living = nullptr; }

void EndAtOnce::end(int signal) const { // in a handler: nothing but write() and _exit()
    const std::string_view words[] = {before_, signal_name(signal), after_};
    for (const std::string_view &part : words)
        if (write(STDERR_FILENO, part.data(), part.size()) < 0) break;
    _exit(exit_signal + signal);
}

const char *signal_name(int signal) { return signal == SIGHUP ? "SIGHUP" : signal == SIGINT ? "SIGINT" : "SIGTERM"; }

} // namespace wisp
