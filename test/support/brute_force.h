// What rays hit and what blocks them, by tests of every triangle.
#pragma once
#include "core/surfaces/coplanar.h"
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

// Surfaces without any tree: every triangle is tested.
struct BruteForce : Surfaces {
    BruteForce(const Scene &scene_, const Surfaces &surfaces) : Surfaces(surfaces), scene(&scene_) {}
    const Scene *scene;
};

// Calls visit(triangle, hit, its instance or how many there are) for every triangle that the line of the ray hits.
template <class Visit>
void for_each_hit(const BruteForce &all, const Ray &ray, uint32_t ignore_triangle, Visit &&visit) {
    const Scene &scene = *all.scene;
    const auto hit_some = [&](const TriangleRay &local, uint32_t first, uint32_t count, uint32_t instance) {
        for (uint32_t i = first; i < first + count; ++i) {
            const Double3 *c = scene.triangles[i].corner;
            TriangleHit hit;
            if (i != ignore_triangle && has_area(vec_of(c[0]), vec_of(c[1]), vec_of(c[2])) &&
                intersect(local, vec_of(c[0]), vec_of(c[1]), vec_of(c[2]), hit))
                visit(i, hit, instance);
        }
    };
    const TriangleRay world(ray.origin, ray.direction);
    hit_some(world, 0, scene.static_count, scene.instance_count);
    hit_some(world, scene.static_count + scene.instance_triangle_count, scene.deforming_count, scene.instance_count);
    for (uint32_t b = 0; b < scene.instance_count; ++b) {
        const Instance &instance = scene.instances[b];
        if (!instance.visible) continue;
        const Vec3 x = vec_of(instance.inverse[0]), y = vec_of(instance.inverse[1]), z = vec_of(instance.inverse[2]);
        const Vec3 row[3] = {Vec3(x.x, y.x, z.x), Vec3(x.y, y.y, z.y), Vec3(x.z, y.z, z.z)};
        const auto turned = [&row](const Vec3 &v) { return Vec3(dot(row[0], v), dot(row[1], v), dot(row[2], v)); };
        hit_some(TriangleRay(turned(ray.origin - vec_of(instance.origin)), turned(ray.direction)), instance.first,
                 instance.count, b);
    }
}

// A triangle in the world.
inline WorldTriangle world_triangle(const Scene &scene, uint32_t triangle, uint32_t instance) {
    WorldTriangle corners;
    for (int i = 0; i < 3; ++i) {
        const Double3 &p = scene.triangles[triangle].corner[i];
        corners.corner[i] = plane_vec_of(p);
        if (instance == scene.instance_count) continue;
        const Instance &placed = scene.instances[instance];
        for (int k = 0; k < 3; ++k) {
            double Double3::*const component = k == 0 ? &Double3::x : k == 1 ? &Double3::y : &Double3::z;
            corners.corner[i][k] = PlaneReal{placed.axis[0].*component * p.x + placed.axis[1].*component * p.y +
                                             placed.axis[2].*component * p.z + placed.origin.*component};
        }
    }
    return corners;
}

inline Hit nearest_by_brute_force(const Surfaces &surfaces, const Ray &ray, Real begin, Real end,
                                  uint32_t ignore_triangle, TreeCounts &) {
    Hit nearest = {false, end, Real(0), Real(0), no_triangle, surfaces.instance_count};
    for_each_hit(static_cast<const BruteForce &>(surfaces), ray, ignore_triangle,
                 [&](uint32_t triangle, const TriangleHit &hit, uint32_t instance) {
                     if (!(hit.distance > begin && hit.distance < end)) return;
                     if (hit.distance < nearest.distance ||
                         (hit.distance == nearest.distance && triangle < nearest.triangle))
                         nearest = {true, hit.distance, hit.u, hit.v, triangle, instance};
                 });
    // Of the triangles in its plane, the lowest.
    const auto &all = static_cast<const BruteForce &>(surfaces);
    const PlaneReal rounding = corner_rounding(surfaces.largest);
    const Real beyond = nearest.distance + coplanar_reach(surfaces, ray);
    Hit lowest = nearest;
    for_each_hit(all, ray, ignore_triangle, [&](uint32_t triangle, const TriangleHit &hit, uint32_t instance) {
        if (!(hit.distance > begin && hit.distance < min(end, beyond)) || !(triangle < lowest.triangle)) return;
        if (are_coplanar(world_triangle(*all.scene, nearest.triangle, nearest.instance),
                         world_triangle(*all.scene, triangle, instance), rounding))
            lowest = {true, hit.distance, hit.u, hit.v, triangle, instance};
    });
    return lowest;
}

inline bool is_blocked_by_brute_force(const Surfaces &surfaces, const Ray &ray, Real begin, Real end,
                                      uint32_t ignore_triangle, TreeCounts &) {
    const auto &all = static_cast<const BruteForce &>(surfaces);
    bool blocked = false;
    for_each_hit(all, ray, ignore_triangle, [&](uint32_t triangle, const TriangleHit &hit, uint32_t) {
        const Material &material = all.scene->materials[all.scene->triangles[triangle].material];
        blocked |= hit.distance > begin && hit.distance < end && !(material.transmission > 0);
    });
    return blocked;
}

inline const ShadowTechnique brute_force_technique = {[](Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &all = *shadows.surfaces;
    return is_blocked_by_brute_force(all, query.ray, all.ray_epsilon, query.end, query.triangle,
                                     shadows.statistics->shadow.traced);
}};

} // namespace wisp::WISP_ARITH
