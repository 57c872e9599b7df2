// Lights: the irradiance that a point receives from each of them.
#pragma once
#include "core/numbers/vec.h"
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

struct Light {
    LightKind kind;
    Vec3 position;
    Vec3 direction;        // whither it travels (spot, parallel)
    Real one_minus_cosine; // of half a spot's angle
    Color color;           // intensity or irradiance
};

Light make_light(const LightSource &source);
Light *make_lights(const Scene &scene, Arena &arena); // nullptr: the arena was too small

struct Illumination {
    Vec3 direction; // unit vector along which the light travels
    Real distance;  // to the light; beyond any scene for a parallel one
    Color irradiance;
};

// What reaches x unattenuated. With a stretch of a ray from `a` to `b` around x the inverse square is its mean over
// that stretch (the equi-angular integral), so that a march past a light has no spike; the stretch's distance from
// the light is taken as at least 2^-10. With a = b = x it is the plain inverse square under the same floor.
Illumination illuminate(const Light &light, const Vec3 &x, const Vec3 &a, const Vec3 &b);

// Whether the unit vector `direction` lies in the cone of `one_minus_cosine` about the unit vector `axis`.
inline bool in_cone(const Vec3 &direction, const Vec3 &axis, Real one_minus_cosine) {
    const Vec3 chord = direction - axis;
    return dot(chord, chord) <= Real(2) * one_minus_cosine;
}

} // namespace wisp::WISP_ARITH
