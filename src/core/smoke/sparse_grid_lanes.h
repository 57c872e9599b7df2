// Bricks for eight points of a ray at a time: loops over lanes without branches, so that each is a vector loop.
#pragma once
#include "core/smoke/sparse_grid.h"

namespace wisp::WISP_ARITH {

using Lanes = Real[lanes];

// Where points of a ray lie in the bricks.
struct LanePoints {
    int32_t brick[lanes]; // 0 where `inside` is not
    bool inside[lanes];   // there is a brick
    Lanes x, y, z;        // in the brick, in cells
};

// The ray of `find_points`, in cells from the beginning of the lattice.
struct GridRay {
    Vec3 start, way;

    GridRay(const SparseGrid &bricks, const Ray &ray)
        : start((ray.origin - bricks.lattice.low) * bricks.inverse_cell), way(ray.direction * bricks.inverse_cell) {}
};

WISP_INLINE void find_points(const SparseGrid &bricks, const GridRay &ray, const Lanes &t, LanePoints &points) {
    const Cell count = bricks.lattice.count;
    const Vec3 most = Vec3(Real(count.x), Real(count.y), Real(count.z)) * Real(brick_cells); // the end of the lattice
    const uint32_t *index = bricks.index;
    for (uint32_t l = 0; l < lanes; ++l) {
        const Real x = min(max(ray.start.x + ray.way.x * t[l], Real(0)), most.x),
                   y = min(max(ray.start.y + ray.way.y * t[l], Real(0)), most.y),
                   z = min(max(ray.start.z + ray.way.z * t[l], Real(0)), most.z);
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

// Where they lie in a field over the bricks: the lowest corner of each one's cell, and the place in it.
struct LanePlaces {
    int32_t node[lanes];
    int32_t row[lanes], layer[lanes]; // from a node to the next along y, and along z
    Lanes x, y, z;
};

// Of a field whose bricks begin at the nodes `first` and have a node every `stride` cells.
WISP_INLINE void find_places(const LanePoints &points, const int32_t (&first)[lanes], const int32_t (&stride)[lanes],
                              LanePlaces &at) {
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t cells = brick_cells / stride[l], n = cells + 1;
        const Real inverse = Real(cells) * Real(1.0 / brick_cells);
        const Real qx = points.x[l] * inverse, qy = points.y[l] * inverse, qz = points.z[l] * inverse;
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

// Of a field that has `fields` times the nodes of one stride in each brick.
WISP_INLINE void find_places(const LanePoints &points, int32_t stride, int32_t fields, LanePlaces &at) {
    int32_t first[lanes], strides[lanes];
    const int32_t nodes = static_cast<int32_t>(nodes_of(stride)) * fields;
    for (uint32_t l = 0; l < lanes; ++l) {
        first[l] = points.brick[l] * nodes;
        strides[l] = stride;
    }
    find_places(points, first, strides, at);
}

// Trilinear between the values of nodes.
template <class Value> WISP_INLINE void interpolate(const LanePlaces &at, Value &&value, Lanes &result) {
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t i = at.node[l], j = i + at.row[l], k = i + at.layer[l], m = j + at.layer[l];
        const Real x = at.x[l], y = at.y[l];
        const Real low = mix(mix(value(i), value(i + 1), x), mix(value(j), value(j + 1), x), y);
        const Real high = mix(mix(value(k), value(k + 1), x), mix(value(m), value(m + 1), x), y);
        result[l] = mix(low, high, at.z[l]);
    }
}
WISP_INLINE void interpolate(const LanePlaces &at, const Real *values, Lanes &result) {
    interpolate(
        at, [values](int32_t node) { return values[node]; }, result);
}

} // namespace wisp::WISP_ARITH
