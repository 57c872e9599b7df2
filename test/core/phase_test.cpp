// Henyey and Greenstein over the whole range of g: the bars are the table of numerics E1 (hard cases A3 to A8, A11).
#include "wisp/phase.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

double at(Real x) { return to_double(x); }
Real real(double x) { return to_real<Real>(x); }

uint32_t lcg(uint32_t &state) { return state = state * 1664525u + 1013904223u; }

// The printed inverse in long double, or the same without a division by g where that loses digits (numerics E1).
long double exact_cosine(long double g, long double xi) {
    const long double s = 2 * xi - 1;
    if (std::fabs(g) < 0.5L)
        return (s + g * (3 + s * s) / 2 + g * g * s + g * g * g * (s * s - 1) / 2) / ((1 + g * s) * (1 + g * s));
    const long double t = (1 - g * g) / (1 - g + 2 * g * xi);
    return (1 + g * g - t * t) / (2 * g);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": sampled cosines are as exact as the table for every g") {
    // Column "stable" of the table, doubled for g itself being rounded; fixed resolves 2^-32 = 2.3e-10.
    const double bar = std::is_same_v<Real, double> ? 1e-15 : std::is_same_v<Real, float> ? 4e-7 : 6e-9;
    uint32_t state = 1;
    for (double g : {1e-12, 1e-8, 1e-6, 1e-4, 0.1, -0.1, 0.5, 0.9, -0.9, 0.99, 0.999, -0.999, 0.9999, -0.9999}) {
        const Real g_real = real(g);
        const Phase phase(g_real);
        double worst = 0;
        for (int i = 0; i < 502; ++i) {
            const Real xi = i == 500 ? Real(0) : i == 501 ? Real(1) : unit_half_open<Real>(lcg(state));
            const Phase::Cosine c = phase.sample(xi);
            CHECK(c.cosine >= Real(-1));
            CHECK(c.cosine <= Real(1));
            CHECK(c.sine >= Real(0));
            CHECK(c.sine <= Real(1));
            worst = std::max(worst, double(std::fabs(at(c.cosine) - exact_cosine(at(g_real), at(xi)))));
        }
        // Fixed resolves 1 - |g| to 2^-32, and the sample moves with it.
        const double fixed_loss = std::is_same_v<Real, Fixed> ? 1.2e-9 / (1 - std::fabs(g)) : 0;
        CAPTURE(g);
        CHECK(worst <= bar + fixed_loss);
    }
}

TEST_CASE(WISP_ARITH_NAME ": without anisotropy the cosine is 2 xi - 1 to the bit") {
    uint32_t state = 7;
    const Phase phase(Real(0));
    CHECK(phase.isotropic());
    for (int i = 0; i < 1000; ++i) {
        const Real xi = unit_half_open<Real>(lcg(state));
        CHECK(phase.sample(xi).cosine == Real(2) * xi - Real(1));
    }
    CHECK(at(phase(Vec3(Real(0), Real(0), Real(1)), Vec3(Real(1), Real(0), Real(0)))) ==
          doctest::Approx(0.0795774715459477));
}

TEST_CASE(WISP_ARITH_NAME ": the density of the phase function integrates to one and has mean cosine g") {
    for (double g : {-0.9, -0.5, 0.0, 0.3, 0.9}) {
        const Phase phase(real(g));
        const Vec3 in(Real(0), Real(0), Real(1));
        double sum = 0, mean = 0;
        const int n = 20000;
        for (int i = 0; i < n; ++i) {
            const double c = -1 + 2 * (i + 0.5) / n;
            const Vec3 out(real(std::sqrt(1 - c * c)), Real(0), real(c));
            const double p = at(phase(in, out)) * 2 * 3.14159265358979323846 * 2 / n;
            sum += p;
            mean += p * c;
        }
        CAPTURE(g);
        CHECK(sum == doctest::Approx(1).epsilon(1e-4));
        CHECK(mean == doctest::Approx(g).epsilon(1e-3));
    }
}

TEST_CASE(WISP_ARITH_NAME ": the forward peak is finite") { // A7
    const Phase phase(real(0.9999));
    const Vec3 d(Real(0), Real(1), Real(0));
    const double a = 1 - at(real(0.9999)); // g as rounded
    // In fixed (1 - g)^2 = 1e-8 has 43 units of resolution.
    const double bar = std::is_same_v<Real, Fixed> ? 0.05 : 1e-3;
    CHECK(at(phase(d, d)) == doctest::Approx((2 - a) / (4 * 3.14159265358979 * a * a)).epsilon(bar));
}

TEST_CASE(WISP_ARITH_NAME ": deflection turns by the angle asked for, about any direction") { // A8
    const double bar = std::is_same_v<Real, float> ? 1e-6 : 2e-9;
    for (const Vec3 &d : {Vec3(Real(0), Real(0), Real(1)), Vec3(Real(0), Real(0), Real(-1)),
                          Vec3(Real(1), Real(0), Real(0)), Vec3(real(1e-20), Real(0), Real(-1)),
                          Vec3(Real(0), -Real(0), Real(-1)), normalize(Vec3(Real(1), Real(-2), Real(0.5)))})
        for (double cosine : {-1.0, -0.3, 0.0, 0.999, 1.0})
            for (double turns : {0.0, 0.2, 0.5, 0.9}) {
                const Vec3 v = deflect(d, {real(cosine), real(std::sqrt(1 - cosine * cosine))}, real(turns));
                CHECK(std::fabs(at(dot(v, v)) - 1) < bar);
                CHECK(std::fabs(at(dot(v, d)) - cosine) < bar);
            }
}

TEST_CASE(WISP_ARITH_NAME ": isotropic directions cover the sphere evenly") { // A10
    const Phase phase(Real(0));
    const Vec3 axis = normalize(Vec3(Real(3), Real(-1), Real(2)));
    double mean[3] = {}, square_z = 0;
    const int n = 100000;
    uint32_t state = 3;
    for (int i = 0; i < n; ++i) {
        const Real xi = unit_open<Real>(lcg(state) ^ lcg(state) >> 16);
        const Vec3 v = deflect(axis, phase.sample(xi), unit_half_open<Real>(lcg(state) ^ lcg(state) >> 16));
        mean[0] += at(v.x) / n;
        mean[1] += at(v.y) / n;
        mean[2] += at(v.z) / n;
        square_z += at(v.z) * at(v.z) / n;
    }
    for (double m : mean) CHECK(std::fabs(m) < 4 / std::sqrt(3.0 * n));
    CHECK(std::fabs(square_z - 1.0 / 3) < 4 * std::sqrt(4.0 / 45 / n));
}

TEST_CASE(WISP_ARITH_NAME ": a million deflections keep the direction a unit vector") { // A9
    const Phase phase(real(0.5));
    Vec3 d(Real(0), Real(0), Real(1));
    uint32_t state = 5;
    for (int i = 0; i < 1000000; ++i) {
        const Real xi = unit_open<Real>(lcg(state));
        d = deflect(d, phase.sample(xi), unit_half_open<Real>(lcg(state)));
    }
    CHECK(std::fabs(at(dot(d, d)) - 1) < 2e-6);
}
