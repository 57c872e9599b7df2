// Where photons start in resampled smoke (S2): where light first collides, and where smoke glows.
//
// The resampled densities and the optical depth grid give the density of first collisions at every node, so no photon
// misses the smoke, and photons are spread evenly over the light. Photons of a light that stands in the smoke start
// there, and fly to their first collision.
#pragma once
#include "core/lights/optical_depth_grid.h"
#include "core/photons/emitter.h"

namespace wisp::WISP_ARITH {

// A source of photons: the first collisions of a light, or the emission of a smoke.
struct PhotonSource {
    uint32_t light;   // its index; the number of lights: a smoke
    uint32_t smoke;   // its index
    Color color;      // per unit of brightness
    Real max_channel; // the largest channel of `color`
    // Of a light many of whose photons collide close to it: they start at the light. Else emitter.light is nullptr.
    Emitter emitter;
    Real most_power; // that collides, of what such a photon sets out with
    Real brightness; // of such a light, as if what it sends were spread evenly over all bricks
    bool starts_at_light() const { return emitter.light != nullptr; }
};

// The distribution of the points where photons start. It depends neither on their number nor on surfaces.
struct EmissionDistribution {
    const PhotonSource *sources;
    uint32_t source_count;
    const Real *rate;      // of tentative collisions per unit of length, by brick
    int32_t deposit_shift; // deposits are scaled by 2^deposit_shift: in thin smoke few collisions are real
    int32_t shift;         // brightness is scaled by 2^shift: in fixed point, that of thin smoke keeps its digits
    Real max_brightness;   // of all nodes
    // Entry source * bricks + brick: the sum of the weights of all nodes before that source and brick. The last entry
    // is the sum of all weights.
    const uint64_t *cumulative_weight;
};
// `depths` are the optical depths to all lights over the medium's bricks. False: the arena was too small.
bool make_emission_distribution(const Scene &scene, const Medium &medium, const OpticalDepthGrid &depths, Arena &arena,
                                EmissionDistribution &distribution, Watch watch = {});
uint64_t emission_bytes(const Scene &scene, uint64_t bricks);
inline uint64_t sum_of_weights(const EmissionDistribution &distribution, const SparseGrid &bricks) {
    return distribution.cumulative_weight[uint64_t{distribution.source_count} * bricks.count];
}
// The power of all photons together: the sum of their largest channels.
Real emitted_power(const EmissionDistribution &distribution, const SparseGrid &bricks);

// The light that photons start from.
struct PhotonSources {
    const Medium &medium;
    const SparseGrid &bricks;
    const OpticalDepthGrid &depths;
    const EmissionDistribution &distribution;
};

// The node where the last photon started, and the weights of the nodes of its source and brick. Photons are placed in
// ascending order of weight, so the next one is near.
struct StartCursor {
    uint64_t entry; // source * bricks + brick; UINT64_MAX: no photon has started
    uint32_t count, next;
    uint64_t end; // the sum of all weights of the distribution up to node `next`, included
    Cell node[nodes_of(1)];
    uint32_t weight[nodes_of(1)];
};
// Moves the cursor to the node that holds `target`, a number below the sum of all weights.
void seek(const PhotonSources &in, uint64_t target, StartCursor &cursor);
inline const PhotonSource &source_at(const PhotonSources &in, const StartCursor &cursor) {
    return in.distribution.sources[cursor.entry / in.bricks.count];
}

// A point of the smoke's bounds, drawn with the density of the tent around the cursor's node.
Vec3 draw_start(const PhotonSources &in, const StartCursor &cursor, Pcg32 &generator);
// The power of a photon of a light that starts at x, as a part of what starts at a node: 0 outside of the smoke, at
// most 1.25. Between nodes the power that starts falls exponentially with the depth to the light, while photons are
// drawn by linear interpolation. The quotient of the two at x (README). The depth is interpolated linearly; where it is
// nearly the same at all corners of the cell, the quotient counts as 1. In cells of smoke with hard faces where it
// differs much, or bends, a ray finds it.
Real power_between_nodes(const PhotonSources &in, const PhotonSource &source, const Vec3 &x);

} // namespace wisp::WISP_ARITH
