// The photon map (S2, S4-2): photons traced through the smoke in batches and stored at their collisions, and the
// density estimate of in-scattered radiance from the nearest of them (Jensen & Christensen 1998).
#pragma once
#include "core/photons/photon_tracing.h"

namespace wisp::WISP_ARITH {

// The photons that collided with one smoke. The arrays are indexed by the slots of the tree.
struct PhotonMap {
    PointTree tree;
    const Vec3 *direction; // along which each photon travelled; nullptr where the smoke is isotropic
    const Color *power;    // in photons; nullptr where all photons carry uniform_power
    Color uniform_power;
    PhotonUnit unit; // of the power
    bool fluxes;     // `direction` holds flux vectors relative to the power: each point stands for many photons
};

struct PhotonMaps {
    const PhotonMap *per_smoke; // one per smoke; nullptr where nothing scatters: no photon is traced
    Status status;
};

// What photons are needed for, how many collisions the store holds, and the bytes for all of it at most.
struct PhotonPlan : PhotonNeeds {
    uint64_t capacity, bytes;
};
PhotonPlan plan_photons(const Scene &scene, const Settings &settings);

// Traces photons. trace_photon() defines which collisions are stored, and with which power. If they do not fit a store
// of `capacity` collisions, it keeps a random half of them, a quarter and so on, each with twice the power:
// statistics.photons.thinning.
PhotonMaps trace_photons(const PhotonTracing &tracing, const Light *lights, uint32_t light_count, uint64_t capacity);

// The workspace of an estimate with up to K = `max_photons` photons; it is made once.
struct Gather {
    uint32_t max_photons; // K >= 2
    uint32_t *slot;
    Real *distance_squared;
    NearestScratch scratch;
};
bool make_gather(uint32_t max_photons, Arena &arena, Gather &gather);
uint64_t gather_bytes(uint32_t max_photons);

// The sum of p(w_p, out) Phi_p / V over the photons around x, per unit of length and steradian, for light that leaves
// along the unit vector `out`. Times the albedo it is the source of multiple scattering (S2).
// If K photons lie within `largest_radius`, the ball V reaches to the farthest of them, and that photon's power is left
// out: K / V would be too large by 1 / (K - 1) on average (N-E5). With fewer photons V is the largest ball.
Color estimate_radiance(const PhotonMap &map, const Phase &phase, const Vec3 &x, const Vec3 &out, Real largest_radius,
                        Gather &gather, Statistics &statistics);

// The fluence times sigma_t, and the flux, of the same photons, from which the light in any direction is found later.
// `radius`: of the ball; 0: there is no photon.
FluenceAndFlux estimate_fluence(const PhotonMap &map, const Vec3 &x, Real largest_radius, Gather &gather,
                                Statistics &statistics, Real &radius);

} // namespace wisp::WISP_ARITH
