// The trees of a scene against tests of every triangle, to the bit: what a ray hits, and what blocks it.
#include "core/geometry/camera.h"
#include "support/brute_force.h"
#include "support/random_rooms.h"

namespace wisp::WISP_ARITH {

namespace {

bool same(const Hit &a, const Hit &b) {
    return a.found == b.found && (!a.found || (a.distance == b.distance && a.u == b.u && a.v == b.v &&
                                               a.triangle == b.triangle && a.instance == b.instance));
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": rays hit, and are blocked, as by tests of every triangle, to the bit") {
    int hits = 0, ties = 0, blocked = 0, wrong = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        const double sizes[] = {1, 16, 1024};
        const RandomRoom room(seed, sizes[seed % 3]);
        const BruteForce all(room.scene, room.surfaces);
        const View view(room.scene.camera);
        TreeCounts unused = {};
        Sequence next{seed};
        const auto random_direction = [&next] {
            Double3 d = {next() - 0.5, next() - 0.5, next() - 0.5};
            if (next() < 0.3) d = {0, next() < 0.5 ? -1.0 : 1.0, next() < 0.5 ? 0 : -0.0}; // along an axis
            return normalize(vec_of(d));
        };
        const auto check = [&](const Ray &ray, Real begin, uint32_t ignore_triangle) {
            const Hit hit = nearest_hit(room.surfaces, ray, begin, infinite_distance, ignore_triangle, unused);
            wrong += !same(hit, nearest_by_brute_force(all, ray, begin, infinite_distance, ignore_triangle, unused));
            if (!hit.found) return hit;
            ++hits;
            int at_once = 0;
            for_each_hit(all, ray, ignore_triangle,
                         [&](uint32_t, const TriangleHit &h, uint32_t) { at_once += h.distance == hit.distance; });
            ties += at_once > 1;
            // Up to just before the hit, up to it and beyond.
            for (const Real end : {hit.distance * Real(0.5), hit.distance, hit.distance + room.surfaces.ray_epsilon}) {
                const bool found = is_blocked(room.surfaces, ray, begin, end, ignore_triangle, unused);
                wrong += found != is_blocked_by_brute_force(all, ray, begin, end, ignore_triangle, unused);
                wrong += !same(nearest_hit(room.surfaces, ray, begin, end, ignore_triangle, unused),
                               nearest_by_brute_force(all, ray, begin, end, ignore_triangle, unused));
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
    // The same triangle is static, in four instances and deforming.
    constexpr uint32_t instances = 4;
    for (uint32_t hidden = 0; hidden < 1u << instances; ++hidden)
        for (const uint32_t static_count : {1u, 0u}) {
            Room room;
            room.material(matte({1, 1, 1}));
            for (uint32_t i = 0; i < static_count + instances + 1; ++i)
                room.add({-1, -1, 0.3}, {1, -1, 0}, {0.2, 1, -0.3}, 0);
            room.scene.static_count = static_count;
            room.scene.instance_triangle_count = instances;
            room.scene.deforming_count = 1;
            for (uint32_t b = 0; b < instances; ++b) {
                const bool visible = (hidden >> b & 1) == 0;
                room.instances.push_back({static_count + b,
                                          1,
                                          {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                          {0, 0, 0},
                                          {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                          visible});
            }
            room.build();
            uint32_t first = static_count == 1 ? 0 : instances;
            for (uint32_t b = instances; static_count == 0 && b-- > 0;)
                if (room.instances[b].visible) first = b;
            TreeCounts unused = {};
            for (const double z : {5.0, -5.0}) {
                const Ray ray = {vec(0.1, 0, z), normalize(vec(0, 0.01, -z))};
                const Hit hit = nearest_hit(room.surfaces, ray, Real(0), infinite_distance, no_triangle, unused);
                REQUIRE(hit.found);
                CHECK(hit.triangle == first);
                CHECK(hit.instance == (static_count == 1 || first == instances ? instances : first));
            }
        }
}

} // namespace wisp::WISP_ARITH
