// Where light goes, by moments of its directions: real spherical harmonics of orders 1 to 4. They are scaled so that
// those of one order of two unit vectors, times each other, sum up to the Legendre polynomial of their cosine: none is
// beyond 1, and those of order 1 are the vector itself.
#pragma once
#include "wisp/phase.h"

namespace wisp::WISP_ARITH {

constexpr int32_t moment_order = 4;
constexpr uint32_t moment_count = (moment_order + 1) * (moment_order + 1) - 1;

struct Moments {
    Real of[moment_count]; // by order; the first three are the flux
};
inline Vec3 flux_of(const Moments &m) { return Vec3(m.of[0], m.of[1], m.of[2]); }

inline Moments moments_of(const Vec3 &d) {
    const Real x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z, across = xx - yy, both = x * y;
    const Real leaf_x = x * (xx - Real(3) * yy), leaf_y = y * (Real(3) * xx - yy);
    const Real five = Real(5) * zz - Real(1), seven = Real(7) * zz - Real(1), less = Real(7) * zz - Real(3);
    return {{x, y, z,
             // 2: sqrt(3), sqrt(3) / 2
             Real(1.7320508075688772) * both, Real(1.7320508075688772) * y * z, Real(0.5) * (Real(3) * zz - Real(1)),
             Real(1.7320508075688772) * x * z, Real(0.8660254037844386) * across,
             // 3: sqrt(5/8), sqrt(15), sqrt(3/8), sqrt(15) / 2
             Real(0.7905694150420949) * leaf_y, Real(3.872983346207417) * both * z, Real(0.6123724356957945) * y * five,
             Real(0.5) * z * (Real(5) * zz - Real(3)), Real(0.6123724356957945) * x * five,
             Real(1.9364916731037085) * z * across, Real(0.7905694150420949) * leaf_x,
             // 4: sqrt(35) / 2, sqrt(35/8), sqrt(5) / 2, sqrt(5/8), sqrt(5) / 4, sqrt(35) / 8
             Real(2.958039891549808) * both * across, Real(2.091650066335189) * z * leaf_y,
             Real(1.118033988749895) * both * seven, Real(0.7905694150420949) * y * z * less,
             Real(0.125) * (Real(35) * zz * zz - Real(30) * zz + Real(3)), Real(0.7905694150420949) * x * z * less,
             Real(0.5590169943749475) * across * seven, Real(2.091650066335189) * z * leaf_x,
             Real(0.739509972887452) * (across * across - Real(4) * both * both)}};
}

// p towards `out`, whose moments are `seen`, of light with these moments, relative to its power. Henyey and
// Greenstein's scales the moments of order l by g^l: those that are kept scatter exactly, those beyond as by
// `phase_of_flux`.
inline Real phase_of_moments(const Phase &phase, const Moments &light, const Vec3 &out, const Moments &seen) {
    const Vec3 flux = flux_of(light);
    const Real size = length(flux), cosine = size > Real(0) ? dot(flux / size, out) : Real(0);
    const Real g = phase.asymmetry(), of_flux = g * min(size, Real(1));
    Real sum = Real(0), before = Real(1), legendre = cosine, known_part = g, flux_part = of_flux;
    uint32_t next = 3;
    for (int32_t l = 2; l <= moment_order; ++l) {
        const Real later = (Real(2 * l - 1) * cosine * legendre - Real(l - 1) * before) / Real(l);
        before = legendre;
        legendre = later;
        known_part *= g;
        flux_part *= of_flux;
        Real known = Real(0);
        for (int32_t m = 0; m < 2 * l + 1; ++m, ++next) known += light.of[next] * seen.of[next];
        sum += Real(2 * l + 1) * (known_part * known - flux_part * legendre);
    }
    return max(Real(0), phase_of_flux(phase, flux, out) + inv_four_pi<Real> * sum);
}

} // namespace wisp::WISP_ARITH
