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

// All smoke, where it is one grid that is not rotated: of densities, or a box. nullptr where it is anything else.
inline const SmokeDescription *aligned_grid(const Scene &scene) {
    const SmokeDescription *only = nullptr;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        if (scene.smokes[i].empty()) continue;
        if (only || !scene.smokes[i].is_grid()) return nullptr;
        only = &scene.smokes[i];
    }
    const int64_t one = total_order_key(1.0);
    const bool aligned = only && total_order_key(only->grid.axis[0].x) == one &&
                         total_order_key(only->grid.axis[1].y) == one && total_order_key(only->grid.axis[2].z) == one;
    return aligned ? only : nullptr;
}

// Whether the cells of the sparse grid are the samples of a density grid, or parts of them.
inline bool keeps_samples(const Scene &scene) {
    const SmokeDescription *smoke = aligned_grid(scene);
    return smoke && smoke->grid.density;
}

// Cells between two samples of such a grid, where cells of `lengths` samples are asked for: 1, 2, 4 or 8. A trilinear
// field that is resampled at whole fractions of its own cells loses nothing, and at even ones has nodes on the grid's
// faces, half a sample beyond the outermost.
inline int32_t subdivision_for(double lengths) {
    int32_t parts = 1;
    for (double cell = 0.75; parts < 8 && total_order_key(lengths) <= total_order_key(cell);
         cell = rounded_product(cell, 0.5))
        parts *= 2;
    return parts;
}

// The edge of the sparse grid's cells, in smoothing lengths or edges of samples, where `lengths` are asked for.
inline double cell_of_bricks(const Scene &scene, double lengths) {
    if (!keeps_samples(scene)) return lengths;
    double cell = 1;
    for (int32_t parts = subdivision_for(lengths); parts > 1; parts /= 2) cell = rounded_product(cell, 0.5);
    return cell;
}

// Whether the scene's smoke can be resampled: it consists of particles, or it is an aligned grid.
inline bool can_resample(const Scene &scene) {
    bool particles = true;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) particles = particles && !scene.smokes[i].is_grid();
    return has_smoke(scene) && (particles || aligned_grid(scene));
}

} // namespace wisp
