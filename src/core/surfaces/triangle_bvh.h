// A tree of boxes over triangles (bounding volume hierarchy), eight children to a node: TreeKind::bvh.
//
// Each triangle is in one leaf, and the boxes of all nodes above the leaf hold the triangle. A box is the slabs between
// two planes across each axis. A point p of a triangle lies in all of them, so at every node the ray crosses the box
// that holds p in an interval that holds the distance of a hit at p.
#pragma once
#include "core/surfaces/triangle_search.h"

namespace wisp {

// Which part of the tree is below a box: node `child`, or, with the highest bit, the first 1 to 8 triangles of a group.
//
//    31    30                3 2           0
//   |leaf | group             | number - 1  |
constexpr uint32_t leaf_bit = 1u << 31;
constexpr bool is_leaf(uint32_t child) { return (child & leaf_bit) != 0; }
constexpr uint32_t group_of(uint32_t child) { return (child & ~leaf_bit) >> 3; }
constexpr uint32_t triangles_in(uint32_t child) { return (child & 7) + 1; }
// Ranges of triangles are divided by cost down to that depth, from then on by halves, an eighth at each node. The
// search keeps seven children of each node above the one that it is at.
constexpr uint32_t max_depth_by_cost = 16, max_bvh_depth = max_depth_by_cost + 9;
constexpr uint32_t bvh_stack = 7 * max_bvh_depth + 1;

namespace f32 {
using BoxPlane = float;
}
namespace f64 {
using BoxPlane = float;
}
namespace fixed {
using BoxPlane = int32_t; // in the tree's steps
}

namespace WISP_ARITH {

// Boxes of eight children; one that is not there is crossed by no ray.
struct BoxNode {
    BoxPlane plane[2][3][lanes]; // [0]: low, [1]: high; [axis]
    uint32_t child[lanes];
};

TriangleTree make_bvh(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch);
uint64_t bvh_bytes(uint32_t count);

// The positions along a ray at which it crosses boxes. For Fixed they are rounded to doubles where the hardware has
// them: products of 64 bits take several times as long.
using BoxParameter = std::conditional_t<std::is_same_v<Real, Fixed> && hardware_double, double, Parameter>;

// A ray's slope along an axis, as PlaneRay has it.
template <class T> struct BoxSlope { T inverse, to_low, to_high; };
template <class T> BoxSlope<T> box_slope(T inverse, T to_low, T to_high, Real, int, T) {
    return {inverse, to_low, to_high};
}
// Each number is rounded to 2^-53 of itself, as are the product with a plane and the difference. All are at most twice
// the reach times the slope, and the margin. PlaneRay's products are rounded to one.
inline BoxSlope<double> box_slope(int64_t inverse, int64_t to_low, int64_t to_high, Fixed reach, int shift, double) {
    const double slope = static_cast<double>(inverse) * 0x1p-32, low = static_cast<double>(to_low),
                 high = static_cast<double>(to_high);
    const double more = 0x1p-49 * (2 * static_cast<double>(reach.raw()) * abs(slope) + (low - high)) + 2;
    return {scale_pow2(slope, shift), low + more, high - more};
}
// An end of a search: none that is below or above it is lost to rounding (sign -1 or 1).
template <class T> T box_end(T end, double, T) { return end; }
inline double box_end(int64_t end, double sign, double) {
    const double nearest = static_cast<double>(end);
    return nearest + sign * 0x1p-52 * abs(nearest);
}

// The ray as it is tested against boxes.
struct BoxRay {
    BoxParameter inverse[3], to_low[3], to_high[3];
    uint32_t backward[3];
    int shift;

