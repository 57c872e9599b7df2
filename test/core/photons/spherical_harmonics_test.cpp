// Spherical harmonics of light, and scattering with them.
#include "core/photons/spherical_harmonics.h"
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

Vec3 direction(Sequence &next) { return normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375)); }

// Bounds the rounding of sums of products of two directions' harmonics: some five operations on numbers below 4 make a
// harmonic, and an error of a direction's length changes order l by l times as much.
double rounding(const Vec3 &a, const Vec3 &b) {
    return 100 * unit_error + 8 * (std::fabs(at(dot(a, a)) - 1) + std::fabs(at(dot(b, b)) - 1));
}

// Light of three beams, each a Henyey-Greenstein lobe of asymmetry `width`. Scattered with g, each is again such a
// lobe, of asymmetry g * width. Scattered light is relative to isotropic light.
struct Beams {
    double fraction[3], width;
    Vec3 axis[3];

    Vec3 flux() const {
        Vec3 sum(Real(0));
        for (int i = 0; i < 3; ++i) sum += axis[i] * real(fraction[i] * width);
        return sum;
    }
    double scattered(double g, const Vec3 &out) const {
        double p = 0;
        for (int i = 0; i < 3; ++i) p += fraction[i] * at(Phase(real(g * width))(axis[i], out));
        return 4 * 3.14159265358979 * p;
    }
    double orders_2_and_3(double g, const Vec3 &out) const {
        const SphericalHarmonics seen = phase_harmonics(Phase(real(g)), out);
        double sum = 0;
        for (int i = 0; i < 3; ++i) {
            const SphericalHarmonics m = harmonics_of(axis[i]);
            for (uint32_t k = 0; k < harmonic_count; ++k)
                sum += fraction[i] * std::pow(width, k < 5 ? 2 : 3) * at(m.value[k]) * at(seen.value[k]);
        }
        return sum;
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME
          ": harmonics of one order of two directions sum up to the Legendre polynomial of their cosine") {
    Sequence next{3};
    for (int i = 0; i < 200; ++i) {
        const Vec3 a = direction(next), b = direction(next);
        const SphericalHarmonics of_a = harmonics_of(a), of_b = harmonics_of(b);
        double second = 0, third = 0;
        for (uint32_t k = 0; k < harmonic_count; ++k) {
            (k < 5 ? second : third) += at(of_a.value[k]) * at(of_b.value[k]);
            CHECK(std::fabs(at(of_a.value[k])) <= 1 + rounding(a, b));
        }
        const double c = at(dot(a, b));
        CHECK(std::fabs(second - (1.5 * c * c - 0.5)) < rounding(a, b));
        CHECK(std::fabs(third - (2.5 * c * c - 1.5) * c) < rounding(a, b));
    }
}

TEST_CASE(WISP_ARITH_NAME ": light from several sides scatters as each of its beams does") {
    Sequence next{9};
    for (double g : {0.55, -0.55, 0.3}) {
        double squares = 0, of_flux = 0, beyond = 0;
        const double width = 0.8;
        for (int i = 0; i < 500; ++i) {
            const Beams light = {{0.5, 0.3, 0.2}, width, {direction(next), direction(next), direction(next)}};
            const Vec3 out = direction(next);
            const Phase phase(real(g));
            const double exact = light.scattered(g, out);
            const double by_flux = 4 * 3.14159265358979 * at(phase_of_flux(phase, light.flux(), out));
            const double found = at(phase_of_moments(phase, light.flux(), real(light.orders_2_and_3(g, out)), out));
            squares += (found - exact) * (found - exact) / 500;
            of_flux += (by_flux - exact) * (by_flux - exact) / 500;
        }
        for (int l = 4; l < 40; ++l) beyond += (2 * l + 1) * std::pow(g * width, 2 * l); // of one beam, mean square
        CAPTURE(g);
        CHECK(squares < beyond);
        CHECK(std::sqrt(of_flux) > 3 * std::sqrt(squares));
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": of one beam, and of isotropic light, the flux alone is right, whatever the phase function") {
    Sequence next{5};
    for (double g : {0.3, -0.5, 0.577, -0.577})
        for (int i = 0; i < 50; ++i) {
            const Vec3 axis = direction(next), out = direction(next);
            const Beams one = {{1, 0, 0}, next(), {axis, axis, axis}};
            const Phase phase(real(g));
            CHECK(std::fabs(one.orders_2_and_3(g, out) - at(henyey_greenstein_closure(phase, one.flux(), out))) <
                  4 * rounding(axis, out)); // weights below 2, of both
            CHECK(at(henyey_greenstein_closure(phase, Vec3(Real(0)), out)) == 0);
        }
}
