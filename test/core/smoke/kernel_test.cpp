// The SPH kernels and their line integrals against closed forms and quadrature (S3, N-L, hard cases C2, C7).
#include "core/smoke/kernel.h"
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// The error of one evaluation: a few units in the last place of numbers near 8 (N-L). In Fixed, b^2 errs by
// 2^-33, and 6 asinh(t / b) multiplies that error.
constexpr double error = std::is_same_v<Real, double> ? 3e-14 : std::is_same_v<Real, float> ? 1.2e-5 : 3e-8;

double spline(double q) { return q < 2 ? std::pow(2 - q, 3) : 0; }
double poly6(double q) { return q < 1 ? std::pow(1 - q * q, 3) : 0; }

// Simpson's rule over f(sqrt(b^2 + t^2)) from 0 to t, in v with t = b sinh(v), where the integrand is smooth.
template <class F> double quadrature(F f, double b, double t) {
    if (b == 0) b = 1e-9;
    const int n = 20000;
    const double end = std::asinh(t / b);
    double sum = 0;
    for (int i = 0; i <= n; ++i) {
        const double q = b * std::cosh(end * i / n);
        sum += (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * f(q) * q;
    }
    return sum * end / n / 3;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": kernels integrate to one over space") {
    double spline_sum = 0, poly6_sum = 0;
    const int n = 20000;
    for (int i = 0; i < n; ++i) { // midpoint rule over shells
        const double q = 2 * (i + 0.5) / n, u = q / 2;
        spline_sum += at(Spline::constant) * at(Spline::value(real(q * q))) * 4 * pi_ * q * q * (2.0 / n);
        poly6_sum += at(Poly6::constant) * at(Poly6::value(real(u * u))) * 4 * pi_ * u * u * (1.0 / n);
    }
    CHECK(spline_sum == doctest::Approx(1).epsilon(1e-6));
    CHECK(poly6_sum == doctest::Approx(1).epsilon(1e-6));
}

TEST_CASE(WISP_ARITH_NAME ": kernels are never negative and end at their support") {
    for (int i = -2000; i <= 2000; ++i) {
        const double q2 = 4 + i * 0x1p-23;
        CHECK(Spline::value(real(q2)) >= Real(0));
        if (q2 >= 4) CHECK(Spline::value(real(q2)) == Real(0));
        CHECK(Poly6::value(real(q2 - 3)) >= Real(0));
        if (q2 >= 4) CHECK(Poly6::value(real(q2 - 3)) == Real(0));
    }
    CHECK(at(Spline::value(Real(0))) == 8);
    CHECK(at(Poly6::value(Real(0))) == 1);
}

TEST_CASE(WISP_ARITH_NAME ": whole chords have the published values") {
    CHECK(at(Spline::chord(Real(0))) == doctest::Approx(8).epsilon(error));
    CHECK(std::fabs(at(Spline::chord(Real(1))) - 1.3953202936818) < error);
    CHECK(std::fabs(at(Spline::chord(real(2.25))) - 0.143788395659) < error);
    CHECK(std::fabs(at(Spline::chord(real(1.9 * 1.9))) - 5.66068171e-4) < error + 5e-13);
    CHECK(Spline::chord(Real(4)) == Real(0));
    CHECK(Spline::chord(Real(5)) == Real(0));
    CHECK(at(Poly6::chord(Real(0))) == doctest::Approx(32.0 / 35).epsilon(error));
    CHECK(Poly6::chord(Real(1)) == Real(0));
    CHECK(Poly6::chord(Real(3)) == Real(0));
    for (int i = 0; i <= 4000; ++i) CHECK(Spline::chord(real(i * 0.001)) >= Real(0));
}

TEST_CASE(WISP_ARITH_NAME ": chords are below their bound") {
    for (int i = 0; i <= 5000; ++i) {
        const Real spline_b2 = real(i * 0.001), poly6_b2 = real(i * 0.00025);
        CHECK(at(Spline::chord(spline_b2)) <= at(chord_bound(Spline(), spline_b2)) + 2 * error);
        CHECK(at(Poly6::chord(poly6_b2)) <= at(chord_bound(Poly6(), poly6_b2)) + 2 * error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": chords over a plane add up to the whole kernel") {
    // int K(b) 2 pi b db = 64 pi / 15: the optical depth over a picture is C_ext times the mass (hard case C15).
    double spline_sum = 0, poly6_sum = 0;
    const int n = 20000;
    for (int i = 0; i < n; ++i) {
        const double b = 2 * (i + 0.5) / n, c = b / 2;
        spline_sum += at(Spline::chord(real(b * b))) * b * (2.0 / n);
        poly6_sum += at(Poly6::chord(real(c * c))) * c * (1.0 / n);
    }
    CHECK(2 * spline_sum == doctest::Approx(64.0 / 15).epsilon(2e-6));
    CHECK(2 * poly6_sum == doctest::Approx(64.0 / 315).epsilon(2e-6));
}

TEST_CASE(WISP_ARITH_NAME ": line integrals equal quadrature") {
    for (double b : {0.0, 1e-4, 0.01, 0.3, 1.0, 1.5, 1.9, 1.999}) {
        const double half = std::sqrt(4 - b * b);
        for (double fraction : {-1.0, -0.7, -0.01, 0.0, 1e-4, 0.2, 0.5, 0.99}) {
            const double t = half * fraction;
            CHECK(std::fabs(at(Spline::line(real(b * b), real(t))) - quadrature(spline, b, t)) < error + 5e-12);
        }
        const double c = b / 2, cut = std::sqrt(1 - c * c);
        for (double fraction : {-1.0, -0.3, 0.0, 0.6, 1.0})
            CHECK(std::fabs(at(Poly6::line(real(c * c), real(cut * fraction))) - quadrature(poly6, c, cut * fraction)) <
                  error + 5e-12);
        CHECK(std::fabs(at(Spline::chord(real(b * b))) - 2 * at(Spline::line(real(b * b), real(half)))) < 2 * error);
        CHECK(std::fabs(at(Poly6::chord(real(c * c))) - 2 * at(Poly6::line(real(c * c), real(cut)))) < 2 * error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": radius_of_fraction holds that fraction of the kernel's integral") {
    for (double fraction : {0.001, 0.1, 0.5, 0.9, 0.999}) {
        const double q = at(Spline::radius_of_fraction(real(fraction))),
                     u = at(Poly6::radius_of_fraction(real(fraction)));
        double spline_sum = 0, poly6_sum = 0;
        const int n = 2000;
        for (int i = 0; i < n; ++i) {
            const double r = q * (i + 0.5) / n, s = u * (i + 0.5) / n;
            spline_sum += 15 / (64 * pi_) * spline(r) * 4 * pi_ * r * r * q / n;
            poly6_sum += 315 / (64 * pi_) * poly6(s) * 4 * pi_ * s * s * u / n;
        }
        CHECK(std::fabs(spline_sum - fraction) < 3e-6);
        CHECK(std::fabs(poly6_sum - fraction) < 3e-6);
    }
    CHECK(at(Spline::radius_of_fraction(Real(0))) < 0.01);
    CHECK(at(Spline::radius_of_fraction(Real(1))) <= 2);
}

TEST_CASE(WISP_ARITH_NAME ": increasing_root brackets, and gives the nearer end without a root") {
    const auto line = [](double root) {
        return [root](Real x, Real &slope) {
            slope = Real(1);
            return x - real(root);
        };
    };
    CHECK(at(increasing_root(Real(0), Real(4), line(0.75))) == 0.75);
    CHECK(at(increasing_root(Real(0), Real(4), line(-1))) < 1e-4);
    CHECK(at(increasing_root(Real(0), Real(4), line(5))) > 4 - 1e-4);
    // A slope of 0 at the ends falls back to bisection.
    const auto cube = [](Real x, Real &slope) {
        slope = Real(3) * x * x;
        return x * x * x - real(1e-3);
    };
    CHECK(at(increasing_root(Real(-1), Real(1), cube)) == doctest::Approx(0.1).epsilon(1e-5));
}

TEST_CASE(WISP_ARITH_NAME ": a kernel that is asked at every use has the bits of its own type") {
    const auto compare = [](const auto &kernel, const AnyKernel &any) {
        CHECK(any.constant == kernel.constant);
        CHECK(any.support == kernel.support);
        CHECK(any.support_squared == kernel.support_squared);
        CHECK(any.line_maximum == kernel.line_maximum);
        CHECK(any.widening == kernel.widening);
        for (const double part : {0.0, 0.25, 0.5, 0.75, 0.99}) {
            const Real b = kernel.support_squared * real(part);
            const Real t = kernel.support * real(0.75 * std::sqrt(1 - part));
            CHECK(any.value(b) == kernel.value(b));
            CHECK(any.chord(b) == kernel.chord(b));
            CHECK(any.line(b, t) == kernel.line(b, t));
            CHECK(any.radius_of_fraction(real(part)) == kernel.radius_of_fraction(real(part)));
        }
    };
    compare(Spline(), AnyKernel{true});
    compare(Poly6(), AnyKernel{false});
    CHECK(with_kernel(Kernel::spline, [](const auto &kernel) { return kernel.support; }) == Real(2));
    CHECK(with_kernel(Kernel::poly6, [](const auto &kernel) { return kernel.support; }) == Real(1));
}
