// The sums that photons leave at the nodes of a sparse grid, and the fluence that is read from them (README, Fluence
// grid).
#pragma once
#include "core/photons/cut_cells.h"
#include "core/photons/particle_map.h"
#include "core/photons/spherical_harmonics.h"

namespace wisp::WISP_ARITH {

// The eye that nodes keep light towards, where they do. Its direction differs within a cell that is near to it, and
// from node to node around it. Closer than `near`, rays from the eye read what smoke scatters to it at that distance
// (lights/README, An eye in smoke).
struct TowardsOneEye {
    Vec3 eye;
    Real near; // 0: nodes keep the light of all directions
};

// The sums of deposits at the nodes of each brick. They are integers, so the order of the deposits does not change
// them.
struct FluenceSums {
    const Medium *medium;
    const SparseGrid *bricks;
    int32_t spacing; // cells between nodes
    int64_t *power;  // `channels` numbers per node, in units of deposits
    int64_t *flux;   // three per node: the sum of direction * (R + G + B); nullptr where all smoke is isotropic
    // harmonic_numbers per node of harmonic_spacing(spacing): the sum of R + G + B, and for each harmonic m of the
    // direction the sum of (1 + m) / 2 * (R + G + B); nullptr where no smoke uses harmonics.
    int64_t *harmonics;
    uint32_t channels;   // one where all photons carry the same power
    Color photon_color;  // of all photons, where they carry the same power
    PhotonUnit unit;     // of a deposit
    PhotonUnit photon;   // its power
    int32_t sigma_shift; // integrals of sigma_t are scaled by 2^sigma_shift: in fixed point, thin smoke keeps its
                         // digits
    const Real *tents;   // by brick and node, of find_tents()
    const Real *densest; // by brick: an upper bound of sigma_t, of find_tents()
    // The part of scattered light that counts as going straight on, where the sums are of light towards the eye, else
    // 0.
    Real straight = Real(0);
    Real largest = Real(0); // 4 pi p of the rest, at most; 0: the sums are not of light towards the eye
    CutCells cut = {};
    TowardsOneEye one_eye = {};
};

// Cells between the nodes of harmonics: these vary less from place to place than power does.
constexpr int32_t harmonic_spacing(int32_t spacing) { return min(2 * spacing, brick_cells / 2); }
constexpr uint32_t harmonic_numbers = 1 + harmonic_count;

// Within `near` the light of all directions varies, too. So `near` goes with how uneven the phase is, as measured
// there, and is at most a part of the extent of the smoke.
inline TowardsOneEye one_eye(const FluenceSums &fluence, const Vec3 &eye) {
    Real uneven = Real(0);
    for (uint32_t s = 0; s < fluence.medium->count; ++s)
        uneven = max(uneven, abs(fluence.medium->smokes[s].phase.asymmetry()));
    const Real cells = min(Real(0.5) + Real(2.5) * uneven, Real(2));
    return {eye, min(largest(fluence.bricks->cell) * (Real(fluence.spacing) * cells),
                     fluence.medium->sphere.radius * Real(1.0 / 6))};
}

// The number of flights that cannot overflow a sum. A flight deposits R + G + B, at most 3.75 photons, times the depth
// that it passes. That depth is 1 in the mean, and less than twice that over many flights.
constexpr uint64_t max_fluence_flights = (uint64_t{1} << (63 - deposit_bits)) / 8;

// Lays out the sums for what photons carry over these bricks, at 0 unless they hold deposits already, and finds the
// cells that surfaces cut. The unit of deposits and their colour are left to the caller.
Status lay_out_sums(const PhotonTracing &tracing, const SparseGrid &bricks, int32_t spacing, PhotonSums &sums,
                    FluenceSums &fluence);
// How many sums these are at most.
uint64_t sums_of_fluence(const PhotonNeeds &needs, uint64_t bricks, int32_t spacing);

// (1 + m) / 2 for each harmonic m of a direction: not below 0.
SphericalHarmonics halves_of(const Vec3 &direction);
// Deposits a photon that flies along `direction` at p, in cells from the beginning of a brick. `halves` of the
// direction count where there are harmonics. Where there is one channel, photons have `photon_color`, and `power` is
// grey.
void deposit(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, const Color &power, const Vec3 &direction,
             const SphericalHarmonics &halves);

// Finds the integrals of sigma_t times the tent of each node over each brick, before light_at_node() is asked. False:
// the arena was too small, or the work is stopped.
bool find_tents(FluenceSums &fluence, Arena &arena, Watch watch = {});
inline uint64_t tent_bytes(uint64_t bricks, int32_t spacing) {
    return Arena::bytes<Real>(bricks * nodes_of(spacing)) + Arena::bytes<Real>(bricks);
}

// The fluence and flux at a node, from the sums of all bricks that hold it. False: there is hardly any smoke around the
// node, less than 2^-10 of the densest in those bricks, and its light is unknown.
bool light_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node, FluenceAndFlux &light);
// The coefficients of the spherical harmonics, relative to the power, at a node of harmonic_spacing().
SphericalHarmonics harmonics_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node);

} // namespace wisp::WISP_ARITH
