// What of the core a program consists of. A program of its own compiles the core with -DWISP_PARTS=surfaces+..., of
// the names below; without it, it has all. Code of other parts is never reached, so that it is not linked
// (-ffunction-sections, --gc-sections).
#pragma once
#include <cstdint>

namespace wisp {

namespace parts {

enum Part : uint32_t {
    surfaces = 1,         // triangles in trees of boxes, shadows by rays
    shadow_proofs = 2,    // ShadowMethod::exact
    other_shadows = 4,    // all other methods
    kd_trees = 8,         // TreeKind::kd
    light_cuts = 16,      // LightChoice::cuts
    particles = 32,       // smoke of particles
    grids = 64,           // of density grids
    resampled = 128,      // densities kept at the nodes of a sparse grid (S4-1)
    exact = 256,          // ... and not kept: marches step by step
    photons = 512,        // scattering more than once, of resampled smoke (S4-4, S4-5)
    exact_photons = 1024, // ... of exact densities: the photon map, the particle map (S2, S4-3)
    paths = 2048,         // Goal::reference, and random paths where photons do not suit
    layers = 4096,
    // One of several.
    any_smoke = particles | grids,
    any_photons = photons | exact_photons,
    all = ~0u
};

#ifndef WISP_PARTS
#define WISP_PARTS all
#endif
constexpr uint32_t of_program = WISP_PARTS;

} // namespace parts

// Whether the program has the part, or one of several.
constexpr bool has(parts::Part part) { return (parts::of_program & part) != 0; }

// Whether smoke is of a density grid: decided at compile time where a program has grids or particles alone.
constexpr bool is_grid_of_program(bool is_grid) { return has(parts::grids) && (!has(parts::particles) || is_grid); }

// Something that needs a part: false, at compile time, in a program without it.
template <parts::Part part> struct Needs {
    bool needed;
    Needs &operator=(bool is_needed) {
        needed = is_needed;
        return *this;
    }
    constexpr operator bool() const { return has(part) && needed; }
};

} // namespace wisp
