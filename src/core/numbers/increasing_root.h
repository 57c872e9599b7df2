// A root of an increasing function by Newton's method inside a bracket.
#pragma once
#include "core/numbers/real.h"

namespace wisp::WISP_ARITH {

// The root in [low, high] of an increasing function. `function(x, slope)` returns the value at x and sets the slope.
// A Newton step that would leave the bracket is replaced by bisection. If the root lies outside [low, high], the result
// is the nearer end. At most 60 evaluations.
template <class Function> Real increasing_root(Real low, Real high, Function function) {
    Real x = Real(0.5) * (low + high);
    for (int i = 0; i < 60 && low < high; ++i) {
        Real slope;
        const Real value = function(x, slope);
        if (value == Real(0)) break;
        (value < Real(0) ? low : high) = x;
        // |value| < slope * room says that the step stays inside. It needs no division: slopes may be almost 0.
        const Real room = value < Real(0) ? high - low : low - high;
        const bool newton = abs(value) < slope * abs(room);
        const Real next = newton ? x - value / slope : Real(0.5) * (low + high);
        if (next == x) break;
        x = next;
    }
    return x;
}

} // namespace wisp::WISP_ARITH
