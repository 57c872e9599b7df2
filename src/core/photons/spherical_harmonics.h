// The angular distribution of light beyond its flux: coefficients of real spherical harmonics of orders l = 2 and 3.
// They are scaled so that, for two unit vectors, the products of the harmonics of one order sum up to the Legendre
// polynomial of the cosine between them. So no harmonic exceeds 1. The harmonics of order 1 would be the vector itself;
// its mean is the flux.
#pragma once
#include "core/photons/direction_limits.h"
#include "core/photons/packed_light.h"
#include "core/smoke/phase.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t harmonic_count = 5 + 7;
constexpr uint32_t harmonic_words = harmonic_count / 3; // packed by threes, as fluxes are
static_assert(harmonic_words * 3 == harmonic_count);

inline bool uses_harmonics(Real asymmetry) {
    constexpr Real limit = Real(max_asymmetry_of_harmonics);
    return asymmetry != Real(0) && !(abs(asymmetry) > limit);
}

struct SphericalHarmonics {
    Real value[harmonic_count]; // five of order 2, seven of order 3
};
// The harmonics of the unit vector d.
inline SphericalHarmonics harmonics_of(const Vec3 &d) {
    const Real x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z, xx_yy = xx - yy, xy = x * y;
    const Real five = Real(5) * zz - Real(1);
    return {{// order 2: sqrt(3), sqrt(3) / 2
             Real(1.7320508075688772) * xy, Real(1.7320508075688772) * y * z, Real(0.5) * (Real(3) * zz - Real(1)),
             Real(1.7320508075688772) * x * z, Real(0.8660254037844386) * xx_yy,
             // order 3: sqrt(5/8), sqrt(15), sqrt(3/8), sqrt(15) / 2
             Real(0.7905694150420949) * y * (Real(3) * xx - yy), Real(3.872983346207417) * xy * z,
             Real(0.6123724356957945) * y * five, Real(0.5) * z * (Real(5) * zz - Real(3)),
             Real(0.6123724356957945) * x * five, Real(1.9364916731037085) * z * xx_yy,
             Real(0.7905694150420949) * x * (xx - Real(3) * yy)}};
}

// The Henyey-Greenstein function multiplies the coefficients of order l by g^l. These weights, times the coefficients
// of the light and summed up, give the radiance that orders 2 and 3 add towards `out`, relative to isotropic light.
inline SphericalHarmonics phase_harmonics(const Phase &phase, const Vec3 &out) {
    SphericalHarmonics weights = harmonics_of(out);
    const Real g = phase.asymmetry(), second = Real(5) * g * g, third = Real(7) * g * g * g;
    for (uint32_t i = 0; i < harmonic_count; ++i) weights.value[i] *= i < 5 ? second : third;
    return weights;
}

// The sum of weights first to last - 1, each times its packed coefficient, in units of 1 / max_component.
WISP_INLINE Real packed_sum(const SphericalHarmonics &weights, const uint32_t *packed, uint32_t first, uint32_t last) {
    Real sum = Real(0);
    for (uint32_t i = first; i < last; ++i)
        sum += weights.value[i] * Real(flux_units(packed[i / 3], static_cast<int32_t>(i % 3)));
    return sum;
}

// The same sum as `phase_of_flux` assumes it: a Henyey-Greenstein lobe about the flux has the coefficients flux^l.
// Where the true coefficients are known, this assumption is subtracted.
inline Real henyey_greenstein_closure(const Phase &phase, const Vec3 &flux, const Vec3 &out) {
    const Vec3 scattered = flux * phase.asymmetry();
    const Real cosine = dot(scattered, out), square = dot(scattered, scattered);
    return Real(2.5) * (Real(3) * cosine * cosine - square) +
           Real(3.5) * cosine * (Real(5) * cosine * cosine - Real(3) * square);
}

// 4 pi times the mean of the phase function towards `out` over light of this flux, to which orders 2 and 3 add `more`.
WISP_INLINE Real phase_of_moments(const Phase &phase, const Vec3 &flux, Real more, const Vec3 &out) {
    const Real p = phase_of_flux(phase, flux, out) * four_pi<Real>;
    return max(Real(0), p + (more - henyey_greenstein_closure(phase, flux, out)));
}

} // namespace wisp::WISP_ARITH
