// Hard cases A: sampling with the smallest and largest random numbers and parameters.
#include "core/photons/photon_walk.h"
#include "host/scene/scene_file.h"
#include "support/built_smoke.h"
#include "support/chosen_draws.h"
#include "support/refusal.h"
#include "support/worst.h"
#include "wisp/settings.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr double ln2 = 0.693147180559945309417;
constexpr bool is_f32 = std::is_same_v<Real, float>, is_fixed = std::is_same_v<Real, Fixed>;

uint64_t key_of(uint64_t i) { return (i + 1) * 0x9e3779b97f4a7c15u; }

// The optical depth along a line through the middle of one particle with h = 1 and cross-section 1 (N-L).
constexpr double depth_of_area = 15 / (8 * pi_);

// An infinite medium of extinction 1. Flight number `zero_flight` of the photon with this key has length 0.
struct InfiniteMedium {
    double albedo_, g;
    uint64_t key;
    uint32_t zero_flight; // from 1; 0: none
};
struct AnyCollision {
    bool found;
    Real distance;
};
AnyCollision first_collision(const InfiniteMedium &medium, const Ray &, Real, Event event) {
    const Event zero = photon_event(medium.key, medium.zero_flight);
    if (medium.zero_flight && event.low == zero.low && event.high == zero.high) return {true, Real(0)};
    return {true, -wisp::log(unit_open<Real>(draw(event, 0)))};
}
Color albedo(const InfiniteMedium &medium, const AnyCollision &) { return Color(real(medium.albedo_)); }
Phase phase(const InfiniteMedium &medium, const AnyCollision &) { return Phase(real(medium.g)); }

Photon photon_along_z() { return {{vec(0, 0, 0), vec(0, 0, 1)}, Color(Real(1)), true}; }

double worst_component(const Vec3 &v) { return std::max({std::fabs(at(v.x)), std::fabs(at(v.y)), std::fabs(at(v.z))}); }

