// Pictures by the trees against pictures of the same shading by tests of every triangle, to the bit.
#include "core/geometry/camera.h"
#include "support/brute_force.h"
#include "support/random_rooms.h"

namespace wisp::WISP_ARITH {

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
        const BruteForce all(room.scene, room.surfaces);
        Statistics statistics;
        Whitted other = room.tracer;
        other.surfaces = &all;
        other.statistics = &statistics;
        Shadows shadows = {&room.scene, &all, room.tracer.lights, &statistics, &brute_force_technique};
        other.shadows = &shadows;
        other.nearest_hit = nearest_by_brute_force;
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
