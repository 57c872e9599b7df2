// How densely a smoke's particles are sampled: the neighbours of each particle, and the density they give there. The
// host judges with it whether a cloud has enough particles (S7, tools).
#pragma once
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp {

// The contribution of the other particles at one particle's position. The particle itself is left out: its own kernel
// is always centred there, so it would bias the estimate.
struct DensityStatistics {
    uint32_t neighbours; // number of other particles whose supports hold the position
    double density;      // the sum of their sigma_t there, per unit of length
};

// find_density_statistics writes one entry for each particle of `source`, in canonical order. It returns false if the
// arena has less than density_statistics_bytes.
#define WISP_DECLARE_DENSITY_STATISTICS(arithmetic)                                                                    \
    namespace arithmetic {                                                                                             \
    uint64_t density_statistics_bytes(uint32_t particles);                                                             \
    bool find_density_statistics(const SmokeDescription &source, Arena &arena, DensityStatistics *per_particle);       \
    }
WISP_DECLARE_DENSITY_STATISTICS(f32)
WISP_DECLARE_DENSITY_STATISTICS(f64)
WISP_DECLARE_DENSITY_STATISTICS(fixed)
#undef WISP_DECLARE_DENSITY_STATISTICS

} // namespace wisp
