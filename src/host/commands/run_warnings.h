// The warnings of a command that renders: of what a scene shows, and of options that change nothing.
#pragma once
#include "host/base/messages.h"
#include "host/commands/request.h"
#include "host/images/picture.h"

namespace wisp {

class RunWarnings {
  public:
    explicit RunWarnings(const Request &request) : request_(request), warnings_(request.options.quiet) {}

    // Of a frame that is to be rendered. An option is warned of in the last frame, if no frame before needed it.
    void of_frame(int64_t frame, const PreparedScene &prepared, const Settings &settings, const Plan &plan);
    // Of the light that is scattered more than once: photons leave it in deep places, or do not tell whence it comes.
    void of_light(const PreparedScene &prepared, const Settings &settings, const Plan &plan);
    // Of that light, when a frame is done: the nearest photons may be far.
    void of_photons(const Scene &scene, const Settings &settings, const Plan &plan, const Statistics &statistics);
    // Of the noise of photons at nodes, or of random paths in their place, when a frame is done.
    void of_noise(const Scene &scene, const Settings &settings, const Statistics &statistics, const Picture &picture);
    // Of radiances that fixed point has cut off, when a frame is done.
    void of_radiances(const Statistics &statistics);
    void print(const Warning &warning) { warnings_.print(warning); }

  private:
    const Request &request_;
    Warnings warnings_;
    std::optional<std::vector<Warning>> idle_; // options, in all frames so far
};

} // namespace wisp
