// Lights, and the irradiance that a point receives from each of them. README.md has the units of each kind.
#pragma once
#include "core/geometry/ray.h"
#include "core/numbers/vec.h"
#include "core/numbers/watch.h"
#include "core/smoke/phase.h"
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

struct Light {
    LightKind kind;
    Vec3 position;         // point, spot, constant
    Vec3 direction;        // spot, parallel: the unit vector along which the light travels
    Real one_minus_cosine; // spot: of the half angle of its cone
    Color color;           // point, spot: intensity; parallel, constant: irradiance
};

// Whether its irradiance falls off with the square of the distance.
constexpr bool has_falloff(LightKind kind) { return kind == LightKind::point || kind == LightKind::spot; }

// Whether a point light or spot stands in a box, or less than `reach` from it along each axis.
inline bool stands_near(const Light &light, const Box &box, Real reach) {
    return has_falloff(light.kind) &&
           is_strictly_inside({box.low - Vec3(reach), box.high + Vec3(reach)}, light.position);
}

Light make_light(const LightSource &source);
Light *make_lights(const Scene &scene, Arena &arena); // nullptr: the arena was too small

struct Illumination {
    Vec3 direction; // the unit vector along which the light travels
    Real distance;  // to the light; 2^20 for a parallel light, farther than any scene is wide
    Color irradiance;
};

// The light at x without attenuation, on a surface that faces the light. For a point light or a spot the factor 1/r^2
// is replaced by its mean over the segment of a ray from `a` to `b` around x: a ray march that passes close to a light
// then has no spike. Of the light of a spot the mean over the part of the segment in its cone counts, as much as that
// part is of the segment. a = b = x gives the plain 1/r^2. Distances to the light are limited to at least 2^-10.
Illumination illuminate(const Light &light, const Vec3 &x, const Vec3 &a, const Vec3 &b);

// What a light shines on of a ray's segment from a to b, both relative to it: from a fraction `from` to a fraction `to`
// of its length. False: nothing. Of spots with a cone of less than half of all directions it is the part in the cone.
bool clip_to_light(const Light &light, const Vec3 &a, const Vec3 &b, Real &from, Real &to);

// The mean of the phase function towards `out` over the light that reaches the segment of a ray from `a` to `b`,
// through the same integral as `illuminate` (README, Mean phase); of a spot, the part in its cone. `in` is the light's
// direction in the middle of the segment: the mean where that turns by less than 1/8 of the phase function's peak.
Real mean_phase(const Light &light, const Phase &phase, const Vec3 &in, const Vec3 &a, const Vec3 &b, const Vec3 &out);

// Whether the unit vector `direction` lies in the cone about the unit vector `axis`: |direction - axis|^2 is
// 2 (1 - cosine), which keeps its digits for narrow cones.
inline bool in_cone(const Vec3 &direction, const Vec3 &axis, Real one_minus_cosine) {
    const Vec3 chord = direction - axis;
    return dot(chord, chord) <= Real(2) * one_minus_cosine;
}

} // namespace wisp::WISP_ARITH
