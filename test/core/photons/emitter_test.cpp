// Emitters: the power that lights and glowing smokes send towards the smoke, and where their photons start (S2).
#include "core/photons/emitter.h"
#include "support/built_sparse_grid.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

const LightSource lamp = {LightKind::point, {1, 2, 3}, {0, 0, 1}, 2, {4, 2, 1}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": photons of a light carry its whole power into its cone") {
    const Sphere smoke = {vec(0, 0, 0), Real(2)};
    LightSource source = lamp;
    source.position = {0, 0, 10};
    const Emitter far = make_emitter(make_light(source), smoke);
    // Solid angle of the sphere of radius 2 at distance 10.
    CHECK(at(far.power.x) == doctest::Approx(4 * 2 * pi_ * (1 - std::sqrt(1 - 0.04))).epsilon(1e-5));
    CHECK(at(far.photon_color.y) == doctest::Approx(0.5));
    source.position = {0.5, 0, 1};
    CHECK(at(make_emitter(make_light(source), smoke).power.x) == doctest::Approx(4 * 4 * pi_).epsilon(1e-6));
    source.kind = LightKind::parallel;
    CHECK(at(make_emitter(make_light(source), smoke).power.x) == doctest::Approx(4 * pi_ * 4).epsilon(1e-6));
}

TEST_CASE(WISP_ARITH_NAME ": photons of every light pass through the sphere that they are sent to") {
    const Sphere smoke = {vec(1, -1, 0.5), Real(3)};
    for (LightKind kind : {LightKind::point, LightKind::parallel, LightKind::constant, LightKind::spot}) {
        LightSource source = {kind, {8, 5, 9}, {0, 0, 1}, 1 - std::cos(0.3), {1, 1, 1}};
        const double d[] = {-7, -6, -8.5}, norm = std::sqrt(49 + 36 + 72.25);
        source.direction = {d[0] / norm, d[1] / norm, d[2] / norm};
        const Light light = make_light(source);
        const Emitter emitter = make_emitter(light, smoke);
        int emitted = 0;
        double mean_offset = 0;
        const int n = 4000;
        for (int i = 0; i < n; ++i) {
            const Photon photon = emit(emitter, smoke, photon_event(uint64_t(i), 0));
            if (!photon.emitted) continue;
            ++emitted;
            const Vec3 to_center = smoke.center - photon.ray.origin;
            const Vec3 across = cross(photon.ray.direction, to_center);
            const double miss = std::sqrt(at(dot(across, across)));
            CHECK(miss <= 3 + 1e-4);
            CHECK(std::fabs(at(dot(photon.ray.direction, photon.ray.direction)) - 1) < 1e-6);
            mean_offset += miss / n;
        }
        CHECK(emitted > n / 2);
        if (kind == LightKind::parallel) CHECK(mean_offset == doctest::Approx(2).epsilon(0.03)); // 2/3 of the radius
    }
}

TEST_CASE(WISP_ARITH_NAME ": photons of narrow spots keep the cone's power") {
    for (double degrees : {0.02, 0.05, 0.2, 1.0}) {
        const double half = degrees / 2 * pi_ / 180, sine = std::sin(half / 2);
        const LightSource source = {LightKind::spot, {0, 0, 0}, {1, 0, 0}, 2 * sine * sine, {1e4, 1e4, 1e4}};
        const Light light = make_light(source);
        CAPTURE(degrees);
        const Sphere smoke = {vec(100, 0, 0), Real(16)};
        const Emitter emitter = make_emitter(light, smoke);
        CHECK(at(emitter.power.x) == doctest::Approx(1e4 * 2 * pi_ * 2 * sine * sine).epsilon(0.01));
        int emitted = 0;
        for (int i = 0; i < 400; ++i) emitted += emit(emitter, smoke, photon_event(uint64_t(i), 0)).emitted ? 1 : 0;
        CHECK(emitted >= 396); // the cone's own photons, but for the rounding at its edge
    }
}

// Photons of the sphere around smokes far apart would meet none.
TEST_CASE(WISP_ARITH_NAME ": smokes far apart are lit each by its own photons, and none is sent twice") {
    SmokeDescription near_smoke = box_smoke({0.5, 0.5, 0.5}, 1, 1), far_smoke = near_smoke;
    near_smoke.grid.center = {0, 0, 0};
    far_smoke.grid.center = {40, 1, 0};
    const BuiltMedium apart({near_smoke, far_smoke}), alone({near_smoke}), behind({far_smoke});
    // The smokes stand one behind the other, as most lights see them.
    const LightSource sources[] = {{LightKind::point, {-9, 0, 0}, {0, 0, 0}, 2, {1, 1, 1}},
                                   {LightKind::point, {0.1, 0, 0}, {0, 0, 0}, 2, {1, 1, 1}},
                                   {LightKind::spot, {-9, 0, 0}, {1, 0, 0}, 0.25, {1, 1, 1}},
                                   {LightKind::parallel, {0, 0, 0}, {1, 0, 0}, 0, {1, 1, 1}},
                                   {LightKind::parallel, {0, 0, 0}, {0, 0.6, -0.8}, 0, {1, 1, 1}},
                                   {LightKind::constant, {-9, 5, 0}, {0, 0, 0}, 2, {1, 1, 1}}};
    for (const LightSource &source : sources) {
        CAPTURE(static_cast<int>(source.kind));
        const Light light = make_light(source);
        std::vector<unsigned char> memory(emitter_bytes(apart.scene) + 4096);
        Arena arena(memory.data(), memory.size());
        const Emitters emitters = find_emitters(apart.medium, &light, 1, arena);
        const bool within = source.kind == LightKind::point && source.position.x > 0; // of all directions, then
        REQUIRE(emitters.count == (within ? 1 : 2));
        const int n = 40000;
        int on_near = 0, on_far = 0;
        for (int i = 0; i < n; ++i) {
            const Emission emission = emit_photon(apart.medium, emitters, uint64_t(i) * 0x9e3779b97f4a7c15u);
            if (!emission.photon.emitted) continue;
            const auto meets = [&](const Sphere &sphere) {
                const Vec3 to_center = sphere.center - emission.photon.ray.origin;
                const Vec3 across = cross(emission.photon.ray.direction, to_center);
                return dot(across, across) < sphere.radius * sphere.radius &&
                       (dot(to_center, emission.photon.ray.direction) > Real(0) ||
                        dot(to_center, to_center) < sphere.radius * sphere.radius);
            };
            on_near += meets(alone.medium.sphere) ? 1 : 0;
            on_far += meets(behind.medium.sphere) ? 1 : 0;
        }
        const auto expected = [&](const Medium &medium) { // of n photons
            const Emitter emitter = make_emitter(light, medium.sphere, apart.medium.sphere);
            return n * at(emitter.power.x / emitters.power);
        };
        const double near_count = expected(alone.medium), far_count = expected(behind.medium);
        CHECK(std::fabs(on_near - near_count) < 5 * std::sqrt(near_count));
        CHECK(std::fabs(on_far - far_count) < 5 * std::sqrt(far_count));
        CHECK(std::max(on_near, on_far) > n / 3); // one in a thousand by the sphere around both
    }
    // Smokes that nearly touch have one target.
    near_smoke.grid.center = {39, 1, 0};
    const BuiltMedium close({near_smoke, far_smoke});
    const Light light = make_light(sources[0]);
    std::vector<unsigned char> memory(emitter_bytes(close.scene) + 4096);
    Arena arena(memory.data(), memory.size());
    CHECK(find_emitters(close.medium, &light, 1, arena).count == 1);
}
