// What is asked of a tree over triangles, of either kind.
#pragma once
#include "core/surfaces/triangle_tree.h"

namespace wisp::WISP_ARITH {

// The tree of that kind of `count` triangles, made from the arena; Triangle::material is an index into `materials`. If
// the arena is too small, or there are more than max_triangles, the tree is not ready and the arena is as before.
TriangleTree make_triangle_tree(TreeKind kind, const Triangle *triangles, uint32_t count, const Material *materials,
                                Arena &arena, Watch watch = {});

// An upper bound of the bytes that making the tree takes from the arena, scratch included. The tree keeps less.
uint64_t triangle_tree_bytes(TreeKind kind, uint32_t count);

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

} // namespace wisp::WISP_ARITH
