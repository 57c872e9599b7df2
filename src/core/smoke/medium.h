// The smoke of a scene: what the march, the shadows and the photons ask of it.
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
    Color emission;              // L_e
    Color emitted_power;         // of all its photons: 4 pi (1 - albedo) L_e times the integral of sigma_t
    const uint32_t *area_before; // per particle or sample, where it glows: the share of 2^32 of those before
    const SmokeDescription *source;
};

// All smokes of a scene. Their densities add; a photon collides with the nearest of their collisions.
struct Medium {
    SmokeVolume *smokes;
    uint32_t count;
    const SparseGrid *bricks; // to which the densities are resampled; nullptr where they are exact
    Box bounds;               // of all supports; empty without particles
    Sphere sphere;            // around them
    bool ready;               // false: the arena was too small

    bool empty() const { return !(bounds.low.x < bounds.high.x); }
};

// `density_step`: the size of the bricks' cells in smoothing lengths of the finest smoke; 0: exact densities, as of any
// smoke that cannot be resampled.
Medium make_medium(const Scene &scene, double density_step, Arena &arena);
uint64_t medium_bytes(const Scene &scene, double density_step);

// int sigma_t of all smokes over the ray's distances 0 to `end`.
Real optical_depth(const Medium &medium, const Ray &ray, Real end);

// Whether there is smoke in the cells of the brick around a node of a field, given in cells. `bricks` are the medium's
// own where it has been resampled.
bool meets_smoke(const Medium &medium, const SparseGrid &bricks, uint32_t brick, const Cell &node, int32_t stride);

struct MediumCollision {
    bool found;
    Real distance;
    uint32_t smoke;   // index of the smoke that the photon collided with
    uint32_t element; // which of its particles (slot) or samples, drawn with its share of the density
};

MediumCollision first_collision(const Medium &medium, const Ray &ray, Real end, Event event);
inline Color albedo(const Medium &medium, const MediumCollision &at) { return medium.smokes[at.smoke].albedo; }
inline Phase phase(const Medium &medium, const MediumCollision &at) { return medium.smokes[at.smoke].phase; }

} // namespace wisp::WISP_ARITH
