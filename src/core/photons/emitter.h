// What sends photons (S2): the lights, and the smokes that glow.
#pragma once
#include "core/geometry/ray.h"
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

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

// A photon of a smoke that glows, from a point of its density in a direction of its own.
Photon emit_from_smoke(const SmokeVolume &smoke, const Color &photon_color, Event event);

// All that sends photons: the lights, and the smokes that glow.
struct Emitters {
    Emitter *list; // nullptr: the arena was too small
    uint32_t count;
    Real power; // the sum of their largest channels
};
Emitters find_emitters(const Medium &medium, const Light *lights, uint32_t light_count, Arena &arena);

// Where a photon starts, and from what.
struct Emission {
    Photon photon;
    const Emitter *emitter;
};
Emission emit_photon(const Medium &medium, const Emitters &emitters, uint64_t key);

} // namespace wisp::WISP_ARITH
