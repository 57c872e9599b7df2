// Multiply scattered light, gathered once more along parallel lines (S4-5).
//
// Photons give the light at the nodes of a field, with noise. That light and the lights' own scatter in the smoke.
// Lines in directions spread over the sphere cross all smoke, carry what is scattered along them from step to step, and
// leave at the nodes what arrives there: the light that has been scattered once or more. Each value is then a mean over
// much smoke, and has little of the photons' noise. What it errs by is the small number of directions. The lines form
// two sets. Their difference says how much that is, and where it is more than the photons' noise, photons count more.
#pragma once
#include "core/lights/optical_depth_grid.h"

namespace wisp::WISP_ARITH {

struct LineSweep {
    const Medium *medium;           // resampled, isotropic; no surface is in it
    const OpticalDepthGrid *depths; // over the medium's bricks
    int32_t spacing;                // cells between the nodes
    int32_t sigma_shift;            // extinctions are scaled by 2^sigma_shift where they are weights
};

// The light in a field of nodes_of(spacing) values a brick, brick after brick: mean radiance from all directions that
// was scattered at least once. `known[i]`: whether the smoke around value i is dense enough for its light to matter;
// every value is set. The known ones are replaced. False: the arena was too small, or the work is stopped; the arena is
// given back.
bool sweep_lines(const LineSweep &sweep, const bool *known, Color *radiance, Arena &arena, Watch watch = {});
uint64_t line_sweep_bytes(uint64_t bricks, int32_t spacing);

// Whether lines help. They cross all places of the lattice, and do not pay where few of these hold bricks. They miss
// the light of a point next to it, so no point light or spot may stand in the smoke, or near it.
bool suits_lines(const LineSweep &sweep);

} // namespace wisp::WISP_ARITH
