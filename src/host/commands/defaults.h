// Settings that the options leave open.
#pragma once
#include "host/scene/options.h"
#include "wisp/scene.h"
#include "wisp/settings.h"

namespace wisp {

// Sets the method and the spacings of grids and samples. So many random paths from each ray take the place of photons
// where these would err. The goal and the photons are set already. Throws Error(exit_usage) for options that exclude
// each other.
void choose_defaults(const Options &options, const Scene &scene, uint32_t paths, Settings &settings);

} // namespace wisp
