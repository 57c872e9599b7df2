// The phase function of Henyey and Greenstein (1941) in a form without cancellation, for every -1 < g < 1 (N-E1).
#pragma once
#include "core/numbers/vec.h"

namespace wisp::WISP_ARITH {

class Phase {
  public:
    explicit Phase(Real g)
        : g_(g), a_(Real(1) - g), b_(Real(1) + g), peak_(inv_four_pi<Real> * ((Real(1) - g) * (Real(1) + g))) {}

    // The same function with g times `factor`.
    Phase with_factor(Real factor) const { return Phase(g_ * factor); }

    Real asymmetry() const { return g_; }
    bool isotropic() const { return g_ == Real(0); }

    // p per steradian, for light that travels along `in` and leaves along `out` (unit vectors). The integral over `out`
    // is 1.
    Real operator()(const Vec3 &in, const Vec3 &out) const {
        if (isotropic()) return inv_four_pi<Real>;
        // 1 + g^2 - 2 g cos = (1 - |g|)^2 + 2 |g| (1 -+ cos), with 1 -+ cos = |out -+ in|^2 / 2 (N-E1)
        const Vec3 chord = g_ > Real(0) ? out - in : out + in;
        const Real one_minus_abs_g = g_ > Real(0) ? a_ : b_;
        const Real d = one_minus_abs_g * one_minus_abs_g + abs(g_) * dot(chord, chord);
        return peak_ / d / sqrt(d);
    }

    struct Cosine {
        Real cosine, sine;
    };
    // The angle between the old and the new direction, from a uniform xi in [0, 1].
    Cosine sample(Real xi) const {
        const Real e = Real(1) - xi, d = a_ * e + b_ * xi;
        const Real ratio_a = a_ / d, ratio_b = b_ / d;
        const Real one_minus = Real(2) * (ratio_a * e) * (ratio_a * (e + b_ * xi));
        const Real one_plus = Real(2) * (ratio_b * xi) * (ratio_b * (xi + a_ * e));
        const Real sine = sqrt(one_minus * one_plus);
        return {one_minus < one_plus ? Real(1) - one_minus : one_plus - Real(1), min(sine, Real(1))};
    }

  private:
    Real g_, a_, b_, peak_;
};

// The mean of p towards `out` over light of which only the flux relative to the fluence, F / phi, is known. It is
// approximated by Henyey and Greenstein's function about the direction of F, with g |F| / phi in place of g. That is
// positive, exact for isotropic light, and has the right first moment.
inline Real phase_of_flux(const Phase &phase, const Vec3 &flux, const Vec3 &out) {
    const Real anisotropy = length(flux);
    if (!(anisotropy > Real(0))) return inv_four_pi<Real>;
    return phase.with_factor(min(anisotropy, Real(1)))(flux / anisotropy, out);
}

// Unit vectors u and v at right angles to each other and to the unit vector d. This frame of Duff et al. (2017) divides
// by zero for no d (hard case A8).
inline void make_frame(const Vec3 &d, Vec3 &u, Vec3 &v) {
    const Real sign = d.z < Real(0) ? Real(-1) : Real(1);
    const Real p = Real(-1) / (sign + d.z), q = d.x * d.y * p;
    u = Vec3(Real(1) + sign * d.x * d.x * p, sign * q, -sign * d.x);
    v = Vec3(q, sign + d.y * d.y * p, -d.y);
}

// A unit vector at the given angle to the unit vector d, rotated about d by `turns` in [0, 1) of a full turn.
inline Vec3 deflect(const Vec3 &d, Phase::Cosine angle, Real turns) {
    Vec3 u, v;
    make_frame(d, u, v);
    Real sine, cosine;
    sincos_turns(turns, sine, cosine);
    return normalize(u * (angle.sine * cosine) + v * (angle.sine * sine) + d * angle.cosine);
}

} // namespace wisp::WISP_ARITH
