// Photons through smoke of exact densities (S2), and their fluence at the nodes of a sparse grid around it: S4-3 with
// nodes in place of particles. Smoke that cannot be resampled, as a turned box, needs no photon map then.
//
// Photons start and collide as those of the photon map. What the map would store is deposited instead, as FluenceSums
// say. The integrals that the sums are divided by are found by random points, as densities may end within a cell.
//
// Where PhotonNeeds::towards_eye, a deposit is multiplied by 4 pi times the phase function from the photon's direction
// to that of the eye: its mean over all smokes at the point, weighted by what each scatters. The nodes then hold what
// the smoke scatters to the eye, times 4 pi / (sum of albedo sigma_t), whatever the directions of the light are.
#pragma once
#include "core/photons/fluence_sums.h"

namespace wisp::WISP_ARITH {

// The bytes for the sums and for tracing, at most. Cut cells take more (cut_cell_bytes).
uint64_t exact_fluence_bytes(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing);

// Adds the deposits of photons to `sums`, and makes `fluence` of the sums as if they held all batches.
// Status::overflow: see max_fluence_flights.
Status trace_exact_fluence(const PhotonTracing &tracing, const SparseGrid &bricks, int32_t spacing, const Light *lights,
                           uint32_t light_count, PhotonSums &sums, FluenceSums &fluence);

} // namespace wisp::WISP_ARITH
