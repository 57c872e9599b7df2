// A lattice of nodes that exists only where smoke is: bricks of 8 x 8 x 8 cells (S4-1, S4-4).
//
// A brick holds the nodes of its own faces too, so that the corners of any cell lie in one brick; a node on a face is
// held by every brick that it belongs to, with the same value. A field over the bricks has a node every `stride` cells,
// 1, 2, 4 or 8: (8 / stride + 1)^3 nodes a brick, x fastest.
#pragma once
#include "core/geometry/lattice.h"
#include "core/numbers/double_bits.h"
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

constexpr int32_t log_brick_cells = 3, brick_cells = 1 << log_brick_cells; // along each edge
constexpr uint32_t no_brick = 0xffffffff;

constexpr int32_t nodes_along(int32_t stride) { return brick_cells / stride + 1; }
constexpr uint32_t nodes_of(int32_t stride) {
    return static_cast<uint32_t>(nodes_along(stride) * nodes_along(stride) * nodes_along(stride));
}

// Of n x n x n nodes or samples, x fastest.
inline Cell cell_of_index(int32_t n, uint32_t index) {
    const int32_t i = static_cast<int32_t>(index);
    return {i % n, i / n % n, i / n / n};
}

struct SparseGrid {
    Lattice lattice; // of the bricks that there may be
    Vec3 cell;       // the size of one
    Vec3 inverse_cell;
    int32_t parts;         // of a grid's cell along each edge
    Box bounds;            // of the smoke, inside the lattice
    const uint32_t *index; // by brick of the lattice: which it is of those that exist, or no_brick
    const Cell *place;     // of those that exist: where in the lattice, ascending
    uint32_t count;        // of those that exist
    bool ready;            // false: the arena was too small
};

// The smallest smoothing length of all smokes (or what stands for it in grids), 0 without smoke.
Real finest_length(const Scene &scene);

// Bricks around the smoke of `scene`, their cells `lengths` smoothing lengths of the finest smoke wide. Where all smoke
// is a single grid that is not turned, the cells are those between the grid's samples or halves of them; of a box they
// fit the box.
SparseGrid make_sparse_grid(const Scene &scene, double lengths, Arena &arena);

// The cells of a grid are cut in so many along each edge: where a trilinear field is resampled nothing is lost.
constexpr int32_t parts_within(double lengths) { return total_order_key(lengths) > total_order_key(0.75) ? 1 : 2; }

struct SparseGridPlan {
    uint64_t count; // of bricks, at most
    uint64_t bytes;
    Real longest; // the diagonal of the smoke's bounds
};
SparseGridPlan plan_sparse_grid(const Scene &scene, double lengths);

// Where a brick begins, and x from there in cells.
inline Vec3 low_of(const SparseGrid &bricks, uint32_t brick) {
    const Cell &at = bricks.place[brick];
    return bricks.lattice.low + Vec3(Real(at.x), Real(at.y), Real(at.z)) * bricks.lattice.edge;
}
inline Vec3 position_in(const SparseGrid &bricks, uint32_t brick, const Vec3 &x) {
    return (x - low_of(bricks, brick)) * bricks.inverse_cell;
}
// A node, by its place in cells from the brick's beginning. Every brick that holds it gives the same point.
inline Vec3 node_of(const SparseGrid &bricks, uint32_t brick, const Cell &node) {
    const Cell &at = bricks.place[brick];
    return bricks.lattice.low + Vec3(Real(at.x * brick_cells + node.x), Real(at.y * brick_cells + node.y),
                                     Real(at.z * brick_cells + node.z)) *
                                    bricks.cell;
}
inline uint32_t brick_at(const SparseGrid &bricks, const Cell &cell) {
    return bricks.index[index_of(bricks.lattice.count, cell)];
}

// The cell of a field in which p lies, a place in a brick in cells, and where in it.
struct GridPlace {
    uint32_t node; // of the cell's lowest corner
    Vec3 t;        // 0 to 1 along each edge
};
inline GridPlace place_of(const Vec3 &p, int32_t stride) {
    const int32_t n = nodes_along(stride);
    const Vec3 q = stride == 1 ? p : p * (Real(1) / Real(stride));
    const int32_t x = min(truncate(max(q.x, Real(0))), n - 2), y = min(truncate(max(q.y, Real(0))), n - 2),
                  z = min(truncate(max(q.z, Real(0))), n - 2);
    return {static_cast<uint32_t>((z * n + y) * n + x), q - Vec3(Real(x), Real(y), Real(z))};
}

// Trilinear between a brick's nodes; `value(node)`.
template <class Value> Real between_nodes(const GridPlace &at, int32_t stride, Value &&value) {
    const uint32_t n = static_cast<uint32_t>(nodes_along(stride));
    return trilinear(at.t, [&](int32_t dx, int32_t dy, int32_t dz) {
        return value(at.node + static_cast<uint32_t>(dx) +
                     n * (static_cast<uint32_t>(dy) + n * static_cast<uint32_t>(dz)));
    });
}

// visit(brick, node) for every brick that holds a node of a field with n nodes along an edge: `node` of the brick at a
// place of the lattice, which need not exist; it may also lie up to n - 1 nodes outside of that.
template <class Visit>
void for_each_holder(const SparseGrid &bricks, const Cell &place, const Cell &node, int32_t n, Visit &&visit) {
    struct Axis {
        int32_t place, node, lowest, highest; // the bricks that hold it: place + lowest to place + highest
        Axis(int32_t place_, int32_t node_, int32_t n, int32_t count) : place(place_), node(node_) {
            if (node < 0) --place, node += n - 1;
            if (node >= n) ++place, node -= n - 1;
            lowest = max(node == 0 ? -1 : 0, -place);
            highest = min(node == n - 1 ? 1 : 0, count - 1 - place);
        }
        int32_t in(int32_t step, int32_t n) const { return step == 0 ? node : step > 0 ? 0 : n - 1; }
    };
    const Cell &count = bricks.lattice.count;
    const Axis x(place.x, node.x, n, count.x), y(place.y, node.y, n, count.y), z(place.z, node.z, n, count.z);
    for (int32_t dz = z.lowest; dz <= z.highest; ++dz)
        for (int32_t dy = y.lowest; dy <= y.highest; ++dy)
            for (int32_t dx = x.lowest; dx <= x.highest; ++dx) {
                const uint32_t brick = brick_at(bricks, {x.place + dx, y.place + dy, z.place + dz});
                if (brick != no_brick)
                    visit(brick, static_cast<uint32_t>((z.in(dz, n) * n + y.in(dy, n)) * n + x.in(dx, n)));
            }
}

// Visits the bricks that the ray passes between `begin` and `end`, in order: visit(brick, from, to) returns whether to
// go on.
template <class Visit> void for_each_brick(const SparseGrid &bricks, const Ray &ray, Real begin, Real end, Visit &&visit) {
    for_each_cell(bricks.lattice, ray, begin, end, [&](const Cell &cell, Real from, Real to) {
        const uint32_t brick = brick_at(bricks, cell);
        return brick == no_brick || visit(brick, from, to);
    });
}

} // namespace wisp::WISP_ARITH
