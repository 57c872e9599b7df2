// A kd-tree over triangles, built by the surface area heuristic (SAH): TreeKind::kd.
//
// The tree divides space. An inner node is a plane across an axis, and its two children are the cells on either side. A
// leaf lists the triangles that intersect its cell. The part of a triangle that lies in a cell decides which children
// list it, so a triangle may be in many leaves.
//
// A point p of a triangle lies in a leaf that lists the triangle, and in the cells of all nodes above that leaf. A ray
// continues into the low child of plane c as far as its coordinate may be <= c + margin, and into the high child from
// where it may be >= c - margin on, both ends included. So at every node the ray continues into the child that holds p,
// with an interval that holds the distance of a hit at p.
#pragma once
#include "core/surfaces/triangle_search.h"

namespace wisp {

constexpr uint32_t max_tree_depth = 56;
constexpr uint32_t leaf_axis = 3;

// An inner node has axis 0, 1 or 2 and a plane `value`: the bits of a float, in Fixed an integer in units of the tree's
// step. Its children are node `first`, an even number, below the plane, and node first + 1 above it. A leaf has axis 3
// and `value` triangles in groups from `first`.
//
//   31                              0   31                          2 1    0
//  | value                           | | first                       | axis |
struct TriangleNode {
    uint32_t value, link;

    uint32_t axis() const { return link & 3; }
    uint32_t first() const { return link >> 2; }
};
static_assert(sizeof(TriangleNode) == 8, "two children in a quarter of a cache line");

namespace WISP_ARITH {

TriangleTree make_kdtree(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena,
                         Watch watch);
uint64_t kdtree_bytes(uint32_t count);

inline float plane_of(uint32_t value, int, float) { return detail::from_bits<float>(value); }
inline double plane_of(uint32_t value, int, double) { return detail::from_bits<float>(value); }
inline int64_t plane_of(uint32_t value, int shift, int64_t) {
    return position_of_steps(static_cast<int32_t>(value), shift);
}

// Calls visit(triangle, hit) for triangles that the ray's line hits, in leaves that the ray passes between parameters
// `begin` and `end`. visit may lower `end`, and returns whether the search is over.
template <class Visit>
WISP_INLINE void search_kdtree(const TriangleTree &tree, const TriangleRay &ray, Parameter begin, Parameter &end,
                               uint32_t ignore_triangle, TreeCounts &counts, Visit &&visit) {
    if (tree.triangle_count == 0) return;
    const PlaneRay<Real> planes = plane_ray(tree, ray);
    const int shift = plane_shift(tree);
    const Filter filter(tree, ray);
    Parameter from = begin, to = end;
    for (int a = 0; a < 3; ++a) {
        const Parameter low = times(position_of(tree.bounds.low[a]), planes.inverse[a]),
                        high = times(position_of(tree.bounds.high[a]), planes.inverse[a]);
        from = max(from, min(low, high) - planes.to_low[a]);
        to = min(to, max(low, high) - planes.to_high[a]);
    }
    if (to < from) return;
    struct StackEntry {
        uint32_t node;
        Parameter from, to;
    };
    StackEntry stack[max_tree_depth];
    uint32_t stack_size = 0;
    uint64_t visits = 0, tests = 0;
    uint32_t last = no_triangle;
    const TriangleNode *node = tree.nodes;
    for (bool done = false; !done;) {
        ++visits;
        while (node->axis() != leaf_axis) {
            const uint32_t axis = node->axis();
            const Parameter crossing = times(plane_of(node->value, shift, Parameter()), planes.inverse[axis]);
            const Parameter far_from = crossing - planes.to_low[axis], near_to = crossing - planes.to_high[axis];
            const uint32_t near = node->first() + planes.backward[axis], far = near ^ 1;
            ++visits;
            if (far_from > to) {
                node = tree.nodes + near;
            } else if (near_to < from) {
                node = tree.nodes + far;
            } else {
                stack[stack_size++] = {far, max(from, far_from), to};
                to = min(to, near_to);
                node = tree.nodes + near;
            }
        }
        for (uint32_t count = node->value, at = node->first(); count > 0 && !done; ++at) {
            const TriangleGroup &group = tree.groups[at];
            const uint32_t tested = min(count, group_triangles);
            tests += tested;
            count -= tested;
            done = search_group(group, tested, ray, filter, ignore_triangle, last, visit);
        }
        for (;;) {
            if (stack_size == 0) {
                done = true;
                break;
            }
            const StackEntry &next = stack[--stack_size];
            if (next.from > end) continue;
            node = tree.nodes + next.node;
            from = next.from;
            to = min(next.to, end);
            break;
        }
    }
    counts.node_visits += visits;
    counts.triangle_tests += tests;
}

} // namespace WISP_ARITH
} // namespace wisp
