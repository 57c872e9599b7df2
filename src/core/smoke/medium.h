// The smoke of a scene: all of its volumes together.
#pragma once
#include "core/geometry/ray.h"
#include "core/smoke/density_field.h"
#include "core/smoke/phase.h"

namespace wisp::WISP_ARITH {

// One `smoke` block.
struct SmokeVolume {
    DensityField field;
    Color albedo;
    Phase phase = Phase(Real(0));
    Color emission;      // L_e
    Color emitted_power; // of the whole smoke: 4 pi (1 - albedo) L_e times the integral of sigma_t
    // Where the smoke emits: for each particle or sample, the fraction of the integral of sigma_t that lies before it,
    // in units of 2^-32; or else nullptr.
    const uint32_t *area_fraction_before;
    const SmokeDescription *source;
};

// All smokes of a scene. Their densities add; a photon collides with the nearest of their collisions.
struct Medium {
    SmokeVolume *smokes;
    uint32_t count;
    const SparseGrid *bricks; // to which the densities are resampled; nullptr: they are exact
    Box bounds;               // of all supports; empty without smoke
    Sphere sphere;            // around all supports
    bool ready;               // false: the arena was too small

    bool empty() const { return !(bounds.low.x < bounds.high.x); }
};

// `density_step` is the edge of the sparse grid's cells in units of the smallest smoothing length; 0 means exact
// densities. Smoke that cannot be resampled has exact densities in any case.
Medium make_medium(const Scene &scene, double density_step, Arena &arena, Watch watch = {});
uint64_t medium_bytes(const Scene &scene, double density_step);

// Raises `squared` to the largest squared distance of a smoke's particles from a point. False: the work is stopped.
bool find_reach(const SmokeDescription &smoke, const Vec3 &from, Watch watch, Real &squared);

// The integral of sigma_t of all smokes over the ray's distances 0 to `end`.
Real optical_depth(const Medium &medium, const Ray &ray, Real end);

// sigma_t of all smokes at x, per unit of length; and an upper bound of it in a box.
inline Real extinction(const Medium &medium, const Vec3 &x) {
    Real sum = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i) sum += extinction(medium.smokes[i].field, x);
    return sum;
}
inline Real majorant(const Medium &medium, const Box &box) {
    Real sum = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i) sum += majorant(medium.smokes[i].field, box);
    return sum;
}

// Whether there is smoke within `spacing` cells of a node, inside the brick. `node` is given in cells from the brick's
// low corner. If the medium is resampled, `bricks` must be its own grid.
bool meets_smoke(const Medium &medium, const SparseGrid &bricks, uint32_t brick, const Cell &node, int32_t spacing);

struct MediumCollision {
    bool found;
    Real distance;
    uint32_t smoke;   // index of the smoke that the photon collided with
    uint32_t element; // the particle (slot) or sample, drawn in proportion to its density there
};

MediumCollision first_collision(const Medium &medium, const Ray &ray, Real end, Event event);
// The sum of density(field) over the smokes that are resampled.
template <class Density> Real sum_of_resampled(const Medium &medium, Density &&density) {
    Real sum = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i)
        if (medium.smokes[i].field.is_resampled) sum += density(medium.smokes[i].field.resampled);
    return sum;
}
// Where sigma_t of resampled smoke changes so much between the corners of one of the finest cells that depths bend in
// it (march/README, Steps). Depths that are known at nodes `spacing` cells apart bend more.
struct Bend {
    bool of_depths; // they are not interpolated there
    Real densest;   // sigma_t of the densest corner, if steps are to be divided by it; else 0
};
// Whether they may bend in any cell of the brick.
bool may_bend_in(const Medium &medium, int32_t spacing, uint32_t brick);
// `node`: the lowest corner of the cell in the brick.
Bend bend_of_cell(const Medium &medium, int32_t spacing, uint32_t brick, uint32_t node);
// The same at a point of the medium's bounds; none where smoke is not resampled.
Bend bend_at(const Medium &medium, int32_t spacing, const Vec3 &x);
// Of resampled smoke, all of which has the same.
inline Phase common_phase(const Medium &medium) {
    uint32_t i = 0;
    while (i + 1 < medium.count && !medium.smokes[i].field.is_resampled) ++i;
    return medium.smokes[i].phase;
}
inline Color albedo(const Medium &medium, const MediumCollision &at) { return medium.smokes[at.smoke].albedo; }
inline Phase phase(const Medium &medium, const MediumCollision &at) { return medium.smokes[at.smoke].phase; }

} // namespace wisp::WISP_ARITH
