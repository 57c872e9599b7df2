// Regular lattices of cells: which cell holds a point, trilinear interpolation, and the cells that a ray crosses.
#pragma once
#include "core/geometry/ray.h"

namespace wisp::WISP_ARITH {

struct Cell {
    int32_t x, y, z;
};

// Boxes of equal size side by side. Cell (x, y, z) reaches from low + (x, y, z) edge to low + (x + 1, y + 1, z + 1)
// edge, for 0 <= x < count.x, 0 <= y < count.y, 0 <= z < count.z.
struct Lattice {
    Vec3 low, edge;
    Vec3 inverse_edge; // 1 / edge
    Cell count;
};

inline Lattice make_lattice(const Vec3 &low, const Vec3 &edge, const Cell &count) {
    return {low, edge, Vec3(Real(1) / edge.x, Real(1) / edge.y, Real(1) / edge.z), count};
}

constexpr uint64_t number_of(const Cell &count) {
    return static_cast<uint64_t>(count.x) * static_cast<uint64_t>(count.y) * static_cast<uint64_t>(count.z);
}
// A line crosses no more cells.
constexpr uint64_t places_of_line(const Cell &count) {
    return static_cast<uint64_t>(count.x) + static_cast<uint64_t>(count.y) + static_cast<uint64_t>(count.z);
}
constexpr int64_t index_of(const Cell &count, const Cell &cell) { // x fastest
    return (int64_t{cell.z} * count.y + cell.y) * count.x + cell.x;
}

// The cell index of coordinate x along one axis, clamped to [0, count).
inline int32_t cell_of(Real x, Real low, Real inverse_edge, int32_t count) {
    const int32_t i = floor_to_int((x - low) * inverse_edge);
    return i < 0 ? 0 : i < count ? i : count - 1;
}

// The cell that holds x, or the nearest cell if x is outside the lattice.
inline Cell cell_at(const Lattice &lattice, const Vec3 &x) {
    const Vec3 &low = lattice.low, &inverse = lattice.inverse_edge;
    const Cell &count = lattice.count;
    return {cell_of(x.x, low.x, inverse.x, count.x), cell_of(x.y, low.y, inverse.y, count.y),
            cell_of(x.z, low.z, inverse.z, count.z)};
}

// The position of x relative to a cell, in units of its edges: 0 to 1 along each axis inside the cell.
inline Vec3 position_in(const Lattice &lattice, const Cell &cell, const Vec3 &x) {
    return (x - lattice.low) * lattice.inverse_edge - Vec3(Real(cell.x), Real(cell.y), Real(cell.z));
}

// Trilinear interpolation at t, 0 to 1 along each axis, between the values corner(dx, dy, dz) of a cell's corners;
// dx, dy, dz are 0 or 1.
template <class Corner> Real trilinear(const Vec3 &t, Corner &&corner) {
    const auto row = [&](int32_t dy, int32_t dz) { return mix(corner(0, dy, dz), corner(1, dy, dz), t.x); };
    return mix(mix(row(0, 0), row(1, 0), t.y), mix(row(0, 1), row(1, 1), t.y), t.z);
}

// The weight of a corner in it: bit 0 of its number is dx, bit 1 dy, bit 2 dz.
inline Real corner_weight(const Vec3 &t, uint32_t corner) {
    return (corner & 1 ? t.x : Real(1) - t.x) * (corner & 2 ? t.y : Real(1) - t.y) * (corner & 4 ? t.z : Real(1) - t.z);
}

// One axis of a traversal: the current cell, and the distance at which the ray leaves it along this axis.
struct LatticeAxis {
    LatticeAxis(Real low_, Real edge_, Real inverse_edge, int32_t count, Real start, Real origin_, Real direction_)
        : low(low_), edge(edge_), origin(origin_), direction(direction_), last(direction_ < Real(0) ? 0 : count - 1),
          forward(direction_ < Real(0) ? -1 : 1), cell(cell_of(start, low_, inverse_edge, count)),
          exit(infinite_distance) {
        find_exit();
    }
    void step() {
        cell += forward;
        find_exit();
    }
    void find_exit() {
        if (direction == Real(0) || cell == last) {
            exit = infinite_distance;
            return;
        }
        exit = bounded_quotient(low + Real(forward < 0 ? cell : cell + 1) * edge - origin, direction);
    }

    Real low, edge, origin, direction;
    int32_t last, forward, cell;
    Real exit;
};

// Visits the cells that the ray crosses between the distances `begin` and `end`, in order (Amanatides, Woo 1987); both
// distances must lie inside the lattice. visit(cell, from, to) returns whether to continue. The intervals [from, to]
// cover [begin, end] once. Every step moves one cell along the ray, so the traversal ends whatever rounding does.
template <class Visit> void for_each_cell(const Lattice &lattice, const Ray &ray, Real begin, Real end, Visit &&visit) {
    const Vec3 start = ray.origin + ray.direction * begin;
    const Vec3 &low = lattice.low, &edge = lattice.edge, &inverse = lattice.inverse_edge, &o = ray.origin,
               &d = ray.direction;
    LatticeAxis x(low.x, edge.x, inverse.x, lattice.count.x, start.x, o.x, d.x);
    LatticeAxis y(low.y, edge.y, inverse.y, lattice.count.y, start.y, o.y, d.y);
    LatticeAxis z(low.z, edge.z, inverse.z, lattice.count.z, start.z, o.z, d.z);
    for (Real from = begin; from < end;) {
        const Real nearest = min(x.exit, min(y.exit, z.exit)), to = max(from, min(nearest, end));
        if (from < to && !visit(Cell{x.cell, y.cell, z.cell}, from, to)) return;
        from = to;
        if (!(nearest < end)) return;
        (x.exit == nearest ? x : y.exit == nearest ? y : z).step();
    }
}

} // namespace wisp::WISP_ARITH
