// The particle map (S4-3): instead of a photon map, each particle stores the power of the photons that collided with
// it. The map does not depend on the camera. In a grid of densities, its samples take the place of particles.
//
// Deposit::exact gives the whole photon to the one particle that it collided with: that particle was drawn with its
// fraction of the density (N-X, smoke/README). There is no search, no power is lost, and the power of each particle is
// unbiased. Deposit::kernel is the method of the paper. Deposit::path adds the expected deposits of every flight.
#pragma once
#include "core/photons/photon_tracing.h"

namespace wisp::WISP_ARITH {

constexpr int32_t deposit_bits = 24; // a unit of power is 2^-24 of one photon's largest channel

// The sums of one smoke's elements: particles by slot, or samples of the grid. They are integers, so the order of the
// deposits does not change them.
struct Deposits {
    int64_t *power; // `channels` numbers per element, in units
    // Three numbers per element: the sum of direction * (R + G + B), or with Direction::mean the sum of directions;
    // nullptr where the smoke is isotropic.
    int64_t *flux;
    uint32_t count, channels; // one channel where all photons carry the same power
    Direction direction_kind;
};

// Sums that photons left do not overflow. Those of a file that nobody traced may, and wrap around.
inline int64_t wrapped_sum(int64_t a, int64_t b) {
    return static_cast<int64_t>(static_cast<uint64_t>(a) + static_cast<uint64_t>(b));
}
inline int64_t wrapped_difference(int64_t a, int64_t b) {
    return static_cast<int64_t>(static_cast<uint64_t>(a) - static_cast<uint64_t>(b));
}
// A sum of deposits in photons.
inline Real photons_of(int64_t sum) { return scaled_integer<Real>(sum, -deposit_bits); }

struct ParticleMap {
    const Deposits *per_smoke; // one per smoke; nullptr where nothing scatters twice
    Color photon_color;        // of all photons, where they carry the same power
    PhotonUnit unit;
};

// Divides a photon that collided at x among all elements there, in proportion to their contributions to the density
// (S4-3, weighted by mass, over the whole support of the kernel). The deposits add up to the photon exactly. False: no
// element contributes at x, and nothing is deposited.
bool deposit_by_kernel(const Deposits &deposits, const DensityField &field, const Vec3 &x, const Color &photon,
                       const Vec3 &direction);

// What photons are needed for, how many sums they leave at most, and the bytes for all of it.
struct ParticleMapPlan {
    PhotonNeeds needs;
    uint64_t sums, bytes;
};
ParticleMapPlan plan_particle_map(const Scene &scene, const Settings &settings);

// The number of deposits that cannot overflow a sum, whatever they are. A photon makes no more deposits on an element
// than it has flights, so tracing stops when emitted + stored exceeds this number.
uint64_t max_deposits(const Settings &settings);

// Adds the deposits of photons to `sums`, and makes `map` of the sums as if they held all batches. Status::overflow:
// see max_deposits.
Status trace_particle_map(const PhotonTracing &tracing, const Scene &scene, const Light *lights, PhotonSums &sums,
                          ParticleMap &map);

} // namespace wisp::WISP_ARITH
