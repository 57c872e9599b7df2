// The trees of a scene against tests of every triangle, to the bit: what a ray hits, and what blocks it.
#include "core/geometry/camera.h"
#include "host/base/double3_algebra.h"
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

TEST_CASE(WISP_ARITH_NAME ": of triangles that overlap in one plane the first of the scene is hit in every view") {
    // Two pairs of them in a plane, each of them static, in an instance or deforming.
    const int kinds = 3; // static, instance, deforming
    int both = 0, wrong = 0;
    for (uint64_t seed = 0; seed < 36; ++seed) {
        Sequence next{seed * 31 + 7};
        const auto vector = [&next](double limit) {
            return Double3{(2 * next() - 1) * limit, (2 * next() - 1) * limit, (2 * next() - 1) * limit};
        };
        const bool along_axis = seed % 4 == 0;
        const Double3 middle = vector(100), u = along_axis ? Double3{1, 0, 0} : unit(vector(1)),
                      v = along_axis ? Double3{0, 0, 1} : unit(cross(u, vector(1)));
        const auto in_plane = [&](double s, double t) { return middle + u * (700 * s) + v * (700 * t); };
        Room room;
        room.material(matte({1, 1, 1}));
        for (int i = 0; i < 4; ++i)
            room.add(in_plane(-1 + next() * 0.1, -1 - next() * 0.1), in_plane(1 + next() * 0.1, -1 + next() * 0.2),
                     in_plane(next() - 0.5, 1 + next() * 0.1), 0);
        const int first_kind = static_cast<int>(seed % kinds), second_kind = static_cast<int>(seed / kinds % kinds);
        const int lower = std::min(first_kind, second_kind), upper = std::max(first_kind, second_kind);
        for (const int kind : {lower, upper})
            (kind == 0   ? room.scene.static_count
             : kind == 1 ? room.scene.instance_triangle_count
                         : room.scene.deforming_count) += 2;
        if (room.scene.instance_triangle_count > 0) { // turned in every other room
            const bool turned = seed % 2 == 1;
            const Double3 x = turned ? unit(vector(1)) : Double3{1, 0, 0},
                          y = turned ? unit(cross(x, vector(1))) : Double3{0, 1, 0}, z = cross(x, y),
                          origin = turned ? vector(50) : Double3{0, 0, 0};
            for (uint32_t i = 0; i < room.scene.instance_triangle_count; ++i)
                for (Double3 &p : room.triangles[room.scene.static_count + i].corner) {
                    const Double3 from_origin = p - origin;
                    p = {dot(x, from_origin), dot(y, from_origin), dot(z, from_origin)};
                }
            room.instances.push_back({room.scene.static_count,
                                      room.scene.instance_triangle_count,
                                      {x, y, z},
                                      origin,
                                      {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}},
                                      true});
        }
        room.build();
        const BruteForce all(room.scene, room.surfaces);
        TreeCounts unused = {};
        for (int i = 0; i < 400; ++i) {
            const Double3 from = vector(1500), at = in_plane(1.2 * next() - 0.6, 1.2 * next() - 0.8);
            const Double3 to = unit(at - from);
            if (std::fabs(dot(to, cross(u, v))) < 0.02) continue; // seen from the side
            const Ray ray = {vec_of(from), vec_of(to)};
            uint32_t first = no_triangle;
            int count = 0;
            for_each_hit(all, ray, no_triangle, [&](uint32_t triangle, const TriangleHit &hit, uint32_t) {
                if (!(hit.distance > Real(0))) return;
                first = min(first, triangle);
                ++count;
            });
            both += count > 1;
            wrong += nearest_hit(room.surfaces, ray, Real(0), infinite_distance, no_triangle, unused).triangle != first;
        }
    }
    CHECK(wrong == 0);
    CHECK(both > 5000);
}

TEST_CASE(WISP_ARITH_NAME ": triangles that only touch, cross or lie close behind one another are not of one plane") {
    const auto corners = [](const Double3 &a, const Double3 &b, const Double3 &c) {
        WorldTriangle result;
        const Double3 corner[] = {a, b, c};
        for (int i = 0; i < 3; ++i) result.corner[i] = plane_vec_of(corner[i]);
        return result;
    };
    const PlaneReal rounding = corner_rounding(Real(1000));
    Sequence next{11};
    int coplanar = 0;
    for (int i = 0; i < 1000; ++i) {
        const auto vector = [&next](double limit) {
            return Double3{(2 * next() - 1) * limit, (2 * next() - 1) * limit, (2 * next() - 1) * limit};
        };
        const Double3 o = vector(500), u = unit(vector(1)), w = unit(cross(u, vector(1))), n = cross(u, w);
        const auto at = [&](double s, double t, double height) { return o + u * s + w * t + n * height; };
        const auto triangle = [&](double height, double tilt) {
            const double s[] = {next() * 100, next() * 100, next() * 100},
                         t[] = {next() * 5, 20 + next() * 90, next() * 70};
            return corners(at(s[0], t[0], height), at(s[1], t[1], height + tilt * t[1]), at(s[2], t[2], height));
        };
        const WorldTriangle plane = triangle(0, 0);
        coplanar += are_coplanar(plane, triangle(0, 0), rounding);
        for (const double height : {1e-9, 1e-3, 1.0}) CHECK_FALSE(are_coplanar(plane, triangle(height, 0), rounding));
        for (const double tilt : {1e-9, 1e-3, 1.0}) {
            const WorldTriangle tilted = triangle(0, tilt);
            CHECK(are_coplanar(plane, tilted, rounding) == are_coplanar(tilted, plane, rounding));
            CHECK_FALSE(are_coplanar(plane, tilted, rounding));
        }
    }
    CHECK(coplanar == 1000);
}

} // namespace wisp::WISP_ARITH
