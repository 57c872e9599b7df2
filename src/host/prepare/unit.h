// The unit of length of the core's scene.
#pragma once
#include "host/prepare/prepare_surfaces.h"
#include "host/scene/options.h"
#include <vector>

namespace wisp {

SmokeExtent extent_of_all(const std::vector<SmokeExtent> &smokes);

// Whether the smoke reaches beyond coordinate_limit in the unit that it, or the surfaces, would have. surfaces: nullptr
// where there are none.
bool is_wide(const SmokeExtent &all, const PreparedSurfaces *surfaces);

// A power of two. The smallest smoothing length becomes 1 to 2, as far as surfaces do not become too small for that.
// The unit is larger where the smoke is wide, or coarse beside surfaces. `smokes` by their numbers, one at least not
// empty; `particles` in the order of their files. Throws InputError with the smoke's place, and its farthest particle,
// where smoothing lengths or surfaces become too small for the arithmetic.
Unit find_unit(const SceneFile &file, const std::vector<SmokeExtent> &smokes,
               const std::vector<std::vector<Particle>> &particles, const PreparedSurfaces *surfaces,
               Arithmetic arithmetic);

} // namespace wisp
