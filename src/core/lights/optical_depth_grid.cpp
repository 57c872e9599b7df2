// Finding the optical depths of nodes, and correcting them for the interpolation.
#include "core/lights/deep_shadow_map.h"
#include "core/lights/optical_depth_grid.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

// Marks in place of a depth. `unknown`: the node has no smoke around it. waiting(face): its depth has not been found
// yet, and the light's line to the node leaves through this face of the light (light_face()).
constexpr Real unknown = Real(-1);
constexpr Real waiting(uint32_t face) { return Real(-2 - static_cast<int32_t>(face)); }

// Units of work: to mark the nodes of a brick, or to look for marks; to find the depth of a ray.
constexpr uint32_t units_of_marks = 32, units_of_scan = 2, units_of_ray = 256;

// Upper bounds of the rows of a deep shadow map, and of the values that it caches.
constexpr uint32_t max_rows = 1 << 14;
constexpr uint64_t max_cache_size(uint64_t bricks) { return bricks * 4 * nodes_of(2); }

// How far a box reaches out of another along each axis; below 0 where it does not.
Vec3 reach_beyond(const Box &outer, const Box &box) { return max(outer.low - box.low, box.high - outer.high); }

// The depths of one light at all nodes. A node on a face is stored by every brick that holds it.
struct Finder {
    const OpticalDepthGrid &depths;
    const Light &light;
    Real *found;
    uint64_t &shadow_rays;
    const Cell *place;   // of each node in its brick, in nodes
    bool cut_off;        // is_cut_off() of the medium
    bool nodes_on_faces; // ... and nodes lie on its faces
    Watch watch;

    const SparseGrid &bricks() const { return *depths.bricks; }
    uint32_t nodes() const { return nodes_of(depths.spacing); }
    Real *of_brick(uint32_t brick) const { return found + size_t{brick} * nodes(); }
    Cell cell_of_node(uint32_t k) const {
        const int32_t spacing = depths.spacing;
        return {place[k].x * spacing, place[k].y * spacing, place[k].z * spacing};
    }
    // A node on a hard face may be rounded to a point outside of the smoke: it is moved to the face.
    Vec3 point_of(uint32_t brick, uint32_t k) const {
        const Vec3 x = node_of(bricks(), brick, cell_of_node(k));
        return cut_off ? min(max(x, bricks().bounds.low), bricks().bounds.high) : x;
    }
    // The depths of neighbouring lines of a deep shadow map bend where they enter smoke that is cut off: they cannot be
    // interpolated near the faces through which light enters: at the face's own nodes and two behind it.
    bool is_near_lit_face(const Vec3 &x) const {
        if (!cut_off) return false;
        const Box &box = bricks().bounds;
        const Vec3 direction = illuminate(light, x, x, x).direction, reach = bricks().cell * Real(2.75);
        for (int axis = 0; axis < 3; ++axis)
            if ((direction[axis] > Real(0) && x[axis] - box.low[axis] < reach[axis]) ||
                (direction[axis] < Real(0) && box.high[axis] - x[axis] < reach[axis]))
                return true;
        return false;
    }
    // Nor can they where some of those lines have left the smoke already, or a crease is between them.
    bool is_near_bend(const Box &lines) const {
        const Box &smoke = bricks().bounds;
        return cut_off && (largest(reach_beyond(smoke, lines)) > Real(0) || has_crease(smoke, light, lines));
    }
    // How far a point may be rounded out of the smoke.
    Vec3 margin() const { return bricks().cell * Real(0.25); }
    // Interpolation at points of the smoke does not reach so far, where other nodes lie on its faces.
    bool is_behind_face(uint32_t brick, uint32_t k) const {
        const Vec3 x = node_of(bricks(), brick, cell_of_node(k));
        return nodes_on_faces && largest(reach_beyond(bricks().bounds, {x, x}) - margin()) > Real(0);
    }
    template <class Visit> void for_each_waiting(uint32_t face, Visit &&visit) const {
        const uint32_t count = bricks().count, all = nodes();
        const Real mark = waiting(face), *depth = found;
        for (uint32_t brick = 0; brick < count && (brick % 16 != 0 || watch.go_on(16 * units_of_scan)); ++brick)
            for (uint32_t k = 0; k < all; ++k)
                if (*depth++ == mark) visit(brick, k);
    }
};

