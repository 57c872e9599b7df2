// How a scene is rendered where the options leave it open.
#pragma once
#include "host/scene/options.h"
#include "wisp/scene.h"
#include "wisp/settings.h"

namespace wisp {

// Sets the method and the steps of what is kept. Throws Error(exit_usage) for options that exclude each other.
void choose_defaults(const Options &options, const Scene &scene, Settings &settings);

// The optical depth of a smoothing length of the finest smoke, in the mean over the volume of the smoke (counted in
// cells of a support's size); 0 without smoke.
double depth_of_length(const Scene &scene);

} // namespace wisp
