// Settings that the options leave open.
#pragma once
#include "host/scene/options.h"
#include "wisp/scene.h"
#include "wisp/settings.h"

namespace wisp {

// Sets the method and the spacings of grids and samples. Throws Error(exit_usage) for options that exclude each other.
void choose_defaults(const Options &options, const Scene &scene, Settings &settings);

// The volume of a smoke: of particles that of the cells, of a support's size, that have some.
double volume_of(const SmokeDescription &smoke);

// The mean optical depth of one smoothing length (the smallest of all smokes) in the densest smoke; 0 without smoke.
double depth_of_length(const Scene &scene);

} // namespace wisp
