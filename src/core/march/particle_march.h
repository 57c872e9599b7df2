// Ray marching over a particle map: what a ray meets is gathered once for many steps (S4-3).
#pragma once
#include "core/march/ray_march.h"
#include "core/photons/packed_particle_map.h"

namespace wisp::WISP_ARITH {

// Steps that are gathered together, a whole number of lanes.
constexpr uint32_t window_steps = 64;

struct ParticleMarcher {
    const Medium *medium;
    const Color *const *sources;  // one array a smoke
    const Irradiance *irradiance; // of what `sources` leave out, or nullptr
    SingleScatterer lights;
    StepLengths steps;
    // Workspace: the window's steps and `lanes` more behind them, that much for each smoke in `sigma`.
    Real *middle, *sigma, *red, *green, *blue;
    Real *extinctions; // of one step, one a smoke
    Statistics *statistics;
    Watch watch = {};
};

// As `march`, with the elements' source functions in place of photons: each particle is visited once a window, not once
// a step.
Segment march(ParticleMarcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder);

bool make_window(const Scene &scene, Arena &arena, ParticleMarcher &marcher); // false: the arena was too small
uint64_t window_bytes(const Scene &scene);

} // namespace wisp::WISP_ARITH
