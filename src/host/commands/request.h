// What a command line asks of a scene: its file, the options, and what the core is to do for them.
#pragma once
#include "host/commands/arguments.h"
#include "host/commands/core.h"
#include "host/prepare/prepare.h"
#include "host/results/map_file.h"
#include "wisp/settings.h"
#include <memory>

namespace wisp {

// The scene of a command line, and the options: the scene's own first, those of the command line over them.
struct Request {
    std::string name;
    SceneFile file;
    Options options;
    Options::Frames frames;
};

// Throws Error(exit_usage) or InputError.
Request read_request(const CommandLine &line);

bool several_frames(const Request &request);

// Throws Error(exit_usage) for options of `render` that do not go together.
void check_options(const Request &request);

// Throws Error(exit_usage) for options that exclude each other, or that the picture does not have room for.
Settings settings_of(const Options &options, const PreparedScene &prepared);

inline bool uses_map(const Settings &settings) { return !settings.reference && settings.method == Method::map; }

// The core's plan, if it can be followed; throws Error for one that cannot, or that is beyond --memory.
Plan checked_plan(const Request &request, const Scene &scene, const Settings &settings);

// The picture is kept twice, as numbers and as the bytes of its file, those of --reference with their sums.
uint64_t picture_bytes(const Options &options, const Settings &settings);
// Throws Error for a picture that is beyond --memory with the plan, or by itself beyond the machine's memory, all of which
// is written; what the system promises and cannot give ends a process without a word.
void check_picture(const Request &request, const Settings &settings, const Plan &plan);

// The particle map of --map-in; `scene`: fingerprint_of_map(). Throws InputError.
MapFile saved_map(const Request &request, int64_t frame, const std::string &scene, const Plan &plan);

// Why the core did not finish, as an Error.
[[noreturn]] void fail(const Request &request, const Plan &plan, int64_t frame, Status status);
[[noreturn]] void stop(const Request &request, int64_t frame); // by a signal

// The arena's block is not touched until the core does, so what a plan reserves and a scene does not use costs nothing.
std::unique_ptr<unsigned char[]> make_block(const std::string &name, uint64_t bytes);

} // namespace wisp
