// The unit of length of the core's scene.
#pragma once
#include "host/prepare/prepare_surfaces.h"
#include "host/scene/options.h"
#include <vector>

namespace wisp {

// How far a smoke reaches (the centres of its particles, or a grid), and its smoothing lengths, in the units of the
// file.
struct SmokeExtent {
    Double3 low, high;
    double smallest_h = 0, largest_h; // smallest_h = 0: it is empty

    bool any() const { return smallest_h > 0; }
    void add(const Double3 &x, double h);
};
SmokeExtent extent_of_all(const std::vector<SmokeExtent> &smokes);

// A power of two as large as it may be: without surfaces the smallest smoothing length becomes 1 to 2, surfaces have a
// unit of their own. It is smaller where the smoke reaches beyond coordinate_limit, or is coarse beside surfaces.
// surfaces: nullptr where there are none; `smokes` by their numbers, one at least not empty. Throws InputError with the
// smoke's place where smoothing lengths or surfaces become too small for the arithmetic.
Unit find_unit(const SceneFile &file, const std::vector<SmokeExtent> &smokes, const PreparedSurfaces *surfaces,
               Arithmetic arithmetic);

} // namespace wisp
