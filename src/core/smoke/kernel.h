// The two SPH kernels (S3) and their line integrals in closed form (N-L), as functions of lengths in units of h.
//
// A kernel is W = C h^-3 f(q^2) with q = r / h and `constant` = C; h^9 is never formed. The h of poly6 is its support,
// so that a particle of smoothing length H and support 2 H has h = H with the spline, and h = 2 H with poly6.
// Line integrals: b is the distance of the line from the particle, t the position along the line measured from the
// point of closest approach. Both are in units of h.
#pragma once
#include "core/numbers/increasing_root.h"
#include "wisp/scene.h"
#include <type_traits>

namespace wisp::WISP_ARITH {

// The cubic spline of Desbrun and Gascuel (1996).
struct Spline {
    static constexpr Real constant = Real(15 / (64 * 3.14159265358979323846)); // 15 / (pi (4h)^3) = C h^-3
    static constexpr Real support = Real(2);
    static constexpr Real support_squared = Real(4);
    static constexpr Real line_maximum = Real(8);              // chord(0): the line through the centre
    static constexpr double variance = 2.0 / 7;                // the integral of x^2 W, x along one axis, in h^2
    static constexpr Real widening = Real(1 / (6 * variance)); // (h / h')^2 = 1 - widening (cell / h)^2 (S4-1)

    // (2 - q)^3 where q < 2, else 0; never negative. Rounding may give q = 2 for q^2 < 4, and the value is then 0 (hard
    // case C7).
    static Real value(Real q_squared) {
        const Real u = max(Real(0), Real(2) - sqrt(q_squared));
        return q_squared < support_squared ? u * u * u : Real(0);
    }

    // F(b, t) of N-L: the integral of (2 - q)^3 from 0 to t; odd in t. 0 <= b < 2, |t| <= sqrt(4 - b^2).
    static Real line(Real b_squared, Real t) {
        const Real b2 = max(b_squared, axis_squared), b = sqrt(b2);
        const Real q2 = b2 + t * t, q = sqrt(q2), u = abs(t);
        const Real polynomial =
            u * (Real(8) - Real(6) * q + Real(6) * b2 + Real(2) * (t * t) - q * (Real(0.25) * q2 + Real(0.375) * b2));
        const Real asinh = log_positive((u + q) / b); // asinh(u / b)
        const Real integral = polynomial - b2 * (Real(6) + Real(0.375) * b2) * asinh;
        return t < Real(0) ? -integral : integral;
    }

    // K(b) of N-L: the integral over the whole chord, 2 F(b, sqrt(4 - b^2)); 0 <= b^2. It has no branches, so that
    // eight particles are one vector loop.
    static Real chord(Real b_squared) {
        const Real b2 = min(max(b_squared, axis_squared), support_squared), half = sqrt(support_squared - b2);
        const Real k = half * (Real(4) + Real(6.5) * b2) -
                       b2 * (Real(12) + Real(0.75) * b2) * log_positive((Real(2) + half) / sqrt(b2));
        return max(Real(0), k); // beyond the support k is 0: half is 0 and the logarithm is that of 1
    }

    // The radius of the ball that holds a fraction xi in [0, 1] of the kernel's volume integral.
    static Real radius_of_fraction(Real xi) {
        return increasing_root(Real(0), Real(2), [xi](Real q, Real &slope) {
            const Real u = Real(2) - q, q2 = q * q;
            slope = Real(15.0 / 16) * q2 * (u * u * u);
            return Real(15.0 / 16) * q2 * q * (Real(8.0 / 3) - q * (Real(3) - q * (Real(1.2) - q * Real(1.0 / 6)))) -
                   xi;
        });
    }

  private:
    // The smallest b^2 in the logarithms. For smaller b, b^2 asinh(t / b) is below the resolution, and the quotient t /
    // b could overflow.
    static constexpr Real axis_squared = std::is_same_v<Real, double> ? Real(0x1p-80) : Real(0x1p-32);
};

// The polynomial kernel of Mueller, Charypar and Gross (2003).
struct Poly6 {
    static constexpr Real constant = Real(315 / (64 * 3.14159265358979323846)); // 315 / (64 pi h^9) h^6 = C h^-3
    static constexpr Real support = Real(1);
    static constexpr Real support_squared = Real(1);
    static constexpr Real line_maximum = Real(32.0 / 35);
    static constexpr double variance = 1.0 / 11;
    static constexpr Real widening = Real(1 / (6 * variance));

    // (1 - q^2)^3 where q < 1, else 0.
    static Real value(Real q_squared) {
        const Real u = max(Real(0), Real(1) - q_squared);
        return u * u * u;
    }

    // G(b, t) of N-L: the integral of (1 - q^2)^3 from 0 to t; odd in t. |t| <= sqrt(1 - b^2).
    static Real line(Real b_squared, Real t) {
        const Real c = Real(1) - b_squared, u = t * t;
        return t * (c * c * c - u * (c * c - u * (Real(0.6) * c - u * Real(1.0 / 7))));
    }

    // The integral over the whole chord: 32/35 (1 - b^2)^(7/2).
    static Real chord(Real b_squared) {
        const Real c = max(Real(0), Real(1) - b_squared);
        return line_maximum * (c * c * c) * sqrt(c);
    }

    // As Spline::radius_of_fraction.
    static Real radius_of_fraction(Real xi) {
        return increasing_root(Real(0), Real(1), [xi](Real q, Real &slope) {
            const Real q2 = q * q, u = Real(1) - q2;
            slope = Real(315.0 / 16) * q2 * (u * u * u);
            return Real(315.0 / 16) * q2 * q *
                       (Real(1.0 / 3) - q2 * (Real(0.6) - q2 * (Real(3.0 / 7) - q2 * Real(1.0 / 9)))) -
                   xi;
        });
    }
};

// An upper bound of chord(b^2) without root or logarithm: line_maximum (1 - b^2 / support^2)^3.
template <class K> Real chord_bound(const K &kernel, Real b_squared) {
    const Real inverse = kernel.support == Real(1) ? Real(1) : Real(0.25);
    const Real u = max(Real(0), Real(1) - b_squared * inverse);
    return kernel.line_maximum * (u * u * u);
}

// Either kernel, which is asked at every use. Where code is to be small, it is compiled for this one only.
struct AnyKernel {
    bool is_spline;
    Real constant = is_spline ? Spline::constant : Poly6::constant;
    Real support = is_spline ? Spline::support : Poly6::support;
    Real support_squared = is_spline ? Spline::support_squared : Poly6::support_squared;
    Real line_maximum = is_spline ? Spline::line_maximum : Poly6::line_maximum;
    Real widening = is_spline ? Spline::widening : Poly6::widening;

    Real value(Real q_squared) const { return is_spline ? Spline::value(q_squared) : Poly6::value(q_squared); }
    Real line(Real b_squared, Real t) const {
        return is_spline ? Spline::line(b_squared, t) : Poly6::line(b_squared, t);
    }
    Real chord(Real b_squared) const { return is_spline ? Spline::chord(b_squared) : Poly6::chord(b_squared); }
    Real radius_of_fraction(Real xi) const {
        return is_spline ? Spline::radius_of_fraction(xi) : Poly6::radius_of_fraction(xi);
    }
};

// What use(the kernel) returns.
template <class Use> WISP_INLINE auto with_kernel(Kernel kernel, Use &&use) {
#ifdef __OPTIMIZE_SIZE__
    return use(AnyKernel{kernel == Kernel::spline});
#else
    return kernel == Kernel::spline ? use(Spline()) : use(Poly6());
#endif
}

} // namespace wisp::WISP_ARITH
