// The layers of a rendered picture: the core's, and what the host adds, the number of samples and the standard error.
#pragma once
#include "host/images/layers.h"
#include "host/results/passes.h"
#include "wisp/wisp.h"

namespace wisp {

// Room for all of them; the core's come first.
PictureLayers make_layers(const Settings &settings, const Plan &plan);

// Adds the host's. Depths become those of the scene's file, whose lengths the core has seen times `scale`. `passes`: of
// --reference.
void finish_layers(PictureLayers &layers, double scale, const Settings &settings, const Plan &plan,
                   const Passes &passes);

} // namespace wisp
