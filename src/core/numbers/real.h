// Real: the scalar of the arithmetic that is being compiled. Core sources are written once, inside
// `namespace wisp::WISP_ARITH`. They are compiled three times, with -DWISP_ARITH=f32, f64 and fixed, and one program
// links all three.
#pragma once
#include "core/numbers/elementary.h"
#include "core/numbers/fixed.h"
#include "core/numbers/simd.h"

#ifndef WISP_ARITH
#error "compile the core with -DWISP_ARITH=f32, -DWISP_ARITH=f64 or -DWISP_ARITH=fixed"
#endif

#define WISP_STRING_OF(name) #name
#define WISP_STRING(name)    WISP_STRING_OF(name)
#define WISP_ARITH_NAME      WISP_STRING(WISP_ARITH) // "f32", "f64" or "fixed"

namespace wisp {

namespace f32 {
using Real = float;
}
namespace f64 {
using Real = double;
}
namespace fixed {
using Real = Fixed;
}

} // namespace wisp
