// All surfaces of a scene: triangles that never move in one kd-tree, those of each body in another in its own space,
// those that change their form in a third, built anew for each frame. Still and moving ones are kept strictly apart, so
// that what is known of still ones holds in every frame.
#pragma once
#include "core/geometry/ray.h"
#include "core/surfaces/triangle_kdtree.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

// A body in this frame. Rays are taken into its space, their distances stay those of the world.
struct PlacedInstance {
    TriangleTree tree;
    Box bounds; // in its own space
    uint32_t first, count;
    Vec3 axis[3], origin, inverse[3];
};

// The visible bodies, halved by the middles of their boxes down to one. Children lie behind their parents: the first
// next to it, the second at `second`; 0: this is the body `body`.
struct InstanceNode {
    Box box; // of the world, and a margin for what is rounded
    uint32_t second, instance;
};

struct Surfaces {
    TriangleTree still, morphs;
    PlacedInstance *instances;
    uint32_t instance_count;
    Box *boxes; // of the visible bodies in the world, as those of the groups
    InstanceNode *groups;
    uint32_t group_count;
    uint32_t static_count, deforming_first, deforming_count; // triangles of the scene
    Real ray_epsilon;
    bool ready; // false: the arena was too small
};

// Bytes of what make_surfaces and place_surfaces need, at most.
uint64_t surface_bytes(const Scene &scene);
uint64_t placement_bytes(const Scene &scene);

// The trees of what never changes its form: as long as the scene's triangles are the same, these are.
Surfaces make_surfaces(const Scene &scene, Arena &arena);

// Moves the bodies to where they are in this frame, and builds the tree of what has changed its form.
void place_surfaces(const Scene &scene, Arena &arena, Surfaces &surfaces);

// The nearest triangle at a distance in (begin, end), of several the first of the scene; `skip` is passed by.
struct Hit {
    bool found;
    Real distance, u, v; // of corners 1 and 2
    uint32_t triangle;   // of the scene
    uint32_t instance;       // or instance_count: none
};
Hit nearest_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &counts);
Hit nearest_opaque_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, TreeCounts &counts);

// The distance above `begin` at which an opaque triangle stops the ray; infinite_distance where none does, or where
// `surfaces` is nullptr. These rays are not counted.
inline Real distance_to_surface(const Surfaces *surfaces, const Ray &ray, Real begin) {
    if (!surfaces) return infinite_distance;
    TreeCounts unused = {};
    return nearest_opaque_hit(*surfaces, ray, begin, infinite_distance, unused).distance;
}

// Whether an opaque triangle is at a distance in (begin, end): one that never moves, and then which; one that changes
// its form; one of a body; one of those two; any.
bool is_blocked_by_static(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip,
                         uint32_t &occluder, TreeCounts &counts);
bool is_blocked_by_deforming(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip,
                          TreeCounts &counts);
bool is_blocked_by_instance(const PlacedInstance &instance, const Ray &ray, Real begin, Real end, uint32_t skip,
                        TreeCounts &counts);
bool is_blocked_by_moving(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip,
                          TreeCounts &counts);
bool is_blocked(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &counts);

// Whether one triangle that never moves, and has an area, is at a distance in (begin, end): as its tree finds it.
inline bool intersects(const Scene &scene, uint32_t triangle, const TriangleRay &ray, Real begin, Real end) {
    const Double3 *corner = scene.triangles[triangle].corner;
    TriangleHit hit;
    return intersect(ray, vec_of(corner[0]), vec_of(corner[1]), vec_of(corner[2]), hit) && hit.distance > begin &&
           hit.distance < end;
}

} // namespace wisp::WISP_ARITH
