// Rays, and the regular lattices of cells that they pass.
#pragma once
#include "core/numbers/vec.h"

namespace wisp::WISP_ARITH {

constexpr Real infinite_distance = Real(0x1p19); // farther than any scene is wide

struct Ray {
    Vec3 origin, direction; // a unit vector
};

// Where a photon collides, and with which part of the density: a particle's slot, or a sample of a grid.
struct Collision {
    bool found;
    Real distance;
    uint32_t element;
};

// a / b with its magnitude kept below 2^20, far outside any scene: the slabs of a ray along a wall need no more.
inline Real bounded_quotient(Real a, Real b) {
    constexpr Real far = Real(0x1p20);
    if (abs(a) < abs(b) * far) return a / b;
    return (a < Real(0)) == (b < Real(0)) ? far : -far;
}

inline void clip_axis(Real low, Real high, Real origin, Real direction, Real &begin, Real &end) {
    if (direction == Real(0)) {
        if (origin < low || origin > high) end = Real(-1);
        return;
    }
    const Real t0 = bounded_quotient(low - origin, direction), t1 = bounded_quotient(high - origin, direction);
    begin = max(begin, min(t0, t1));
    end = min(end, max(t0, t1));
}

// The part of the ray inside the box, clipped to distances >= 0; false when there is none. Rays along the walls and
// from inside count as inside (hard case E7).
inline bool clip(const Box &box, const Ray &ray, Real &begin, Real &end) {
    begin = max(begin, Real(0));
    clip_axis(box.low.x, box.high.x, ray.origin.x, ray.direction.x, begin, end);
    clip_axis(box.low.y, box.high.y, ray.origin.y, ray.direction.y, begin, end);
    clip_axis(box.low.z, box.high.z, ray.origin.z, ray.direction.z, begin, end);
    return begin < end;
}

struct Cell {
    int32_t x, y, z;
};

// Cells of equal size side by side: cell (x, y, z) reaches from low + (x, y, z) edge to low + (x + 1, y + 1, z + 1)
// edge, for 0 <= x < count.x and so on.
struct Lattice {
    Vec3 low, edge;
    Vec3 inverse_edge;
    Cell count;
};

inline Lattice make_lattice(const Vec3 &low, const Vec3 &edge, const Cell &count) {
    return {low, edge, Vec3(Real(1) / edge.x, Real(1) / edge.y, Real(1) / edge.z), count};
}

constexpr uint64_t number_of(const Cell &count) {
    return static_cast<uint64_t>(count.x) * static_cast<uint64_t>(count.y) * static_cast<uint64_t>(count.z);
}
constexpr int64_t index_of(const Cell &count, const Cell &cell) { // x fastest
    return (int64_t{cell.z} * count.y + cell.y) * count.x + cell.x;
}

inline int32_t cell_of(Real x, Real low, Real inverse_edge, int32_t count) {
    const int32_t i = floor_to_int((x - low) * inverse_edge);
    return i < 0 ? 0 : i < count ? i : count - 1;
}

// The cell that holds x, or the nearest one; and where x lies in a cell, 0 to 1 along each edge.
inline Cell cell_at(const Lattice &lattice, const Vec3 &x) {
    const Vec3 &low = lattice.low, &inverse = lattice.inverse_edge;
    const Cell &count = lattice.count;
    return {cell_of(x.x, low.x, inverse.x, count.x), cell_of(x.y, low.y, inverse.y, count.y),
            cell_of(x.z, low.z, inverse.z, count.z)};
}
inline Vec3 place_in(const Lattice &lattice, const Cell &cell, const Vec3 &x) {
    return (x - lattice.low) * lattice.inverse_edge - Vec3(Real(cell.x), Real(cell.y), Real(cell.z));
}

// Between the eight values corner(dx, dy, dz) at the ends of a cell's edges, 0 or 1 each.
template <class Corner> Real trilinear(const Vec3 &t, Corner &&corner) {
    const auto row = [&](int32_t dy, int32_t dz) { return mix(corner(0, dy, dz), corner(1, dy, dz), t.x); };
    return mix(mix(row(0, 0), row(1, 0), t.y), mix(row(0, 1), row(1, 1), t.y), t.z);
}

// One axis of a walk through a lattice: the cell, and where the ray leaves it.
struct LatticeAxis {
    LatticeAxis(Real low_, Real edge_, Real inverse_edge, int32_t count, Real start, Real origin_, Real direction_)
        : low(low_), edge(edge_), origin(origin_), direction(direction_), last(direction_ < Real(0) ? 0 : count - 1),
          forward(direction_ < Real(0) ? -1 : 1), cell(cell_of(start, low_, inverse_edge, count)), exit(infinite_distance) {
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

// Visits the cells that the ray passes between the distances `begin` and `end`, both inside the lattice, in order:
// visit(cell, from, to) returns whether to go on. Every step moves one cell along the ray, so it ends whatever rounding
// does; the lengths from `begin` to `end` are covered once.
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
