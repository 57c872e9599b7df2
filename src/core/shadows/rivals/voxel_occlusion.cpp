// `voxel`: voxel occlusion testing (Woo & Amanatides 1990) (C7). A regular grid covers the static triangles. Each voxel
// has a state for each light: all of it is in shadow, none of it is, or neither is known.
//
// A voxel's state is computed when the first ray from it asks, and only by proof (box_shaft.h):
//
//   shadowed   the triangle that blocked that ray blocks all rays from the voxel
//   lit        no static triangle may block any ray, or only one triangle may: then rays from that triangle are lit
//   mixed      neither is proved: rays are traced
//
// So the answers are those of `trace`. Rays from points outside the grid are traced.
#include "core/shadows/box_shaft.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint64_t max_voxels = 1u << 18;
constexpr uint32_t units_of_light = 1 << 12; // of work
constexpr int64_t rim = 1 << 9;              // lattice steps around the bounds, for points that are rounded
// States that are not the number of a triangle.
enum : uint32_t { unresolved = 0xfffffffe, mixed = 0xfffffffd, shadowed = 0xfffffffc, lit = 0xfffffffb };

struct VoxelLight : ShaftLight {
    uint32_t *state; // of each voxel: one of the above, or the only triangle that may block rays
};

struct VoxelGrid {
    uint32_t light_count;
    int exponent; // of the lattice's steps
    LatticePoint low;
    int64_t edge; // of a voxel in steps; 0: before the first frame
    uint32_t count[3];
    VoxelLight *lights;
};

uint64_t voxel_count(const VoxelGrid &grid) { return uint64_t{grid.count[0]} * grid.count[1] * grid.count[2]; }

// Covers the static triangles with cubes: as many as max_voxels allows.
void lay_out(VoxelGrid &grid, const TriangleTree &tree) {
    grid.exponent = static_exponent(tree);
    grid.low = lattice_point(tree.bounds.low, grid.exponent);
    LatticePoint high = lattice_point(tree.bounds.high, grid.exponent);
    for (int a = 0; a < 3; ++a) {
        grid.low.x[a] -= rim;
        high.x[a] += rim;
    }
    grid.edge = 1;
    for (;;) {
        for (int a = 0; a < 3; ++a) grid.count[a] = static_cast<uint32_t>((high.x[a] - grid.low.x[a]) / grid.edge + 1);
        uint64_t count = 1;
        for (int a = 0; a < 3; ++a) count = std::min(count * grid.count[a], uint64_t{1} << 32);
        if (count <= max_voxels) return;
        grid.edge += (grid.edge + 15) / 16;
    }
}

uint64_t voxel_bytes(const Scene &scene, const Settings &) {
    return Arena::bytes<VoxelGrid>(1) + Arena::bytes<VoxelLight>(scene.light_count) +
           scene.light_count * Arena::bytes<uint32_t>(max_voxels);
}

void *make_voxels(const Scene &scene, const Settings &, Arena &arena, Watch) {
    VoxelGrid *grid = arena.make<VoxelGrid>(1);
    VoxelLight *lights = arena.make<VoxelLight>(scene.light_count);
    if (!grid || !lights) return nullptr;
    *grid = {};
    grid->light_count = scene.light_count;
    grid->lights = lights;
    for (uint32_t l = 0; l < scene.light_count; ++l) {
        lights[l].state = arena.make<uint32_t>(max_voxels);
        if (!lights[l].state) return nullptr;
    }
    return grid;
}

bool begin_voxel_frame(Shadows &shadows, const Settings &, Arena &) {
    VoxelGrid &grid = memory_of<VoxelGrid>(shadows);
    const TriangleTree &tree = shadows.surfaces->static_tree;
    const bool first = grid.edge == 0;
    if (tree.triangle_count == 0) return true;
    if (first) lay_out(grid, tree);
    shadows.watch.expect(uint64_t{grid.light_count} * units_of_light);
    for (uint32_t l = 0; l < grid.light_count; ++l) {
        if (!shadows.watch.done(units_of_light)) return false;
        VoxelLight &light = grid.lights[l];
        if (update_light(light, shadows, l, first) &&
            !fill(light.state, voxel_count(grid), uint32_t{unresolved}, shadows.watch))
            return false;
    }
    return true;
}

bool is_shadowed_by_voxels(Shadows &shadows, const ShadowQuery &query) {
    VoxelGrid &grid = memory_of<VoxelGrid>(shadows);
    const TriangleTree &tree = shadows.surfaces->static_tree;
    if (tree.triangle_count == 0) return is_blocked_by_moving(shadows, query);
    VoxelLight &light = grid.lights[query.light];
    const Vec3 &from = query.ray.origin;
    bool within = is_on_lattice(tree, from);
    const LatticePoint at = within ? lattice_point(from, grid.exponent) : grid.low;
    LatticeBounds box;
    uint64_t index = 0;
    const int shift = light.lattice.exponent - grid.exponent; // to longer steps
    for (int a = 2; a >= 0; --a) {
        const int64_t offset = at.x[a] - grid.low.x[a], voxel = offset < 0 ? -1 : offset / grid.edge;
        within = within && voxel >= 0 && voxel < grid.count[a];
        if (!within) break;
        index = index * grid.count[a] + static_cast<uint64_t>(voxel);
        box.low.x[a] = (grid.low.x[a] + voxel * grid.edge) >> shift;
        box.high.x[a] = ((grid.low.x[a] + (voxel + 1) * grid.edge) >> shift) + 1;
    }
    uint32_t outside = mixed, &state = within ? light.state[index] : outside;
    if (state == shadowed) {
        ++shadows.statistics->rays.shadow_culled;
        return true;
    }
    if (state == lit || state == query.triangle) return is_shadowed_by_moving_alone(shadows, query);
    uint32_t occluder;
    const bool blocked = is_blocked_by_static(shadows, query, occluder);
    if (state == unresolved) {
        const BoxShaft shaft(light.lattice, box, light.light);
        uint32_t count;
        if (blocked)
            state = is_shaft_shadowed(shadows, light.lattice, shaft, occluder) ? shadowed : mixed;
        else if (!find_blockers(shadows, light.lattice, shaft, 1, &state, count))
            state = mixed;
        else if (count == 0)
            state = lit;
    }
    return blocked || is_blocked_by_moving(shadows, query);
}

} // namespace

const ShadowTechnique voxel_technique = {is_shadowed_by_voxels, voxel_bytes, make_voxels, begin_voxel_frame};

} // namespace wisp::WISP_ARITH
