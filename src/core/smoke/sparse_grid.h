// A sparse grid: a lattice of nodes that exists only around smoke, in bricks of 8 x 8 x 8 cells (S4-1, S4-4). OpenVDB
// (Museth 2013) calls such a block a leaf node.
//
// A brick holds the nodes on its own faces too, so all corners of a cell lie in one brick. A node on a face is stored
// in every brick that it belongs to, with the same value. A field over the grid has a node every `spacing` cells, where
// the spacing is 1, 2, 4 or 8: (8 / spacing + 1)^3 nodes a brick, x fastest.
#pragma once
#include "core/geometry/lattice.h"
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

constexpr int32_t log_brick_cells = 3, brick_cells = 1 << log_brick_cells; // cells along an edge of a brick
constexpr uint32_t no_brick = 0xffffffff;

// Nodes along an edge of a brick, and in a brick.
constexpr int32_t nodes_along(int32_t spacing) { return brick_cells / spacing + 1; }
constexpr uint32_t nodes_of(int32_t spacing) {
    return static_cast<uint32_t>(nodes_along(spacing) * nodes_along(spacing) * nodes_along(spacing));
}

// The coordinates of element `index` in an array of n x n x n elements, x fastest.
inline Cell cell_of_index(int32_t n, uint32_t index) {
    const int32_t i = static_cast<int32_t>(index);
    return {i % n, i / n % n, i / n / n};
}

struct SparseGrid {
    Lattice lattice;       // its cells are the bricks that may exist
    Vec3 cell;             // the edges of a cell of a brick, in units of the scene
    Vec3 inverse_cell;     // 1 / cell
    int32_t subdivision;   // cells along an edge of a density grid's cell
    Box bounds;            // of the smoke, inside the lattice
    const uint32_t *index; // by cell of the lattice: the brick's number, or no_brick
    const Cell *position;  // by brick: its cell in the lattice, ascending
    uint32_t count;        // bricks that exist
    bool ready;            // false: the arena was too small
};

// The box of all supports of particles and of all density grids; at the origin without smoke.
Box box_around_smoke(const Scene &scene);

// The smallest smoothing length of all smokes, 0 without smoke. A density grid's length is given by its description.
Real smallest_smoothing_length(const Scene &scene);

// The bricks around the smoke of `scene`. The edge of a cell is `lengths` times the smallest smoothing length. There
// are two exceptions. If all smoke is one density grid that is not rotated, the cells are those between its samples, or
// parts of them. If it is one box of constant density, the cells are shrunk until a whole number fits the box.
SparseGrid make_sparse_grid(const Scene &scene, double lengths, Arena &arena, Watch watch = {});

struct SparseGridPlan {
    uint64_t count;   // an upper bound of the number of bricks
    uint64_t of_line; // the same of those that a line crosses
    uint64_t bytes;   // what make_sparse_grid takes from the arena, at most
    uint64_t places;  // of the lattice
    Box bounds;       // as in SparseGrid, as the next
    Vec3 cell;
};
SparseGridPlan plan_sparse_grid(const Scene &scene, double lengths);

// The low corner of a brick.
inline Vec3 low_of(const SparseGrid &bricks, uint32_t brick) {
    const Cell &at = bricks.position[brick];
    return bricks.lattice.low + Vec3(Real(at.x), Real(at.y), Real(at.z)) * bricks.lattice.edge;
}
// The position of x relative to the low corner of a brick, in cells.
inline Vec3 position_in(const SparseGrid &bricks, uint32_t brick, const Vec3 &x) {
    return (x - low_of(bricks, brick)) * bricks.inverse_cell;
}
// The point of a node that is given in cells from the brick's low corner. Every brick that holds the node gives the
// same bits.
inline Vec3 node_of(const SparseGrid &bricks, uint32_t brick, const Cell &node) {
    const Cell &at = bricks.position[brick];
    return bricks.lattice.low + Vec3(Real(at.x * brick_cells + node.x), Real(at.y * brick_cells + node.y),
                                     Real(at.z * brick_cells + node.z)) *
                                    bricks.cell;
}
inline uint32_t brick_at(const SparseGrid &bricks, const Cell &cell) {
    return bricks.index[index_of(bricks.lattice.count, cell)];
}

