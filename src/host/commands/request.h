// A command line that renders a scene: the scene's file, the options, and the settings of the core that follow from
// both.
#pragma once
#include "host/commands/arguments.h"
#include "host/base/interrupt.h"
#include "host/base/renderers.h"
#include "host/prepare/prepare.h"
#include "host/results/map_file.h"
#include "wisp/settings.h"
#include <memory>
#include <optional>

namespace wisp {

// The scene of a command line, and the options: the scene's own first, those of the command line over them.
struct Request {
    std::string name;
    SceneFile file;
    Options options;
    Options::Frames frames;
    std::vector<std::string> given; // the options of the command line
};

// Throws Error(exit_usage) or InputError. A signal ends the process while the scene is read, and is noted from then on.
Request read_request(const CommandLine &line);

// The files that the request's frames are made of: the scene, what it includes, textures and smoke.
std::vector<std::string> files_read(const Request &request);

bool is_given(const Request &request, const std::string &option);
bool several_frames(const Request &request);

// Throws Error(exit_usage) for options of `render` that do not go together.
void check_options(const Request &request);

// Throws Error(exit_usage) for options that exclude each other, or that the picture does not have room for. `why_paths`:
// why random paths take the place of photons, or nullptr.
Settings settings_of(const Options &options, const PreparedScene &prepared, const char **why_paths = nullptr);

inline bool uses_map(const Settings &settings) {
    return settings.goal != Goal::reference && settings.method == Method::map;
}

// The core's plan. Throws Error for a plan that cannot be followed.
Plan checked_plan(const Request &request, const Scene &scene, const Settings &settings);

// fingerprint_of_map() of a scene that is rendered so.
std::string fingerprint_of_map(const Request &request, const PreparedScene &prepared, const Settings &settings,
                               const Plan &plan);

// The particle map of --map-in; `scene`: fingerprint_of_map(). Throws InputError.
MapFile saved_map(const Request &request, int64_t frame, const std::string &scene, const Plan &plan);

// Throws the Error of a core that did not finish.
[[noreturn]] void fail(const Request &request, const Plan &plan, int64_t frame, Status status);
[[noreturn]] void stop(const Request &request, int64_t frame); // after a signal
// A signal ends the process at once, with the line that stop() leads to.
void end_at_once(const Request &request, int64_t frame, std::optional<EndAtOnce> &life);

} // namespace wisp
