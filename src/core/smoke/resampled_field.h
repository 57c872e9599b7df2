// Smoke resampled to bricks (S4-1): sigma_t at the nodes, trilinear between them.
#pragma once
#include "core/smoke/grid_field.h"
#include "core/smoke/particle_field.h"
#include "core/smoke/sparse_grid.h"

namespace wisp::WISP_ARITH {

// Tentative collisions of a flight, at most: where there are more, the density leaves no measurable way between them.
constexpr uint32_t max_tentative = 1u << 16;

struct ResampledField {
    const SparseGrid *bricks;
    const Real *extinction; // nodes_of(1) a brick
    const Real *greatest;   // of each brick
    uint32_t dimension;     // of a photon's draws
    bool ready;             // false: the arena was too small

    const Real *nodes(uint32_t brick) const { return extinction + size_t{brick} * nodes_of(1); }
};

// The density of `source` at the bricks' nodes: sums over its particles, or its grid's samples.
ResampledField resample(const SmokeDescription &source, const SparseGrid &bricks, uint32_t dimension, Arena &arena);
// Of `bricks` bricks; what is needed while resampling is included.
uint64_t resampled_field_bytes(const SmokeDescription &source, uint64_t bricks);

// sigma_t at p, a place in the brick in cells.
inline Real extinction(const ResampledField &field, uint32_t brick, const Vec3 &p) {
    const Real *nodes = field.nodes(brick);
    return between_nodes(place_of(p, 1), 1, [nodes](uint32_t node) { return nodes[node]; });
}

// As of the other fields: sigma_t at x; its integral over the ray's distances 0 to `end`, by the middles of parts no
// longer than a cell; an upper bound in a box; a photon's collision, by tracking against the bricks' greatest values
// (Woodcock), none on the longest flight.
Real extinction(const ResampledField &field, const Vec3 &x);
Real optical_depth(const ResampledField &field, const Ray &ray, Real end);
Real majorant(const ResampledField &field, const Box &box);
Collision first_collision(const ResampledField &field, const Ray &ray, Real end, Event event);

} // namespace wisp::WISP_ARITH
