// Smoke resampled to a sparse grid (S4-1): sigma_t at the nodes, trilinear between them.
#pragma once
#include "core/smoke/grid_field.h"
#include "core/smoke/particle_field.h"
#include "core/smoke/sparse_grid.h"

namespace wisp::WISP_ARITH {

// The limit of tentative collisions in one flight. A flight with more of them would advance by less than the resolution
// of Real between two.
constexpr uint32_t max_tentative = 1u << 16;

struct ResampledField {
    const SparseGrid *bricks;
    const Real *extinction; // nodes_of(1) values a brick
    const Real *minorants;  // by brick: the smallest of its values
    const Real *majorants;  // ... and the largest
    Real largest;           // ... of all bricks
    uint32_t dimension;     // the dimension of a photon's draws (random.h)
    bool ready;             // false: the arena was too small

    const Real *nodes(uint32_t brick) const { return extinction + size_t{brick} * nodes_of(1); }
};

// Computes sigma_t of `source` at the nodes: a sum over its particles, or an interpolation of its grid's samples.
ResampledField resample(const SmokeDescription &source, const SparseGrid &bricks, uint32_t dimension, Arena &arena,
                        Watch watch = {});
// The bytes that resample() takes from the arena for `bricks` bricks, scratch included.
uint64_t resampled_field_bytes(const SmokeDescription &source, uint64_t bricks);

// sigma_t at p, given in cells from the brick's low corner.
inline Real extinction(const ResampledField &field, uint32_t brick, const Vec3 &p) {
    const Real *nodes = field.nodes(brick);
    return between_nodes(find_cell(p, 1), 1, [nodes](uint32_t node) { return nodes[node]; });
}

// sigma_t at x, per unit of length; 0 where there is no brick.
Real extinction(const ResampledField &field, const Vec3 &x);

// Where sigma_t changes by more than this, times a cell's edge, depths bend within the cell: between dense samples and
// empty ones.
constexpr Real max_bend = Real(0.25);

// The integral of sigma_t over the ray's distances 0 to `end`, by the midpoint rule with steps of at most a cell, a
// quarter of one in bricks where sigma_t bends depths, or of a brick where it is constant.
Real optical_depth(const ResampledField &field, const Ray &ray, Real end);

// An upper bound of sigma_t in the box.
Real majorant(const ResampledField &field, const Box &box);

// A photon's first collision before `end`, by delta tracking (Woodcock et al. 1965) with each brick's majorant.
// Collision::element is the brick. There is no collision if a flight exceeds max_tentative.
Collision first_collision(const ResampledField &field, const Ray &ray, Real end, Event event);

} // namespace wisp::WISP_ARITH
