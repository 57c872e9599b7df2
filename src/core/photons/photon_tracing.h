// Tracing photons in batches (S2). Both the photon map and the particle map are made of the collisions found here.
#pragma once
#include "core/photons/photon_walk.h"
#include "core/surfaces/surfaces.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include "wisp/statistics.h"

namespace wisp::WISP_ARITH {

// The largest channel of one photon, power / emitted, as unit * 2^exponent with `unit` in [1, 2). In fixed point the
// quotient itself could leave the range at either end.
struct PhotonUnit {
    Real unit;
    int32_t exponent;
};
PhotonUnit photon_unit(Real power, uint64_t emitted);
// By which power of two sigma_t and its integrals are scaled, in smoke that is so dense at most: in fixed point, thin
// smoke keeps its digits.
int32_t sigma_shift_for(Real densest);

// The light that arrives at a point from all directions.
struct FluenceAndFlux {
    Color radiance; // the mean radiance: fluence / (4 pi)
    Vec3 flux;      // the flux vector divided by the fluence, both summed over R G B: its length is 0 to 1
};

// Whether a surface stands between the start of a photon and its light. Photons of a parallel light start near the
// smoke.
bool is_stopped_before(const Surfaces *surfaces, const Emission &emission);

// What photons are needed for, and what they must carry.
struct PhotonNeeds {
    bool traced;     // some light is scattered more than once
    bool directions; // ... by a phase function that is not isotropic
    bool harmonics;  // ... which uses spherical harmonics (spherical_harmonics.h)
    bool powers;     // photons differ in power
    // What all smoke's one phase function scatters widely (ForwardPeak) is kept towards the eye, in place of
    // directions.
    bool towards_eye;
};
PhotonNeeds photon_needs(const Scene &scene, const Settings &settings);

// Records the flights of photons. The first one comes from the light.
struct FlightRecord {
    const Medium &medium;
    uint64_t photon; // its number
    Ray ray;
    Real end;      // infinite_distance: it leaves the smoke
    bool collides; // at `end`, with smoke
    Color power;   // in photons
};
struct FlightRecorder {
    void *context;
    void (*on_flight)(void *context, const FlightRecord &flight);
};
// Hardly ever.
inline bool is_recording(const FlightRecorder *recorder) { return __builtin_expect(recorder != nullptr, false); }

// What photons are traced through, which of them, and what counts them: the same for all stores.
struct PhotonTracing {
    const Medium &medium;
    const Surfaces *surfaces; // stop photons; nullptr: there are none
    const Settings &settings;
    const PhotonNeeds &needs;
    Batches batches; // may be empty
    Watch watch;
    Arena &arena;
    Statistics &statistics;
    Vec3 eye = Vec3(Real(0)); // of the camera, where light is kept towards it
    const FlightRecorder *flights = nullptr;
};

constexpr uint32_t units_of_photon = 32, units_of_flight = 256; // of work

// Traces one photon.
//   on_collision(collision, photon as it arrives, power)  for every collision that the map stores
//   on_flight(photon as it starts, end, power)            for every flight that may lead to such a collision
// The map stores collisions after the first, because the march computes single scattering directly; of photons that
// the smoke itself emits, it stores the first too (N-E6). `power` is the power before the roulette, so whoever reads
// the map multiplies by the albedo.
template <class OnCollision, class OnFlight>
void trace_photon(const PhotonTracing &tracing, const Emitters &emitters, uint64_t key, OnCollision &&on_collision,
                  OnFlight &&on_flight) {
    const Medium &medium = tracing.medium;
    const Surfaces *surfaces = tracing.surfaces;
    auto &counts = tracing.statistics.photons;
    const Emission emission = emit_photon(medium, emitters, key);
    const Emitter &emitter = *emission.emitter;
    ++counts.emitted;
    if (!emission.photon.emitted) {
        ++counts.escaped;
        return;
    }
    if (is_stopped_before(surfaces, emission)) {
        ++counts.blocked;
        return;
    }
    const bool constant = emitter.light && emitter.light->kind == LightKind::constant;
    const uint32_t first_stored = emitter.light ? 1 : 0;
    Real weight = Real(1), stop = infinite_distance;
    const PathEnd ending = walk(
        medium, emission.photon, key,
        [&](const MediumCollision &at, uint32_t number, const Photon &arrived) {
            ++counts.collisions;
            if (constant && number == 0) { // irradiance without falloff: the weight cancels 1/r^2
                const Vec3 offset = arrived.ray.origin - emitter.light->position;
                weight = dot(offset, offset) / emitter.reach_squared;
            }
            if (number >= first_stored) on_collision(at, arrived, arrived.power * weight);
        },
        [&](const Photon &photon, Real end, uint32_t number) {
            if (is_recording(tracing.flights))
                tracing.flights->on_flight(tracing.flights->context, {medium, counts.emitted - 1, photon.ray, end,
                                                                      end < stop, photon.power * weight});
            if (number >= first_stored) on_flight(photon, end, photon.power * weight);
        },
        [&](const Ray &ray, uint32_t number) {
            if (!tracing.watch.go_on(units_of_flight)) return Real(0); // stopped: the walk ends here
            // A light may stand on a surface: the first flight of its photons begins beyond that surface.
            const bool from_lamp = number == 0 && emitter.light && emitter.light->kind != LightKind::parallel;
            const Real begin = from_lamp && surfaces ? surfaces->ray_epsilon : Real(0);
            return stop = distance_to_surface(surfaces, ray, begin);
        });
    ++(ending == PathEnd::absorbed  ? counts.absorbed
       : ending == PathEnd::escaped ? counts.escaped
       : ending == PathEnd::blocked ? counts.blocked
                                    : counts.capped);
}

template <class OnCollision>
void trace_photon(const PhotonTracing &tracing, const Emitters &emitters, uint64_t key, OnCollision &&on_collision) {
    trace_photon(tracing, emitters, key, on_collision, [](const Photon &, Real, const Color &) {});
}

// Each batch has a Mersenne Twister of its own, which draws one 64-bit key per photon and nothing else.
inline void seed_batch(Mt19937 &generator, uint64_t seed, uint64_t batch) {
    generator.seed(static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32), static_cast<uint32_t>(batch),
                   static_cast<uint32_t>(batch >> 32));
}

