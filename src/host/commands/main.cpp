// wisp: the command line.
#include "host/base/error.h"
#include "host/base/version.h"
#include "host/commands/commands.h"
#include "host/images/compare.h"
#include "host/scene/options.h"
#include "wisp/self_test.h"
#include <cstdio>
#include <new>

#ifndef WISP_FLAGS
#define WISP_FLAGS "unknown flags"
#endif

namespace wisp {

namespace {

// An error is one line, whatever bytes a file or an argument put into it.
void print_error(std::string line) {
    for (char &c : line)
        if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
    std::fprintf(stderr, "%s\n", line.c_str());
}

int run(const std::vector<std::string> &words) {
    if (words.empty())
        throw Error(exit_usage,
                    "found no command, expected render, plan, inspect, compare, merge, stitch, help or version");
    const std::string &command = words[0];
    const std::vector<std::string> arguments(words.begin() + 1, words.end());
    if (command == "help" || command == "--help" || command == "-h") {
        std::fputs(help_text().c_str(), stdout);
        return exit_done;
    }
    if (command == "version" || command == "--version") {
        std::printf("wisp %s\ncompiler %s\nflags %s\narithmetics f32 f64 fixed\n", version, __VERSION__, WISP_FLAGS);
        return exit_done;
    }
    if (command == "compare") return compare_command(arguments);
    if (command == "merge") return merge_command(arguments);
    if (command == "stitch") return stitch_command(arguments);
    if (command != "render" && command != "plan" && command != "inspect")
        throw Error(exit_usage, "there is no command '" + command +
                                    "', expected render, plan, inspect, compare, merge, stitch, help or version");
    if (const char *fault = arithmetic_fault())
        throw Error(exit_usage,
                    std::string("this process does not compute as wisp needs it: ") + fault +
                        "; either a library in it, as any that is built for 'fast math', has switched the processor's "
                        "mode: run without it (LD_PRELOAD, plugins); or wisp was built with other flags than the "
                        "Makefile's: 'wisp version' prints them");
    if (command == "inspect") return inspect_command(arguments);
    return command == "render" ? render_command(arguments) : plan_command(arguments);
}

} // namespace

} // namespace wisp

int main(int count, char **words) {
    int status;
    try {
        status = wisp::run(std::vector<std::string>(words + 1, words + count));
    } catch (const wisp::Error &error) {
        wisp::print_error(error.what());
        return error.status;
    } catch (const std::bad_alloc &) {
        std::fprintf(stderr, "wisp: the system gives no more memory\n");
        return wisp::exit_memory;
    }
    if (std::fflush(stdout) != 0) {
        std::fprintf(stderr, "wisp: standard output could not be written\n");
        return wisp::exit_output;
    }
    return status;
}