std::string error_of_phase(const std::string &g) {
    return refusal_of([&] { parse_scene("s.aff", "smoke a.vtk {\n phase " + g + " }"); });
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case A1: the longest free path is finite and has the known length") {
    // 32 bits of a draw become the middle of their bin, 1 - 2^-33 at most: 33 ln 2 = 22.87. Float rounds that to
    // 1 - 2^-24, 24 ln 2 = 16.64, and fixed has the bin's lower end, 1 - 2^-32, 32 ln 2 = 22.18.
    const double longest = (is_f32 ? 24 : is_fixed ? 32 : 33) * ln2;
    const Real by_log1p = -wisp::log1p(-unit_open<Real>(0xffffffffu));
    CHECK(at(by_log1p) == doctest::Approx(longest).epsilon(1e-6));
    // -log(u) is longest for the smallest number: 2^-33, or 2^-32 in fixed.
    CHECK(at(-wisp::log(unit_open<Real>(0))) == doctest::Approx((is_fixed ? 32 : 33) * ln2).epsilon(1e-6));

    // A photon with that draw collides in smoke that is a thousandth deeper, and passes smoke a thousandth thinner.
    const Ray ray = {vec(-5, 0, 0), vec(1, 0, 0)};
    const uint32_t bits = 0xffffffffu;
    const Event largest_draw = event_with_draw(0, bits);
    REQUIRE(draw(largest_draw, 0) == bits);
    const double depth = at(-wisp::log1p(-unit_open<Real>(bits)));
    for (double factor : {0.5, 0.999, 1.001, 30.0}) {
        const BuiltField built(smoke_of({{{0, 0, 0}, 1, factor * depth / depth_of_area}}));
        const auto collision = first_collision(built.field, ray, Real(20), largest_draw);
        CAPTURE(factor);
        CHECK(collision.found == (factor > 1));
        if (!collision.found) continue;
        CHECK(collision.distance > Real(3));
        CHECK(collision.distance < Real(7));
        // The line integral is wrong by up to 1.2e-5 of its maximum 8 in float, at either end (N-L).
        CHECK(at(optical_depth(built.field, ray, collision.distance)) ==
              doctest::Approx(depth).epsilon(is_f32 ? 3e-6 * std::max(factor, 1.0) : 1e-6));
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case A2: a path of length 0 is one more collision in the same place, and the walk goes on") {
    // In dense smoke the shortest path is below the resolution. A longer path from there moves on.
    const BuiltField dense(smoke_of({{{0, 0, 0}, 1, 1e5}}));
    const Ray inside = {vec(0.5, 0, 0), vec(1, 0, 0)};
    const Event shortest = event_with_draw(0, 0);
    REQUIRE(draw(shortest, 0) == 0);
    const auto near = first_collision(dense.field, inside, Real(20), shortest);
    REQUIRE(near.found);
    CHECK(near.distance >= Real(0));
    CHECK(near.distance < real(1e-3));
    const auto onward = first_collision(dense.field, inside, Real(20), event_with_draw(0, 0xfffffeffu)); // 1 - 2^-24
    REQUIRE(onward.found);
    CHECK(onward.distance > near.distance);

    // A walk whose third flight has length 0 collides twice in the same place and goes on.
    const uint64_t key = key_of(5);
    std::vector<Vec3> places;
    const PathEnd ending =
        walk(InfiniteMedium{0.999, 0, key, 3}, photon_along_z(), key,
             [&](const AnyCollision &, uint32_t, const Photon &p) { places.push_back(p.ray.origin); });
    CHECK(ending == PathEnd::absorbed);
    REQUIRE(places.size() > 5);
    int repeated = 0;
    for (size_t i = 1; i < places.size(); ++i)
        if (places[i] == places[i - 1]) {
            CHECK(i == 2);
            ++repeated;
        }
    CHECK(repeated == 1);

    // A light in the densest smoke: every photon first collides at the light, and no first collision is stored.
    const std::vector<Particle> one = {{{0, 0, 0}, 1, 1e5}};
    SmokeDescription smoke = smoke_of(one);
    smoke.albedo = {0.25, 0.25, 0.25};
    const LightSource lamp = {LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {1, 1, 1}};
    Scene scene = {};
    scene.camera = look_at_origin(12, 8, 2);
    scene.smokes = &smoke;
    scene.smoke_count = 1;
    scene.lights = &lamp;
    scene.light_count = 1;
    Settings settings = small_settings(2);
    settings.photons = 2000;
    const Rendered picture = render_in_memory(scene, settings);
    const auto &photons = picture.statistics.photons;
    CHECK(photons.emitted == settings.photons);
    CHECK(photons.collisions - photons.stored == photons.emitted);
    CHECK(photons.stored > 0);
    CHECK(photons.absorbed == photons.emitted);
    for (float value : picture.rgb) CHECK(std::isfinite(value));
}

TEST_CASE(WISP_ARITH_NAME ": hard case A3: for g = 0 the cosine is 2 xi - 1 to the bit, and p is 1 / (4 pi)") {
    const Phase phase(Real(0));
    CHECK(phase.isotropic());
    const auto check = [&](Real xi) { CHECK(phase.sample(xi).cosine == Real(2) * xi - Real(1)); };
    for (double xi : {0.0, 0x1p-33, 0x1p-32, 0.25, 0.5, 1 - 0x1p-24, 1 - 0x1p-33, 1.0}) check(real(xi));
    for (uint32_t i = 0; i < 1000; ++i) check(unit_half_open<Real>(draw(photon_event(1, 1), i)));
    for (const Vec3 &out : {vec(1, 0, 0), vec(0, 0, 1), vec(0, 0, -1)})
        CHECK(phase(vec(0, 0, 1), out) == inv_four_pi<Real>);
    CHECK(at(inv_four_pi<Real>) == doctest::Approx(0.0795774715459477).epsilon(1e-7));
}

TEST_CASE(WISP_ARITH_NAME ": hard case A4: a tiny g loses no digits") {
    // Errors against the exact cosine 2 xi - 1 + 3/2 g (1 - (2 xi - 1)^2) + O(g^2), with the bounds of N-E1. The term
    // in g is 1.5e-8 for g = 1e-8. Fixed rounds six quotients and products to 2^-33, and doubles their error twice.
    const double bar = is_f32 ? 4e-8 : is_fixed ? 12 * 0x1p-33 : 5e-16;
    for (double g : {1e-8, 1e-12, -1e-8, -1e-12}) {
        const Real g_real = real(g);
        const Phase phase(g_real);
        double worst = 0, worst_to_isotropic = 0;
        Sequence next;
        for (int i = 0; i < 3002; ++i) {
            const Real xi = i < 2 ? Real(i) : real(next());
            const double s = 2 * at(xi) - 1, cosine = at(phase.sample(xi).cosine);
            worst = worst_of(worst, std::fabs(cosine - (s + 1.5 * at(g_real) * (1 - s * s))));
            worst_to_isotropic = worst_of(worst_to_isotropic, std::fabs(cosine - s));
        }
        CAPTURE(g);
        CHECK(worst <= bar);
        CHECK(worst_to_isotropic <= bar + 1.5 * std::fabs(at(g_real)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case A5: the sharpest peaks of the phase function have the right angles") {
    // Small angles are read from the sine: 1 - cos = sin^2 / (1 + cos). In float 1 - |g| = 1e-4 is rounded by 3e-8, and
    // its square has twice that relative error. In fixed 1 - |g| and the denominator are rounded by 2^-33, and the
    // result has a resolution of 2^-32.
    const double xis[] = {0, 0x1p-32, 0.5, 1 - 0x1p-24, 1};
    const double forward[] = {2, 1.9999813755, 1.49995e-8, 5.96e-16, 0};
    const double backward[] = {0, 2.3284e-18, 1.49995e-8, 1.9952406, 2};
    for (int i = 0; i < 5; ++i) {
        const Phase::Cosine f = Phase(real(0.9999)).sample(real(xis[i])), b = Phase(real(-0.9999)).sample(real(xis[i]));
        const auto away = [](double cosine, double sine) {
            return cosine > 0 ? sine * sine / (1 + cosine) : 1 - cosine;
        };
        const auto bar = [](double value) {
            // Half a unit of the last digit printed above, and the error of the arithmetic.
            return value * (is_f32     ? 1e-3
                            : is_fixed ? 1e-5
                                       : 1e-3 * (value < 1e-9)) +
                   (is_fixed ? 3 * 0x1p-32 : 0) + (value > 1 ? 5e-8 : 4e-6 * value);
        };
        CAPTURE(xis[i]);
        CHECK(std::fabs(away(at(f.cosine), at(f.sine)) - forward[i]) <= bar(forward[i]));
        CHECK(std::fabs(away(-at(b.cosine), at(b.sine)) - backward[i]) <= bar(backward[i]));
        for (const Phase::Cosine &c : {f, b}) {
            CHECK(c.cosine >= Real(-1));
            CHECK(c.cosine <= Real(1));
        }
        if (i == 0) CHECK((f.cosine == Real(-1) && b.cosine == Real(-1)));
        if (i == 4) CHECK((f.cosine == Real(1) && b.cosine == Real(1)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case A6: |g| >= 1 and g that is no number are refused with the line of the file") {
    for (const char *g : {"1", "-1", "1.5", "+1.0"})
        CHECK(error_of_phase(g) == std::string("s.aff:2: found phase ") + g + ", expected above -1 and below 1");
    for (const char *g : {"nan", "NaN", "-nan", "inf"})
        CHECK(error_of_phase(g) ==
              std::string("s.aff:2: found '") + g + "', expected a number: g of the phase function");
    CHECK(error_of_phase("0.9999") == "no error");
}

TEST_CASE(WISP_ARITH_NAME ": hard case A7: the forward peak is finite") {
    // In float the error comes from rounding g. In fixed (1 - g)^2 = 1e-8 has 42.9 units and is rounded by half a unit;
    // its power of 3/2 has 3/2 of that relative error.
    const double bar = is_fixed ? 1.5 * 0.5 / 42.9 : 1e-3;
    const Phase forward(real(0.9999)), backward(real(-0.9999));
    for (const Vec3 &d : {vec(0, 1, 0), vec(0, 0, -1), normalize(vec(1, -2, 0.5))}) {
        CHECK(at(forward(d, d)) == doctest::Approx(1.5915e7).epsilon(bar));
        CHECK(at(backward(d, -d)) == doctest::Approx(1.5915e7).epsilon(bar));
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case A8: the frame about any direction is orthonormal, and directions have the sampled angle") {
    const double bar = is_f32 ? 1e-6 : is_fixed ? 2e-9 : 2e-15;
    for (const Vec3 &d : {vec(0, 0, 1), vec(0, 0, -1), vec(1e-20, 0, -1), Vec3(Real(0), -Real(0), Real(-1)),
                          Vec3(Real(0), Real(0), -Real(1)), vec(1, 0, 0), vec(-1, 0, 0), vec(0, 1, 0),
                          normalize(vec(1, -2, 0.5)), normalize(vec(1e-4, 1e-4, -1))}) {
        const Phase::Cosine right_angle = {Real(0), Real(1)};
        const Vec3 u = deflect(d, right_angle, Real(0)), v = deflect(d, right_angle, real(0.25));
        for (const Vec3 &a : {u, v}) {
            CHECK(std::fabs(at(dot(a, a)) - 1) < bar);
            CHECK(std::fabs(at(dot(a, d))) < bar);
        }
        CHECK(std::fabs(at(dot(u, v))) < bar);
        CHECK(worst_component(cross(u, v) - d) < 2 * bar); // right-handed
        for (double cosine : {-1.0, -0.3, 0.0, 0.999, 1.0})
            for (double turns : {0.0, 0.2, 0.5, 0.9}) {
                const Vec3 w = deflect(d, {real(cosine), real(std::sqrt(1 - cosine * cosine))}, real(turns));
                CHECK(std::fabs(at(dot(w, w)) - 1) < bar);
                CHECK(std::fabs(at(dot(w, d)) - cosine) < bar);
            }
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case A9: the direction stays a unit vector in a million scatterings, and <r^2> is exact") {
    double worst = 0;
    uint32_t scatterings = 0;
    const PathEnd ending =
        walk(InfiniteMedium{1, 0.5, 0, 0}, photon_along_z(), key_of(1),
             [&](const AnyCollision &, uint32_t, const Photon &p) {
                 worst = worst_of(worst, std::fabs(std::sqrt(at(dot(p.ray.direction, p.ray.direction))) - 1));
                 ++scatterings;
             });
    CHECK(ending == PathEnd::capped);
    CHECK(scatterings == 1000000);
    CHECK(worst < 2e-6);

    for (double c : {0.5, 0.9})
        for (double g : {-0.5, 0.0, 0.8}) {
            double sum = 0, square = 0;
            const int n = 5000;
            for (int i = 0; i < n; ++i) {
                double r2 = 0;
                walk(
                    InfiniteMedium{c, g, 0, 0}, photon_along_z(), key_of(uint64_t(i)),
                    [&](const AnyCollision &, uint32_t, const Photon &p) { r2 = at(dot(p.ray.origin, p.ray.origin)); });
                sum += r2;
                square += r2 * r2;
            }
            const double mean = sum / n, sigma = std::sqrt((square / n - mean * mean) / n);
            CAPTURE(c);
            CAPTURE(g);
            CHECK(std::fabs(mean - 2 / ((1 - c) * (1 - c * g))) < 4 * sigma);
        }
}

TEST_CASE(WISP_ARITH_NAME ": hard case A10: isotropic light has a mean direction of 0 and <dz^2> of 1/3") {
    double mean[3] = {}, square_z = 0;
    const auto add = [&](const Vec3 &d, int n) {
        mean[0] += at(d.x) / n;
        mean[1] += at(d.y) / n;
        mean[2] += at(d.z) / n;
        square_z += at(d.z) * at(d.z) / n;
    };
    const auto check = [&](int n) {
        for (double &m : mean) {
            CHECK(std::fabs(m) < 4 / std::sqrt(3.0 * n)); // 2.3e-3 for a million
            m = 0;
        }
        CHECK(std::fabs(square_z - 1.0 / 3) < 4 * std::sqrt(4.0 / 45 / n)); // 1.2e-3
        square_z = 0;
    };
    const Light light = make_light({LightKind::point, {0.5, 0, 0}, {0, 0, 1}, 2, {1, 1, 1}});
    const Sphere around = {vec(0, 0, 0), Real(2)};
    const Emitter emitter = make_emitter(light, around);
    const int n = 1000000;
    for (int i = 0; i < n; ++i) add(emit(emitter, around, photon_event(key_of(uint64_t(i)), 0)).ray.direction, n);
    check(n);
    // The same for photons that smoke emits, and for isotropic scattering about a slanted direction.
    const int fewer = 100000;
    const std::vector<Particle> one = {{{0, 0, 0}, 1, 1}};
    SmokeDescription glow = smoke_of(one);
    glow.emission = {1, 1, 1};
    const BuiltMedium built({glow});
    for (int i = 0; i < fewer; ++i)
        add(emit_from_smoke(built.medium.smokes[0], Color(Real(1)), photon_event(key_of(uint64_t(i)), 0)).ray.direction,
            fewer);
    check(fewer);
    const Vec3 axis = normalize(vec(3, -1, 2));
    for (int i = 0; i < fewer; ++i) {
        const Event event = photon_event(key_of(uint64_t(i)), 1);
        add(deflect(axis, Phase(Real(0)).sample(unit_open<Real>(draw(event, dimension_phase))),
                    unit_half_open<Real>(draw(event, dimension_azimuth))),
            fewer);
    }
    check(fewer);
}

TEST_CASE(WISP_ARITH_NAME ": hard case A11: a cosine beyond 1 has the angle 0, no sine is not a number") {
    for (double beyond : {6e-8, 1.2e-7, 1e-3}) {
        CHECK(wisp::acos(real(1 + beyond)) == Real(0));
        CHECK(at(wisp::acos(real(-1 - beyond))) == doctest::Approx(pi_).epsilon(1e-7));
    }
    CHECK(wisp::acos(real(1.0000001)) == Real(0));
    for (double g : {0.0, 1e-8, 0.5, -0.5, 0.9999, -0.9999}) {
        const Phase phase(real(g));
        for (uint32_t bits : {0u, 1u, 255u, 0x7fffffffu, 0x80000000u, 0xfffffeffu, 0xffffffffu}) {
            const Phase::Cosine c = phase.sample(unit_open<Real>(bits));
            CHECK(c.sine >= Real(0)); // false for NaN
            CHECK(c.sine <= Real(1));
        }
        CHECK(phase.sample(Real(0)).sine == Real(0));
        CHECK(phase.sample(Real(1)).sine == Real(0));
    }
    // A lamp that touches the smoke's sphere sends into half of all directions, and one next to it nearly so: the
    // cosine of the cone is at its other end.
    for (double distance : {1.0, 1 + 0x1p-23, 1 + 0x1p-31, 1.5}) {
        const Light light = make_light({LightKind::point, {0, 0, distance}, {0, 0, 1}, 2, {1, 1, 1}});
        const Sphere sphere = {vec(0, 0, 0), Real(1)};
        const Emitter emitter = make_emitter(light, sphere);
        for (uint32_t bits : {0u, 1u, 0x80000000u, 0xffffffffu}) {
            const Photon photon = emit(emitter, sphere, event_with_draw(dimension_direction_1, bits));
            CHECK(std::fabs(at(dot(photon.ray.direction, photon.ray.direction)) - 1) < 1e-6);
        }
    }
}