// Marks the nodes that have no smoke around them. They are the same for every light.
void mark_nodes_in_smoke(const Finder &finder) {
    for (uint32_t brick = 0; brick < finder.bricks().count && finder.watch.done(units_of_marks); ++brick)
        for (uint32_t k = 0; k < finder.nodes(); ++k) {
            const bool in_smoke =
                !finder.is_behind_face(brick, k) && meets_smoke(*finder.depths.medium, finder.bricks(), brick,
                                                                finder.cell_of_node(k), finder.depths.spacing);
            finder.of_brick(brick)[k] = in_smoke ? Real(0) : unknown;
        }
}

// Marks all other nodes as waiting for a depth of this light.
void begin_light(const Finder &finder) {
    for (uint32_t brick = 0; brick < finder.bricks().count && finder.watch.done(units_of_marks); ++brick)
        for (uint32_t k = 0; k < finder.nodes(); ++k) {
            Real &depth = finder.of_brick(brick)[k];
            if (!(depth < Real(0))) depth = waiting(light_face(finder.light, finder.point_of(brick, k)));
        }
}

// Finds the depth of each waiting node of a brick by a ray, or copies it from another brick that holds the node.
void find_by_rays(const Finder &finder, uint32_t brick) {
    const SparseGrid &bricks = finder.bricks();
    const int32_t n = nodes_along(finder.depths.spacing);
    for (uint32_t k = 0; k < finder.nodes(); ++k) {
        Real &depth = finder.of_brick(brick)[k];
        if (!(depth < unknown)) continue;
        const Real *known = nullptr;
        for_each_holder(bricks, bricks.position[brick], finder.place[k], n, [&](uint32_t other, uint32_t there) {
            const Real *depth_there = finder.of_brick(other) + there;
            if (!(*depth_there < Real(0))) known = depth_there;
        });
        if (known) {
            depth = *known;
            continue;
        }
        if (!finder.watch.go_on(units_of_ray)) return;
        const Vec3 p = finder.point_of(brick, k);
        const Illumination from = illuminate(finder.light, p, p, p);
        depth = max(Real(0), optical_depth(*finder.depths.medium, {p, -from.direction}, from.distance));
        ++finder.shadow_rays;
    }
}

// Finds the depths of the nodes on a face by a deep shadow map, if it has no more lines than there are such nodes.
// Nodes for which the map has no depth keep waiting. False: the arena was too small, or the work is stopped.
bool find_by_deep_shadow_map(const Finder &finder, uint32_t face, Arena &arena) {
    const SparseGrid &bricks = finder.bricks();
    const uint32_t nodes = finder.nodes();
    const Vec3 around = bricks.cell * Real(finder.depths.spacing);
    const Box reach = {bricks.bounds.low - around, bricks.bounds.high + around};
    const DeepShadowMap map(*finder.depths.medium, finder.cut_off, finder.light, face, reach);
    uint64_t count = 0;
    finder.for_each_waiting(face, [&](uint32_t, uint32_t) { ++count; });
    if (map.count() == 0 || map.count() > count || map.cache_size() > max_cache_size(bricks.count) ||
        map.rows() > max_rows)
        return true;

    // Sort the nodes by the rows in which they lie.
    const size_t mark = arena.mark();
    Real *cache = arena.make<Real>(static_cast<size_t>(map.cache_size()));
    uint32_t *order = arena.make<uint32_t>(static_cast<size_t>(count));
    uint32_t *begin = arena.make<uint32_t>(size_t{map.rows()} + 1); // of each row
    if (!cache || !order || !begin) return false;
    const auto row_of = [&](uint32_t brick, uint32_t k) { return map.row_of(finder.point_of(brick, k)); };
    std::fill(begin, begin + map.rows() + 1, 0);
    finder.for_each_waiting(face, [&](uint32_t brick, uint32_t k) { ++begin[row_of(brick, k) + 1]; });
    for (uint32_t row = 0; row < map.rows(); ++row) begin[row + 1] += begin[row];
    finder.for_each_waiting(face,
                            [&](uint32_t brick, uint32_t k) { order[begin[row_of(brick, k)]++] = brick * nodes + k; });
    uint32_t rows_begun = 0, next = 0;
    finder.watch.expect(count);
    for (uint32_t row = 1; row < map.rows(); ++row) {
        if (next == begin[row]) continue; // begin[row] is now the end of the row: filling `order` moved it
        for (rows_begun = max(rows_begun, row - 1); rows_begun <= row + 2; ++rows_begun)
            map.begin_row(rows_begun, cache);
        while (next < begin[row]) {
            const uint32_t first = next, end = min(begin[row], next + 256);
            const uint64_t lines = finder.shadow_rays;
            for (; next < end; ++next) {
                const uint32_t brick = order[next] / nodes, k = order[next] % nodes;
                const Vec3 x = finder.point_of(brick, k);
                if (finder.is_near_lit_face(x) || finder.is_near_bend(map.lines_around(x))) continue;
                const Real depth = map.depth(x, cache, finder.shadow_rays);
                if (!(depth < Real(0))) finder.of_brick(brick)[k] = depth;
            }
            if (!finder.watch.done(end - first) ||
                !finder.watch.go_on(static_cast<uint32_t>(finder.shadow_rays - lines) * units_of_ray))
                return false;
        }
    }
    arena.rewind(mark);
    return true;
}

