// The irradiance map (S4-4): light that was scattered more than once, kept at the nodes of bricks and interpolated
// while marching, instead of an estimate at every step.
//
// A point holds the mean radiance phi / (4 pi) that arrives there from all directions, which every smoke scatters by
// its own sigma_s, and the flux with it where some smoke does not scatter evenly: the map belongs to no view.
//
//   value, all light of one colour   |31                     0|   radiance in units of 2^(exponent - 30)
//   value, else                      |31                     0|   a packed colour (packed_light.h)
//   flux                             |31                     0|   a packed flux, as part of the radiance
#pragma once
#include "wisp/packed_light.h"
#include "wisp/photon_bricks.h"

namespace wisp::WISP_ARITH {

constexpr int32_t grey_bits = 30;

struct Irradiance {
    const Bricks *bricks;
    const int32_t *first;  // by brick: its first point
    const int32_t *stride; // by brick: cells between its points
    const uint32_t *value; // by point
    const uint32_t *flux;  // or nullptr
    uint32_t points;
    bool grey;        // all light has one colour
    Color color;      // ... namely this, its largest channel 1
    int32_t exponent; // the brightest is below 2^exponent
    bool ready;       // false: the arena was too small
};

// The map of what photons left. `tolerance` > 0: bricks are given as few points as keep every other one within that
// part of the brick's largest (adaptive).
Irradiance make_irradiance(const BrickDeposits &deposits, Real tolerance, Arena &arena);
uint64_t irradiance_bytes(uint64_t bricks, int32_t stride, bool flux);

inline uint64_t bytes_of(const Irradiance &map) {
    return uint64_t{map.points} * (map.flux ? 8 : 4) + uint64_t{map.bricks->count} * 2 * sizeof(int32_t);
}

// The mean radiance at p, a place in a brick in cells, and which part of it flows whither.
NodeLight light_at(const Irradiance &irradiance, uint32_t brick, const Vec3 &p);

} // namespace wisp::WISP_ARITH
