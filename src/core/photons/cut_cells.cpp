#include "core/photons/cut_cells.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t units_of_edge = 8; // of work
constexpr uint32_t all_corners = 0xff;

// Where a node sees from, as a part of its cell's edges. A surface often lies in a plane of nodes: these are beside it,
// all on one side.
Vec3 seen_from(const CutCells &cut, uint32_t brick, const Cell &node) {
    const SparseGrid &bricks = *cut.bricks;
    const int32_t spacing = cut.spacing;
    const Vec3 aside = bricks.cell * (Real(spacing) * Real(1.0 / 256));
    return node_of(bricks, brick, {node.x * spacing, node.y * spacing, node.z * spacing}) +
           Vec3(aside.x, Real(3) * aside.y, Real(9) * aside.z);
}

bool are_parted(const Surfaces &surfaces, const Vec3 &from, const Vec3 &to) {
    TreeCounts unused = {};
    return is_blocked(surfaces, {from, direction_between(from, to)}, Real(0), length(to - from), no_triangle, unused);
}

Cell corner_of(const Cell &lowest, uint32_t corner) {
    const int32_t c = static_cast<int32_t>(corner);
    return {lowest.x + (c & 1), lowest.y + (c >> 1 & 1), lowest.z + (c >> 2)};
}

// The corners of a cell that edges connect with one of them.
uint32_t connected_with(uint32_t corner, const uint8_t *lowest, int32_t n) {
    uint32_t group = 1u << corner;
    for (uint32_t before = 0; before != group;) {
        before = group;
        for (uint32_t i = 0; i < 24; ++i) {
            const uint32_t axis = i >> 3, from = i & 7, to = from | 1u << axis, both = 1u << from | 1u << to;
            if (from != to && (group & both) != 0 && (lowest[offset_of_corner(from, n)] >> axis & 1) == 0)
                group |= both;
        }
    }
    return group;
}

Cell along_axis(int32_t axis, int32_t along, int32_t second, int32_t third) {
    return axis == 0 ? Cell{along, second, third} : axis == 1 ? Cell{third, along, second} : Cell{second, third, along};
}

// Finds the edges of a brick that triangles cross. Returns whether there are any.
bool find_edges(const CutCells &cut, uint32_t brick, uint8_t *edges) {
    const int32_t n = nodes_along(cut.spacing);
    bool any = false;
    for (int32_t axis = 0; axis < 3; ++axis)
        for (int32_t line = 0; line < n * n; ++line) {
            const auto node = [&](int32_t i) { return along_axis(axis, i, line % n, line / n); };
            const auto place = [&](int32_t i) { return seen_from(cut, brick, node(i)); };
            if (!are_parted(*cut.surfaces, place(0), place(n - 1))) continue;
            for (int32_t i = 0; i < n - 1; ++i) {
                if (!are_parted(*cut.surfaces, place(i), place(i + 1))) continue;
                const Cell at = node(i);
                edges[(at.z * n + at.y) * n + at.x] |= static_cast<uint8_t>(1 << axis);
                any = true;
            }
        }
    return any;
}

// Marks the cells that triangles meet as cut: a corner of a room, or what is smaller than a cell, may lie between their
// edges.
struct CellMarker {
    const CutCells &cut;
    uint8_t *edges;
    Vec3 size; // of parts of triangles whose boxes are taken for them: a cell, where the numbers tell cells apart

    CellMarker(const CutCells &cut_, uint8_t *edges_)
        : cut(cut_), edges(edges_),
          size(max(cut.bricks->cell * Real(cut.spacing),
                   max(absolute(cut.bricks->bounds.low), absolute(cut.bricks->bounds.high)) * Real(0x1p-18))) {}

    void mark(const Vec3 &a, const Vec3 &b, const Vec3 &c) const {
        const SparseGrid &bricks = *cut.bricks;
        const Box box = {min(a, min(b, c)), max(a, max(b, c))};
        if (largest(max(box.low - bricks.bounds.high, bricks.bounds.low - box.high)) > Real(0)) return;
        if (largest(box.high - box.low - size) > Real(0)) {
            const Vec3 ab = (a + b) * Real(0.5), bc = (b + c) * Real(0.5), ca = (c + a) * Real(0.5);
            mark(a, ab, ca);
            mark(ab, b, bc);
            mark(ca, bc, c);
            mark(ab, bc, ca);
            return;
        }
        for (uint32_t corner = 0; corner < 8; ++corner) {
            const Vec3 x = corner_of(box, corner);
            const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
            if (brick == no_brick) continue;
            edges[cut.first(brick) + find_cell(position_in(bricks, brick, x), cut.spacing).node] |= 8;
        }
    }
    // Of the tree of an instance (nullptr: of the world). False: the work is stopped.
    bool mark_all(const TriangleTree &tree, const PlacedInstance *instance, Watch watch) const {
        for (uint32_t i = 0; i < tree.group_count * group_triangles; ++i) {
            const TriangleGroup &group = tree.groups[i / group_triangles];
            const uint32_t lane = i % group_triangles;
            if ((group.triangle[lane] & transmissive_bit) != 0) continue; // nor is there one
            if (!watch.go_on(units_of_edge)) return false;
            Vec3 corner[3];
            for (uint32_t c = 0; c < 3; ++c)
                corner[c] = in_world(
                    instance, Vec3(group.corner[c][0][lane], group.corner[c][1][lane], group.corner[c][2][lane]));
            mark(corner[0], corner[1], corner[2]);
        }
        return true;
    }
};

} // namespace

