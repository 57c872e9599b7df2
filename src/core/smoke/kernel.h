// The two SPH kernels (S3) and their closed line integrals (numerics L), as functions of normalised lengths.
//
// A particle's density is C h^-3 f(q^2), q = r / h, with the constants C below; h^9 is never formed. For poly6 the
// kernel's own h is its support, so the same support 2 H is written h = H for the spline and h = 2 H for poly6.
// Line integrals: a line passes a particle at distance b; t is measured along it from the closest approach; both in h.
#pragma once
#include "core/numbers/increasing_root.h"
#include <type_traits>

namespace wisp::WISP_ARITH {

// Desbrun
struct Spline {
    static constexpr Real constant = Real(15 / (64 * 3.14159265358979323846)); // 15 / (pi (4h)^3) = C h^-3
    static constexpr Real support = Real(2);
    static constexpr Real support_squared = Real(4);
    static constexpr Real line_maximum = Real(8); // the whole line through the middle
    static constexpr double variance = 2.0 / 7;   // int x^2 W, along one axis

    // (2 - q)^3 where q < 2, else 0. Never negative: rounding may give q = 2 for q^2 < 4, hence the maximum (C7).
    static Real value(Real q_squared) {
        const Real u = max(Real(0), Real(2) - sqrt(q_squared));
        return q_squared < support_squared ? u * u * u : Real(0);
    }

    // int_0^t (2 - q)^3 dt', odd in t; 0 <= b < 2, |t| <= sqrt(4 - b^2). (numerics L, F)
    static Real line(Real b_squared, Real t) {
        const Real b2 = max(b_squared, axis_squared), b = sqrt(b2);
        const Real q2 = b2 + t * t, q = sqrt(q2), u = abs(t);
        const Real polynomial =
            u * (Real(8) - Real(6) * q + Real(6) * b2 + Real(2) * (t * t) - q * (Real(0.25) * q2 + Real(0.375) * b2));
        const Real asinh = log_positive((u + q) / b); // asinh(u / b)
        const Real integral = polynomial - b2 * (Real(6) + Real(0.375) * b2) * asinh;
        return t < Real(0) ? -integral : integral;
    }

    // The whole chord, 2 line(b, sqrt(4 - b^2)); 0 <= b^2. No branches, so that a leaf is one vector loop.
    // (numerics L, K)
    static Real chord(Real b_squared) {
        const Real b2 = min(max(b_squared, axis_squared), support_squared), half = sqrt(support_squared - b2);
        const Real k = half * (Real(4) + Real(6.5) * b2) -
                       b2 * (Real(12) + Real(0.75) * b2) * log_positive((Real(2) + half) / sqrt(b2));
        return max(Real(0), k); // beyond the support the logarithm is that of 1: 0
    }

    // The radius within which a share xi in [0, 1] of the kernel's volume integral lies.
    static Real radius_of_share(Real xi) {
        return increasing_root(Real(0), Real(2), [xi](Real q, Real &slope) {
            const Real u = Real(2) - q, q2 = q * q;
            slope = Real(15.0 / 16) * q2 * (u * u * u);
            return Real(15.0 / 16) * q2 * q * (Real(8.0 / 3) - q * (Real(3) - q * (Real(1.2) - q * Real(1.0 / 6)))) -
                   xi;
        });
    }

  private:
    // Nearer to the axis than this, b^2 asinh(t / b) is below the resolution, and its quotient must not overflow.
    static constexpr Real axis_squared = std::is_same_v<Real, double> ? Real(0x1p-80) : Real(0x1p-32);
};

// Mueller
struct Poly6 {
    static constexpr Real constant = Real(315 / (64 * 3.14159265358979323846)); // 315 / (64 pi h^9) h^6 = C h^-3
    static constexpr Real support = Real(1);
    static constexpr Real support_squared = Real(1);
    static constexpr Real line_maximum = Real(32.0 / 35);
    static constexpr double variance = 1.0 / 11;

    // (1 - q^2)^3 where q < 1, else 0.
    static Real value(Real q_squared) {
        const Real u = max(Real(0), Real(1) - q_squared);
        return u * u * u;
    }

    // int_0^t (1 - b^2 - t'^2)^3 dt', odd in t; |t| <= sqrt(1 - b^2). (numerics L, G)
    static Real line(Real b_squared, Real t) {
        const Real c = Real(1) - b_squared, u = t * t;
        return t * (c * c * c - u * (c * c - u * (Real(0.6) * c - u * Real(1.0 / 7))));
    }

    // The whole chord: 32/35 (1 - b^2)^(7/2).
    static Real chord(Real b_squared) {
        const Real c = max(Real(0), Real(1) - b_squared);
        return line_maximum * (c * c * c) * sqrt(c);
    }

    static Real radius_of_share(Real xi) {
        return increasing_root(Real(0), Real(1), [xi](Real q, Real &slope) {
            const Real q2 = q * q, u = Real(1) - q2;
            slope = Real(315.0 / 16) * q2 * (u * u * u);
            return Real(315.0 / 16) * q2 * q *
                       (Real(1.0 / 3) - q2 * (Real(0.6) - q2 * (Real(3.0 / 7) - q2 * Real(1.0 / 9)))) -
                   xi;
        });
    }
};

// An upper bound of a kernel's chord(b^2) that costs no root and no logarithm: its maximum times (1 - b^2 /
// support^2)^3.
template <class Kernel> Real chord_bound(Real b_squared) {
    constexpr Real inverse = Kernel::support == Real(1) ? Real(1) : Real(0.25);
    const Real u = max(Real(0), Real(1) - b_squared * inverse);
    return Kernel::line_maximum * (u * u * u);
}

} // namespace wisp::WISP_ARITH
