// A kd-tree over triangles, built by the surface area heuristic (SAH). It finds the nearest triangle on a ray, and
// whether any triangle blocks the ray.
//
// The tree divides space. An inner node is a plane across an axis, and its two children are the cells on either side. A
// leaf lists the triangles that intersect its cell. The part of a triangle that lies in a cell decides which children
// list it, so a triangle may be in many leaves. Planes lie on a lattice of 2^23 steps to either side of 0, and the tree
// is built by integers: it is the same in every arithmetic, but for the rounding of corners.
//
// The hits are those of testing every triangle, to the bit. A triangle's hit does not depend on the tree, and the ray
// passes through a leaf that lists the triangle: at distance t the ray is, in each coordinate, within the error that
// triangle.h derives of a point p of the triangle. p lies in a leaf that lists the triangle, and in the cells of all
// nodes above that leaf. A ray continues into the low child of plane c as far as its coordinate may be <= c + margin,
// and into the high child from where it may be >= c - margin on, both ends included. The margin covers that error and
// the rounding of the crossing. So at every node the ray continues into the child that holds p, with an interval that
// holds t. A node is left out only where its interval begins beyond the nearest hit so far, so hits at the same
// distance are found.
//
// Components of the direction below e times the largest one (e = 2^-24, 2^-53, in Fixed as far as lengths have room)
// are raised to that. This moves the ray by e M at most, which is in the margin. So there is no division by 0, and a
// ray in a plane, with a component of +0 or of -0, continues into both children.
#pragma once
#include "core/geometry/ray.h"
#include "core/geometry/triangle.h"
#include "wisp/arena.h"
#include "wisp/scene.h"
#include "wisp/statistics.h"

namespace wisp {

constexpr uint32_t group_triangles = lanes;  // tested side by side
constexpr uint32_t no_triangle = 0xffffffff; // not in any tree
constexpr uint32_t max_triangles = 1u << 28; // in a tree
constexpr uint32_t max_tree_depth = 56;
constexpr uint32_t transmissive_bit = 1u << 31; // in TriangleGroup::triangle

// A position along a ray: for float and double the distance; in Fixed the length along the largest component of the
// ray's direction, in units of 2^-32.
namespace f32 {
using Parameter = float;
}
namespace f64 {
using Parameter = double;
}
namespace fixed {
using Parameter = int64_t;
}

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

// Triangles of a leaf, their corners by axis.
struct TriangleGroup {
    Real corner[3][3][group_triangles]; // [corner][axis]
    uint32_t triangle[group_triangles]; // index in the caller's array; highest bit: not opaque
};

struct TriangleTree {
    bool ready; // false: the arena was too small
    const TriangleNode *nodes;
    const TriangleGroup *groups;
    uint32_t node_count, group_count;
    uint32_t triangle_count; // of those that have an area
    int32_t step_exponent;   // planes are multiples of 2^step_exponent
    Box bounds;              // of all triangles that have an area, if there are any
    Real largest;            // of the magnitudes of their coordinates
};

struct SurfaceHit {
    Real distance;
    uint32_t triangle; // index in the caller's array
    Real u, v;         // the weights of its corners 1 and 2
    uint32_t lowest;   // of nearest_hit(): no hit up to `beyond` farther has a lower triangle
};

// The tree of `count` triangles, made from the arena; Triangle::material is an index into `materials`. If the arena is
// too small, or there are more than max_triangles, the tree is not ready and the arena is as before.
TriangleTree make_triangle_tree(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena,
                                Watch watch = {});

// An upper bound of the bytes that making the tree takes from the arena, scratch included. The tree keeps less.
uint64_t triangle_tree_bytes(uint32_t count);

// The nearest hit at a distance in (begin, end); at one distance, that of the lowest triangle. `ignore_triangle` is
// never hit.
bool nearest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end, uint32_t ignore_triangle,
                 SurfaceHit &hit, TreeCounts &counts, Real beyond = Real(0));

// The same for opaque triangles.
bool nearest_opaque_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                        uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts);

// Of the hits at a distance in [begin, end) that of the lowest triangle from `first` on.
bool lowest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end, uint32_t ignore_triangle,
                uint32_t first, SurfaceHit &hit, TreeCounts &counts);

// Whether an opaque triangle is hit at a distance in (begin, end), and which: the first that the search finds.
bool any_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end, uint32_t ignore_triangle,
             uint32_t &occluder, TreeCounts &counts);

} // namespace WISP_ARITH
} // namespace wisp
