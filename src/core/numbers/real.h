// The scalar of the arithmetic that is being compiled. Core sources are written once, inside
// `namespace wisp::WISP_ARITH`, and compiled three times with -DWISP_ARITH=f32, f64 and fixed, so that all three
// arithmetics live in one program.
#pragma once
#include "core/numbers/elementary.h"
#include "core/numbers/fixed.h"

#ifndef WISP_ARITH
#error "compile the core with -DWISP_ARITH=f32, -DWISP_ARITH=f64 or -DWISP_ARITH=fixed"
#endif

#define WISP_STRING_OF(name) #name
#define WISP_STRING(name)    WISP_STRING_OF(name)
#define WISP_ARITH_NAME      WISP_STRING(WISP_ARITH) // "f32", "f64" or "fixed"

// With g++, functions whose loops run over `lanes` values are compiled for wider vectors too, and the widest that the
// CPU has is taken (clang 14 knows target_clones, but not beside flatten). Bits do not change: lanes and the order of
// their sums are fixed, and contraction is off.
#if defined(__x86_64__) && defined(__linux__) && defined(WISP_MULTIVERSION) && !defined(__clang__)
#define WISP_MULTIVERSIONED __attribute__((target_clones("avx2", "default"), flatten))
#else
#define WISP_MULTIVERSIONED
#endif

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

// Values that a leaf loop handles side by side, whatever the width of the hardware.
constexpr uint32_t lanes = 8;

} // namespace wisp
