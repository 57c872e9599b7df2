#include "core/lights/forward_peak.h"

namespace wisp::WISP_ARITH {

ForwardPeak::ForwardPeak(const Phase &of) : phase(of), narrow(0) {
    const Vec3 straight(Real(1), Real(0), Real(0));
    largest = max(phase(straight, straight), phase(straight, -straight));
}

// |1 - g e^(i A)| = distance: p(A) = (1 - g^2) / (4 pi distance^3), and the integral of p over larger angles is
// (1 - g^2) / (2 g) (1 / distance - 1 / (1 + g)).
ForwardPeak::ForwardPeak(const Phase &of, Real away) : phase(of) {
    const Real g = of.asymmetry(), a = Real(1) - g, b = Real(1) + g;
    const Real distance = sqrt(a * a + Real(2) * g * away);
    largest = inv_four_pi<Real> * (a * b) / (distance * distance * distance);
    const Real outside = a * (b - distance) / (Real(2) * g * distance);
    narrow = max(Real(0), Real(1) - outside - Real(0.5) * four_pi<Real> * away * largest);
}

ForwardPeak forward_peak(const Medium &medium, const Light *lights, uint32_t count, const Vec3 &eye) {
    constexpr Real most = Real(0.1339746); // 1 - cos 30 degrees
    const Phase phase = common_phase(medium);
    const Real width = Real(1) - phase.asymmetry(); // of the peak in radians: it falls to 0.35 to 0.5 there
    const Real least = min(Real(0.0038053), Real(0.5) * width * width); // 1 - cos 5 degrees, 1 - cos(width) about
    const Vec3 &middle = medium.sphere.center;
    const Vec3 to_eye = direction_between(middle, eye);
    const auto light_there = [&](uint32_t i) { return illuminate(lights[i], middle, middle, middle); };
    Real all = Real(0), away = most;
    for (uint32_t i = 0; i < count; ++i) all += largest(light_there(i).irradiance);
    for (uint32_t i = 0; i < count; ++i) {
        const bool inside =
            lights[i].kind != LightKind::parallel &&
            length(lights[i].position - middle) < medium.sphere.radius; // its light comes from all sides
        const Illumination from = light_there(i);
        if (inside || !(largest(from.irradiance) * Real(8) > all)) continue;
        const Vec3 chord = from.direction - to_eye; // |chord|^2 = 2 (1 - cosine); a third of the chord is about A's
        away = min(away, dot(chord, chord) * Real(1.0 / 18));
    }
    return ForwardPeak(phase, max(away, least));
}

} // namespace wisp::WISP_ARITH
