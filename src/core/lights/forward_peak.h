// The forward peak of a phase function, taken off for light that is scattered to one eye (README, Forward peak).
#pragma once
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

// A phase function with 0 < g as the sum of two parts. The narrow part is what it scatters by less than an angle A
// above p(A): light that it scatters counts as going straight on. The wide part is the rest, at most p(A). It says
// exactly what is scattered by more than A.
struct ForwardPeak {
    Phase phase;
    Real largest; // of the wide part, per steradian
    Real narrow;  // the integral of the narrow part over all directions: 0 to 1

    // All of it is wide. g may be any.
    explicit ForwardPeak(const Phase &of);
    // `away`: 1 - cos A, above 0.
    ForwardPeak(const Phase &of, Real away);
    // Per steradian.
    Real wide(const Vec3 &in, const Vec3 &out) const { return min(phase(in, out), largest); }
};

// The forward peak of all resampled smoke, which has one phase function. A is about a third of the angle by which a
// light must be scattered to reach the eye from the middle of the smoke: the least of all lights that give that at
// least 1/8 of the light there; at least 5 degrees or the peak's width, 1 - g, and at most 30 degrees. Of a light in
// the smoke the angle is 0, as it shines from all sides, and of a spot there that of its cone's nearest edge.
ForwardPeak forward_peak(const Medium &medium, const Light *lights, uint32_t count, const Vec3 &eye);

} // namespace wisp::WISP_ARITH
