// All surfaces of a scene. Triangles that never move (static) have one tree in the world's space. The triangles of each
// instance, which move as one, have a tree in the instance's own space. Triangles that change their form (deforming)
// have a third kind of tree, built anew in each frame. Static and moving triangles are strictly separated, so that what
// is known of static ones holds in every frame.
#pragma once
#include "core/geometry/ray.h"
#include "core/numbers/parts.h"
#include "core/surfaces/triangle_queries.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

// An instance in this frame. Rays are transformed into its space; their distances stay those of the world.
struct PlacedInstance {
    TriangleTree tree;
    Box bounds; // in its own space
    uint32_t first, count;
    Vec3 axis[3], origin, inverse[3]; // columns of its matrix, where its space begins, columns of the inverse matrix
};

// A point of the space of an instance (nullptr: of the world's) in the world.
inline Vec3 in_world(const PlacedInstance *instance, const Vec3 &v) {
    if (!instance) return v;
    return instance->axis[0] * v.x + instance->axis[1] * v.y + instance->axis[2] * v.z + instance->origin;
}

// A node of the top-level tree: visible instances, halved by the middles of their boxes down to one. The first child
// follows its parent, the second is at `second`. In a leaf, of instance `instance`, `second` is 0.
struct InstanceNode {
    Box box; // in the world, with a margin for roundings
    uint32_t second, instance;
};

constexpr uint32_t max_group_depth = 40; // groups are halved, so 2^32 instances need less

struct Surfaces {
    TreeKind kind; // of all trees
    TriangleTree static_tree, deforming_tree;
    PlacedInstance *instances;
    uint32_t instance_count;
    Box *boxes;           // by instance: of visible ones, as InstanceNode::box
    InstanceNode *groups; // the top-level tree, root first
    uint32_t group_count;
    uint32_t static_count, deforming_first, deforming_count; // triangles of the scene
    const Triangle *triangles;                               // of the scene
    const Instance *placed;                                  // of this frame
    Real largest;                                            // of the magnitudes of all coordinates in the world
    Real ray_epsilon;
    bool ready; // false: the arena was too small
};

// Upper bounds of the bytes that make_surfaces and place_surfaces take.
uint64_t surface_bytes(const Scene &scene, TreeKind kind);
uint64_t placement_bytes(const Scene &scene, TreeKind kind);

// The trees of static triangles and of instances. They are valid as long as the scene has the same triangles.
Surfaces make_surfaces(const Scene &scene, TreeKind kind, Arena &arena, Watch watch = {});

// Moves the instances to where they are in this frame, and builds the tree of deforming triangles.
void place_surfaces(const Scene &scene, Arena &arena, Surfaces &surfaces, Watch watch = {});

// How much farther than the nearest hit one of a triangle in the same plane may seem to be: each of the two distances
// is off by at most 16 e M |n| / |n d|, of a plane with normal n (triangle.h, and the rounding of corners). In Fixed, 4
// units of 2^-32 take the place of 16 e M; of an instance 6 M more, as its matrix is rounded to half a unit: each of
// three coordinates is off by 3 M / 2, for the ray's origin and for its direction. This is enough where the ray meets
// the plane at 0.2 degrees or more, and no instance is enlarged.
Real coplanar_reach(const Surfaces &surfaces, const Ray &ray);

// The nearest triangle at a distance in (begin, end). `ignore_triangle` is never hit. Of triangles in one plane
// (coplanar.h) the distances differ by roundings alone: there, and at one distance, the first of the scene is hit.
// nearest_opaque_hit() does not ask for planes, because its callers want the distance.
struct Hit {
    bool found;
    Real distance, u, v; // of corners 1 and 2
    uint32_t triangle;   // of the scene
    uint32_t instance;   // or Surfaces::instance_count: none
};
Hit nearest_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                TreeCounts &counts);
Hit nearest_opaque_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, TreeCounts &counts);

// The distance beyond `begin` at which an opaque triangle blocks the ray; infinite_distance where none does, or where
// `surfaces` is nullptr. These rays are not counted.
inline Real distance_to_surface(const Surfaces *surfaces, const Ray &ray, Real begin) {
    if (!has(parts::surfaces) || !surfaces) return infinite_distance;
    TreeCounts unused = {};
    return nearest_opaque_hit(*surfaces, ray, begin, infinite_distance, unused).distance;
}

// Whether an opaque triangle is at a distance in (begin, end): a static one, and which; a deforming one; one of an
// instance; a moving one, that is, one of those two; any.
bool is_blocked_by_static(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                          uint32_t &occluder, TreeCounts &counts);
bool is_blocked_by_deforming(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                             TreeCounts &counts);
bool is_blocked_by_instance(const PlacedInstance &instance, const Ray &ray, Real begin, Real end,
                            uint32_t ignore_triangle, TreeCounts &counts);
bool is_blocked_by_moving(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                          TreeCounts &counts);
bool is_blocked(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                TreeCounts &counts);

// Whether this static triangle, which has an area, is at a distance in (begin, end): as its tree finds it.
inline bool intersects(const Scene &scene, uint32_t triangle, const TriangleRay &ray, Real begin, Real end) {
    const Double3 *corner = scene.triangles[triangle].corner;
    TriangleHit hit;
    return intersect(ray, vec_of(corner[0]), vec_of(corner[1]), vec_of(corner[2]), hit) && hit.distance > begin &&
           hit.distance < end;
}

} // namespace wisp::WISP_ARITH