// The depth of a node in any brick that holds it. `node` may lie one node outside of the brick.
Real depth_of_neighbour(const Finder &finder, uint32_t brick, const Cell &node) {
    Real depth = unknown;
    for_each_holder(finder.bricks(), finder.bricks().position[brick], node, nodes_along(finder.depths.spacing),
                    [&](uint32_t other, uint32_t there) { depth = max(depth, finder.of_brick(other)[there]); });
    return depth;
}

// A node's depth without 1/12 of its second differences: the interpolation then has the right mean (README). They are
// no measure of it across a crease. A node that lies behind a face, whose depth is that of the face, gets what the
// interpolation needs to have that depth there: it may be below 0.
Real corrected(const Finder &finder, uint32_t brick, uint32_t k) {
    const int32_t n = nodes_along(finder.depths.spacing);
    const Real *here = finder.of_brick(brick) + k;
    if (*here < Real(0)) return Real(0);
    const Cell &node = finder.place[k];
    const Box &smoke = finder.bricks().bounds;
    const Vec3 x = node_of(finder.bricks(), brick, finder.cell_of_node(k)), outside = reach_beyond(smoke, {x, x}),
               margin = finder.margin(), length = finder.bricks().cell * Real(finder.depths.spacing);
    Real second_difference = Real(0), beyond = Real(0);
    ptrdiff_t step = 1; // index distance to the next node along the axis
    for (int32_t axis = 0; axis < 3; ++axis, step *= n) {
        const int32_t along = axis == 0 ? node.x : axis == 1 ? node.y : node.z;
        const auto neighbour = [&](int32_t offset) {
            if (along + offset >= 0 && along + offset < n && !(here[offset * step] < Real(0)))
                return here[offset * step];
            Cell other = node;
            (axis == 0 ? other.x : axis == 1 ? other.y : other.z) += offset;
            return depth_of_neighbour(finder, brick, other);
        };
        const Real before = neighbour(-1), behind = neighbour(1);
        if (finder.cut_off && outside[axis] > margin[axis]) {
            const Real gap = outside[axis], inside = x[axis] < smoke.low[axis] ? behind : before;
            if (!(inside < Real(0)) && gap < length[axis]) beyond += (*here - inside) * (gap / (length[axis] - gap));
            continue;
        }
        Box neighbours = {x, x};
        neighbours.low[axis] -= length[axis];
        neighbours.high[axis] += length[axis];
        if (finder.cut_off &&
            (reach_beyond(smoke, neighbours)[axis] > margin[axis] || has_crease(smoke, finder.light, neighbours)))
            continue;
        if (!(before < Real(0)) && !(behind < Real(0))) second_difference += (before - *here) + (behind - *here);
    }
    return max(Real(0), *here - second_difference * Real(1.0 / 12)) + beyond;
}

} // namespace

