// One frame of a scene on its way through the core: what `inspect` and `show` have in common.
#pragma once
#include "host/commands/request.h"
#include "wisp/wisp.h"
#include <functional>

namespace wisp {

// Throws Error(exit_usage) for options of `render` that do not go with such a command, and for several frames.
// has_output: it makes pictures.
void check_single_frame(const Request &request, const std::string &command, bool has_output);

class SingleFrame {
  public:
    // Prepares the scene, and the settings that follow from the options. Throws Error.
    explicit SingleFrame(const Request &request);

    // The core's plan of the settings, which may have been changed; reads the particle map of --map-in. Throws Error
    // for a plan that cannot be followed, and for one that does not fit in memory.
    void make_plan();
    // Calls core(job), once or several times. The job has no place yet for the picture. Throws the Error of a core that
    // did not finish.
    void run(const std::function<Status(Job &job)> &core);

    PreparedScene prepared;
    Settings settings;
    Plan plan = {};
    Statistics statistics = {};

  private:
    const Request &request_;
    std::optional<EndAtOnce> at_once_;
    MapFile map_;
    std::unique_ptr<unsigned char[]> block_;
};

} // namespace wisp
