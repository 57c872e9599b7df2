#include "host/results/picture_bytes.h"
#include "wisp/layers.h"
#include "wisp/pixel_sums.h"

namespace wisp {

uint32_t layer_planes(const Settings &settings, const Plan &plan) {
    return settings.layers ? planes_of(plan.layers) + 1 + (settings.goal == Goal::reference ? 3 : 0) : 0;
}

uint64_t picture_bytes(const Settings &settings, const Plan &plan) {
    if (settings.goal == Goal::photons) return 0;
    const uint64_t floats = 3 + layer_planes(settings, plan);
    return settings.crop.pixels() *
           (2 * floats * sizeof(float) + (settings.goal == Goal::reference ? sizeof(PixelSums) : 0));
}

} // namespace wisp
