// The irradiance map (S4-4): light that was scattered more than once, kept at the nodes of bricks and interpolated
// while marching, instead of an estimate at every step.
//
// A point holds the mean radiance phi / (4 pi) that arrives there from all directions, which every smoke scatters by
// its own sigma_s, and the flux with it where some smoke does not scatter evenly: the map belongs to no view. Made of
// photon maps it holds what all smoke there scatters, as their estimate is of collisions, not of light. Moments beyond
// the flux are kept in resampled smoke, at nodes of their own, as many in every brick.
//
//   value, all light of one colour   |31                     0|   radiance in units of 2^(exponent - 30), by brick
//   value, else                      |31                     0|   a packed colour (packed_light.h)
//   flux                             |31                     0|   a packed flux, as part of the radiance
#pragma once
#include "core/geometry/camera.h"
#include "core/photons/packed_light.h"
#include "core/photons/fluence_grid.h"
#include "core/photons/packed_particle_map.h"

namespace wisp::WISP_ARITH {

constexpr int32_t single_channel_bits = 30;
constexpr uint32_t harmonic_words = harmonic_count / 3;
static_assert(harmonic_words * 3 == harmonic_count, "packed by threes, as fluxes are");

struct Irradiance {
    const SparseGrid *bricks;
    const int32_t *first;      // by brick: its first point
    const int32_t *stride;     // by brick: cells between its points
    const int32_t *exponent;   // by brick: its brightest point is below 2^exponent
    const uint32_t *value;     // by point
    const uint32_t *flux;      // or nullptr
    const uint32_t *harmonics; // packed as fluxes, three in each of `harmonic_words`; or nullptr
    int32_t harmonic_spacing;
    uint32_t points;
    bool of_light;       // a point is to be multiplied with sigma_s; false: it has been
    bool single_channel; // all light has one colour
    Color color;         // ... namely this, its largest channel 1
    bool ready;          // false: the arena was too small
};
inline uint64_t bytes_of(const Irradiance &map) {
    const uint64_t of_brick =
        3 * sizeof(int32_t) + (map.harmonics ? nodes_of(map.harmonic_spacing) * harmonic_words * 4 : 0);
    return uint64_t{map.points} * (map.flux ? 8 : 4) + uint64_t{map.bricks->count} * of_brick;
}
uint64_t irradiance_bytes(const Scene &scene, uint64_t bricks, int32_t stride, bool flux, bool harmonics);

// The map of what photons left at the bricks' nodes. `tolerance` > 0: bricks are given as few points as keep every
// other one within that part of the brick's largest (adaptive).
Irradiance make_irradiance(const Medium &medium, const FluenceSums &deposits, Real tolerance, Arena &arena);

struct IrradianceRequest {
    const Medium *medium;
    const SparseGrid *bricks;
    int32_t stride;
    Real tolerance;
    bool flux;       // some smoke does not scatter evenly
    ViewBounds view; // bricks outside hold nothing
};
// Of photon maps, one a smoke: estimates within `radius`, one a smoke (S4-2).
Irradiance make_irradiance(const IrradianceRequest &request, const PhotonMap *maps, const Real *radius, Gather &gather,
                           Arena &arena, Statistics &statistics);
// Of a particle map: the light of the particles around, by their parts in the density (S4-3).
Irradiance make_irradiance(const IrradianceRequest &request, const PackedMap &map, Arena &arena);

// The map's value at p, a place in a brick in cells.
FluenceAndFlux light_at(const Irradiance &irradiance, uint32_t brick, const Vec3 &p);

// What is scattered at x along `out` for the second time and more, per unit of length; the smokes have these
// extinctions there.
Color scattered_light(const Irradiance &irradiance, const Medium &medium, const Vec3 &x, const Vec3 &out,
                      const Real *extinctions);

} // namespace wisp::WISP_ARITH
