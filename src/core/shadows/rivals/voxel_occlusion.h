// Voxel occlusion testing (Woo, Amanatides 1990): a regular grid over what never moves, where each voxel knows of each
// light whether all of it lies in its shadow, none of it, or neither.
//
// It is found out when the first ray asks, and only if it is proved (shaft.h): full, where what stopped that ray stops
// all; null, where nothing may stop any, or nothing but the one triangle that asks; all else is complicated, and
// traced. So shadows are those of tracing. Points outside the grid are traced.
#pragma once
#include "core/shadows/box_shaft.h"

namespace wisp::WISP_ARITH {

struct VoxelLight : ShaftLight {
    uint32_t *state; // of each voxel: what is known, or the one triangle that may stop rays
};

struct VoxelShadows {
    uint32_t light_count;
    int exponent; // of the grid's steps
    LatticePoint low;
    int64_t edge; // of a voxel
    uint32_t count[3];
    VoxelLight *lights;
};

uint64_t voxel_bytes(const Scene &scene);
VoxelShadows *make_voxel_shadows(const Scene &scene, Arena &arena); // nullptr: the arena was too small
void begin_frame(VoxelShadows &voxels, const Shadows &shadows);
bool is_shadowed(VoxelShadows &voxels, Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