// Calls trace(key) for the photons of a batch, until it returns false; returns what the last call returned.
template <class Trace> bool for_each_photon(Mt19937 &generator, uint64_t photons, Trace &&trace) {
    for (uint64_t i = 0; i < photons; ++i) {
        const uint64_t high = generator();
        const uint64_t low = generator();
        if (!trace(high << 32 | low)) return false;
    }
    return true;
}
// The same, until the work is stopped.
template <class Trace>
bool for_each_photon(const PhotonTracing &tracing, Mt19937 &generator, uint64_t photons, Trace &&trace) {
    constexpr uint32_t at_once = 64;
    uint32_t traced = 0;
    return for_each_photon(generator, photons, [&](uint64_t key) {
        return trace(key) && (++traced % at_once != 0 || tracing.watch.done(at_once * units_of_photon));
    });
}

constexpr uint64_t batch_bytes = Arena::bytes<Mt19937>(1); // of the arena, while batches are traced

// Calls trace_batch(generator, number, photons) for the batches to be traced, until it returns false. The generator's
// state, 2.5 kB, would be a third of a small board's stack.
template <class TraceBatch> Status for_each_batch(const PhotonTracing &tracing, TraceBatch &&trace_batch) {
    const size_t mark = tracing.arena.mark();
    Mt19937 *generator = tracing.arena.make<Mt19937>(1);
    if (!generator) return Status::out_of_memory;
    const Batches &batches = tracing.batches;
    const auto photons_of_batch = [&](uint64_t batch) {
        const uint64_t left = tracing.settings.photons - batch * batch_photons;
        return left < batch_photons ? left : batch_photons;
    };
    if (batches.first < batches.last)
        tracing.watch.expect(((batches.last - 1 - batches.first) * batch_photons + photons_of_batch(batches.last - 1)) *
                             units_of_photon);
    for (uint64_t batch = batches.first; batch < batches.last; ++batch) {
        seed_batch(*generator, tracing.settings.seed, batch);
        if (!trace_batch(*generator, batch, photons_of_batch(batch))) break;
    }
    tracing.arena.rewind(mark);
    return tracing.watch.stopped() ? Status::stopped : Status::done;
}

} // namespace wisp::WISP_ARITH
