// Shadows of points of space; the parts of steps that a light reaches, against shadow rays from the middles of all
// parts, which test every triangle.
#include "core/shadows/shadows_in_space.h"
#include "core/surfaces/light_fan.h"
#include "support/brute_force.h"
#include "support/compared_pictures.h"
#include "support/random_rooms.h"

namespace wisp::WISP_ARITH {

namespace {

// Steps of one ray, some of them without a length.
struct Steps {
    Ray ray;
    Real middle[lanes], length[lanes];
};
Steps random_steps(Sequence &next, double size) {
    const auto within = [&next](double limit) { return (2 * next() - 1) * limit; };
    Steps steps;
    steps.ray.origin = vec(within(size), within(size), within(size));
    Vec3 direction = vec(within(1), within(1), within(1));
    while (length(direction) < real(0.1)) direction = vec(within(1), within(1), within(1));
    steps.ray.direction = normalize(direction);
    const double scales[] = {0.01, 0.1, 0.5};
    double from = next() * size;
    const double scale = size * scales[static_cast<int>(next() * 3)];
    for (uint32_t l = 0; l < lanes; ++l) {
        const double dx = next() < 0.2 ? 0 : scale * (0.2 + next());
        steps.middle[l] = real(from + dx / 2);
        steps.length[l] = real(dx);
        from += dx + (next() < 0.2 ? scale : 0);
    }
    return steps;
}

// The surfaces of a scene, with trees of one kind.
struct OtherTrees {
    OtherTrees(const Scene &scene, TreeKind kind) {
        memory.resize(static_cast<size_t>(surface_bytes(scene, kind) + placement_bytes(scene, kind)));
        Arena arena(memory.data(), memory.size());
        surfaces = make_surfaces(scene, kind, arena);
        REQUIRE(surfaces.ready);
        place_surfaces(scene, arena, surfaces);
        REQUIRE(surfaces.ready);
    }
    std::vector<unsigned char> memory;
    Surfaces surfaces;
};

// Lit parts of random steps, and shadow rays from the middles of all parts.
struct Comparison {
    uint64_t parts = 0, other = 0, asked = 0, dark = 0, partly = 0;
    int worst = 0;

    void compare(RandomRoom &room, Sequence &next, int times) {
        const BruteForce all(room.scene, room.surfaces);
        const OtherTrees kd(room.scene, TreeKind::kd);
        Shadows in_kd = room.shadows;
        in_kd.surfaces = &kd.surfaces;
        for (uint32_t light = 0; light < room.scene.light_count; ++light)
            for (int i = 0; i < times; ++i) {
                const Steps steps = random_steps(next, room.size);
                Real lit[lanes], again[lanes];
                const uint64_t before = room.statistics.rays.shadow;
                find_lit_parts(room.shadows, light, steps.ray, lanes, steps.middle, steps.length, lit);
                uint64_t with_length = 0;
                for (uint32_t l = 0; l < lanes; ++l) with_length += steps.length[l] > Real(0);
                CHECK(room.statistics.rays.shadow - before == with_length);
                find_lit_parts(in_kd, light, steps.ray, lanes, steps.middle, steps.length, again);
                for (uint32_t l = 0; l < lanes; ++l) {
                    CHECK(lit[l] == again[l]);
                    if (steps.length[l] > Real(0)) compare(room, all, steps, light, l, lit[l]);
                }
            }
    }

