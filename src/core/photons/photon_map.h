// The photon map (S2): photons traced through the smoke in batches, stored at their collisions, and the estimate of
// in-scattered radiance from the nearest of them.
#pragma once
#include "core/photons/photon_tracing.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

// The photons that collided with one smoke. Arrays are indexed by the slots of the tree.
struct PhotonMap {
    PointTree tree;
    const Vec3 *direction; // whither each travelled; nullptr where the smoke scatters evenly
    const Color *power;    // in photons; nullptr where all carry the same
    Color uniform_power;   // ... namely this
    PhotonUnit unit;       // of the power
    bool fluxes;           // directions are those of many photons together: fluxes relative to the power
};

struct PhotonMaps {
    const PhotonMap *per_smoke; // one a smoke; nullptr where nothing scatters: no photon is traced
    Status status;
};

// Whether photons are needed, what they carry, and the bytes for them at most.
struct PhotonPlan : PhotonNeeds {
    uint64_t capacity, bytes;
};
PhotonPlan plan_photons(const Scene &scene, const Settings &settings);

// Traces `settings.photons` photons, or as many whole batches as the planned store holds. Collisions after the first
// are stored, as single scattering is computed while marching; those of photons that the smoke itself emits from the
// first. Stored is the power before the roulette, so readers multiply by the albedo.
PhotonMaps trace_photons(const Medium &medium, const Surfaces *surfaces, const Light *lights, uint32_t light_count,
                         const Settings &settings, const PhotonPlan &plan, const Observer &observer, Arena &arena,
                         Statistics &statistics);

// The workspace of an estimate with up to `most` photons, made once.
struct Gather {
    uint32_t most; // K >= 2
    uint32_t *slot;
    Real *distance_squared;
    NearestScratch scratch;
};
bool make_gather(uint32_t most, Arena &arena, Gather &gather);
uint64_t gather_bytes(uint32_t most);

// sum p(w_p, out) Phi_p / V around x, per unit of length and steradian, for light that leaves along the unit vector
// `out`: times the albedo it is the source of multiple scattering (S2). Of K photons found the farthest only sets the
// ball, as k / V_k is biased upwards (numerics E5); of fewer the ball is the largest one.
Color estimate_radiance(const PhotonMap &map, const Phase &phase, const Vec3 &x, const Vec3 &out, Real largest_radius,
                        Gather &gather, Statistics &statistics);

// The same as if scattered evenly, and the photons' flux, for any direction to be asked later.
FluenceAndFlux estimate_fluence(const PhotonMap &map, const Vec3 &x, Real largest_radius, Gather &gather,
                                Statistics &statistics);

} // namespace wisp::WISP_ARITH
