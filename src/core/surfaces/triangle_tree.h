// Trees over triangles: the nearest triangle on a ray, and whether any triangle blocks the ray. There are two kinds, a
// tree of boxes (triangle_bvh.h), the default, and one of planes (triangle_kdtree.h).
//
// The hits are those of testing every triangle, to the bit, in both: a triangle's hit does not depend on the tree, and
// each tree finds the leaves of all triangles that the ray may hit. At a hit's distance t the ray is, in each
// coordinate, within the error that triangle.h derives of a point p of the triangle. The margin of a ray's crossings
// with planes (triangle_search.h) covers that error. A part of the tree is left out only where it begins beyond the
// nearest hit so far, so hits at the same distance are found.
//
// Trees are built by integers, on a lattice of 2^23 steps to either side of 0: they are the same in every arithmetic,
// but for the rounding of corners.
#pragma once
#include "core/geometry/ray.h"
#include "core/geometry/triangle.h"
#include "wisp/arena.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include "wisp/statistics.h"

namespace wisp {

constexpr uint32_t group_triangles = lanes;     // tested side by side
constexpr uint32_t no_triangle = 0xffffffff;    // not in any tree
constexpr uint32_t max_triangles = 1u << 28;    // in a tree
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

struct TriangleNode; // triangle_kdtree.h

namespace WISP_ARITH {

struct BoxNode; // triangle_bvh.h

// Triangles of a leaf, their corners by axis.
struct TriangleGroup {
    Real corner[3][3][group_triangles]; // [corner][axis]
    uint32_t triangle[group_triangles]; // index in the caller's array; highest bit: not opaque
};

struct TriangleTree {
    bool ready; // false: the arena was too small
    TreeKind kind;
    const TriangleNode *nodes; // of TreeKind::kd
    const BoxNode *boxes;      // of TreeKind::bvh
    const TriangleGroup *groups;
    uint32_t node_count, group_count;
    uint32_t root;           // of TreeKind::bvh, as BoxNode::child
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

} // namespace WISP_ARITH
} // namespace wisp
