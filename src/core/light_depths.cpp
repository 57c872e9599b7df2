// A lattice of optical depths to the lights, filled as it is asked.
#include "wisp/light_depths.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint64_t brick_nodes = uint64_t{brick_edge} * brick_edge * brick_edge;

// Cells and bricks for a box of this size: one node more than cells.
int32_t cells_for(Real size, Real spacing) { return floor_to_int(size / spacing) + 1; }
int32_t bricks_for(int32_t cells) { return cells / brick_edge + 1; }

Real node_depth(const LightDepths &depths, uint32_t l, int32_t x, int32_t y, int32_t z) {
    Real *&brick = depths.of_brick[index_of(depths.bricks, {x / brick_edge, y / brick_edge, z / brick_edge})];
    if (!brick) {
        brick = depths.arena->make<Real>(brick_nodes * depths.light_count);
        for (uint64_t i = 0; brick && i < brick_nodes * depths.light_count; ++i) brick[i] = Real(-1);
    }
    const int64_t inside =
        index_of({brick_edge, brick_edge, brick_edge}, {x % brick_edge, y % brick_edge, z % brick_edge});
    Real *kept = brick ? brick + static_cast<uint64_t>(inside) * depths.light_count + l : nullptr;
    if (kept && !(*kept < Real(0))) return *kept;
    const Vec3 node = depths.lattice.low + Vec3(Real(x), Real(y), Real(z)) * depths.lattice.edge;
    const Illumination way = illuminate(depths.lights[l], node, node, node);
    const Real depth = max(Real(0), optical_depth(*depths.medium, {node, -way.direction}, way.distance));
    ++*depths.shadow_rays;
    if (kept) *kept = depth; // else the arena is full: the same value, found each time
    return depth;
}

} // namespace

bool make_light_depths(const Medium &medium, const Light *lights, uint32_t light_count, Real spacing, Arena &arena,
                       uint64_t *shadow_rays, LightDepths &depths) {
    depths = {&medium, lights, light_count, {}, {}, nullptr, &arena, shadow_rays};
    const Vec3 size = medium.bounds.high - medium.bounds.low;
    const Cell cells = {cells_for(size.x, spacing), cells_for(size.y, spacing), cells_for(size.z, spacing)};
    depths.lattice = make_lattice(medium.bounds.low, Vec3(spacing), cells);
    depths.bricks = {bricks_for(cells.x), bricks_for(cells.y), bricks_for(cells.z)};
    const uint64_t bricks = number_of(depths.bricks);
    depths.of_brick = arena.make<Real *>(bricks);
    if (!depths.of_brick) return false;
    for (uint64_t i = 0; i < bricks; ++i) depths.of_brick[i] = nullptr;
    return true;
}

Real light_depth(const LightDepths &depths, uint32_t l, const Vec3 &x) {
    const Cell cell = cell_at(depths.lattice, x);
    return max(Real(0), trilinear(place_in(depths.lattice, cell, x), [&](int32_t dx, int32_t dy, int32_t dz) {
                   return node_depth(depths, l, cell.x + dx, cell.y + dy, cell.z + dz);
               }));
}

uint64_t light_depth_bytes(const Scene &scene, double lengths) {
    if (!(lengths > 0) || scene.light_count == 0) return 0;
    // As many bricks as the box around everything has; particles ask for no more than those around them.
    Vec3 low(Real(0)), high(Real(0));
    Real widest = Real(0);
    uint64_t particles = 0;
    bool grids = false, any = false;
    const auto add = [&](const Vec3 &x, const Vec3 &reach) {
        low = any ? lowest(low, x - reach) : x - reach;
        high = any ? highest(high, x + reach) : x + reach;
        any = true;
    };
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeSource &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        const Real reach = Real(2) * to_real<Real>(smoke.largest_h);
        widest = max(widest, reach);
        particles += smoke.count;
        grids = grids || smoke.is_grid();
        for (uint32_t k = 0; k < smoke.count; ++k) add(vec_of(smoke.particles[k].position), Vec3(reach));
        if (smoke.is_grid()) add(vec_of(smoke.grid.center), Vec3(length(vec_of(smoke.grid.half))));
    }
    if (!any) return 0;
    const Real spacing = finest_length(scene) * to_real<Real>(lengths);
    const auto bricks_along = [&](Real size) {
        return static_cast<uint64_t>(bricks_for(cells_for(size, spacing)) + 1); // + 1: another rounding
    };
    const Vec3 size = high - low;
    const uint64_t all = bricks_along(size.x) * bricks_along(size.y) * bricks_along(size.z);
    const uint64_t across = bricks_along(Real(2) * widest + Real(2) * spacing) + 1;
    const uint64_t near = grids ? all : particles * (across * across * across);
    return Arena::bytes<Real *>(all) + min(all, near) * Arena::bytes<Real>(brick_nodes * scene.light_count);
}

} // namespace wisp::WISP_ARITH
