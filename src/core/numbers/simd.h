// Loops over lanes: values that are computed side by side, whatever the width of the hardware's vectors.
#pragma once
#include <cstdint>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

// Functions whose loops run over `lanes` values. g++ compiles them for AVX2 too, and the program takes the version that
// the CPU has. (clang 14 has target_clones, but not together with flatten.) The bits are the same in every version:
// the number of lanes and the order of their sums are fixed, and contraction is off. They are never inlined, with one
// version neither: their arrays of lanes are on the stack only while they run. (Where code is to be small, g++
// decides.)
#if defined(__x86_64__) && defined(__linux__) && defined(WISP_MULTIVERSION) && !defined(__clang__)
#define WISP_MULTIVERSIONED __attribute__((target_clones("avx2", "default"), flatten))
// ... and for AVX-512, which has masks of lanes: rays through triangles gain by it, smoke does not.
#define WISP_MULTIVERSIONED_WITH_MASKS __attribute__((target_clones("arch=x86-64-v4", "avx2", "default"), flatten))
#elif defined(__OPTIMIZE_SIZE__)
#define WISP_MULTIVERSIONED
#define WISP_MULTIVERSIONED_WITH_MASKS
#else
#define WISP_MULTIVERSIONED            __attribute__((noinline))
#define WISP_MULTIVERSIONED_WITH_MASKS __attribute__((noinline))
#endif

// Before a loop over lanes: keeps g++ from unrolling a loop that should become one vector instruction.
#if defined(__GNUC__) && !defined(__clang__)
#define WISP_NO_UNROLL _Pragma("GCC unroll 1")
#else
#define WISP_NO_UNROLL
#endif

// Functions that must be inlined into a WISP_MULTIVERSIONED caller, to be compiled for its vectors. Where code is to be
// small, there are no vectors.
#if defined(__OPTIMIZE_SIZE__) && !defined(WISP_MULTIVERSION)
#define WISP_INLINE inline
#else
#define WISP_INLINE __attribute__((always_inline)) inline
#endif

namespace wisp {

constexpr uint32_t lanes = 8;

// The sum of all lanes, in one order for every arithmetic and every width of hardware.
template <class T> constexpr T sum_of_lanes(const T (&sum)[lanes]) {
    static_assert(lanes == 8, "the order of additions below is for eight");
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

// A mask of the lanes where a is not less than b. x86 has instructions for it, which g++ does not find.
template <class T> WISP_INLINE uint32_t lanes_not_less(const T (&a)[lanes], const T (&b)[lanes]) {
    uint32_t mask = 0;
    WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) mask |= a[l] < b[l] ? 0u : 1u << l;
    return mask;
}
#if defined(__SSE2__)
WISP_INLINE uint32_t lanes_not_less(const float (&a)[lanes], const float (&b)[lanes]) {
    uint32_t mask = 0;
    for (uint32_t l = 0; l < lanes; l += 4)
        mask |= static_cast<uint32_t>(_mm_movemask_ps(_mm_cmpnlt_ps(_mm_loadu_ps(a + l), _mm_loadu_ps(b + l)))) << l;
    return mask;
}
WISP_INLINE uint32_t lanes_not_less(const double (&a)[lanes], const double (&b)[lanes]) {
    uint32_t mask = 0;
    for (uint32_t l = 0; l < lanes; l += 2)
        mask |= static_cast<uint32_t>(_mm_movemask_pd(_mm_cmpnlt_pd(_mm_loadu_pd(a + l), _mm_loadu_pd(b + l)))) << l;
    return mask;
}
#endif

} // namespace wisp