// A position inside one cell of a field over a brick.
struct CellPosition {
    uint32_t node; // the cell's lowest corner
    Vec3 t;        // 0 to 1 along each edge
};
// The cell of a field with the given spacing that holds p, in cells from the brick's low corner.
inline CellPosition find_cell(const Vec3 &p, int32_t spacing) {
    const int32_t n = nodes_along(spacing);
    const Vec3 q = spacing == 1 ? p : p * (Real(1) / Real(spacing));
    const int32_t x = min(truncate(max(q.x, Real(0))), n - 2), y = min(truncate(max(q.y, Real(0))), n - 2),
                  z = min(truncate(max(q.z, Real(0))), n - 2);
    return {static_cast<uint32_t>((z * n + y) * n + x), q - Vec3(Real(x), Real(y), Real(z))};
}

// From a cell's lowest corner to another, bit a of whose number is its step along axis a; n nodes are along an edge.
inline uint32_t offset_of_corner(uint32_t corner, int32_t n) {
    const uint32_t along = static_cast<uint32_t>(n);
    return (corner & 1) + along * ((corner >> 1 & 1) + along * (corner >> 2));
}

// The least and the greatest value at the corners of a cell. `row`, `layer`: steps to the next node along y, along z.
inline void range_of_corners(const Real *lowest, int32_t row, int32_t layer, Real &least, Real &greatest) {
    least = greatest = *lowest;
    for (int32_t corner = 1; corner < 8; ++corner) {
        const Real value = lowest[(corner & 1) + (corner >> 1 & 1) * row + (corner >> 2) * layer];
        least = min(least, value);
        greatest = max(greatest, value);
    }
}

// Trilinear interpolation between a brick's nodes, whose values are value(node).
template <class Value> Real between_nodes(const CellPosition &at, int32_t spacing, Value &&value) {
    const uint32_t n = static_cast<uint32_t>(nodes_along(spacing));
    return trilinear(at.t, [&](int32_t dx, int32_t dy, int32_t dz) {
        return value(at.node + static_cast<uint32_t>(dx) +
                     n * (static_cast<uint32_t>(dy) + n * static_cast<uint32_t>(dz)));
    });
}

// Calls visit(brick, index of the node in that brick) for every brick that holds a node. The field has n nodes along an
// edge of a brick. `node` is relative to the brick at `position` of the lattice, which need not exist; it may also lie
// up to n - 1 nodes outside that brick.
template <class Visit>
void for_each_holder(const SparseGrid &bricks, const Cell &position, const Cell &node, int32_t n, Visit &&visit) {
    struct Axis {
        int32_t position, node, lowest, highest; // the holders are the bricks position + lowest to position + highest
        Axis(int32_t position_, int32_t node_, int32_t n, int32_t count) : position(position_), node(node_) {
            if (node < 0) --position, node += n - 1;
            if (node >= n) ++position, node -= n - 1;
            lowest = max(node == 0 ? -1 : 0, -position);
            highest = min(node == n - 1 ? 1 : 0, count - 1 - position);
        }
        int32_t in(int32_t step, int32_t n) const { return step == 0 ? node : step > 0 ? 0 : n - 1; }
    };
    const Cell &count = bricks.lattice.count;
    const Axis x(position.x, node.x, n, count.x), y(position.y, node.y, n, count.y), z(position.z, node.z, n, count.z);
    for (int32_t dz = z.lowest; dz <= z.highest; ++dz)
        for (int32_t dy = y.lowest; dy <= y.highest; ++dy)
            for (int32_t dx = x.lowest; dx <= x.highest; ++dx) {
                const uint32_t brick = brick_at(bricks, {x.position + dx, y.position + dy, z.position + dz});
                if (brick != no_brick)
                    visit(brick, static_cast<uint32_t>((z.in(dz, n) * n + y.in(dy, n)) * n + x.in(dx, n)));
            }
}

// Visits the bricks that the ray crosses between the distances `begin` and `end`, in order. visit(brick, from, to)
// returns whether to continue.
template <class Visit>
void for_each_brick(const SparseGrid &bricks, const Ray &ray, Real begin, Real end, Visit &&visit) {
    for_each_cell(bricks.lattice, ray, begin, end, [&](const Cell &cell, Real from, Real to) {
        const uint32_t brick = brick_at(bricks, cell);
        return brick == no_brick || visit(brick, from, to);
    });
}

} // namespace wisp::WISP_ARITH
