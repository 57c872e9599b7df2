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
    const auto is_inside = [&](const Light &light) { // some of its light flies to the eye from any place around it
        return light.kind != LightKind::parallel && length(light.position - middle) < medium.sphere.radius;
    };
    const auto light_there = [&](const Light &light) { // of a spot inside, on its axis
        const bool on_axis = light.kind == LightKind::spot && is_inside(light);
        const Vec3 x = on_axis ? light.position + light.direction * length(light.position - middle) : middle;
        return illuminate(light, x, x, x);
    };
    Real all = Real(0), away = most;
    for (uint32_t i = 0; i < count; ++i) all += largest(light_there(lights[i]).irradiance);
    for (uint32_t i = 0; i < count; ++i) {
        const Light &light = lights[i];
        const Illumination from = light_there(light);
        if (!(largest(from.irradiance) * Real(8) > all)) continue;
        // Chords of angles: |chord|^2 = 2 (1 - cosine). A third of the chord is about A's.
        const Real cone = light.kind == LightKind::spot ? sqrt(Real(2) * light.one_minus_cosine) : Real(2);
        const Real chord = max(Real(0), length(from.direction - to_eye) - (is_inside(light) ? cone : Real(0)));
        away = min(away, chord * chord * Real(1.0 / 18));
    }
    return ForwardPeak(phase, max(away, least));
}

} // namespace wisp::WISP_ARITH
