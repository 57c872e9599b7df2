// Ray marching through resampled smoke: brick by brick, eight steps side by side (S1).
#pragma once
#include "core/march/ray_march.h"
#include "core/photons/irradiance_map.h"

namespace wisp::WISP_ARITH {

struct GridMarchRoom; // groups of steps, which would be much of a small stack

struct GridMarcher {
    const Medium *medium;           // resampled
    const OpticalDepthGrid *depths; // to all lights, over the medium's bricks
    const Irradiance *irradiance;   // or nullptr: nothing scatters twice
    Shadows *shadows;               // of surfaces; nullptr: there are none
    Real step;
    // The part of scattered light that counts as going straight on (FluenceSums); 0: none. It takes no light of the
    // smoke from a ray, only light from behind all smoke.
    Real straight;
    Statistics *statistics;
    Watch watch;
    GridMarchRoom *room; // of make_march_room()
};

// nullptr: the arena was too small.
GridMarchRoom *make_march_room(Arena &arena);
uint64_t march_room_bytes();

// As `march` of ray_march.h, with steps at the same places along the ray. Steps outside of bricks are skipped. Optical
// depths are summed from step to step, and transmittances are computed for eight steps side by side.
Segment march(GridMarcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder);

} // namespace wisp::WISP_ARITH
