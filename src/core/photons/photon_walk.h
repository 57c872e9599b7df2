// The path of one photon (S2): free flight, Russian roulette, new direction, until it is absorbed or leaves the smoke.
//
// The walk is a template over the medium. A medium offers `first_collision(medium, ray, end, event)`, `albedo(medium,
// collision)` and `phase(medium, collision)`; a collision has `found` and `distance`.
#pragma once
#include "core/photons/emitter.h"

namespace wisp::WISP_ARITH {

// How a path ends. Blocked: by a surface. Capped: it had too many collisions.
enum class PathEnd { absorbed, escaped, blocked, capped };

constexpr uint32_t max_collisions = 1000000; // of one photon

// The default of `on_flight`: nothing happens.
struct NoFlight {
    void operator()(const Photon &, Real, uint32_t) const {}
};

// The default of `distance_to_stop`: nothing stops a photon.
struct NoStop {
    Real operator()(const Ray &, uint32_t) const { return infinite_distance; }
};

// Follows `photon` to the end of its path. Flights and collisions are numbered from 0; the events of the random numbers
// count flights from 1.
//   on_collision(collision, number, photon)  the photon as it arrives, before the roulette
//   on_flight(photon, end, number)           the photon as it starts; it collides at the distance `end`, or leaves
//   there distance_to_stop(ray, number)            where something ends the flight; infinite_distance: nowhere
template <class Medium, class OnCollision, class OnFlight = NoFlight, class DistanceToStop = NoStop>
PathEnd walk(const Medium &medium, Photon photon, uint64_t key, OnCollision &&on_collision, OnFlight &&on_flight = {},
             DistanceToStop &&distance_to_stop = {}) {
    for (uint32_t number = 0; number < max_collisions; ++number) {
        const Event event = photon_event(key, number + 1);
        const Real end = distance_to_stop(photon.ray, number);
        const auto collision = first_collision(medium, photon.ray, end, event);
        on_flight(photon, collision.found ? collision.distance : end, number);
        if (!collision.found) return end < infinite_distance ? PathEnd::blocked : PathEnd::escaped;
        photon.ray.origin += photon.ray.direction * collision.distance;
        on_collision(collision, number, photon);

        // The photon survives if xi < q. The comparison is strict: an albedo of 0 never survives, and 1 always does.
        const Color albedo_here = albedo(medium, collision);
        const Color scattered = photon.power * albedo_here;
        const Real q = largest(scattered) / largest(photon.power);
        if (!(unit_half_open<Real>(draw(event, dimension_survival)) < q)) return PathEnd::absorbed;
        photon.power = scattered / q;
        photon.ray.direction = deflect(photon.ray.direction,
                                       phase(medium, collision).sample(unit_open<Real>(draw(event, dimension_phase))),
                                       unit_half_open<Real>(draw(event, dimension_azimuth)));
    }
    return PathEnd::capped;
}

} // namespace wisp::WISP_ARITH
