// Voxel occlusion testing.
#include "core/shadows/rivals/voxel_occlusion.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint64_t max_voxels = 1u << 18;
constexpr int64_t rim = 1 << 9; // steps around the bounds, for points that are rounded
// States that are no triangle, nor no_triangle, as which points of space ask.
enum : uint32_t { unknown = 0xfffffffe, complicated = 0xfffffffd, full = 0xfffffffc, null = 0xfffffffb };

uint64_t voxel_count(const VoxelShadows &voxels) {
    return uint64_t{voxels.count[0]} * voxels.count[1] * voxels.count[2];
}

// The cubes that cover the still triangles with the most voxels that there may be.
void lay_out(VoxelShadows &voxels, const TriangleTree &still) {
    voxels.exponent = static_exponent(still);
    voxels.low = lattice_point(still.bounds.low, voxels.exponent);
    LatticePoint high = lattice_point(still.bounds.high, voxels.exponent);
    for (int a = 0; a < 3; ++a) {
        voxels.low.x[a] -= rim;
        high.x[a] += rim;
    }
    voxels.edge = 1;
    for (;;) {
        for (int a = 0; a < 3; ++a)
            voxels.count[a] = static_cast<uint32_t>((high.x[a] - voxels.low.x[a]) / voxels.edge + 1);
        uint64_t count = 1;
        for (int a = 0; a < 3; ++a) count = std::min(count * voxels.count[a], uint64_t{1} << 32);
        if (count <= max_voxels) return;
        voxels.edge += (voxels.edge + 15) / 16;
    }
}

} // namespace

uint64_t voxel_bytes(const Scene &scene) {
    return Arena::bytes<VoxelShadows>(1) + Arena::bytes<VoxelLight>(scene.light_count) +
           scene.light_count * Arena::bytes<uint32_t>(max_voxels);
}

VoxelShadows *make_voxel_shadows(const Scene &scene, Arena &arena) {
    VoxelShadows *voxels = arena.make<VoxelShadows>(1);
    VoxelLight *lights = arena.make<VoxelLight>(scene.light_count);
    if (!voxels || !lights) return nullptr;
    *voxels = {};
    voxels->light_count = scene.light_count;
    voxels->lights = lights;
    for (uint32_t l = 0; l < scene.light_count; ++l) {
        lights[l].state = arena.make<uint32_t>(max_voxels);
        if (!lights[l].state) return nullptr;
    }
    return voxels;
}

void begin_frame(VoxelShadows &voxels, const Shadows &shadows) {
    const TriangleTree &still = shadows.surfaces->still;
    const bool first = voxels.edge == 0;
    if (still.triangle_count == 0) return;
    if (first) lay_out(voxels, still);
    for (uint32_t l = 0; l < voxels.light_count; ++l) {
        VoxelLight &voxel_light = voxels.lights[l];
        if (!follow_light(voxel_light, shadows, l, !first)) continue;
        std::fill(voxel_light.state, voxel_light.state + voxel_count(voxels), unknown);
    }
}

bool is_shadowed(VoxelShadows &voxels, Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    if (surfaces.still.triangle_count == 0) return is_blocked_by_moving(shadows, query);
    VoxelLight &light = voxels.lights[query.light];
    const Vec3 &from = query.ray.origin;
    bool within = is_on_lattice(surfaces.still, from);
    const LatticePoint at = within ? lattice_point(from, voxels.exponent) : voxels.low;
    LatticeBounds box;
    uint64_t index = 0;
    const int shift = light.lattice.exponent - voxels.exponent; // to longer steps
    for (int a = 2; a >= 0; --a) {
        const int64_t place = at.x[a] - voxels.low.x[a], cell = place < 0 ? -1 : place / voxels.edge;
        within = within && cell >= 0 && cell < voxels.count[a];
        if (!within) break;
        index = index * voxels.count[a] + static_cast<uint64_t>(cell);
        box.low.x[a] = (voxels.low.x[a] + cell * voxels.edge) >> shift;
        box.high.x[a] = ((voxels.low.x[a] + (cell + 1) * voxels.edge) >> shift) + 1;
    }
    uint32_t outside = complicated, &state = within ? light.state[index] : outside;
    if (state == full) {
        ++statistics.rays.shadow_culled;
        return true;
    }
    if (state == null || state == query.triangle) return is_shadowed_by_moving_alone(shadows, query);
    uint32_t occluder;
    const bool blocked = is_blocked_by_static(shadows, query, occluder);
    if (state == unknown) {
        const BoxShaft shaft(light.lattice, box, light.light);
        uint32_t count;
        if (blocked)
            state = is_cut_by(shadows, light.lattice, shaft, occluder) ? full : complicated;
        else if (!find_blockers(shadows, light.lattice, shaft, 1, &state, count))
            state = complicated;
        else if (count == 0)
            state = null;
    }
    return blocked || is_blocked_by_moving(shadows, query);
}

} // namespace wisp::WISP_ARITH
