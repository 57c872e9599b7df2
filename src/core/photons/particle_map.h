// The particle map (S4-3): the power of photons kept on the particles that they collided with, or on the samples of a
// grid, instead of a photon map. It does not depend on the camera.
//
// A photon's collision is with one particle, drawn with the share that it has in the density (numerics X), and the
// whole photon goes to it: no search, nothing lost, and what each particle receives is unbiased. The paper's way is
// Deposit::kernel.
#pragma once
#include "core/photons/photon_tracing.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

constexpr int32_t deposit_bits = 24; // a unit is 2^-24 of one photon's largest channel

// What one smoke's elements (particles by slot, or samples of the grid) received, in integers: the same sums whatever
// the order.
struct Deposits {
    int64_t *power; // `channels` of each element, in units
    // Three of each: the sum of direction times (R + G + B), or of directions alone; nullptr where the smoke scatters
    // evenly.
    int64_t *flux;
    uint32_t count, channels; // one channel where all photons are alike
    Direction kept;
};

// A sum of deposits in photons.
inline Real photons_of(int64_t sum) { return scaled_integer<Real>(sum, -deposit_bits); }

struct ParticleMap {
    const Deposits *per_smoke; // one a smoke; nullptr where nothing scatters twice
    Color photon_color;        // of all photons, where they are alike
    PhotonUnit unit;
};

// Shares a photon that collided at x among all elements there, by their parts in the density (S4-3, with the mass of a
// particle and its whole support). False: there is none, and nothing is deposited.
bool deposit_by_kernel(const Deposits &deposits, const DensityField &field, const Vec3 &x, const Color &photon,
                       const Vec3 &direction);

// Whether photons are needed, how many numbers they leave at most, and the bytes for all.
struct ParticleMapPlan {
    PhotonNeeds needs;
    uint64_t sums, bytes;
};
ParticleMapPlan plan_particle_map(const Scene &scene, const Settings &settings);

// So many deposits fit in a sum, whatever they are: with a photon more it might overflow. No photon makes more deposits
// on an element than it has flights.
uint64_t max_deposits(const Settings &settings);

// Adds what the photons of `batches` leave, none perhaps, to `sums`, and makes `map` of those as if all were there.
Status trace_particle_map(const Scene &scene, const Medium &medium, const Surfaces *surfaces, const Light *lights,
                          const Settings &settings, const PhotonNeeds &needs, const Batches &batches,
                          const Observer &observer, Arena &arena, PhotonSums &sums, Statistics &statistics,
                          ParticleMap &map);

} // namespace wisp::WISP_ARITH
