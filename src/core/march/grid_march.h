// Ray marching through resampled smoke: brick by brick, eight steps side by side (S1).
#pragma once
#include "core/march/ray_march.h"
#include "core/photons/irradiance_map.h"

namespace wisp::WISP_ARITH {

struct GridMarcher {
    const Medium *medium;         // resampled
    const OpticalDepthGrid *depths;    // to all lights, over the medium's bricks
    const Irradiance *irradiance; // or nullptr: nothing scatters twice
    Shadows *shadows;             // of surfaces; nullptr: there are none
    Real step;
    Statistics *statistics;
};

// As the other `march`: steps lie at the same places along the ray, and those outside of bricks are passed over. Depths
// are kept, and transmittances of steps multiplied in groups of eight.
Segment march(GridMarcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder);

} // namespace wisp::WISP_ARITH