bool find_cut_cells(const Surfaces &surfaces, const SparseGrid &bricks, int32_t spacing, Arena &arena, Watch watch,
                    CutCells &cut) {
    const int32_t n = nodes_along(spacing);
    const uint32_t nodes = nodes_of(spacing);
    uint8_t *edges = arena.make<uint8_t>(uint64_t{bricks.count} * nodes);
    if (!edges) return false;
    cut = {&surfaces, &bricks, spacing, edges};
    watch.expect(uint64_t{bricks.count} * nodes * units_of_edge);
    for (uint32_t brick = 0; brick < bricks.count; ++brick) {
        if (!watch.done(nodes * units_of_edge)) return false;
        uint8_t *of_brick = edges + cut.first(brick);
        for (uint32_t node = 0; node < nodes; ++node) of_brick[node] = 0;
        if (!find_edges(cut, brick, of_brick)) continue;
        for (uint32_t node = 0; node < nodes; ++node) {
            const Cell at = cell_of_index(n, node);
            if (max(at.x, max(at.y, at.z)) < n - 1 && connected_with(0, of_brick + node, n) != all_corners)
                of_brick[node] |= 8;
        }
    }
    const CellMarker marker(cut, edges);
    if (!marker.mark_all(surfaces.static_tree, nullptr, watch)) return false;
    if (!marker.mark_all(surfaces.deforming_tree, nullptr, watch)) return false;
    for (uint32_t i = 0; i < surfaces.instance_count; ++i)
        if (surfaces.placed[i].visible && !marker.mark_all(surfaces.instances[i].tree, &surfaces.instances[i], watch))
            return false;
    return true;
}

bool has_cut_cell(const CutCells &cut, uint32_t brick) {
    for (uint32_t node = 0; cut.any() && node < nodes_of(cut.spacing); ++node)
        if (cut.is_cut(brick, node)) return true;
    return false;
}

bool are_parted(const CutCells &cut, uint32_t brick, const Cell &a, const Cell &b) {
    return are_parted(*cut.surfaces, seen_from(cut, brick, a), seen_from(cut, brick, b));
}

bool find_weights_in_cut_cell(const CutCells &cut, uint32_t brick, const CellPosition &at, const Vec3 &x,
                              CornerWeights &weights) {
    constexpr Real least = Real(0x1p-10); // of a corner that is seen: their sum is not 0
    const int32_t n = nodes_along(cut.spacing);
    const Cell lowest = cell_of_index(n, at.node);
    for (uint32_t corner = 0; corner < 8; ++corner)
        weights.of[corner] = max(corner_weight(at.t, corner), Real(0)) + least;
    const auto nearest_of = [&](uint32_t group) {
        uint32_t nearest = static_cast<uint32_t>(__builtin_ctz(group));
        for (uint32_t corner = nearest + 1; corner < 8; ++corner)
            if ((group >> corner & 1) != 0 && weights.of[corner] > weights.of[nearest]) nearest = corner;
        return nearest;
    };
    const auto seen_of = [&](auto &&group_of) {
        uint32_t seen = 0;
        for (uint32_t rest = all_corners; rest != 0;) {
            const uint32_t nearest = nearest_of(rest), group = group_of(nearest);
            if (!are_parted(*cut.surfaces, x, seen_from(cut, brick, corner_of(lowest, nearest)))) seen |= group;
            rest &= ~group;
        }
        return seen;
    };
    const uint8_t *lowest_edges = cut.edges + cut.first(brick) + at.node;
    // Where a surface parts the corners, those that are connected lie on one side: x sees all of them if it sees the
    // nearest. Where it sees no such one, because surfaces bend within the cell, or none is parted, because a surface
    // ends in it, each corner is asked for.
    uint32_t seen = 0;
    if (connected_with(0, lowest_edges, n) != all_corners)
        seen = seen_of([&](uint32_t corner) { return connected_with(corner, lowest_edges, n); });
    if (seen == 0) seen = seen_of([](uint32_t corner) { return 1u << corner; });
    Real sum = Real(0);
    for (uint32_t corner = 0; corner < 8; ++corner) {
        if ((seen >> corner & 1) == 0) weights.of[corner] = Real(0);
        sum += weights.of[corner];
    }
    if (seen == 0) return false;
    for (Real &weight : weights.of) weight = weight / sum;
    return true;
}

} // namespace wisp::WISP_ARITH
