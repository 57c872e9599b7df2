// What the builders of both trees share: triangles on the trees' lattice, and the groups of leaves.
#pragma once
#include "core/numbers/double_bits.h"
#include "core/surfaces/triangle_tree.h"

namespace wisp::WISP_ARITH {

constexpr int lattice_bits = 23; // coordinates are below 2^23 steps

struct LatticeBox {
    int32_t low[3], high[3];
};

// A triangle in a node. The box holds the part of the triangle that lies in the node.
struct TriangleItem {
    uint32_t triangle;
    LatticeBox box;
};

constexpr uint32_t groups_for(uint32_t triangles) { return (triangles + group_triangles - 1) / group_triangles; }

inline Vec3 corner_of(const Triangle &triangle, uint32_t i) { return vec_of(triangle.corner[i]); }

inline LatticeBox around(const Box &box, int step_exponent) {
    LatticeBox result;
    for (int axis = 0; axis < 3; ++axis) {
        result.low[axis] = floor_to_int(scale_pow2(box.low[axis], -step_exponent));
        result.high[axis] = -floor_to_int(-scale_pow2(box.high[axis], -step_exponent));
    }
    return result;
}

// Sets the items of all triangles that have an area, and the tree's triangle_count, bounds, largest and step_exponent.
inline void find_items(const Triangle *triangles, uint32_t count, TriangleItem *items, TriangleTree &tree,
                       Watch watch) {
    tree.largest = Real(0);
    for (uint32_t i = 0; i < count && (i % 1024 != 0 || watch.go_on(1024)); ++i) {
        const Vec3 a = corner_of(triangles[i], 0), b = corner_of(triangles[i], 1), c = corner_of(triangles[i], 2);
        if (!has_area(a, b, c)) continue;
        const Vec3 low = min(a, min(b, c)), high = max(a, max(b, c));
        Box &bounds = tree.bounds;
        bounds = tree.triangle_count == 0 ? Box{low, high} : Box{min(bounds.low, low), max(bounds.high, high)};
        items[tree.triangle_count++].triangle = i;
        for (int axis = 0; axis < 3; ++axis) tree.largest = max(tree.largest, max(abs(low[axis]), abs(high[axis])));
    }
    constexpr int finest = std::is_same_v<Real, Fixed> ? -32 : -100;
    tree.step_exponent = finest;
    while (!(scale_pow2(tree.largest, -lattice_bits - tree.step_exponent) < Real(1))) ++tree.step_exponent;
    for (uint32_t i = 0; i < tree.triangle_count; ++i) {
        const Triangle &triangle = triangles[items[i].triangle];
        const Vec3 a = corner_of(triangle, 0), b = corner_of(triangle, 1), c = corner_of(triangle, 2);
        items[i].box = around({min(a, min(b, c)), max(a, max(b, c))}, tree.step_exponent);
    }
}

// Fills a group with these items, group_triangles at most.
inline void fill_group(const Triangle *triangles, const Material *materials, const TriangleItem *items, uint32_t count,
                       TriangleGroup &group) {
    for (uint32_t lane = 0; lane < group_triangles; ++lane) {
        const bool empty = lane >= count;
        const Triangle *triangle = empty ? nullptr : triangles + items[lane].triangle;
        group.triangle[lane] = empty ? no_triangle : items[lane].triangle;
        if (!empty && total_order_key(materials[triangle->material].transmission) > 0)
            group.triangle[lane] |= transmissive_bit;
        for (uint32_t c = 0; c < 3; ++c) {
            const Vec3 p = empty ? Vec3(Real(0)) : corner_of(*triangle, c);
            for (int axis = 0; axis < 3; ++axis) group.corner[c][axis][lane] = p[axis];
        }
    }
}

} // namespace wisp::WISP_ARITH
