// Emitters: the power that lights and glowing smokes send towards the smoke, and where their photons start (S2).
#include "core/photons/emitter.h"
#include "support/built_smoke.h"
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
