// Emitters of photons (S2): the lights, and the smokes that glow.
#pragma once
#include "core/geometry/ray.h"
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

// A light that shines on smoke in a sphere, or a smoke that glows.
struct Emitter {
    const Light *light;    // nullptr: a smoke
    uint32_t smoke;        // its index
    Color power;           // of all its photons together
    Color photon_color;    // the power of one photon: `power` divided by its largest channel
    Real one_minus_cosine; // of the half angle of the cone that holds the emission (point, spot, constant)
    Vec3 axis;             // of that cone
    Real reach_squared;    // constant: the largest squared distance of a first collision
    Sphere target;         // that holds smoke
    uint32_t earlier;      // targets of the same light, whose emitters come right before; what meets one starts there
};

// The emitter of the photons of a light that may meet the sphere around the smoke. Its power is 0 if none can. They fly
// on as far as the sphere around all smoke reaches.
Emitter make_emitter(const Light &light, const Sphere &smoke, const Sphere &all);
inline Emitter make_emitter(const Light &light, const Sphere &all) { return make_emitter(light, all, all); }

struct Photon {
    Ray ray;
    Color power;  // in units of one photon's largest channel: 0 to 1
    bool emitted; // false: its direction lies outside the cone of a spot, and the photon does not exist
};

// A photon of an emitter that is a light. That of a parallel light starts before the sphere around all smoke.
Photon emit(const Emitter &emitter, const Sphere &all, Event event);

// A photon of a smoke that glows. It starts at a point with the probability density of the smoke's extinction, in a
// uniform direction.
Photon emit_from_smoke(const SmokeVolume &smoke, const Color &photon_color, Event event);

// All emitters of a scene.
struct Emitters {
    Emitter *list; // nullptr: the arena was too small
    uint32_t count;
    Real power; // the sum of the largest channels of their powers
};
Emitters find_emitters(const Medium &medium, const Light *lights, uint32_t light_count, Arena &arena);
uint64_t emitter_bytes(const Scene &scene);

// The start of a photon's path.
struct Emission {
    Photon photon;
    const Emitter *emitter;
};
// Chooses an emitter with a probability proportional to its power, so that all photons carry the same largest channel.
// The choice is a function of the photon's key alone.
Emission emit_photon(const Medium &medium, const Emitters &emitters, uint64_t key);

} // namespace wisp::WISP_ARITH
