// Optical depths from the nodes of a sparse grid to every light. A march interpolates them, so no step needs a shadow
// ray through the smoke. The nodes are corrected so that the interpolation has the right mean (README, Optical depth
// grid).
#pragma once
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

struct OpticalDepthGrid {
    const Medium *medium;
    const Light *lights;
    uint32_t light_count;
    const SparseGrid *bricks;
    int32_t spacing;   // cells between nodes: 1, 2, 4 or 8
    const Real *depth; // nodes_of(spacing) values per light, light after light, brick after brick; 0 outside of smoke
    bool cut_off;      // is_cut_off() of the medium
};

// Depths are interpolated between nodes. Where smoke of this sigma_t is deeper than 1 between two of them, the depth is
// found by a ray instead.
inline bool is_dense(const OpticalDepthGrid &depths, Real sigma) {
    return sigma * largest(depths.bricks->cell) * Real(depths.spacing) > Real(1);
}

// Nor are they interpolated so near to a point light or spot in the smoke: the depth to it has a peak there.
inline Real reach_of_peak(const OpticalDepthGrid &depths) {
    return largest(depths.bricks->cell) * Real(2 * depths.spacing);
}
inline bool has_peak(const OpticalDepthGrid &depths, const Light &light, const Vec3 &x) {
    return has_falloff(light.kind) && length(x - light.position) < reach_of_peak(depths);
}

// Depths that differ by less count as equal, and a depth that is nearer to the mean of two others as linear.
constexpr Real depth_tolerance = Real(1.0 / 32);

// Whether light enters smoke that is cut off at the faces of `smoke` through more than one of them on the way to points
// of a box in it. The depth then bends within the box, at a crease that starts at an edge of the smoke.
bool has_crease(const Box &smoke, const Light &light, const Box &box);

// Finds the depths of all nodes that have smoke around them: along the lines of a deep shadow map where that is
// cheaper, by a ray per node elsewhere. Adds the lines and rays to `shadow_rays`. False: the arena was too small.
bool make_optical_depth_grid(const Medium &medium, const Light *lights, uint32_t light_count, const SparseGrid &bricks,
                             int32_t spacing, Arena &arena, uint64_t *shadow_rays, OpticalDepthGrid &depths,
                             Watch watch = {});
// The bytes that make_optical_depth_grid takes at most, for `bricks` bricks.
uint64_t optical_depth_grid_bytes(uint64_t bricks, uint32_t light_count, int32_t spacing);

// The depths of one brick, as OpticalDepthGrid::depth orders them.
inline const Real *depths_of_brick(const OpticalDepthGrid &depths, uint32_t brick) {
    return depths.depth + size_t{brick} * depths.light_count * nodes_of(depths.spacing);
}

// The optical depth, at least 0, from x in the medium's bounds to light l: trilinear between nodes; 0 outside of all
// bricks. Its error falls with the square of the spacing.
Real optical_depth_to_light(const OpticalDepthGrid &depths, uint32_t l, const Vec3 &x);

} // namespace wisp::WISP_ARITH
