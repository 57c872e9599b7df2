// Optical depths from the nodes of bricks to every light, kept once found: what lies between is interpolated, so that a
// march need not ask for a shadow at every step.
//
// Between nodes a linear interpolation lies above a hollow and below a bump, by a twelfth of the second difference in
// the mean along each axis: that is taken from the nodes, so that what is interpolated has the right mean.
#pragma once
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

struct OpticalDepthGrid {
    const Medium *medium;
    const Light *lights;
    uint32_t light_count;
    const SparseGrid *bricks;
    int32_t stride;
    const Real *depth; // by brick: nodes_of(stride) for each light; 0 where there is no smoke around
};

// False: the arena was too small.
bool make_optical_depth_grid(const Medium &medium, const Light *lights, uint32_t light_count, const SparseGrid &bricks,
                             int32_t stride, Arena &arena, uint64_t *shadow_rays, OpticalDepthGrid &depths);
uint64_t optical_depth_grid_bytes(uint64_t bricks, uint32_t light_count, int32_t stride);

// Those of a brick: of each light its nodes.
inline const Real *depths_of_brick(const OpticalDepthGrid &depths, uint32_t brick) {
    return depths.depth + size_t{brick} * depths.light_count * nodes_of(depths.stride);
}

// The depth between x, in the medium's bounds, and light l: trilinear. 0 where there is no brick.
Real optical_depth_to_light(const OpticalDepthGrid &depths, uint32_t l, const Vec3 &x);

} // namespace wisp::WISP_ARITH
