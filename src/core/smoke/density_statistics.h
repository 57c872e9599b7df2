// How densely particles stand about each other: whether their number suffices for the density that they stand for.
#pragma once
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp {

// What the others give at a particle: the particle itself is left out, since nothing but itself put it there.
struct Neighbourhood {
    uint32_t neighbours; // whose supports hold it
    double density;      // their sigma_t, per unit of length
};

// Of every particle of `source`, in canonical order. False: the arena has less than neighbourhood_bytes.
#define WISP_DECLARE_NEIGHBOURHOODS(arithmetic)                                                                        \
    namespace arithmetic {                                                                                             \
    uint64_t neighbourhood_bytes(uint32_t particles);                                                                  \
    bool find_neighbourhoods(const SmokeDescription &source, Arena &arena, Neighbourhood *of_particle);                     \
    }
WISP_DECLARE_NEIGHBOURHOODS(f32)
WISP_DECLARE_NEIGHBOURHOODS(f64)
WISP_DECLARE_NEIGHBOURHOODS(fixed)
#undef WISP_DECLARE_NEIGHBOURHOODS

} // namespace wisp
