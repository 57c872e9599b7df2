// Lights: what they give to a point, and the photons that they send towards the smoke (S2).
#pragma once
#include "core/smoke/density_field.h"
#include "core/smoke/phase.h"

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

struct Sphere {
    Vec3 center;
    Real radius;
};

// One thing that sends photons: a light, or a smoke that glows.
struct Emitter {
    const Light *light;    // or nullptr:
    uint32_t smoke;        // the smoke that glows
    Color power;           // of all its photons together
    Color photon_color;    // power / its largest channel: what one photon carries
    Real one_minus_cosine; // of the cone that holds the emission (point, spot, constant)
    Vec3 axis;             // of that cone
    Real reach_squared;    // constant: the largest squared distance of a first collision
};

// The photons of a light that may meet the sphere. The power is 0 when none can.
Emitter make_emitter(const Light &light, const Sphere &smoke);

struct Photon {
    Ray ray;
    Color power; // in units of one photon's largest channel: 0 to 1
    bool leaves; // false: sent outside the light's own cone, so it does not exist
};

Photon emit(const Emitter &emitter, const Sphere &smoke, Event event);

} // namespace wisp::WISP_ARITH
