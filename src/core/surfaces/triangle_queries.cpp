#include "core/surfaces/triangle_queries.h"
#include "core/numbers/parts.h"
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_kdtree.h"

namespace wisp::WISP_ARITH {

namespace {

bool is_kdtree(TreeKind kind) { return has(parts::kd_trees) && kind == TreeKind::kd; }

} // namespace

uint64_t triangle_tree_bytes(TreeKind kind, uint32_t count) {
    return is_kdtree(kind) ? kdtree_bytes(count) : bvh_bytes(count);
}

TriangleTree make_triangle_tree(TreeKind kind, const Triangle *triangles, uint32_t count, const Material *materials,
                                Arena &arena, Watch watch) {
    if (count > max_triangles) return {};
    return (is_kdtree(kind) ? make_kdtree : make_bvh)(triangles, count, materials, arena, watch);
}

namespace {

enum class Goal { nearest, nearest_opaque, lowest, any_opaque };

// What all queries search for. `first`: the lowest triangle that counts. Where code is to be small, there is one search
// for all goals; else each has its own.
WISP_INLINE bool find(Goal goal, const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                      uint32_t ignore_triangle, uint32_t first, Real beyond, SurfaceHit &hit, TreeCounts &counts) {
    hit = {end, no_triangle, Real(0), Real(0), no_triangle};
    if (tree.triangle_count == 0) return false;
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    const Parameter search_begin = span_of(begin, dominant).low;
    Parameter search_end = span_of(end, dominant).high;
    // Whether the search is over.
    const auto visit = [&](uint32_t marked, const TriangleHit &found) {
        const bool is_opaque = (marked & transmissive_bit) == 0;
        if ((goal == Goal::nearest_opaque || goal == Goal::any_opaque) && !is_opaque) return false;
        const uint32_t triangle = marked & ~transmissive_bit;
        if (goal == Goal::lowest ? found.distance < begin : !(found.distance > begin)) return false;
        if (!(found.distance < end)) return false;
        if (goal == Goal::lowest || goal == Goal::any_opaque) {
            if (goal == Goal::lowest && (triangle < first || !(triangle < hit.triangle))) return false;
            hit = {found.distance, triangle, found.u, found.v, triangle};
            return goal == Goal::any_opaque;
        }
        if (hit.distance < found.distance || (found.distance == hit.distance && hit.triangle < triangle)) {
            if (found.distance - hit.distance <= beyond) hit.lowest = min(hit.lowest, triangle);
            return false;
        }
        const bool is_close = hit.distance - found.distance <= beyond;
        hit = {found.distance, triangle, found.u, found.v, is_close ? min(hit.lowest, triangle) : triangle};
        search_end = span_of(found.distance + beyond, dominant).high;
        return false;
    };
    if (is_kdtree(tree.kind))
        search_kdtree(tree, ray, search_begin, search_end, ignore_triangle, counts, visit);
    else
        search_bvh(goal != Goal::any_opaque, tree, ray, search_begin, search_end, ignore_triangle, counts, visit);
    return hit.triangle != no_triangle;
}

} // namespace

WISP_MULTIVERSIONED_WITH_MASKS bool nearest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                                uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts,
                                                Real beyond) {
    return find(Goal::nearest, tree, ray, begin, end, ignore_triangle, 0, beyond, hit, counts);
}

WISP_MULTIVERSIONED_WITH_MASKS bool nearest_opaque_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin,
                                                       Real end, uint32_t ignore_triangle, SurfaceHit &hit,
                                                       TreeCounts &counts) {
    return find(Goal::nearest_opaque, tree, ray, begin, end, ignore_triangle, 0, Real(0), hit, counts);
}

WISP_MULTIVERSIONED_WITH_MASKS bool lowest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                               uint32_t ignore_triangle, uint32_t first, SurfaceHit &hit,
                                               TreeCounts &counts) {
    return find(Goal::lowest, tree, ray, begin, end, ignore_triangle, first, Real(0), hit, counts);
}

WISP_MULTIVERSIONED_WITH_MASKS bool any_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                            uint32_t ignore_triangle, uint32_t &occluder, TreeCounts &counts) {
    SurfaceHit hit;
    const bool found = find(Goal::any_opaque, tree, ray, begin, end, ignore_triangle, 0, Real(0), hit, counts);
    occluder = hit.triangle;
    return found;
}

} // namespace wisp::WISP_ARITH
