// Lights: irradiance, its mean past a step, and the photons they send (decisions on units: README, Lights).
#include "core/lights/light.h"
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr double pi_ = 3.14159265358979323846;

Light light_of(const LightSource &source) { return make_light(source); }
const LightSource lamp = {LightKind::point, {1, 2, 3}, {0, 0, 1}, 2, {4, 2, 1}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": point lights fall off with the squared distance, parallel and constant ones do not") {
    const Vec3 x = vec(1, 2, 7);
    const Illumination there = illuminate(light_of(lamp), x, x, x);
    CHECK(at(there.irradiance.x) == doctest::Approx(0.25));
    CHECK(at(there.irradiance.z) == doctest::Approx(0.0625));
    CHECK(at(there.distance) == doctest::Approx(4));
    CHECK(at(there.direction.z) == 1);
    LightSource other = lamp;
    other.kind = LightKind::constant;
    CHECK(at(illuminate(light_of(other), x, x, x).irradiance.x) == 4);
    other.kind = LightKind::parallel;
    CHECK(at(illuminate(light_of(other), x, x, x).irradiance.x) == 4);
}

TEST_CASE(WISP_ARITH_NAME ": a spot lights its cone and nothing else") {
    LightSource spot = lamp;
    spot.kind = LightKind::spot;
    spot.one_minus_cosine = 1 - std::cos(pi_ / 6);
    const auto lit = [&](double x, double z) {
        const Vec3 p = vec(1 + x, 2, 3 + z);
        return at(illuminate(light_of(spot), p, p, p).irradiance.x) > 0;
    };
    CHECK(lit(0, 5));
    CHECK(lit(std::tan(pi_ / 6) * 4.99, 5));
    CHECK(!lit(std::tan(pi_ / 6) * 5.01, 5));
    CHECK(!lit(0, -5));
}

TEST_CASE(WISP_ARITH_NAME ": over a step the inverse square is its exact mean") {
    // Steps that pass at 0.05 to 20 units, from far to near to far, by quadrature.
    for (double closest : {0.05, 0.5, 3.0, 20.0})
        for (double from : {-30.0, -1.0, -0.2, 0.0, 0.6, 10.0}) {
            const double dx = 0.5;
            double expected = 0;
            const int n = 2000;
            for (int i = 0; i < n; ++i) {
                const double t = from + dx * (i + 0.5) / n;
                expected += 1 / (closest * closest + t * t) / n;
            }
            LightSource at_origin = lamp;
            at_origin.position = {0, 0, 0};
            at_origin.color = {1, 1, 1};
            const Vec3 a = vec(closest, from, 0), b = vec(closest, from + dx, 0);
            const Illumination found = illuminate(light_of(at_origin), (a + b) * Real(0.5), a, b);
            CAPTURE(closest);
            CAPTURE(from);
            CHECK(at(found.irradiance.x) ==
                  doctest::Approx(expected).epsilon(std::is_same_v<Real, double> ? 1e-6 : 5e-5));
        }
}

TEST_CASE(WISP_ARITH_NAME ": photons of a light carry its whole power into its cone") {
    const Sphere smoke = {vec(0, 0, 0), Real(2)};
    LightSource source = lamp;
    source.position = {0, 0, 10};
    const Emitter far = make_emitter(light_of(source), smoke);
    // Solid angle of the sphere of radius 2 at distance 10.
    CHECK(at(far.power.x) == doctest::Approx(4 * 2 * pi_ * (1 - std::sqrt(1 - 0.04))).epsilon(1e-5));
    CHECK(at(far.photon_color.y) == doctest::Approx(0.5));
    source.position = {0.5, 0, 1};
    CHECK(at(make_emitter(light_of(source), smoke).power.x) == doctest::Approx(4 * 4 * pi_).epsilon(1e-6));
    source.kind = LightKind::parallel;
    CHECK(at(make_emitter(light_of(source), smoke).power.x) == doctest::Approx(4 * pi_ * 4).epsilon(1e-6));
}

TEST_CASE(WISP_ARITH_NAME ": photons of every light pass through the sphere that they are sent to") {
    const Sphere smoke = {vec(1, -1, 0.5), Real(3)};
    for (LightKind kind : {LightKind::point, LightKind::parallel, LightKind::constant, LightKind::spot}) {
        LightSource source = {kind, {8, 5, 9}, {0, 0, 1}, 1 - std::cos(0.3), {1, 1, 1}};
        const double d[] = {-7, -6, -8.5}, norm = std::sqrt(49 + 36 + 72.25);
        source.direction = {d[0] / norm, d[1] / norm, d[2] / norm};
        const Light light = light_of(source);
        const Emitter emitter = make_emitter(light, smoke);
        int leave = 0;
        double mean_offset = 0;
        const int n = 4000;
        for (int i = 0; i < n; ++i) {
            const Photon photon = emit(emitter, smoke, photon_event(uint64_t(i), 0));
            if (!photon.leaves) continue;
            ++leave;
            const Vec3 to_center = smoke.center - photon.ray.origin;
            const Vec3 across = cross(photon.ray.direction, to_center);
            const double miss = std::sqrt(at(dot(across, across)));
            CHECK(miss <= 3 + 1e-4);
            CHECK(std::fabs(at(dot(photon.ray.direction, photon.ray.direction)) - 1) < 1e-6);
            mean_offset += miss / n;
        }
        CHECK(leave > n / 2);
        if (kind == LightKind::parallel) CHECK(mean_offset == doctest::Approx(2).epsilon(0.03)); // 2/3 of the radius
    }
}

TEST_CASE(WISP_ARITH_NAME ": narrow spots keep their cone and its power") {
    for (double degrees : {0.02, 0.05, 0.2, 1.0}) {
        const double half = degrees / 2 * pi_ / 180, sine = std::sin(half / 2);
        const LightSource source = {LightKind::spot, {0, 0, 0}, {1, 0, 0}, 2 * sine * sine, {1e4, 1e4, 1e4}};
        const Light light = light_of(source);
        const auto lit = [&](double share) {
            const Vec3 p = vec(100, 100 * std::tan(half * share), 0);
            return largest(illuminate(light, p, p, p).irradiance) > Real(0);
        };
        CAPTURE(degrees);
        CHECK(lit(0));
        CHECK(lit(0.97));
        CHECK(!lit(1.03));
        const Sphere smoke = {vec(100, 0, 0), Real(16)};
        const Emitter emitter = make_emitter(light, smoke);
        CHECK(at(emitter.power.x) == doctest::Approx(1e4 * 2 * pi_ * 2 * sine * sine).epsilon(0.01));
        int leave = 0;
        for (int i = 0; i < 400; ++i) leave += emit(emitter, smoke, photon_event(uint64_t(i), 0)).leaves ? 1 : 0;
        CHECK(leave >= 396); // the cone's own photons, but for the rounding at its edge
    }
}
