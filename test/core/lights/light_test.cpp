// Lights: irradiance, and its mean past a step (units: lights/README, Radiometry).
#include "core/lights/light.h"
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>
#include <random>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

const LightSource lamp = {LightKind::point, {1, 2, 3}, {0, 0, 1}, 2, {4, 2, 1}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": point lights fall off with the squared distance, parallel and constant ones do not") {
    const Vec3 x = vec(1, 2, 7);
    const Illumination there = illuminate(make_light(lamp), x, x, x);
    CHECK(at(there.irradiance.x) == doctest::Approx(0.25));
    CHECK(at(there.irradiance.z) == doctest::Approx(0.0625));
    CHECK(at(there.distance) == doctest::Approx(4));
    CHECK(at(there.direction.z) == 1);
    LightSource other = lamp;
    other.kind = LightKind::constant;
    CHECK(at(illuminate(make_light(other), x, x, x).irradiance.x) == 4);
    other.kind = LightKind::parallel;
    CHECK(at(illuminate(make_light(other), x, x, x).irradiance.x) == 4);
}

TEST_CASE(WISP_ARITH_NAME ": a spot lights its cone and nothing else") {
    LightSource spot = lamp;
    spot.kind = LightKind::spot;
    spot.one_minus_cosine = 1 - std::cos(pi_ / 6);
    const auto lit = [&](double x, double z) {
        const Vec3 p = vec(1 + x, 2, 3 + z);
        return at(illuminate(make_light(spot), p, p, p).irradiance.x) > 0;
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
            const Illumination found = illuminate(make_light(at_origin), (a + b) * Real(0.5), a, b);
            CAPTURE(closest);
            CAPTURE(from);
            CHECK(at(found.irradiance.x) ==
                  doctest::Approx(expected).epsilon(std::is_same_v<Real, double> ? 1e-6 : 5e-5));
        }
}

TEST_CASE(WISP_ARITH_NAME ": over a step the phase function is its mean over the light that the step receives") {
    for (const LightKind kind : {LightKind::point, LightKind::constant})
        for (const double g : {0.5, -0.5, 0.95, -0.95})
            for (const double closest : {0.01, 0.1, 1.0, 30.0})
                for (const double from : {-3.0, -1.0, -0.5, -0.1, 0.0, 0.7, 2.0}) {
                    // A step of length 1 along y, from the light on, by quadrature.
                    double expected = 0, weights = 0;
                    const int n = 20000;
                    for (int i = 0; i < n; ++i) {
                        const double y = from + (i + 0.5) / n, d2 = closest * closest + y * y;
                        const double weight = kind == LightKind::point ? 1 / d2 : 1, cosine = y / std::sqrt(d2);
                        expected += weight * (1 - g * g) / (4 * pi_ * std::pow(1 + g * g - 2 * g * cosine, 1.5));
                        weights += weight;
                    }
                    LightSource source = lamp;
                    source.kind = kind;
                    source.position = {0, 0, 0};
                    const Light light = make_light(source);
                    const Vec3 a = vec(closest, from, 0), b = vec(closest, from + 1, 0), x = (a + b) * Real(0.5);
                    const double found =
                        at(mean_phase(light, Phase(real(g)), illuminate(light, x, a, b).direction, a, b, vec(0, 1, 0)));
                    CAPTURE(static_cast<int>(kind));
                    CAPTURE(g);
                    CAPTURE(closest);
                    CAPTURE(from);
                    CHECK(std::fabs(found * weights / expected - 1) < (kind == LightKind::point ? 0.01 : 0.05));
                }
}

TEST_CASE(WISP_ARITH_NAME
          ": over a step the light of a spot and its phase are means, wherever the step cuts the cone") {
    // Segments and cones at random, by quadrature. Wide cones count as a whole, by the step's middle.
    std::mt19937 generator(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    int in_part = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const double half = pi_ / 180 * (trial % 3 == 0 ? 2 : trial % 3 == 1 ? 15 : 70);
        const double sine = std::sin(half / 2);
        const LightSource source = {LightKind::spot, {0, 0, 0}, {0.6, 0, 0.8}, 2 * sine * sine, {1, 1, 1}};
        const Light light = make_light(source);
        const double wide = 5 * std::min(std::tan(half), 1.0);
        const double p[] = {3 + wide * uniform(generator), wide * uniform(generator), 4 + wide * uniform(generator)};
        const double d[] = {wide * uniform(generator), wide * uniform(generator), wide * uniform(generator)};
        const int n = 4000;
        const double g = 0.7, eye[] = {0, 0.6, 0.8};
        double expected = 0, scattered = 0;
        int lit = 0;
        for (int i = 0; i < n; ++i) {
            const double t = (i + 0.5) / n, x = p[0] + t * d[0], y = p[1] + t * d[1], z = p[2] + t * d[2];
            const double r2 = x * x + y * y + z * z;
            if (0.6 * x + 0.8 * z < std::sqrt(r2) * std::cos(half)) continue;
            const double cosine = (x * eye[0] + y * eye[1] + z * eye[2]) / std::sqrt(r2);
            expected += 1 / r2 / n;
            scattered += (1 - g * g) / (4 * pi_ * std::pow(1 + g * g - 2 * g * cosine, 1.5)) / r2 / n;
            ++lit;
        }
        in_part += lit > 0 && lit < n;
        const Vec3 a = vec(p[0], p[1], p[2]), b = vec(p[0] + d[0], p[1] + d[1], p[2] + d[2]);
        const Illumination found = illuminate(light, (a + b) * Real(0.5), a, b);
        CAPTURE(trial);
        CHECK(std::fabs(at(found.irradiance.x) - expected) < 0.0125 * std::max(0.04, expected));
        if (lit < n / 64) continue; // too few for the quadrature
        const Real mean = mean_phase(light, Phase(real(g)), found.direction, a, b, vec(eye[0], eye[1], eye[2]));
        CHECK(std::fabs(at(mean) * expected / scattered - 1) < 0.025);
    }
    CHECK(in_part > 50);
}

TEST_CASE(WISP_ARITH_NAME ": narrow spots keep their cone") {
    for (double degrees : {0.02, 0.05, 0.2, 1.0}) {
        const double half = degrees / 2 * pi_ / 180, sine = std::sin(half / 2);
        const LightSource source = {LightKind::spot, {0, 0, 0}, {1, 0, 0}, 2 * sine * sine, {1e4, 1e4, 1e4}};
        const Light light = make_light(source);
        const auto lit = [&](double fraction) {
            const Vec3 p = vec(100, 100 * std::tan(half * fraction), 0);
            return largest(illuminate(light, p, p, p).irradiance) > Real(0);
        };
        CAPTURE(degrees);
        CHECK(lit(0));
        CHECK(lit(0.97));
        CHECK(!lit(1.03));
    }
}
