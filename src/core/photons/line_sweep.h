// Multiply scattered light, gathered again along parallel lines (S4-5).
//
// Photons give the light at the nodes of a field, with noise. That light and the lights' own scatter in the smoke.
// Lines in directions spread over the sphere cross all smoke, carry what is scattered along them from step to step, and
// leave at the nodes what arrives there: the light that has been scattered once or more. Each value is then a mean over
// much smoke, and has little of the photons' noise. What it errs by is the small number of directions. The lines form
// two sets. Their difference says how much that is, and where it is more than the photons' noise, photons count more.
// At last the blur of the cells is taken away.
//
// Where the phase is isotropic, all of that is done for the light that a set of lines gathered first.
//
// Where the phase is not isotropic, photons say at each node what is scattered along each line, by their flux and
// spherical harmonics. What arrives along the lines is weighted by the phase function towards the eye: no moments of
// its directions are needed.
#pragma once
#include "core/lights/least_distance.h"
#include "core/lights/optical_depth_grid.h"
#include "core/smoke/phase.h"

namespace wisp::WISP_ARITH {

struct LineSweep {
    const Medium *medium;           // resampled; no surface is in it
    const OpticalDepthGrid *depths; // over the medium's bricks
    int32_t spacing;                // cells between the nodes
    int32_t sigma_shift;            // extinctions are scaled by 2^sigma_shift where they are weights
    Phase phase;                    // of all smokes
    Vec3 eye;                       // of all camera rays
    int32_t turns;                  // of the axes, in each of both sets: 1 or 2
    uint64_t seed;                  // of where lines lie
};

// The light of photons in a field of nodes_of(spacing) values a brick, brick after brick, that was scattered at least
// once: its mean radiance from all directions, and the distribution of these (irradiance_map.h has the packing).
struct LightOfPhotons {
    // By node: whether the smoke around it is dense enough for its light to matter. Every radiance is set.
    const bool *known;
    Color *radiance;
    const uint32_t *flux;      // by node; nullptr where the phase is isotropic, as the next
    const uint32_t *harmonics; // at nodes of their own
    int32_t harmonic_spacing;  // cells between these
};

// Replaces the radiance by what photons and lines say of the radiance that is scattered towards the eye, times
// 4 pi / albedo / sigma_t: of isotropic phases the mean radiance, as before. Unknown nodes keep the light of photons.
// False: the arena was too small, or the work is stopped; the arena is given back.
bool sweep_lines(const LineSweep &sweep, const LightOfPhotons &light, Arena &arena, Watch watch = {});
// `of_line`: how many bricks a line crosses at most.
uint64_t line_sweep_bytes(uint64_t bricks, uint64_t of_line, int32_t spacing, bool isotropic);

// Whether lines pay: they cross all places of the lattice of bricks, and do not where few of these hold bricks.
bool suits_lines(uint64_t places, uint64_t bricks);

} // namespace wisp::WISP_ARITH
