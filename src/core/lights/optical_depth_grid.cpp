// Optical depths to the lights at the nodes of bricks around smoke.
#include "core/lights/deep_shadow_map.h"
#include "core/lights/optical_depth_grid.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

// Below every real depth: there is no smoke around such a node; or there is, and its depth is yet to be found, along
// lines of a face of its light.
constexpr Real unknown = Real(-1);
constexpr Real waiting(uint32_t face) { return Real(-2 - static_cast<int32_t>(face)); }

// Rows of lines, and values of those in memory, at most.
constexpr uint32_t max_rows = 1 << 14;
constexpr uint64_t column_room(uint64_t bricks) { return bricks * 2 * nodes_of(2); }

// The depths of one light at all nodes of the bricks, shared ones in each brick that holds them.
struct Finder {
    const OpticalDepthGrid &depths;
    const Light &light;
    Real *found;
    uint64_t &shadow_rays;
    const Cell *place; // of each node in a brick, in nodes
    bool cut_off;      // there is smoke at the medium's bounds

    const SparseGrid &bricks() const { return *depths.bricks; }
    uint32_t nodes() const { return nodes_of(depths.stride); }
    Real *of_brick(uint32_t brick) const { return found + size_t{brick} * nodes(); }
    Cell cell_of_node(uint32_t k) const {
        const int32_t stride = depths.stride;
        return {place[k].x * stride, place[k].y * stride, place[k].z * stride};
    }
    Vec3 point_of(uint32_t brick, uint32_t k) const { return node_of(bricks(), brick, cell_of_node(k)); }
    template <class Visit> void for_each_waiting(uint32_t face, Visit &&visit) const {
        for (uint32_t brick = 0; brick < bricks().count; ++brick)
            for (uint32_t k = 0; k < nodes(); ++k)
                if (of_brick(brick)[k] == waiting(face)) visit(brick, k);
    }
};

// The same nodes for every light.
void mark_nodes_in_smoke(const Finder &finder) {
    for (uint32_t brick = 0; brick < finder.bricks().count; ++brick)
        for (uint32_t k = 0; k < finder.nodes(); ++k) {
            const bool meets = meets_smoke(*finder.depths.medium, finder.bricks(), brick, finder.cell_of_node(k),
                                           finder.depths.stride);
            finder.of_brick(brick)[k] = meets ? Real(0) : unknown;
        }
}

// Of those that are not unknown, whatever depth they have.
void begin_light(const Finder &finder) {
    for (uint32_t brick = 0; brick < finder.bricks().count; ++brick)
        for (uint32_t k = 0; k < finder.nodes(); ++k) {
            Real &depth = finder.of_brick(brick)[k];
            if (!(depth < Real(0))) depth = waiting(light_face(finder.light, finder.point_of(brick, k)));
        }
}

// By a ray from each node of a brick that still waits; those that other bricks hold too may be known.
void find_by_rays(const Finder &finder, uint32_t brick) {
    const SparseGrid &bricks = finder.bricks();
    const int32_t n = nodes_along(finder.depths.stride);
    for (uint32_t k = 0; k < finder.nodes(); ++k) {
        Real &depth = finder.of_brick(brick)[k];
        if (!(depth < unknown)) continue;
        const Real *known = nullptr;
        for_each_holder(bricks, bricks.place[brick], finder.place[k], n, [&](uint32_t other, uint32_t there) {
            const Real *its = finder.of_brick(other) + there;
            if (!(*its < Real(0))) known = its;
        });
        if (known) {
            depth = *known;
            continue;
        }
        const Vec3 p = finder.point_of(brick, k);
        const Illumination way = illuminate(finder.light, p, p, p);
        depth = max(Real(0), optical_depth(*finder.depths.medium, {p, -way.direction}, way.distance));
        ++finder.shadow_rays;
    }
}

// Along the lines of a face, where these are no more than its nodes; nodes that are refused keep waiting. False: the
// arena was too small.
bool find_by_columns(const Finder &finder, uint32_t face, Arena &arena) {
    const SparseGrid &bricks = finder.bricks();
    const uint32_t nodes = finder.nodes();
    const Vec3 around = bricks.cell * Real(finder.depths.stride);
    const Box reach = {bricks.bounds.low - around, bricks.bounds.high + around};
    const DeepShadowMap columns(*finder.depths.medium, finder.cut_off, finder.light, face, reach);
    uint64_t count = 0;
    finder.for_each_waiting(face, [&](uint32_t, uint32_t) { ++count; });
    if (columns.count() == 0 || columns.count() > count || columns.room() > column_room(bricks.count) ||
        columns.rows() > max_rows)
        return true;

    // Nodes in the order of the rows in which they lie.
    const size_t mark = arena.mark();
    Real *kept = arena.make<Real>(static_cast<size_t>(columns.room()));
    uint32_t *order = arena.make<uint32_t>(static_cast<size_t>(count));
    uint32_t *begin = arena.make<uint32_t>(size_t{columns.rows()} + 1); // of each row
    if (!kept || !order || !begin) return false;
    const auto row_of = [&](uint32_t brick, uint32_t k) { return columns.row_of(finder.point_of(brick, k)); };
    std::fill(begin, begin + columns.rows() + 1, 0);
    finder.for_each_waiting(face, [&](uint32_t brick, uint32_t k) { ++begin[row_of(brick, k) + 1]; });
    for (uint32_t row = 0; row < columns.rows(); ++row) begin[row + 1] += begin[row];
    finder.for_each_waiting(face,
                            [&](uint32_t brick, uint32_t k) { order[begin[row_of(brick, k)]++] = brick * nodes + k; });
    uint32_t known = 0, next = 0;
    for (uint32_t row = 1; row < columns.rows(); ++row) {
        if (next == begin[row]) continue; // where the next one began before its nodes were placed
        for (known = max(known, row - 1); known <= row + 2; ++known) columns.begin_row(known, kept);
        for (; next < begin[row]; ++next) {
            const uint32_t brick = order[next] / nodes, k = order[next] % nodes;
            const Real depth = columns.depth(finder.point_of(brick, k), kept, finder.shadow_rays);
            if (!(depth < Real(0))) finder.of_brick(brick)[k] = depth;
        }
    }
    arena.rewind(mark);
    return true;
}

