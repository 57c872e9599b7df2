// Henyey and Greenstein over the whole range of g: the bounds are those of N-E1.
#include "core/smoke/phase.h"
#include "support/worst.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

double at(Real x) { return to_double(x); }
Real real(double x) { return to_real<Real>(x); }

uint32_t lcg(uint32_t &state) { return state = state * 1664525u + 1013904223u; }

// The inverse as printed (S2) in long double, or the same without a division by g where that loses digits (N-E1).
long double exact_cosine(long double g, long double xi) {
    const long double s = 2 * xi - 1;
    if (std::fabs(g) < 0.5L)
        return (s + g * (3 + s * s) / 2 + g * g * s + g * g * g * (s * s - 1) / 2) / ((1 + g * s) * (1 + g * s));
    const long double t = (1 - g * g) / (1 - g + 2 * g * xi);
    return (1 + g * g - t * t) / (2 * g);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": sampled cosines are as exact as the table for every g") {
    // The largest errors measured for each g, doubled because g itself is rounded. Fixed resolves 2^-32 = 2.3e-10.
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
            worst = worst_of(worst, double(std::fabs(at(c.cosine) - exact_cosine(at(g_real), at(xi)))));
        }
        // Fixed resolves 1 - |g| to 2^-32, and the sample moves with it.
        const double fixed_loss = std::is_same_v<Real, Fixed> ? 1.2e-9 / (1 - std::fabs(g)) : 0;
        CAPTURE(g);
        CHECK(worst <= bar + fixed_loss);
    }
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
