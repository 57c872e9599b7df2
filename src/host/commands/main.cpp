// wisp: the command line.
#include "host/base/interrupt.h"
#include "host/base/messages.h"
#include "host/base/text.h"
#include "host/base/version.h"
#include "host/commands/commands.h"
#include "host/scene/options.h"
#include "core/numbers/self_test.h"
#include <csignal>
#include <cstdio>
#include <new>
#include <optional>

#ifndef WISP_FLAGS
#define WISP_FLAGS "unknown flags"
#endif

namespace wisp {

namespace {

struct Command {
    const char *name, *usage, *what, *example;
    int (*run)(const std::vector<std::string> &arguments);
    std::string (*help)(); // on its own options; nullptr: it has those of render alone
    // Needs this process's floating point to be IEEE's, and says itself where a signal stops it.
    bool renders;
    const char *refused = ""; // of render's options, those that it never takes
};

// Whether a list of names between blanks has this one.
bool has_name(const std::string &names, const std::string &name) {
    return (" " + names + " ").find(" " + name + " ") != std::string::npos;
}

std::string render_help(const std::string &refused = "") {
    // By subject. A test holds that each option stands in one group.
    const struct {
        const char *subject;
        std::vector<std::string> options;
    } groups[] = {{"Picture", {"size", "spp", "crop", "frames", "frame-count", "arith", "exposure"}},
                  {"What is written", {"output", "layers", "digest", "stats", "progress", "quiet", "verbose"}},
                  {"Smoke", {"smoke", "photons", "seed", "step", "max-error", "thin"}},
                  {"Smoke, the method in detail",
                   {"irradiance", "irradiance-step", "density-step", "light-step", "estimate", "deposit", "direction",
                    "gather", "gather-radius"}},
                  {"Surfaces", {"shadows", "lights", "depth", "tree"}},
                  {"A file of smoke by itself", {"up", "ground", "grid", "write-scene"}},
                  {"Reference", {"reference", "passes", "error-out"}},
                  {"Maps, memory", {"map-out", "map-in", "batches", "remap", "memory"}}};
    std::string text;
    for (const auto &group : groups) {
        std::vector<std::string> options;
        for (const std::string &option : group.options)
            if (!has_name(refused, option)) options.push_back(option);
        if (!options.empty())
            text += std::string(" ") + group.subject + ":\n" + help_lines(scene_options(), options);
    }
    return text;
}

constexpr Command commands[] = {
    {"render", "SCENE [options]", "pictures, one per frame; of a scene, or of a file of smoke by itself",
     "wisp render smoke.bgeo -o smoke.png --size 800x600", render_command, nullptr, true},
    {"plan", "SCENE [options]", "the stages that this scene needs, and the bytes of each",
     "wisp plan scene.aff --photons 4M", plan_command, plan_help, true, "max-error"},
    {"inspect", "SCENE X Y [options]", "a pixel explained: its rays, hits, shadows, smoke and sums",
     "wisp inspect scene.aff 120 64", inspect_command, inspect_help, true,
     "output layers digest stats max-error reference passes error-out map-out batches"},
    {"show", "STAGE SCENE [options]", "a picture of what a stage makes: density, photons, trees, proofs ...",
     "wisp show density scene.aff -o density.png", show_command, show_help, true,
     "layers stats max-error reference passes error-out map-out batches"},
    {"info", "FILE [--json]", "what a file is and holds: particles, grid, scene, map, passes, picture",
     "wisp info smoke.vdb", info_command, info_help, false},
    {"compare", "A B [options]", "how two pictures differ, .pfm, .exr or .png; exit 1 when they do",
     "wisp compare a.pfm b.pfm --tolerance 0.01", compare_command, compare_help, false},
    {"merge", "A B [...] -o FILE", "the picture of several .passes together, or .map as one .map",
     "wisp merge a.passes b.passes -o truth.pfm", merge_command, merge_help, false},
    {"stitch", "A B [...] -o FILE", "the picture of parts rendered with --crop, .pfm or .exr",
     "wisp stitch top.pfm bottom.pfm -o whole.png", stitch_command, stitch_help, false},
};

std::string usage_of(const Command &command) {
    return in_columns(std::string("wisp ") + command.name + " " + command.usage, command.what);
}

constexpr char how_to_write[] =
    "written --x V or --x=V; -o is --output, -q --quiet, -v --verbose. Counts may be\n250k, "
    "2M, 1G (thousands, millions, thousand millions) or 2.5e5";

std::string help_on(const Command &command) {
    return usage_of(command) + "\nExample: " + command.example + "\n\nOptions, " + how_to_write + ":\n" +
           (command.help ? command.help() : "") + (command.renders ? render_help(command.refused) : "");
}

std::string help_text() {
    std::string text;
    for (const Command &command : commands) text += usage_of(command);
    text += in_columns("wisp COMMAND --help", "the options of one command, and an example; as wisp help COMMAND") +
            in_columns("wisp help | version", "all of this; compiler and flags") + "\nOptions, " + how_to_write +
            ":\n" + render_help() +
            "\nOptions of inspect, beside those of render that 'wisp inspect --help' lists, but --shadows paper.\n"
            "With --crop what is before the pixel in the crop is rendered first, so that shadows are decided by\n"
            "what was learnt there, else the pixel alone.\n" +
            inspect_help() + "\nWhat show has, beside those of render that 'wisp show --help' lists:\n" + show_help() +
            "\nOptions of plan, beside those of render:\n" + plan_help() + "\nOptions of info:\n" +
            info_help() + "\nOptions of compare:\n" + compare_help() +
            "\nExit: 0 done, 1 pictures differ, 2 wrong usage, 3 bad input, 4 does not fit in memory, 5 could\n"
            "not write, 128 + N stopped by signal N; frames that are there already as they would be made are\n"
            "kept\n";
    return text;
}

std::string expected_commands() {
    std::string expected = ", expected ";
    for (const Command &command : commands) expected += command.name + std::string(", ");
    return expected + "help or version";
}

const Command &command_named(const std::string &name) {
    std::vector<std::string> names = {"help", "version"};
    for (const Command &command : commands) {
        if (name == command.name) return command;
        names.push_back(command.name);
    }
    throw Error(exit_usage, "there is no command '" + name + "'" + expected_commands() + did_you_mean(name, names));
}

void refuse_more_words(const std::vector<std::string> &words, size_t most, const char *expected) {
    if (words.size() > most)
        throw Error(exit_usage,
                    "found '" + printable(words[most]) + "' behind '" + words[most - 1] + "', expected " + expected);
}

int run(const std::vector<std::string> &words) {
    if (words.empty()) throw Error(exit_usage, "found no command" + expected_commands());
    const std::string &name = words[0];
    if (name == "help" || name == "--help" || name == "-h") {
        refuse_more_words(words, 2, "one command");
        std::fputs((words.size() > 1 ? help_on(command_named(words[1])) : help_text()).c_str(), stdout);
        return exit_done;
    }
    if (name == "version" || name == "--version") {
        refuse_more_words(words, 1, "nothing");
        std::printf("wisp %s\ncompiler %s\nflags %s\narithmetics f32 f64 fixed\n", version, __VERSION__, WISP_FLAGS);
        return exit_done;
    }
    const Command &command = command_named(name);
    if (words.size() > 1 && (words[1] == "--help" || words[1] == "-h")) {
        std::fputs(help_on(command).c_str(), stdout);
        return exit_done;
    }
    std::optional<EndAtOnce> at_once;
    if (!command.renders) {
        install_signal_handlers();
        at_once.emplace("wisp: error: " + name + ": stopped by ", "");
    }
    const char *fault = command.renders ? arithmetic_fault() : nullptr;
    if (!fault) return command.run(std::vector<std::string>(words.begin() + 1, words.end()));
    throw Error(exit_usage,
                std::string("this process does not compute as wisp needs it: ") + fault +
                    "; either a library in it, as any that is built for 'fast math', has switched the processor's "
                    "mode: run without it (LD_PRELOAD, plugins); or wisp was built with other flags than the "
                    "Makefile's: 'wisp version' prints them");
}

} // namespace

} // namespace wisp

int main(int count, char **words) {
    std::signal(SIGXFSZ, SIG_IGN); // a file that may grow no more is one that cannot be written
    const auto fail = [](const wisp::Error &error) {
        wisp::print_error(error);
        return error.status;
    };
    try {
        try {
            const int status = wisp::run(std::vector<std::string>(words + 1, words + count));
            if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return status;
            return fail({wisp::exit_output, "standard output could not be written"});
        } catch (const wisp::Error &error) {
            return fail(error);
        }
    } catch (const std::bad_alloc &) { // here a line must take no memory
        std::fputs("wisp: error: the system gives no more memory\n", stderr);
        return wisp::exit_memory;
    }
}
