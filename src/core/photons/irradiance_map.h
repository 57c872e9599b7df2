// The irradiance map (S4-4): multiply scattered light, stored at the nodes of a sparse grid and interpolated while
// marching, instead of an estimate at every step.
//
// A point stores the mean radiance, fluence / (4 pi), that arrives there from all directions; every smoke scatters it
// by its own sigma_s. Where some smoke is not isotropic, the point stores the flux too. So the map does not depend on
// the view, but where light was gathered towards the eye along lines, or photons were kept as scattered to it: there
// the point stores what the smoke scatters to the eye, and no flux. A map made of photon maps on particles stores the
// light that all smoke there scatters, because photon maps estimate collisions, not fluence. Coefficients of spherical
// harmonics are stored in resampled smoke only, at nodes of their own.
//
//   value, one channel    |31                     0|   radiance in units of 2^(exponent - 30), by brick
//   value, three channels |31                     0|   a packed colour (packed_light.h)
//   flux                  |31                     0|   a packed flux relative to the radiance
#pragma once
#include "core/geometry/camera.h"
#include "core/photons/fluence_sums.h"
#include "core/photons/line_sweep.h"
#include "core/photons/packed_light.h"
#include "core/photons/packed_particle_map.h"

namespace wisp::WISP_ARITH {

constexpr int32_t single_channel_bits = 30;

struct Irradiance {
    const SparseGrid *bricks;
    const int32_t *first;      // by brick: its first point
    const int32_t *spacing;    // by brick: cells between its points
    const ColorScale *scale;   // by brick; of one channel: all exponents are the same
    const uint32_t *value;     // by point
    const uint32_t *flux;      // by point; or nullptr
    const uint32_t *harmonics; // packed like fluxes, three coefficients a word, harmonic_words a node; or nullptr
    int32_t harmonic_spacing;  // cells between these nodes, the same in every brick
    uint32_t points;
    bool incident;       // a point holds arriving light, to be multiplied by sigma_s; false: scattered light
    bool single_channel; // all light has one colour
    Color color;         // ... which is this; its largest channel is 1
    CutCells cut;        // a brick that has some has as many points as the field
    TowardsOneEye one_eye;
    Real variance; // at most, of what a ray sees by the map, relative to that: by photons at nodes (README, Noise)
    bool ready; // false: the arena was too small
};
inline uint64_t bytes_of(const Irradiance &map) {
    const uint64_t per_brick = 2 * sizeof(int32_t) + sizeof(ColorScale) +
                               (map.harmonics ? nodes_of(map.harmonic_spacing) * harmonic_words * 4 : 0);
    return uint64_t{map.points} * (map.flux ? 8 : 4) + uint64_t{map.bricks->count} * per_brick;
}
// What a map takes from the arena at most; `of_fluence`: one that is made of the fluence grid.
// `of_line`: 0, or its light is gathered again along lines that cross so many bricks at most.
uint64_t irradiance_bytes(const Scene &scene, uint64_t bricks, int32_t spacing, bool flux, bool of_fluence,
                          bool harmonics, uint64_t of_line);

// The gather of light along lines (S4-5), which is towards the eye where the phase is not isotropic.
struct LineGather {
    const OpticalDepthGrid *depths; // to the lights; nullptr: there is no gather
    Vec3 eye;
    int32_t turns; // LineSweep::turns
    uint64_t seed; // of where lines lie
};

// The map of the fluence at the nodes, gathered again along lines. With `tolerance` > 0 the map is adaptive: each
// brick has as few points as keep all others within that fraction of the brick's largest value.
Irradiance make_irradiance(const Medium &medium, const FluenceSums &sums, const LineGather &gather, Real tolerance,
                           Arena &arena, Watch watch = {});

struct IrradianceRequest {
    const Medium *medium;
    const SparseGrid *bricks;
    int32_t spacing;
    Real tolerance;
    bool flux;       // some smoke is not isotropic
    ViewBounds view; // bricks outside stay empty
};
// The map of estimates from photon maps (S4-2), one map and one largest radius per smoke.
Irradiance make_irradiance(const IrradianceRequest &request, const PhotonMap *maps, const Real *radius, Gather &gather,
                           Arena &arena, Statistics &statistics, Watch watch = {});
// The map of a particle map (S4-3): the light of the particles around, weighted by their contributions to the density.
Irradiance make_irradiance(const IrradianceRequest &request, const PackedMap &map, Arena &arena, Watch watch = {});

// From which distance on a ray from the eye reads the map for what is nearer, as what lies at `distance`. 0: it reads
// its own places: nothing is nearer, or a surface stands in between.
Real nearest_read(const Irradiance &irradiance, const Ray &from_eye, Real distance);

// The fluence and flux at p, in cells from the beginning of a brick.
FluenceAndFlux light_at(const Irradiance &irradiance, uint32_t brick, const Vec3 &p);

// The multiply scattered light at x along `out`, per unit of length. `extinctions` are the smokes' sigma_t there.
Color scattered_light(const Irradiance &irradiance, const Medium &medium, const Vec3 &x, const Vec3 &out,
                      const Real *extinctions);

} // namespace wisp::WISP_ARITH