  private:
    void compare(const RandomRoom &room, const BruteForce &all, const Steps &steps, uint32_t light, uint32_t l,
                 Real lit) {
        TreeCounts unused = {};
        int count = 0;
        for (uint32_t p = 0; p < shadow_parts; ++p) {
            const double t = at(steps.middle[l]) + at(steps.length[l]) * ((p + 0.5) / shadow_parts - 0.5);
            const Vec3 x = steps.ray.origin + steps.ray.direction * real(t);
            const Illumination from = illuminate(room.shadows.lights[light], x, x, x);
            count += !is_blocked_by_brute_force(all, {x, -from.direction}, Real(0), from.distance - all.ray_epsilon,
                                                no_triangle, unused);
        }
        const int found = static_cast<int>(at(lit) * shadow_parts + 0.5), off = std::abs(found - count);
        parts += shadow_parts;
        other += static_cast<uint64_t>(off);
        worst = std::max(worst, off);
        ++asked;
        dark += found == 0;
        partly += found > 0 && found < static_cast<int>(shadow_parts);
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": the lit parts of steps are those that shadow rays find, in both trees") {
    Comparison all;
    for (uint64_t seed = 0; seed < 12; ++seed) {
        const double sizes[] = {1, 16, 1024};
        RandomRoom room(seed, sizes[seed % 3]);
        Sequence next{seed * 3 + 1};
        all.compare(room, next, 12);
    }
    CHECK(all.asked > 4000);
    CHECK(all.dark > 400);
    CHECK(all.partly > 100);
    CHECK(all.other * 25000 < all.parts); // by rounding: none where this was measured
    CHECK(all.worst <= 1);
}

TEST_CASE(WISP_ARITH_NAME ": a triangle that a lamp stands on hides it from no point of space") {
    int steps_hidden = 0, steps_hidden_above = 0;
    for (uint64_t seed = 0; seed < 150; ++seed) {
        const double sizes[] = {1, 16, 1024}, size = sizes[seed % 3];
        Sequence next{seed * 5 + 2};
        const auto somewhere = [&next](double limit) {
            const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
            return Double3{x, y, z} * limit;
        };
        Double3 c[3];
        do
            for (Double3 &corner : c) corner = somewhere(size);
        while (length(cross(c[1] - c[0], c[2] - c[0])) < 0.3 * size * size);
        const double u = next(), weights[3][2] = {{u, (1 - u) * next()}, {u, 0}, {0, 0}}; // inside, an edge, a corner
        const double *weight = weights[seed / 3 % 3];
        const Double3 lamp = c[0] + (c[1] - c[0]) * weight[0] + (c[2] - c[0]) * weight[1];
        const Double3 normal = unit(cross(c[1] - c[0], c[2] - c[0]));
        for (const double height : {0.0, 0.01}) { // above the triangle it is hidden from what lies below
            Room room;
            room.scene.ray_epsilon = 4e-6 * size;
            room.add(c[0], c[1], c[2], room.material(matte({1, 1, 1})));
            room.light(LightKind::point, lamp + normal * (height * size), {1, 1, 1});
            room.build();
            for (int i = 0; i < 20; ++i) { // by the lamp
                const Double3 from = somewhere(2 * size), to = lamp + somewhere(0.1 * size);
                const double far = length(to - from), dx = 0.05 * size;
                Steps steps = {{vec_of(from), normalize(vec_of(to - from))}, {}, {}};
                for (uint32_t l = 0; l < lanes; ++l) {
                    steps.middle[l] = real(std::max(dx * (l + 0.5), far + dx * (l - 3.5)));
                    steps.length[l] = real(dx);
                }
                Real lit[lanes];
                find_lit_parts(room.shadows, 0, steps.ray, lanes, steps.middle, steps.length, lit);
                for (const Real part : lit) (height > 0 ? steps_hidden_above : steps_hidden) += part < Real(1);
            }
        }
    }
    CHECK(steps_hidden == 0);
    CHECK(steps_hidden_above > 1000);
}

TEST_CASE(WISP_ARITH_NAME ": a ray finds what stands between a point in space and a light") {
    Room room;
    room.add({-1, 1, -1}, {1, 1, -1}, {0, 1, 1}, room.material(matte({1, 1, 1})));
    room.light(LightKind::constant, {0, 2, 0}, {1, 1, 1});
    room.build();
    const auto ask = [&](double x, double y) {
        const Vec3 at = vec_of({x, y, 0});
        return is_blocked_in_space(room.surfaces, at, illuminate(room.tracer.lights[0], at, at, at),
                                   room.statistics.shadow.traced);
    };
    CHECK(ask(0, 0));
    CHECK(!ask(5, 0));
    CHECK(!ask(0, 1.5)); // above the triangle
    CHECK(!ask(0, 3));   // the triangle lies beyond the light's other side
    CHECK(room.statistics.shadow.traced.node_visits > 0);
}

} // namespace wisp::WISP_ARITH
