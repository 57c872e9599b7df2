// The result of a photon's flight through one density field.
#pragma once
#include "core/numbers/real.h"

namespace wisp::WISP_ARITH {

struct Collision {
    bool found;
    Real distance;    // along the ray
    uint32_t element; // what the photon collides with: a particle's slot, a grid's sample, or a brick
};

} // namespace wisp::WISP_ARITH
