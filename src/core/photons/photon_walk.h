// The walk of one photon (S2): free path, roulette, new direction, until it is absorbed or leaves.
//
// Written once for every medium that offers `first_collision(medium, ray, end, event)`, `albedo(medium, collision)`
// and `phase(medium, collision)`, where a collision has `found` and `distance`.
#pragma once
#include "core/photons/emitter.h"

namespace wisp::WISP_ARITH {

enum class PathEnd { absorbed, escaped, blocked, capped };

constexpr uint32_t max_collisions = 1000000; // of one photon; more of them are counted as capped

// A flight of a photon: the ray up to `end`, where it collides or which is beyond any smoke. None is watched by
// default.
struct NoFlight {
    void operator()(const Photon &, Real, uint32_t) const {}
};

// Nothing stops a photon, unless a walk is told what does.
struct NoStop {
    Real operator()(const Ray &, uint32_t) const { return infinite_distance; }
};

// `photon` flies on from where it is; `event` numbers its flights from 1. At each collision `visit(collision, number,
// position, photon)` sees the photon as it arrives, before the roulette; number counts from 0. `flight(photon, end,
// number)` sees it at the start of the flight to that collision. `stop(ray, number)` is where something ends the
// flight: infinite_distance where nothing does.
template <class Medium, class Visit, class Flight = NoFlight, class Stop = NoStop>
PathEnd walk(const Medium &medium, Photon photon, uint64_t key, Visit &&visit, Flight &&flight = {}, Stop &&stop = {}) {
    for (uint32_t number = 0; number < max_collisions; ++number) {
        const Event event = photon_event(key, number + 1);
        const Real end = stop(photon.ray, number);
        const auto collision = first_collision(medium, photon.ray, end, event);
        flight(photon, collision.found ? collision.distance : end, number);
        if (!collision.found) return end < infinite_distance ? PathEnd::blocked : PathEnd::escaped;
        photon.ray.origin += photon.ray.direction * collision.distance;
        visit(collision, number, photon);

        // Survives when xi < q: strict, so that an albedo of 0 never does, and 1 always.
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
