// A tree of boxes over triangles (bounding volume hierarchy), eight children to a node: TreeKind::bvh.
//
// Each triangle is in one leaf, and the boxes of all nodes above the leaf hold the triangle. A box is the slabs between
// two planes across each axis. A point p of a triangle lies in all of them, so at every node the ray crosses the box
// that holds p in an interval that holds the distance of a hit at p.
#pragma once
#include "core/surfaces/triangle_search.h"
#include <utility>

namespace wisp {

// Which part of the tree is below a box: node `child`, or, with the highest bit, the first 1 to 8 triangles of a group.
//
//    31    30                3 2           0
//   |leaf | group             | number - 1  |
constexpr uint32_t leaf_bit = 1u << 31;
constexpr bool is_leaf(uint32_t child) { return (child & leaf_bit) != 0; }
constexpr uint32_t group_of(uint32_t child) { return (child & ~leaf_bit) >> 3; }
constexpr uint32_t triangles_in(uint32_t child) { return (child & 7) + 1; }
// The search keeps the other children of each node above the one that it is at: 63 at most in the scenes that were
// measured, of up to 1.3 million triangles.
constexpr uint32_t bvh_stack = 96;

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

// Boxes are tested in float, in Fixed only where the hardware has floating point. The margin of a float's ray covers 14
// units for the hit (triangle_search.h). Doubles and Fixed need less: a unit each to round the direction and the origin
// to float and to divide by the largest component, and in Fixed what float_reach() adds.
constexpr bool boxes_in_float = !std::is_same_v<Real, Fixed> || hardware_double;
using BoxNumber = std::conditional_t<boxes_in_float, float, Fixed>;
using BoxParameter = decltype(position_of(BoxNumber()));

inline float float_of(float x) { return x; }
inline float float_of(double x) { return static_cast<float>(x); }
inline float float_of(int64_t x) { return static_cast<float>(x) * 0x1p-32f; }
inline float float_of(Fixed x) { return float_of(x.raw()); }

// In Fixed a hit is found within 8 + |dominant| units of 2^-32, and 2^-32 of the reach: see slope_of(). 24 units of
// 2^-24 of what is added here are as much.
inline float float_reach(float reach, float) { return reach; }
inline float float_reach(double reach, double) { return float_of(reach); }
inline float float_reach(Fixed reach, Fixed dominant) {
    return float_of(reach) + (1 + abs(float_of(dominant))) * 0x1p-8f;
}

inline float float_component(float component, float) { return component; }
inline float float_component(double component, double) { return float_of(component); }
inline float float_component(Fixed component, Fixed dominant) { return float_of(component) / abs(float_of(dominant)); }

// A ray's growth along an axis from plane to plane of boxes, which in Fixed are counted in steps.
inline float per_plane(float inverse, int, float) { return inverse; }
inline float per_plane(float inverse, int step_exponent, int32_t) { return scale_pow2(inverse, step_exponent); }

// The ray as it is tested against boxes.
inline PlaneRay<float> box_ray(const TriangleTree &tree, const TriangleRay &ray, float) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    const auto component = [&](int axis) { return float_component(ray.direction[axis], dominant); };
    const float origin[3] = {float_of(ray.origin.x), float_of(ray.origin.y), float_of(ray.origin.z)};
    const float direction[3] = {component(0), component(1), component(2)};
    PlaneRay<float> boxes(origin, direction, direction[ray.z], float_reach(reach_of(tree, ray), dominant));
    for (float &inverse : boxes.inverse) inverse = per_plane(inverse, tree.step_exponent, BoxPlane());
    return boxes;
}
inline PlaneRay<Real> box_ray(const TriangleTree &tree, const TriangleRay &ray, Fixed) { return plane_ray(tree, ray); }

inline float at_box_plane(BoxPlane plane, int, float inverse) { return static_cast<float>(plane) * inverse; }
inline int64_t at_box_plane(int32_t plane, int shift, int64_t inverse) {
    return times(position_of_steps(plane, shift), inverse);
}

// An end of a search: none that is below or above it is lost to rounding (sign -1 or 1).
inline float box_end(float end, float, float) { return end; }
template <class T> float box_end(T end, float sign, float) {
    const float nearest = float_of(end);
    return nearest + sign * 0x1p-22f * abs(nearest);
}
inline int64_t box_end(int64_t end, float, int64_t) { return end; }

// A box's plane in the tree's steps.
inline int32_t steps_of(float plane, int step_exponent) { return floor_to_int(scale_pow2(plane, -step_exponent)); }
inline int32_t steps_of(int32_t plane, int) { return plane; }

// The children whose boxes the ray crosses between two parameters, as a mask, and where it enters each.
WISP_INLINE uint32_t crossed_children(const BoxNode &node, const PlaneRay<BoxNumber> &ray, int shift,
                                      BoxParameter begin, BoxParameter end, BoxParameter (&from)[lanes]) {
    const BoxPlane *const near_x = node.plane[ray.backward[0]][0], *const far_x = node.plane[1 - ray.backward[0]][0],
                          *const near_y = node.plane[ray.backward[1]][1],
                          *const far_y = node.plane[1 - ray.backward[1]][1],
                          *const near_z = node.plane[ray.backward[2]][2],
                          *const far_z = node.plane[1 - ray.backward[2]][2];
    const auto at = [&](BoxPlane plane, uint32_t axis) { return at_box_plane(plane, shift, ray.inverse[axis]); };
    BoxParameter to[lanes];
    WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) {
        const BoxParameter x = at(near_x[l], 0) - ray.to_low[0], y = at(near_y[l], 1) - ray.to_low[1],
                           z = at(near_z[l], 2) - ray.to_low[2];
        from[l] = max(max(x, y), max(z, begin));
        const BoxParameter u = at(far_x[l], 0) - ray.to_high[0], v = at(far_y[l], 1) - ray.to_high[1],
                           w = at(far_z[l], 2) - ray.to_high[2];
        to[l] = min(min(u, v), min(w, end));
    }
    return lanes_not_less(to, from);
}

// Calls visit(triangle, hit) for triangles that the ray's line hits, in leaves that the ray crosses between parameters
// `begin` and `end`. visit may lower `end`, and returns whether the search is over. nearest_first: of a node's children
// the nearest is searched first; where any hit will do, putting them in order takes longer than it saves.
template <class Visit>
WISP_INLINE void search_bvh(bool nearest_first, const TriangleTree &tree, const TriangleRay &ray, Parameter begin,
                            Parameter &end, uint32_t ignore_triangle, TreeCounts &counts, Visit &&visit) {
    const PlaneRay<BoxNumber> boxes = box_ray(tree, ray, BoxNumber());
    const int shift = plane_shift(tree);
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
            uint32_t mask = crossed_children(node, boxes, shift, first_from, last_to, from);
            missed = mask == 0;
            if (missed) break;
            const auto entry = [&](uint32_t lane) { return Entry{node.child[lane], from[lane]}; };
            const uint32_t base = stack_size;
            now = entry(static_cast<uint32_t>(__builtin_ctz(mask)));
            for (mask &= mask - 1; mask != 0;) {
                const uint32_t lane = 31 - static_cast<uint32_t>(__builtin_clz(mask));
                mask ^= 1u << lane;
                Entry next = entry(lane);
                uint32_t at = stack_size++;
                if (nearest_first) {
                    if (next.from < now.from) std::swap(next, now);
                    for (; at > base && stack[at - 1].from < next.from; --at) stack[at] = stack[at - 1];
                }
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
