// Look-ups in a sparse grid for eight points of a ray at a time. The loops over lanes have no branches, so that each
// becomes a vector loop.
#pragma once
#include "core/smoke/sparse_grid.h"

namespace wisp::WISP_ARITH {

using Lanes = Real[lanes];

// Whether lanes are computed side by side. Else each costs, so those that count for nothing are left out.
constexpr bool in_vectors = !std::is_same_v<Real, Fixed>;

struct LaneColor {
    Real red[lanes], green[lanes], blue[lanes];
};
WISP_INLINE void set(LaneColor &color, const Color &value) {
    for (uint32_t l = 0; l < lanes; ++l) color.red[l] = value.x, color.green[l] = value.y, color.blue[l] = value.z;
}
WISP_INLINE void add(LaneColor &color, const Lanes &amount, const Color &value) {
    for (uint32_t l = 0; l < lanes; ++l) {
        color.red[l] += amount[l] * value.x;
        color.green[l] += amount[l] * value.y;
        color.blue[l] += amount[l] * value.z;
    }
}

// The bricks of eight points.
struct LanePoints {
    int32_t brick[lanes]; // 0 for points in no brick
    bool inside[lanes];   // whether there is a brick
    Lanes x, y, z;        // the position in the brick, in cells
};

// A ray in cells from the low corner of the lattice.
struct GridRay {
    Vec3 start, direction;

    GridRay(const SparseGrid &bricks, const Ray &ray)
        : start((ray.origin - bricks.lattice.low) * bricks.inverse_cell),
          direction(ray.direction * bricks.inverse_cell) {}
};

// Finds the bricks of the points at the distances t. Points outside the lattice are moved to its nearest face.
WISP_INLINE void find_points(const SparseGrid &bricks, const GridRay &ray, const Lanes &t, LanePoints &points) {
    const Cell count = bricks.lattice.count;
    const Vec3 high = Vec3(Real(count.x), Real(count.y), Real(count.z)) * Real(brick_cells); // corner of the lattice
    const uint32_t *index = bricks.index;
    for (uint32_t l = 0; l < lanes; ++l) {
        const Real x = min(max(ray.start.x + ray.direction.x * t[l], Real(0)), high.x),
                   y = min(max(ray.start.y + ray.direction.y * t[l], Real(0)), high.y),
                   z = min(max(ray.start.z + ray.direction.z * t[l], Real(0)), high.z);
        const int32_t bx = min(truncate(x) >> log_brick_cells, count.x - 1),
                      by = min(truncate(y) >> log_brick_cells, count.y - 1),
                      bz = min(truncate(z) >> log_brick_cells, count.z - 1);
        points.x[l] = x - Real(bx * brick_cells);
        points.y[l] = y - Real(by * brick_cells);
        points.z[l] = z - Real(bz * brick_cells);
        points.brick[l] = (bz * count.y + by) * count.x + bx;
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t brick = static_cast<int32_t>(index[points.brick[l]]);
        points.inside[l] = brick >= 0; // no_brick is -1
        points.brick[l] = max(brick, 0);
    }
}

// The cells of eight points in a field over the grid.
struct LaneCells {
    int32_t node[lanes];              // the lowest corner
    int32_t row[lanes], layer[lanes]; // steps from a node to the next one along y, and along z
    Lanes x, y, z;                    // the position in the cell, 0 to 1 along each edge
};

// The cells in a field whose spacing may differ between bricks. In the brick of lane l the nodes begin at first[l] and
// are spacing[l] cells apart.
WISP_INLINE void find_cells(const LanePoints &points, const int32_t (&first)[lanes], const int32_t (&spacing)[lanes],
                            LaneCells &at) {
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t cells = brick_cells / spacing[l], n = cells + 1;
        const Real inverse = Real(cells) * Real(1.0 / brick_cells);
        const auto scaled = [&](Real x) { return !in_vectors && spacing[l] == 1 ? x : x * inverse; };
        const Real qx = scaled(points.x[l]), qy = scaled(points.y[l]), qz = scaled(points.z[l]);
        const int32_t x = min(truncate(qx), cells - 1), y = min(truncate(qy), cells - 1),
                      z = min(truncate(qz), cells - 1);
        at.node[l] = first[l] + (z * n + y) * n + x;
        at.row[l] = n;
        at.layer[l] = n * n;
        at.x[l] = qx - Real(x);
        at.y[l] = qy - Real(y);
        at.z[l] = qz - Real(z);
    }
}

// The cells in a field with one spacing, which stores `fields` arrays of nodes after each other in each brick. The
// cells are those of the first array.
WISP_INLINE void find_cells(const LanePoints &points, int32_t spacing, int32_t fields, LaneCells &at) {
    int32_t first[lanes], spacings[lanes];
    const int32_t nodes = static_cast<int32_t>(nodes_of(spacing)) * fields;
    for (uint32_t l = 0; l < lanes; ++l) {
        first[l] = points.brick[l] * nodes;
        spacings[l] = spacing;
    }
    find_cells(points, first, spacings, at);
}

// Trilinear interpolation between nodes, whose values are value(node).
template <class Value> WISP_INLINE void interpolate(const LaneCells &at, Value &&value, Lanes &result) {
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t i = at.node[l], j = i + at.row[l], k = i + at.layer[l], m = j + at.layer[l];
        const Real x = at.x[l], y = at.y[l];
        const Real low = mix(mix(value(i), value(i + 1), x), mix(value(j), value(j + 1), x), y);
        const Real high = mix(mix(value(k), value(k + 1), x), mix(value(m), value(m + 1), x), y);
        result[l] = mix(low, high, at.z[l]);
    }
}
WISP_INLINE void interpolate(const LaneCells &at, const Real *values, Lanes &result) {
    interpolate(
        at, [values](int32_t node) { return values[node]; }, result);
}

// A corner of the cell of lane l.
inline int32_t node_of_corner(const LaneCells &at, uint32_t l, uint32_t corner) {
    const int32_t c = static_cast<int32_t>(corner);
    return at.node[l] + (c & 1) + (c >> 1 & 1) * at.row[l] + (c >> 2) * at.layer[l];
}

// How the interpolated value changes along `direction`, in cells of the field, per unit of length.
WISP_INLINE void change_along(const LaneCells &at, const Real *values, const Vec3 &direction, Lanes &result) {
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t i = at.node[l], j = i + at.row[l], k = i + at.layer[l], m = j + at.layer[l];
        const Real x = at.x[l], y = at.y[l], z = at.z[l];
        const Real ix = values[i + 1] - values[i], jx = values[j + 1] - values[j], kx = values[k + 1] - values[k],
                   mx = values[m + 1] - values[m];
        const Real ii = values[i] + x * ix, jj = values[j] + x * jx, kk = values[k] + x * kx, mm = values[m] + x * mx;
        const Real low = jj - ii, high = mm - kk;
        result[l] = direction.x * mix(mix(ix, jx, y), mix(kx, mx, y), z) + direction.y * mix(low, high, z) +
                    direction.z * mix(kk - ii, mm - jj, y);
    }
}

} // namespace wisp::WISP_ARITH
