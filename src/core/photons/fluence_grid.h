// Photons through resampled smoke (S2), and their fluence at the nodes of the sparse grid: S4-3 with nodes in place of
// particles.
//
// Photons start as photon_starts.h says. They fly by delta tracking against the largest density of each brick (Woodcock
// 1965). At every tentative collision, real or not, a photon deposits its power times the probability that the
// collision is real at the corners of the cell around it (trilinear). So the sums are the power that collides around
// each node. Divided by the integral of sigma_t times the node's tent, that is the fluence: interpolated, it gives back
// all collisions (README).
//
// Where PhotonNeeds::towards_eye, a deposit is multiplied by 4 pi times the wide part of the phase function from the
// photon's direction to that of the eye (ForwardPeak). The nodes then hold what the smoke scatters to the eye, times
// 4 pi / albedo / sigma_t, exactly but for noise, whatever the directions of the light are.
#pragma once
#include "core/lights/forward_peak.h"
#include "core/photons/cut_cells.h"
#include "core/photons/particle_map.h"
#include "core/photons/photon_starts.h"
#include "core/photons/spherical_harmonics.h"

namespace wisp::WISP_ARITH {

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
    uint32_t channels;  // one where all photons carry the same power
    Color photon_color; // of all photons, where they carry the same power
    PhotonUnit unit;    // of a deposit
    int32_t
        sigma_shift;   // integrals of sigma_t are scaled by 2^sigma_shift: in fixed point, thin smoke keeps its digits
    const Real *tents; // by brick and node, of find_tents()
    // The part of scattered light that counts as going straight on, where the sums are of light towards the eye, else
    // 0.
    Real straight = Real(0);
    CutCells cut = {};
};

// How many sums photons leave at most, and the bytes for them and for tracing. Cut cells take more (cut_cell_bytes).
struct FluencePlan {
    uint64_t sums, bytes;
};
// Cells between the nodes of harmonics: these vary less from place to place than power does.
constexpr int32_t harmonic_spacing(int32_t spacing) { return min(2 * spacing, brick_cells / 2); }
constexpr uint32_t harmonic_numbers = 1 + harmonic_count;
FluencePlan plan_fluence(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing);

// The number of flights that cannot overflow a sum. A flight deposits R + G + B, at most 3.75 photons, times the depth
// that it passes. That depth is 1 in the mean, and less than twice that over many flights.
constexpr uint64_t max_fluence_flights = (uint64_t{1} << (63 - deposit_bits)) / 8;

// Adds the deposits of photons to `sums`, and makes `fluence` of the sums as if they held all batches.
// Status::overflow: see max_fluence_flights.
Status trace_fluence(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, int32_t spacing, PhotonSums &sums, FluenceSums &fluence);

// Finds the integrals of sigma_t times the tent of each node over each brick, before light_at_node() is asked. False:
// the arena was too small, or the work is stopped.
bool find_tents(FluenceSums &fluence, Arena &arena, Watch watch = {});
inline uint64_t tent_bytes(uint64_t bricks, int32_t spacing) { return Arena::bytes<Real>(bricks * nodes_of(spacing)); }

// The fluence and flux at a node, from the sums of all bricks that hold it. False: there is hardly any smoke around the
// node, less than 2^-10 of the densest in those bricks, and its light is unknown.
bool light_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node, FluenceAndFlux &light);
// The coefficients of the spherical harmonics, relative to the power, at a node of harmonic_spacing().
SphericalHarmonics harmonics_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node);

} // namespace wisp::WISP_ARITH
