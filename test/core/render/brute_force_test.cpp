// Trees against tests of every triangle, to the bit: what a ray hits, what blocks it, and pictures by the same shading.
#include "core/geometry/camera.h"
#include "core/surfaces/texture.h"
#include "support/random_rooms.h"

namespace wisp::WISP_ARITH {

namespace {

// Without any tree.
struct EveryTriangle : Surfaces {
    EveryTriangle(const Scene &scene_, const Surfaces &surfaces) : Surfaces(surfaces), scene(&scene_) {}
    const Scene *scene;
};

// visit(triangle, its meeting, the body or how many there are) of every triangle that the line of the ray meets.
template <class Visit> void meet_all(const EveryTriangle &all, const Ray &ray, uint32_t skip, Visit &&visit) {
    const Scene &scene = *all.scene;
    const auto meet_some = [&](const TriangleRay &local, uint32_t first, uint32_t count, uint32_t instance) {
        for (uint32_t i = first; i < first + count; ++i) {
            const Double3 *c = scene.triangles[i].corner;
            TriangleHit hit;
            if (i != skip && has_area(vec_of(c[0]), vec_of(c[1]), vec_of(c[2])) &&
                intersect(local, vec_of(c[0]), vec_of(c[1]), vec_of(c[2]), hit))
                visit(i, hit, instance);
        }
    };
    const TriangleRay world(ray.origin, ray.direction);
    meet_some(world, 0, scene.static_count, scene.instance_count);
    meet_some(world, scene.static_count + scene.instance_triangle_count, scene.deforming_count, scene.instance_count);
    for (uint32_t b = 0; b < scene.instance_count; ++b) {
        const Instance &instance = scene.instances[b];
        if (!instance.visible) continue;
        const Vec3 x = vec_of(instance.inverse[0]), y = vec_of(instance.inverse[1]), z = vec_of(instance.inverse[2]);
        const Vec3 row[3] = {Vec3(x.x, y.x, z.x), Vec3(x.y, y.y, z.y), Vec3(x.z, y.z, z.z)};
        const auto turned = [&row](const Vec3 &v) { return Vec3(dot(row[0], v), dot(row[1], v), dot(row[2], v)); };
        meet_some(TriangleRay(turned(ray.origin - vec_of(instance.origin)), turned(ray.direction)), instance.first, instance.count,
                  b);
    }
}

Hit nearest_of_all(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &) {
    Hit nearest = {false, end, Real(0), Real(0), no_triangle, surfaces.instance_count};
    meet_all(static_cast<const EveryTriangle &>(surfaces), ray, skip,
             [&](uint32_t triangle, const TriangleHit &hit, uint32_t instance) {
                 if (!(hit.distance > begin && hit.distance < end)) return;
                 if (hit.distance < nearest.distance ||
                     (hit.distance == nearest.distance && triangle < nearest.triangle))
                     nearest = {true, hit.distance, hit.u, hit.v, triangle, instance};
             });
    return nearest;
}

bool is_blocked_by_any(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &) {
    const auto &all = static_cast<const EveryTriangle &>(surfaces);
    bool blocked = false;
    meet_all(all, ray, skip, [&](uint32_t triangle, const TriangleHit &hit, uint32_t) {
        const Material &material = all.scene->materials[all.scene->triangles[triangle].material];
        blocked |= hit.distance > begin && hit.distance < end && !(material.transmission > 0);
    });
    return blocked;
}

const ShadowTechnique brute_force_technique = {[](Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &all = *shadows.surfaces;
    return is_blocked_by_any(all, query.ray, all.ray_epsilon, query.end, query.triangle,
                             shadows.statistics->shadow.traced);
}};

bool same(const Hit &a, const Hit &b) {
    return a.found == b.found && (!a.found || (a.distance == b.distance && a.u == b.u && a.v == b.v &&
                                               a.triangle == b.triangle && a.instance == b.instance));
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": rays meet and are stopped as by every triangle, to the bit") {
    int hits = 0, ties = 0, blocked = 0, wrong = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        const double sizes[] = {1, 16, 1024};
        const RandomRoom room(seed, sizes[seed % 3]);
        const EveryTriangle all(room.scene, room.surfaces);
        const View view(room.scene.camera);
        TreeCounts unused = {};
        Sequence next{seed};
        const auto random_direction = [&next] {
            Double3 d = {next() - 0.5, next() - 0.5, next() - 0.5};
            if (next() < 0.3) d = {0, next() < 0.5 ? -1.0 : 1.0, next() < 0.5 ? 0 : -0.0}; // along an axis
            return normalize(vec_of(d));
        };
        const auto check = [&](const Ray &ray, Real begin, uint32_t skip) {
            const Hit hit = nearest_hit(room.surfaces, ray, begin, infinite_distance, skip, unused);
            wrong += !same(hit, nearest_of_all(all, ray, begin, infinite_distance, skip, unused));
            if (!hit.found) return hit;
            ++hits;
            int at_once = 0;
            meet_all(all, ray, skip,
                     [&](uint32_t, const TriangleHit &h, uint32_t) { at_once += h.distance == hit.distance; });
            ties += at_once > 1;
            // Up to just before the hit, up to it and beyond.
            for (const Real end : {hit.distance * Real(0.5), hit.distance, hit.distance + room.surfaces.ray_epsilon}) {
                const bool found = is_blocked(room.surfaces, ray, begin, end, skip, unused);
                wrong += found != is_blocked_by_any(all, ray, begin, end, skip, unused);
                wrong += !same(nearest_hit(room.surfaces, ray, begin, end, skip, unused),
                               nearest_of_all(all, ray, begin, end, skip, unused));
                blocked += found;
            }
            return hit;
        };
        for (int pixel = 0; pixel < room_pixels * room_pixels; ++pixel) {
            const Ray ray =
                view.ray_through(Real(pixel % room_pixels) + Real(0.5), Real(pixel / room_pixels) + Real(0.5));
            const Hit hit = check(ray, Real(0), no_triangle);
            if (!hit.found) continue;
            const Vec3 from = ray.origin + ray.direction * hit.distance;
            check({from, random_direction()}, room.surfaces.ray_epsilon, hit.triangle);
            check({from, ray.direction}, Real(0), no_triangle); // a hair from the surface
            check({from, ray.direction}, Real(0), hit.triangle);
            // From a corner, along an edge: in planes, through corners.
            const Double3 *c = room.triangles[hit.triangle].corner;
            if (hit.instance == room.scene.instance_count && length(c[1] - c[0]) > 0)
                check({vec_of(c[0]), normalize(vec_of(c[1]) - vec_of(c[0]))}, Real(0), no_triangle);
        }
    }
    CHECK(wrong == 0);
    CHECK(hits > 10000);
    CHECK(ties > 400);
    CHECK(blocked > 5000);
}

TEST_CASE(WISP_ARITH_NAME ": of triangles at one distance the first of the scene is hit, whatever holds it") {
    // The same triangle is still, in four bodies and in the morphs.
    constexpr uint32_t instances = 4;
    for (uint32_t hidden = 0; hidden < 1u << instances; ++hidden)
        for (const uint32_t still : {1u, 0u}) {
            Room room;
            room.material(matte({1, 1, 1}));
            for (uint32_t i = 0; i < still + instances + 1; ++i) room.add({-1, -1, 0.3}, {1, -1, 0}, {0.2, 1, -0.3}, 0);
            room.scene.static_count = still;
            room.scene.instance_triangle_count = instances;
            room.scene.deforming_count = 1;
            for (uint32_t b = 0; b < instances; ++b) {
                const bool visible = (hidden >> b & 1) == 0;
                room.instances.push_back({still + b,
                                       1,
                                       {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                       {0, 0, 0},
                                       {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                       visible});
            }
            room.build();
            uint32_t first = still == 1 ? 0 : instances;
            for (uint32_t b = instances; still == 0 && b-- > 0;)
                if (room.instances[b].visible) first = b;
            TreeCounts unused = {};
            for (const double z : {5.0, -5.0}) {
                const Ray ray = {vec(0.1, 0, z), normalize(vec(0, 0.01, -z))};
                const Hit hit = nearest_hit(room.surfaces, ray, Real(0), infinite_distance, no_triangle, unused);
                REQUIRE(hit.found);
                CHECK(hit.triangle == first);
                CHECK(hit.instance == (still == 1 || first == instances ? instances : first));
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": no triangle shades itself or is mirrored in itself, however slanted the light is") {
    Room room;
    Material m = mirror(0.5);
    m.diffuse = {1, 1, 1};
    m.ambient = {0.25, 0.25, 0.25};
    m.shininess = 0; // the highlight is everywhere, so that lit points are seen
    room.material(m);
    const Double3 a = {-1999, -1001, -357}, b = {1733, -1203, 411}, c = {21, 1907, 777};
    room.add(a, b, c, 0);
    room.depth = 1;
    const Double3 along = unit(b - a), plane = unit(cross(b - a, c - a));
    int lit = 0;
    for (double slope = 1e-2; slope > 1e-12; slope /= 10) {
        room.lights.clear();
        room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, unit(along - plane * slope));
        room.build();
        Sequence next{6};
        for (int i = 0; i < 200; ++i) {
            const double u = 0.1 + 0.4 * next(), v = 0.1 + 0.4 * next();
            const Double3 at_point = a + (b - a) * u + (c - a) * v;
            const Double3 from = at_point - along * 300 + plane * (300 * slope);
            room.statistics = {};
            const Color seen = room.look(from, at_point);
            if (at(seen.x) == 0) continue; // passed by
            CHECK(room.statistics.rays.reflected == 1);
            const bool alone = room.statistics.rays.shadow == 0;
            CHECK(at(seen.x) == doctest::Approx(alone ? 0.25 : 0.75).epsilon(0.01)); // and the mirror is dark
            lit += !alone;
        }
    }
    CHECK(lit > 500);
}

TEST_CASE(WISP_ARITH_NAME ": pictures are those of every triangle, to the bit, and so are the counts") {
    uint64_t rays = 0;
    int wrong = 0;
    for (uint64_t seed = 1000; seed < 1100; ++seed) {
        const double sizes[] = {1, 16, 1024};
        RandomRoom room(seed, sizes[seed % 3]);
        const EveryTriangle all(room.scene, room.surfaces);
        Statistics statistics;
        Whitted other = room.tracer;
        other.surfaces = &all;
        other.statistics = &statistics;
        Shadows shadows = {&room.scene, &all, room.tracer.lights, &statistics, &brute_force_technique};
        other.shadows = &shadows;
        other.nearest_hit = nearest_of_all;
        const View view(room.scene.camera);
        for (int pixel = 0; pixel < room_pixels * room_pixels; ++pixel) {
            const Ray ray =
                view.ray_through(Real(pixel % room_pixels) + Real(0.5), Real(pixel / room_pixels) + Real(0.5));
            wrong += trace(room.tracer, ray) != trace(other, ray);
        }
        CHECK(statistics.rays.reflected == room.statistics.rays.reflected);
        CHECK(statistics.rays.refracted == room.statistics.rays.refracted);
        CHECK(statistics.rays.shadow == room.statistics.rays.shadow);
        rays += statistics.rays.shadow + statistics.rays.reflected + statistics.rays.refracted;
    }
    CHECK(wrong == 0);
    CHECK(rays > 50000);
}

} // namespace wisp::WISP_ARITH
