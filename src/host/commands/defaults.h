// Settings that the options leave open.
#pragma once
#include "host/scene/options.h"
#include "wisp/scene.h"
#include "wisp/settings.h"

namespace wisp {

// Sets the method and the spacings of grids and samples. settings.paths becomes 0, or 1 where random paths take the
// place of photons: bricks fine enough for these would be too large. The goal and the photons are set already. Throws
// Error(exit_usage) for options that exclude each other.
void choose_defaults(const Options &options, const Scene &scene, Settings &settings);

} // namespace wisp
