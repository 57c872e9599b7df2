// Tracing photons in batches (S2), whatever is made of their collisions: a photon map or a particle map.
#pragma once
#include "core/photons/photon_walk.h"
#include "core/surfaces/surfaces.h"
#include "wisp/photon_sums.h"
#include "wisp/progress.h"
#include "wisp/settings.h"
#include "wisp/statistics.h"

namespace wisp::WISP_ARITH {

// One photon's largest channel, power / emitted, as unit * 2^exponent with unit in [1, 2): in fixed point neither end
// of the range is near.
struct PhotonUnit {
    Real unit;
    int32_t exponent;
};
PhotonUnit photon_unit(Real power, uint64_t emitted);

// Light from all directions: its mean radiance phi / (4 pi), and the flux relative to phi.
struct FluenceAndFlux {
    Color radiance;
    Vec3 flux;
};

// Photons of a parallel light start near the smoke: whether a surface stops them on the way there.
bool is_stopped_before(const Surfaces *surfaces, const Emission &birth);

// Whether photons are needed, and what tells them apart.
struct PhotonNeeds {
    bool traced;     // some light is scattered more than once
    bool directions; // ... and not evenly
    bool harmonics;  // ... and some smoke takes moments (moments.h)
    bool powers;     // photons differ in power
};
PhotonNeeds photon_needs(const Scene &scene, const Settings &settings);

// Traces one photon. collect(collision, photon as it arrives, its power) hears of the collisions after the first, as
// single scattering is computed directly; of photons that the smoke itself emits from the first. The power is that
// before the roulette, so readers multiply by the albedo.
// fly(photon as it sets out, how far it flies, its power) hears of the flights to those collisions.
template <class Collect, class Fly>
void trace_photon(const Medium &medium, const Surfaces *surfaces, const Emitters &emitters, uint64_t key,
                  Statistics &statistics, Collect &&collect, Fly &&fly) {
    auto &counts = statistics.photons;
    const Emission birth = emit_photon(medium, emitters, key);
    const Emitter &emitter = *birth.emitter;
    ++counts.emitted;
    if (!birth.photon.leaves) {
        ++counts.escaped;
        return;
    }
    if (is_stopped_before(surfaces, birth)) {
        ++counts.blocked;
        return;
    }
    const bool constant = emitter.light && emitter.light->kind == LightKind::constant;
    const uint32_t first_stored = emitter.light ? 1 : 0;
    Real falloff = Real(1);
    const PathEnd fate = walk(
        medium, birth.photon, key,
        [&](const MediumCollision &at, uint32_t number, const Photon &arrived) {
            ++counts.collisions;
            if (constant && number == 0) { // irradiance without falloff: as many photons to the area everywhere
                const Vec3 way = arrived.ray.origin - emitter.light->position;
                falloff = dot(way, way) / emitter.reach_squared;
            }
            if (number >= first_stored) collect(at, arrived, arrived.power * falloff);
        },
        [&](const Photon &photon, Real end, uint32_t number) {
            if (number >= first_stored) fly(photon, end, photon.power * falloff);
        },
        [&](const Ray &ray, uint32_t number) {
            const bool from_lamp = number == 0 && emitter.light && emitter.light->kind != LightKind::parallel;
            const Real begin = from_lamp && surfaces ? surfaces->ray_epsilon : Real(0); // it may stand on one
            return distance_to_surface(surfaces, ray, begin);
        });
    ++(fate == PathEnd::absorbed  ? counts.absorbed
       : fate == PathEnd::escaped ? counts.escaped
       : fate == PathEnd::blocked ? counts.blocked
                                  : counts.capped);
}

template <class Collect>
void trace_photon(const Medium &medium, const Surfaces *surfaces, const Emitters &emitters, uint64_t key,
                  Statistics &statistics, Collect &&collect) {
    trace_photon(medium, surfaces, emitters, key, statistics, collect, [](const Photon &, Real, const Color &) {});
}

// Calls trace(key) for the photons of a batch; false as soon as that returns false.
template <class Trace> bool for_each_photon(uint64_t seed, uint64_t batch, uint64_t photons, Trace &&trace) {
    Mt19937 generator(static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32), static_cast<uint32_t>(batch),
                      static_cast<uint32_t>(batch >> 32));
    for (uint64_t i = 0; i < photons; ++i) {
        const uint64_t high = generator();
        const uint64_t low = generator();
        if (!trace(high << 32 | low)) return false;
    }
    return true;
}

// Calls trace_batch(number, photons) for a part of the batches of all photons, until it returns false.
template <class TraceBatch>
Status for_each_batch(uint64_t photons, const Batches &batches, const Observer &observer, TraceBatch &&trace_batch) {
    for (uint64_t batch = batches.first; batch < batches.last; ++batch) {
        if (!observer(Stage::photons, batch - batches.first, batches.last - batches.first)) return Status::stopped;
        const uint64_t left = photons - batch * batch_photons;
        if (!trace_batch(batch, left < batch_photons ? left : batch_photons)) break;
    }
    return Status::done;
}

} // namespace wisp::WISP_ARITH
