// Whether there is smoke, and which can be resampled to a sparse grid (S4-1).
#pragma once
#include "core/numbers/double_bits.h"
#include "wisp/scene.h"

namespace wisp {

inline bool has_smoke(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty()) return true;
    return false;
}

// Whether all smoke is one density grid that is not rotated.
inline bool is_aligned_grid(const Scene &scene) {
    uint32_t smokes = 0;
    const GridDescription *grid = nullptr;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        if (scene.smokes[i].empty()) continue;
        ++smokes;
        if (scene.smokes[i].is_grid()) grid = &scene.smokes[i].grid;
    }
    return smokes == 1 && grid && total_order_key(grid->axis[0].x) == total_order_key(1.0) &&
           total_order_key(grid->axis[1].y) == total_order_key(1.0) &&
           total_order_key(grid->axis[2].z) == total_order_key(1.0);
}

// Whether the scene's smoke can be resampled: it consists of particles, or it is an aligned grid.
inline bool can_resample(const Scene &scene) {
    bool particles = true;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) particles = particles && !scene.smokes[i].is_grid();
    return has_smoke(scene) && (particles || is_aligned_grid(scene));
}

} // namespace wisp