    BoxRay(const TriangleTree &tree, const TriangleRay &ray) {
        const PlaneRay planes(tree, ray);
        const Real reach = reach_of(tree, ray);
        shift = planes.shift;
        for (uint32_t a = 0; a < 3; ++a) {
            const BoxSlope<BoxParameter> slope =
                box_slope(planes.inverse[a], planes.to_low[a], planes.to_high[a], reach, shift, BoxParameter());
            inverse[a] = slope.inverse, to_low[a] = slope.to_low, to_high[a] = slope.to_high;
            backward[a] = planes.backward[a];
        }
    }
};

inline float at_box_plane(float plane, int, float inverse) { return plane * inverse; }
inline double at_box_plane(float plane, int, double inverse) { return static_cast<double>(plane) * inverse; }
inline double at_box_plane(int32_t plane, int, double inverse) { return static_cast<double>(plane) * inverse; }
inline int64_t at_box_plane(int32_t plane, int shift, int64_t inverse) {
    return times(static_cast<int64_t>(static_cast<uint64_t>(int64_t{plane}) << shift), inverse);
}

// A box's plane in the tree's steps.
inline int32_t steps_of(float plane, int step_exponent) { return floor_to_int(scale_pow2(plane, -step_exponent)); }
inline int32_t steps_of(int32_t plane, int) { return plane; }

// The children whose boxes the ray crosses between two parameters, as a mask, and where it enters each.
WISP_INLINE uint32_t crossed_children(const BoxNode &node, const BoxRay &ray, BoxParameter begin, BoxParameter end,
                                      BoxParameter (&from)[lanes]) {
    const BoxPlane *const near_x = node.plane[ray.backward[0]][0], *const far_x = node.plane[1 - ray.backward[0]][0],
                          *const near_y = node.plane[ray.backward[1]][1],
                          *const far_y = node.plane[1 - ray.backward[1]][1],
                          *const near_z = node.plane[ray.backward[2]][2],
                          *const far_z = node.plane[1 - ray.backward[2]][2];
    const auto at = [&ray](BoxPlane plane, uint32_t axis) { return at_box_plane(plane, ray.shift, ray.inverse[axis]); };
    BoxParameter to[lanes];
    WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) {
        const BoxParameter x = at(near_x[l], 0) - ray.to_low[0], y = at(near_y[l], 1) - ray.to_low[1],
                           z = at(near_z[l], 2) - ray.to_low[2];
        from[l] = max(max(x, y), max(z, begin));
        const BoxParameter u = at(far_x[l], 0) - ray.to_high[0], v = at(far_y[l], 1) - ray.to_high[1],
                           w = at(far_z[l], 2) - ray.to_high[2];
        to[l] = min(min(u, v), min(w, end));
    }
    uint32_t mask = 0;
    WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) mask |= from[l] <= to[l] ? 1u << l : 0u;
    return mask;
}

// Calls visit(triangle, hit) for triangles that the ray's line hits, in leaves that the ray crosses between parameters
// `begin` and `end`, the nearer of two children first. visit may lower `end`, and returns whether the search is over.
template <class Visit>
WISP_INLINE void search_bvh(const TriangleTree &tree, const TriangleRay &ray, Parameter begin, Parameter &end,
                            uint32_t ignore_triangle, TreeCounts &counts, Visit &&visit) {
    const BoxRay boxes(tree, ray);
    const Filter filter(tree, ray);
    const BoxParameter first_from = box_end(begin, -1, BoxParameter());
    struct Entry {
        uint32_t child;
        BoxParameter from;
    };
    Entry stack[bvh_stack];
    uint32_t stack_size = 0, last = no_triangle;
    uint64_t visits = 0, tests = 0;
    stack[stack_size++] = {tree.root, first_from};
    while (stack_size > 0) {
        Entry now = stack[--stack_size];
        const BoxParameter last_to = box_end(end, 1, BoxParameter());
        if (now.from > last_to) continue;
        bool missed = false;
        while (!is_leaf(now.child)) {
            ++visits;
            const BoxNode &node = tree.boxes[now.child];
            BoxParameter from[lanes];
            uint32_t mask = crossed_children(node, boxes, first_from, last_to, from);
            missed = mask == 0;
            if (missed) break;
            const uint32_t first = static_cast<uint32_t>(__builtin_ctz(mask)), base = stack_size;
            now = {node.child[first], from[first]};
            for (mask &= mask - 1; mask != 0; mask &= mask - 1) {
                const uint32_t lane = static_cast<uint32_t>(__builtin_ctz(mask));
                Entry next = {node.child[lane], from[lane]};
                if (next.from < now.from) std::swap(next, now);
                uint32_t at = stack_size++;
                for (; at > base && stack[at - 1].from < next.from; --at) stack[at] = stack[at - 1];
                stack[at] = next;
            }
        }
        if (missed) continue;
        const uint32_t count = triangles_in(now.child);
        ++visits;
        tests += count;
        if (search_group(tree.groups[group_of(now.child)], count, ray, filter, ignore_triangle, last, visit)) break;
    }
    counts.node_visits += visits;
    counts.triangle_tests += tests;
}

} // namespace WISP_ARITH
} // namespace wisp
