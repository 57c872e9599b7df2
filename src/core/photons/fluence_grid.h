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
#include "core/photons/fluence_sums.h"
#include "core/photons/photon_starts.h"

namespace wisp::WISP_ARITH {

// The bytes for the sums and for tracing, at most. Cut cells take more (cut_cell_bytes).
uint64_t fluence_bytes(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing);

// Adds the deposits of photons to `sums`, and makes `fluence` of the sums as if they held all batches.
// Status::overflow: see max_fluence_flights.
Status trace_fluence(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, int32_t spacing, PhotonSums &sums, FluenceSums &fluence);

} // namespace wisp::WISP_ARITH
