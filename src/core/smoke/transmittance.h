// The mean transmittance of a stretch (N-E4).
#pragma once
#include "core/numbers/elementary.h"

namespace wisp::WISP_ARITH {

// (1 - e^-s) / s for s >= 0: the mean transmittance of a stretch of depth s (N-E4). 1 at 0; by its series below 2^-7,
// where the quotient would lose digits.
inline Real mean_transmittance(Real s) {
    if (s < Real(0x1p-7)) return Real(1) - s * (Real(0.5) - s * (Real(1.0 / 6) - s * Real(1.0 / 24)));
    return -expm1(-s) / s;
}

// (1 - e^-s) / s without a branch (N-E4), where `e` is e^-s.
inline Real mean_transmittance_of(Real s, Real e) {
    const Real series =
        Real(1) -
        s * (Real(0.5) - s * (Real(1.0 / 6) - s * (Real(1.0 / 24) - s * (Real(1.0 / 120) - s * Real(1.0 / 720)))));
    const Real quotient = (Real(1) - e) / max(s, Real(0.125));
    return s < Real(0.125) ? series : quotient;
}

} // namespace wisp::WISP_ARITH
