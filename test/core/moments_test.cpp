// Moments of light, and how it scatters by them.
#include "built_smoke.h"
#include "wisp/moments.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

double legendre(int l, double x) {
    return l == 0 ? 1 : l == 1 ? x : ((2 * l - 1) * x * legendre(l - 1, x) - (l - 1) * legendre(l - 2, x)) / l;
}

Vec3 direction(Sequence &next) { return normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375)); }

const double rounding = (std::is_same_v<Real, Fixed> ? 1000 : 40) * unit_error;

// Light of beams with a width: Henyey and Greenstein's about each, which scattered is again so, with the product of
// both.
struct Beams {
    double share[3], width;
    Vec3 way[3];
};
double exactly(const Beams &light, double g, const Vec3 &out) {
    double p = 0;
    for (int i = 0; i < 3; ++i) p += light.share[i] * at(Phase(real(g * light.width))(light.way[i], out));
    return p;
}
Moments moments_of_beams(const Beams &light) {
    double sum[moment_count] = {};
    for (int i = 0; i < 3; ++i) {
        const Moments m = moments_of(light.way[i]);
        for (int l = 1, k = 0; l <= moment_order; ++l)
            for (int n = 0; n < 2 * l + 1; ++n, ++k) sum[k] += light.share[i] * std::pow(light.width, l) * at(m.of[k]);
    }
    Moments moments;
    for (uint32_t k = 0; k < moment_count; ++k) moments.of[k] = real(sum[k]);
    return moments;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": moments of one order of two directions make up Legendre's polynomial of their cosine") {
    Sequence next{3};
    for (int i = 0; i < 200; ++i) {
        const Vec3 a = direction(next), b = direction(next);
        const Moments of_a = moments_of(a), of_b = moments_of(b);
        for (int l = 1, k = 0; l <= moment_order; ++l) {
            double sum = 0;
            for (int m = 0; m < 2 * l + 1; ++m, ++k) {
                sum += at(of_a.of[k]) * at(of_b.of[k]);
                CHECK(std::fabs(at(of_a.of[k])) <= 1 + rounding);
            }
            CHECK(std::fabs(sum - legendre(l, at(dot(a, b)))) < rounding);
        }
        CHECK((flux_of(of_a).x == a.x && flux_of(of_a).y == a.y && flux_of(of_a).z == a.z));
    }
}

TEST_CASE(WISP_ARITH_NAME ": light from several sides scatters as each of its beams does") {
    Sequence next{9};
    for (double g : {0.5, -0.5, 0.9}) {
        const double width = g > 0.5 ? 0.5 : 0.7;
        double squares = 0, of_flux = 0;
        for (int i = 0; i < 500; ++i) {
            Beams light = {{0.5, 0.3, 0.2}, width, {direction(next), direction(next), direction(next)}};
            const Moments moments = moments_of_beams(light);
            const Vec3 out = direction(next);
            const double exact = 4 * 3.14159265358979 * exactly(light, g, out);
            const double found =
                4 * 3.14159265358979 * at(phase_of_moments(Phase(real(g)), moments, out, moments_of(out)));
            const double by_flux = 4 * 3.14159265358979 * at(phase_of_flux(Phase(real(g)), flux_of(moments), out));
            CHECK(found >= 0);
            squares += (found - exact) * (found - exact) / 500;
            of_flux += (by_flux - exact) * (by_flux - exact) / 500;
        }
        CAPTURE(g);
        CAPTURE(std::sqrt(squares));
        CAPTURE(std::sqrt(of_flux));
        double beyond = 0; // what orders above 4 are of a single beam, root mean square
        for (int l = moment_order + 1; l < 40; ++l) beyond += (2 * l + 1) * std::pow(g * width, 2 * l);
        CHECK(squares < beyond);
        CHECK(std::sqrt(of_flux) > 5 * std::sqrt(squares));
    }
}

TEST_CASE(WISP_ARITH_NAME ": one beam and even light scatter exactly, whatever the phase function") {
    Sequence next{5};
    for (double g : {0.0, 0.3, -0.5, 0.9, -0.9})
        for (int i = 0; i < 50; ++i) {
            const Vec3 way = direction(next), out = direction(next);
            const Beams one = {{1, 0, 0}, next(), {way, way, way}};
            const double exact = exactly(one, g, out);
            const double most = (1 + std::fabs(g)) / ((1 - std::fabs(g)) * (1 - std::fabs(g)));
            CHECK(std::fabs(at(phase_of_moments(Phase(real(g)), moments_of_beams(one), out, moments_of(out))) - exact) <
                  rounding * most * most);
            CHECK(at(phase_of_moments(Phase(real(g)), Moments{}, out, moments_of(out))) ==
                  doctest::Approx(0.0795774715).epsilon(1e-6));
        }
}
