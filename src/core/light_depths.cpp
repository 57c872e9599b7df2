// Optical depths to the lights at the nodes of bricks around smoke.
#include "wisp/light_depths.h"

namespace wisp::WISP_ARITH {

namespace {

// Below every real depth: there is no smoke around such a node.
constexpr Real unknown = Real(-1);

// The nodes of one brick; those that bricks before hold too are known already.
void find_depths(const LightDepths &depths, uint32_t brick, Real *found, uint64_t &shadow_rays) {
    const Bricks &bricks = *depths.bricks;
    const int32_t n = nodes_along(depths.stride), stride = depths.stride;
    const uint32_t nodes = nodes_of(stride), lights = depths.light_count;
    for (uint32_t k = 0; k < nodes; ++k) {
        const Cell at = cell_of_index(n, k), node = {at.x * stride, at.y * stride, at.z * stride};
        Real *depth = found + size_t{brick} * lights * nodes + k;
        for (uint32_t l = 0; l < lights; ++l) depth[size_t{l} * nodes] = unknown;
        if (!meets_smoke(*depths.medium, bricks, brick, node, stride)) continue;
        const Real *known = nullptr;
        for_each_holder(bricks, bricks.place[brick], at, n, [&](uint32_t other, uint32_t there) {
            const Real *its = found + size_t{other} * lights * nodes + there;
            if (other < brick && !(*its < Real(0))) known = its;
        });
        const Vec3 p = node_of(bricks, brick, node);
        for (uint32_t l = 0; l < lights; ++l) {
            if (known) {
                depth[size_t{l} * nodes] = known[size_t{l} * nodes];
                continue;
            }
            const Illumination way = illuminate(depths.lights[l], p, p, p);
            depth[size_t{l} * nodes] = max(Real(0), optical_depth(*depths.medium, {p, -way.direction}, way.distance));
            ++shadow_rays;
        }
    }
}

// A node's depth, as any brick that holds it found it. `node` may lie a node outside of the brick.
Real depth_beside(const LightDepths &depths, const Real *found, uint32_t brick, uint32_t l, const Cell &node) {
    const uint32_t nodes = nodes_of(depths.stride);
    Real depth = unknown;
    for_each_holder(*depths.bricks, depths.bricks->place[brick], node, nodes_along(depths.stride),
                    [&](uint32_t other, uint32_t there) {
                        depth = max(depth, found[(size_t{other} * depths.light_count + l) * nodes + there]);
                    });
    return depth;
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
    for (uint32_t b = 0; b < bricks.count; ++b) find_depths(depths, b, found, *shadow_rays);

    for (size_t i = 0; i < values; ++i) {
        const uint32_t l = static_cast<uint32_t>(i / nodes % light_count),
                       b = static_cast<uint32_t>(i / nodes / light_count);
        const Cell node = cell_of_index(nodes_along(stride), static_cast<uint32_t>(i % nodes));
        const Real here = found[i];
        Real bend = Real(0);
        for (int32_t axis = 0; axis < 3 && !(here < Real(0)); ++axis) {
            Cell low = node, high = node;
            --(axis == 0 ? low.x : axis == 1 ? low.y : low.z);
            ++(axis == 0 ? high.x : axis == 1 ? high.y : high.z);
            const Real before = depth_beside(depths, found, b, l, low),
                       behind = depth_beside(depths, found, b, l, high);
            if (!(before < Real(0)) && !(behind < Real(0))) bend += (before - here) + (behind - here);
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
