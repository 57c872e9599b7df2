// A kd-tree over triangles, by the surface area heuristic: what a ray hits first, and whether anything stops it.
//
// The tree cuts space: a node is a plane across an axis, its two children the cells on either side, a leaf the
// triangles that meet its cell. Triangles are cut off at cells when they are sorted into children, and may be in many
// leaves. Planes lie on a lattice of 2^23 steps to either side of 0, and the tree is built by integers: it is the same
// in every arithmetic, but for the rounding of corners.
//
// The hits are those of testing every triangle, to the bit: a triangle's hit does not depend on the tree, and the ray
// passes through a leaf that lists it. For at distance t the ray is, in each coordinate, within the error that
// triangle.h derives of a point p of the triangle; p lies in a leaf that lists the triangle, and in the cells of all
// nodes above it. A ray goes on into the low child of plane c as far as its coordinate may be <= c + margin, into the
// high one from where it may be >= c - margin on, both ends included, with a margin that covers that error and the
// rounding of the crossing. So at every node it goes on into the child that holds p, with an interval that holds t. A
// node is left out only where its interval begins behind the nearest hit so far: what is at the same distance is looked
// at. Components of the direction below e times the largest (2^-24, 2^-53, in Fixed as far as lengths have room) are
// raised to that, which moves the ray by e M at most, and is in the margin; so there is no division by 0, and a ray in
// a plane, of +0 or of -0, goes on into both children.
#pragma once
#include "core/geometry/ray.h"
#include "core/geometry/triangle.h"
#include "wisp/arena.h"
#include "wisp/scene.h"
#include "wisp/statistics.h"

namespace wisp {

constexpr uint32_t group_triangles = lanes;   // that are tested side by side
constexpr uint32_t no_triangle = 0xffffffff;  // not in any tree
constexpr uint32_t max_triangles = 1u << 28; // in a tree
constexpr uint32_t max_tree_depth = 56;
constexpr uint32_t lets_light_through = 1u << 31; // in TriangleGroup::triangle

// A plane of the tree, and where a ray is in its terms: for float and double its distance; in Fixed the length along
// the largest component of its direction, in units of 2^-32.
namespace f32 {
using Parameter = float;
}
namespace f64 {
using Parameter = double;
}
namespace fixed {
using Parameter = int64_t;
}

// An inner node: plane `value` (the bits of a float; in Fixed an integer in units of the tree's step) across the axis
// 0, 1, 2; `first` is an even number, the child below it, first + 1 that above. A leaf: axis 3, `value` triangles in
// groups from `first`.
//
//   31                              0   31                          2 1    0
//  | value                           | | first                       | axis |
struct TriangleNode {
    uint32_t value, link;

    uint32_t axis() const { return link & 3; }
    uint32_t first() const { return link >> 2; }
};
static_assert(sizeof(TriangleNode) == 8, "two children to a quarter of a cache line");

namespace WISP_ARITH {

// Triangles of a leaf, corners by axis.
struct TriangleGroup {
    Real corner[3][3][group_triangles]; // [corner][axis]
    uint32_t triangle[group_triangles]; // index in the caller's array; highest bit: lets light through
};

struct TriangleTree {
    bool ready; // false: the arena was too small
    const TriangleNode *nodes;
    const TriangleGroup *groups;
    uint32_t node_count, group_count;
    uint32_t triangle_count; // those that have an area
    int32_t step_exponent;   // planes are multiples of 2^step_exponent
    Box bounds;              // of all triangles that have an area; if there are any
    Real largest;            // of the magnitudes of their coordinates
};

struct SurfaceHit {
    Real distance;
    uint32_t triangle; // index in the caller's array
    Real u, v;         // the weights of its corners 1 and 2
};

// The tree of `count` triangles, made from the arena; `materials` are those of Triangle::material. Too small an arena,
// or more than max_triangles, give a tree that is not ready, and leave the arena as it was.
TriangleTree make_triangle_tree(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena);

// An upper bound of the bytes that making it takes from the arena, scratch included. What the tree keeps is less.
uint64_t triangle_tree_bytes(uint32_t count);

// The hit of the least distance in (begin, end), and of those the lowest triangle; `skip` is never hit.
bool nearest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end, uint32_t skip, SurfaceHit &hit,
                 TreeCounts &counts);

// The same of triangles that let no light through.
bool nearest_opaque_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end, uint32_t skip,
                        SurfaceHit &hit, TreeCounts &counts);

// Whether any triangle that lets no light through is hit in (begin, end), and which: the first that the search meets.
bool any_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end, uint32_t skip, uint32_t &occluder,
             TreeCounts &counts);

} // namespace WISP_ARITH
} // namespace wisp
