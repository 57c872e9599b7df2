// A sphere.
#pragma once
#include "core/numbers/vec.h"

namespace wisp::WISP_ARITH {

struct Sphere {
    Vec3 center;
    Real radius; // 0: empty
};

} // namespace wisp::WISP_ARITH
