// One frame of a scene on its way through the core: what `inspect` and `show` have in common.
#pragma once
#include "host/commands/memory_check.h"
#include "host/commands/run_warnings.h"
#include "wisp/wisp.h"
#include <functional>

namespace wisp {

// Throws Error(exit_usage) for options of `render` that do not go with such a command, and for several frames.
// has_output: it makes pictures.
void check_single_frame(const Request &request, const std::string &command, bool has_output);

class SingleFrame {
  public:
    // Prepares the request's frame.
    explicit SingleFrame(const Request &request);

    // Prepares another frame: the scene, and the settings that follow from the options. Throws Error.
    void prepare(int64_t frame);

    // The core's plan of the settings, which may have been changed; reads the particle map of --map-in. Throws Error
    // for a plan that cannot be followed, and for one that does not fit in memory. `shows_light`: that is scattered more
    // than once, of which there may be warnings.
    void make_plan(bool shows_light = true);
    // Calls core(job), once or several times. The job has no place yet for the picture. Throws the Error of a core that
    // did not finish.
    void run(const std::function<Status(Job &job)> &core);

    PreparedScene prepared;
    Settings settings;
    Plan plan = {};
    FrameCache cache = {}; // for jobs that learn from frame to frame

  private:
    const Request &request_;
    RunWarnings warnings_;
    int64_t frame_;
    std::optional<EndAtOnce> at_once_;
    MapFile map_;
    Block block_;
};

} // namespace wisp