// Towards the light, smoke ends at the nearest of its lit faces. How far that of each axis is grows along the axis
// alone. So one face is the nearest from all of the box if it is no farther from its farthest points than any other is
// from its nearest. Distances are parts of the way to a point; of a parallel light, lengths. A crease that hardly cuts
// the box is none: creases go through nodes, where rounding must not decide.
bool has_crease(const Box &smoke, const Light &light, const Box &box) {
    const bool parallel = light.kind == LightKind::parallel;
    const Real none = parallel ? infinite_distance : Real(1); // a way to the light through no face of the axis
    Vec3 least(none), most(none);
    Real slack = Real(0);
    for (int axis = 0; axis < 3; ++axis) {
        const Real along = light.direction[axis], from = light.position[axis];
        const bool rises = parallel ? along > Real(0) : from < smoke.low[axis],
                   falls = parallel ? along < Real(0) : from > smoke.high[axis];
        if (!rises && !falls) continue;
        const Real face = rises ? smoke.low[axis] : smoke.high[axis], gap = abs(face - from);
        const auto way = [&](Real x) { // from x to the face
            const Real inside = max(Real(0), rises ? x - face : face - x);
            return parallel ? min(none, bounded_quotient(inside, abs(along))) : inside / (inside + gap);
        };
        const Real low = way(box.low[axis]), high = way(box.high[axis]);
        least[axis] = min(low, high);
        most[axis] = max(low, high);
        slack = max(slack, (most[axis] - least[axis]) * Real(0x1p-8));
    }
    const auto is_first = [&](Real farthest, Real a, Real b) { return farthest <= a + slack && farthest <= b + slack; };
    return !(is_first(most.x, least.y, least.z) || is_first(most.y, least.z, least.x) ||
             is_first(most.z, least.x, least.y));
}

bool make_optical_depth_grid(const Medium &medium, const Light *lights, uint32_t light_count, const SparseGrid &bricks,
                             int32_t spacing, Arena &arena, uint64_t *shadow_rays, OpticalDepthGrid &depths,
                             Watch watch) {
    depths = {&medium, lights, light_count, &bricks, spacing, nullptr, is_cut_off(medium)};
    const size_t nodes = nodes_of(spacing), all = bricks.count * nodes;
    Real *depth = arena.make<Real>(all * light_count);
    depths.depth = depth;
    const size_t mark = arena.mark();
    Real *found = arena.make<Real>(all);
    Cell *place = arena.make<Cell>(nodes);
    if (!depth || !found || !place) return false;
    for (uint32_t k = 0; k < nodes; ++k) place[k] = cell_of_index(nodes_along(spacing), k);
    // Samples of a density grid lie half a cell of it inside its faces.
    bool samples = false;
    for (uint32_t i = 0; i < medium.count; ++i) samples = samples || medium.smokes[i].source->grid.density;
    const bool nodes_on_faces = depths.cut_off && spacing == 1 && (!samples || bricks.subdivision > 1);
    watch.expect((bricks.count + light_count * uint64_t{bricks.count} * 3) * units_of_marks);
    for (uint32_t l = 0; l < light_count; ++l) {
        const Finder finder = {depths, lights[l], found, *shadow_rays, place, depths.cut_off, nodes_on_faces, watch};
        if (l == 0) mark_nodes_in_smoke(finder);
        begin_light(finder);
        if (medium.bricks && all <= UINT32_MAX)
            for (uint32_t face = 0; face < light_faces; ++face)
                if (!find_by_deep_shadow_map(finder, face, arena)) return false;
        for (uint32_t b = 0; b < bricks.count && watch.done(units_of_marks); ++b) find_by_rays(finder, b);
        for (uint32_t b = 0; b < bricks.count && watch.done(units_of_marks); ++b)
            for (uint32_t k = 0; k < nodes; ++k)
                depth[(size_t{b} * light_count + l) * nodes + k] = corrected(finder, b, k);
    }
    arena.rewind(mark);
    return !watch.stopped();
}

uint64_t optical_depth_grid_bytes(uint64_t bricks, uint32_t light_count, int32_t spacing) {
    const uint64_t nodes = bricks * nodes_of(spacing);
    return Arena::bytes<Real>(nodes * light_count) + Arena::bytes<Real>(nodes) + Arena::bytes<Cell>(nodes_of(spacing)) +
           Arena::bytes<Real>(max_cache_size(bricks)) + Arena::bytes<uint32_t>(nodes) +
           Arena::bytes<uint32_t>(max_rows + 1);
}

Real optical_depth_to_light(const OpticalDepthGrid &depths, uint32_t l, const Vec3 &x) {
    const SparseGrid &bricks = *depths.bricks;
    const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
    if (brick == no_brick) return Real(0);
    const Real *depth = depths_of_brick(depths, brick) + size_t{l} * nodes_of(depths.spacing);
    return max(Real(0), between_nodes(find_cell(position_in(bricks, brick, x), depths.spacing), depths.spacing,
                                      [depth](uint32_t node) { return depth[node]; }));
}

} // namespace wisp::WISP_ARITH
