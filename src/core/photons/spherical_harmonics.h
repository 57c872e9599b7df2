// Where light goes beyond its flux, by moments of its directions: real spherical harmonics of orders 2 and 3. They are
// scaled so that those of one order of two unit vectors, times each other, sum up to the Legendre polynomial of their
// cosine: none is beyond 1. Those of order 1 would be the vector itself, whose mean is the flux.
#pragma once
#include "core/smoke/phase.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t harmonic_count = 5 + 7;

// Where |g| is above, the first order that is not kept weighs more than even light, (2 l + 1) g^l > 1 for l = 4: of
// such smoke the flux says more than a series that ends there.
constexpr double max_asymmetry_of_harmonics = 0.577;
inline bool takes_harmonics(Real asymmetry) {
    constexpr Real most = Real(max_asymmetry_of_harmonics);
    return asymmetry != Real(0) && !(abs(asymmetry) > most);
}

struct SphericalHarmonics {
    Real of[harmonic_count];
};
inline SphericalHarmonics harmonics_of(const Vec3 &d) {
    const Real x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z, across = xx - yy, both = x * y;
    const Real five = Real(5) * zz - Real(1);
    return {{// 2: sqrt(3), sqrt(3) / 2
             Real(1.7320508075688772) * both, Real(1.7320508075688772) * y * z, Real(0.5) * (Real(3) * zz - Real(1)),
             Real(1.7320508075688772) * x * z, Real(0.8660254037844386) * across,
             // 3: sqrt(5/8), sqrt(15), sqrt(3/8), sqrt(15) / 2
             Real(0.7905694150420949) * y * (Real(3) * xx - yy), Real(3.872983346207417) * both * z,
             Real(0.6123724356957945) * y * five, Real(0.5) * z * (Real(5) * zz - Real(3)),
             Real(0.6123724356957945) * x * five, Real(1.9364916731037085) * z * across,
             Real(0.7905694150420949) * x * (xx - Real(3) * yy)}};
}

// Henyey and Greenstein's function scales the moments of order l by g^l. Times light's moments these sum up to what
// orders 2 and 3 of it send towards `out`, in parts of even light.
inline SphericalHarmonics seen_harmonics(const Phase &phase, const Vec3 &out) {
    SphericalHarmonics seen = harmonics_of(out);
    const Real g = phase.asymmetry(), second = Real(5) * g * g, third = Real(7) * g * g * g;
    for (uint32_t i = 0; i < harmonic_count; ++i) seen.of[i] *= i < 5 ? second : third;
    return seen;
}

// What `phase_of_flux` takes them for, instead.
inline Real henyey_greenstein_closure(const Phase &phase, const Vec3 &flux, const Vec3 &out) {
    const Vec3 scattered = flux * phase.asymmetry();
    const Real along = dot(scattered, out), square = dot(scattered, scattered);
    return Real(2.5) * (Real(3) * along * along - square) +
           Real(3.5) * along * (Real(5) * along * along - Real(3) * square);
}

} // namespace wisp::WISP_ARITH