// A node's depth, as any brick that holds it found it. `node` may lie a node outside of the brick.
Real depth_beside(const Finder &finder, uint32_t brick, const Cell &node) {
    Real depth = unknown;
    for_each_holder(finder.bricks(), finder.bricks().place[brick], node, nodes_along(finder.depths.stride),
                    [&](uint32_t other, uint32_t there) { depth = max(depth, finder.of_brick(other)[there]); });
    return depth;
}

// What is interpolated between nodes then has the right mean.
Real corrected(const Finder &finder, uint32_t brick, uint32_t k) {
    const int32_t n = nodes_along(finder.depths.stride);
    const Real *here = finder.of_brick(brick) + k;
    if (*here < Real(0)) return Real(0);
    const Cell &node = finder.place[k];
    Real bend = Real(0);
    ptrdiff_t step = 1; // to the next node along the axis
    for (int32_t axis = 0; axis < 3; ++axis, step *= n) {
        const int32_t along = axis == 0 ? node.x : axis == 1 ? node.y : node.z;
        const auto beside = [&](int32_t way) {
            if (along + way >= 0 && along + way < n && !(here[way * step] < Real(0))) return here[way * step];
            Cell other = node;
            (axis == 0 ? other.x : axis == 1 ? other.y : other.z) += way;
            return depth_beside(finder, brick, other);
        };
        const Real before = beside(-1), behind = beside(1);
        if (!(before < Real(0)) && !(behind < Real(0))) bend += (before - *here) + (behind - *here);
    }
    return max(Real(0), *here - bend * Real(1.0 / 12));
}

} // namespace

bool make_optical_depth_grid(const Medium &medium, const Light *lights, uint32_t light_count, const SparseGrid &bricks,
                       int32_t stride, Arena &arena, uint64_t *shadow_rays, OpticalDepthGrid &depths) {
    depths = {&medium, lights, light_count, &bricks, stride, nullptr};
    const size_t nodes = nodes_of(stride), all = bricks.count * nodes;
    Real *depth = arena.make<Real>(all * light_count);
    depths.depth = depth;
    const size_t mark = arena.mark();
    Real *found = arena.make<Real>(all);
    if (!depth || !found) return false;
    Cell place[nodes_of(1)];
    for (uint32_t k = 0; k < nodes; ++k) place[k] = cell_of_index(nodes_along(stride), k);
    const bool cut_off = is_cut_off(medium);
    for (uint32_t l = 0; l < light_count; ++l) {
        const Finder finder = {depths, lights[l], found, *shadow_rays, place, cut_off};
        if (l == 0) mark_nodes_in_smoke(finder);
        begin_light(finder);
        if (medium.bricks && all <= UINT32_MAX)
            for (uint32_t face = 0; face < light_faces; ++face)
                if (!find_by_columns(finder, face, arena)) return false;
        for (uint32_t b = 0; b < bricks.count; ++b) find_by_rays(finder, b);
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < nodes; ++k)
                depth[(size_t{b} * light_count + l) * nodes + k] = corrected(finder, b, k);
    }
    arena.rewind(mark);
    return true;
}

uint64_t optical_depth_grid_bytes(uint64_t bricks, uint32_t light_count, int32_t stride) {
    const uint64_t nodes = bricks * nodes_of(stride);
    return Arena::bytes<Real>(nodes * light_count) + Arena::bytes<Real>(nodes) +
           Arena::bytes<Real>(column_room(bricks)) + Arena::bytes<uint32_t>(nodes) +
           Arena::bytes<uint32_t>(max_rows + 1);
}

Real optical_depth_to_light(const OpticalDepthGrid &depths, uint32_t l, const Vec3 &x) {
    const SparseGrid &bricks = *depths.bricks;
    const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
    if (brick == no_brick) return Real(0);
    const Real *depth = depths_of_brick(depths, brick) + size_t{l} * nodes_of(depths.stride);
    return max(Real(0), between_nodes(place_of(position_in(bricks, brick, x), depths.stride), depths.stride,
                                      [depth](uint32_t node) { return depth[node]; }));
}

} // namespace wisp::WISP_ARITH
