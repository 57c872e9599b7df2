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

// Calls visit(triangle, hit) for triangles that the ray's line hits, in leaves that the ray passes between parameters
// `begin` and `end`. visit may lower `end`, and returns whether the search is over.
template <bool nearest_first, class Visit>
WISP_INLINE void search(const TriangleTree &tree, const TriangleRay &ray, Parameter begin, Parameter &end,
                        uint32_t ignore_triangle, TreeCounts &counts, Visit &&visit) {
    if (tree.triangle_count == 0) return;
    if (is_kdtree(tree.kind))
        search_kdtree(tree, ray, begin, end, ignore_triangle, counts, visit);
    else
        search_bvh<nearest_first>(tree, ray, begin, end, ignore_triangle, counts, visit);
}

} // namespace

template <bool opaque_only>
WISP_INLINE bool find_nearest(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                              uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts, Real beyond) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    Parameter search_end = span_of(end, dominant).high;
    hit = {end, no_triangle, Real(0), Real(0), no_triangle};
    search<true>(
        tree, ray, span_of(begin, dominant).low, search_end, ignore_triangle, counts,
        [&](uint32_t marked, const TriangleHit &found) {
            if (opaque_only && (marked & transmissive_bit) != 0) return false;
            const uint32_t triangle = marked & ~transmissive_bit;
            if (!(found.distance > begin) || !(found.distance < end)) return false;
            if (hit.distance < found.distance || (found.distance == hit.distance && hit.triangle < triangle)) {
                if (found.distance - hit.distance <= beyond) hit.lowest = min(hit.lowest, triangle);
                return false;
            }
            const bool is_close = hit.distance - found.distance <= beyond;
            hit = {found.distance, triangle, found.u, found.v, is_close ? min(hit.lowest, triangle) : triangle};
            search_end = span_of(found.distance + beyond, dominant).high;
            return false;
        });
    return hit.triangle != no_triangle;
}

WISP_MULTIVERSIONED_WITH_MASKS bool nearest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                                uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts,
                                                Real beyond) {
    return find_nearest<false>(tree, ray, begin, end, ignore_triangle, hit, counts, beyond);
}

WISP_MULTIVERSIONED_WITH_MASKS bool nearest_opaque_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin,
                                                       Real end, uint32_t ignore_triangle, SurfaceHit &hit,
                                                       TreeCounts &counts) {
    return find_nearest<true>(tree, ray, begin, end, ignore_triangle, hit, counts, Real(0));
}

WISP_MULTIVERSIONED_WITH_MASKS bool lowest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                               uint32_t ignore_triangle, uint32_t first, SurfaceHit &hit,
                                               TreeCounts &counts) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    Parameter search_end = span_of(end, dominant).high;
    hit = {end, no_triangle, Real(0), Real(0), no_triangle};
    search<true>(tree, ray, span_of(begin, dominant).low, search_end, ignore_triangle, counts,
                 [&](uint32_t marked, const TriangleHit &found) {
                     const uint32_t triangle = marked & ~transmissive_bit;
                     if (triangle < first || !(triangle < hit.triangle)) return false;
                     if (found.distance < begin || !(found.distance < end)) return false;
                     hit = {found.distance, triangle, found.u, found.v, triangle};
                     return false;
                 });
    return hit.triangle != no_triangle;
}

WISP_MULTIVERSIONED_WITH_MASKS bool any_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                            uint32_t ignore_triangle, uint32_t &occluder, TreeCounts &counts) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    Parameter search_end = span_of(end, dominant).high;
    occluder = no_triangle;
    search<false>(tree, ray, span_of(begin, dominant).low, search_end, ignore_triangle, counts,
                  [&](uint32_t triangle, const TriangleHit &found) {
                      if (!(found.distance > begin) || !(found.distance < end)) return false;
                      if ((triangle & transmissive_bit) != 0) return false;
                      occluder = triangle;
                      return true;
                  });
    return occluder != no_triangle;
}

} // namespace wisp::WISP_ARITH
