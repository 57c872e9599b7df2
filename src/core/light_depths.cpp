// Optical depths to the lights at the nodes of bricks, filled as they are asked for.
#include "wisp/light_depths.h"

namespace wisp::WISP_ARITH {

namespace {

// Whether there is smoke in the cells of the brick around a node.
bool meets_smoke(const LightDepths &depths, uint32_t brick, const Cell &node) {
    const int32_t s = depths.stride;
    const Cell low = {max(node.x - s, 0), max(node.y - s, 0), max(node.z - s, 0)};
    const Cell high = {min(node.x + s, brick_cells), min(node.y + s, brick_cells), min(node.z + s, brick_cells)};
    const Medium &medium = *depths.medium;
    if (!medium.bricks) {
        const Box box = {node_of(*depths.bricks, brick, low), node_of(*depths.bricks, brick, high)};
        for (uint32_t i = 0; i < medium.count; ++i)
            if (majorant(medium.smokes[i].field, box) > Real(0)) return true;
        return false;
    }
    const Cell count = {nodes_along(1), nodes_along(1), nodes_along(1)};
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!medium.smokes[i].field.is_bricks) continue;
        const Real *sigma = medium.smokes[i].field.bricks.nodes(brick);
        for (int32_t z = low.z; z <= high.z; ++z)
            for (int32_t y = low.y; y <= high.y; ++y)
                for (int32_t x = low.x; x <= high.x; ++x)
                    if (sigma[index_of(count, {x, y, z})] > Real(0)) return true;
    }
    return false;
}

// Behind every real depth: there is no smoke around such a node.
constexpr Real unknown = Real(-1);

void find_depths(const LightDepths &depths, uint32_t brick, Real *depth, uint64_t &shadow_rays) {
    const int32_t n = nodes_along(depths.stride), stride = depths.stride;
    const uint32_t nodes = nodes_of(stride);
    for (int32_t z = 0; z < n; ++z)
        for (int32_t y = 0; y < n; ++y)
            for (int32_t x = 0; x < n; ++x, ++depth) {
                const Cell node = {x * stride, y * stride, z * stride};
                const bool wanted = meets_smoke(depths, brick, node);
                const Vec3 p = node_of(*depths.bricks, brick, node);
                for (uint32_t l = 0; l < depths.light_count; ++l) {
                    depth[size_t{l} * nodes] = unknown;
                    if (!wanted) continue;
                    const Illumination way = illuminate(depths.lights[l], p, p, p);
                    depth[size_t{l} * nodes] =
                        max(Real(0), optical_depth(*depths.medium, {p, -way.direction}, way.distance));
                    ++shadow_rays;
                }
            }
}

// A node's depth, as any brick that holds it knows it. `node` may lie a node outside of the brick.
Real depth_beside(const LightDepths &depths, const Real *found, uint32_t brick, uint32_t l, Cell node) {
    const Bricks &bricks = *depths.bricks;
    const int32_t n = nodes_along(depths.stride);
    Cell at = bricks.place[brick];
    const Cell &count = bricks.lattice.count;
    const auto move = [n](int32_t &place, int32_t &inside) {
        if (inside < 0) --place, inside += n - 1;
        if (inside >= n) ++place, inside -= n - 1;
    };
    move(at.x, node.x);
    move(at.y, node.y);
    move(at.z, node.z);
    if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= count.x || at.y >= count.y || at.z >= count.z) return unknown;
    const uint32_t other = brick_at(bricks, at);
    if (other == no_brick) return unknown;
    const uint32_t nodes = nodes_of(depths.stride);
    return found[(size_t{other} * depths.light_count + l) * nodes +
                 static_cast<size_t>((node.z * n + node.y) * n + node.x)];
}

} // namespace

bool make_light_depths(const Medium &medium, const Light *lights, uint32_t light_count, const Bricks &bricks,
                       int32_t stride, Arena &arena, uint64_t *shadow_rays, LightDepths &depths) {
    depths = {&medium, lights, light_count, &bricks, stride, nullptr};
    const uint32_t nodes = nodes_of(stride);
    const size_t values = size_t{bricks.count} * light_count * nodes;
    Real *depth = arena.make<Real>(values);
    depths.depth = depth;
    const size_t mark = arena.mark();
    Real *found = arena.make<Real>(values);
    if (!depth || !found) return false;
    for (uint32_t b = 0; b < bricks.count; ++b)
        find_depths(depths, b, found + size_t{b} * light_count * nodes, *shadow_rays);

    const int32_t n = nodes_along(stride);
    for (size_t i = 0; i < values; ++i) {
        const int32_t k = static_cast<int32_t>(i % nodes);
        const uint32_t l = static_cast<uint32_t>(i / nodes % light_count),
                       b = static_cast<uint32_t>(i / nodes / light_count);
        const Cell node = {k % n, k / n % n, k / n / n};
        const auto beside = [&](int32_t dx, int32_t dy, int32_t dz) {
            return depth_beside(depths, found, b, l, {node.x + dx, node.y + dy, node.z + dz});
        };
        const Real here = found[i];
        Real bend = Real(0);
        const auto add = [&](Real before, Real behind) {
            if (!(before < Real(0)) && !(behind < Real(0))) bend += before - here + (behind - here);
        };
        if (!(here < Real(0))) {
            add(beside(-1, 0, 0), beside(1, 0, 0));
            add(beside(0, -1, 0), beside(0, 1, 0));
            add(beside(0, 0, -1), beside(0, 0, 1));
        }
        depth[i] = here < Real(0) ? Real(0) : max(Real(0), here - bend * Real(1.0 / 12));
    }
    arena.rewind(mark);
    return true;
}

uint64_t light_depth_bytes(uint64_t bricks, uint32_t light_count, int32_t stride) {
    return 2 * Arena::bytes<Real>(bricks * light_count * nodes_of(stride));
}

Real light_depth(const LightDepths &depths, uint32_t l, const Vec3 &x) {
    const Bricks &bricks = *depths.bricks;
    const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
    if (brick == no_brick) return Real(0);
    const Real *depth = light_depths_of(depths, brick) + size_t{l} * nodes_of(depths.stride);
    return max(Real(0), between_nodes(place_of(place_in(bricks, brick, x), depths.stride), depths.stride,
                                      [depth](uint32_t node) { return depth[node]; }));
}

} // namespace wisp::WISP_ARITH
