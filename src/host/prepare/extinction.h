// How dense the smoke of a prepared scene is.
#pragma once
#include "wisp/scene.h"

namespace wisp {

// The volume of a smoke: of particles that of the cells, of a support's size, that have some.
double volume_of(const SmokeDescription &smoke);

// The optical depth of one smoothing length, the smallest of all smokes; 0 without smoke.
struct DepthOfLength {
    double mean;     // of the densest smoke, over its volume
    double greatest; // about: where a smoke is densest
};
DepthOfLength depth_of_length(const Scene &scene);

} // namespace wisp
