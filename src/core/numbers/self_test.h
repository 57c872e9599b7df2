// Does this machine, as it is set up now, compute what the bits of every picture rest on? A program asks before it
// renders, and refuses when it does not: one library built with -ffast-math anywhere in the process switches subnormal
// numbers off for all of it, and a build that contracts a * b + c draws a picture that only looks right.
//
// The operands are volatile, so that the operations happen at run time and in the mode of that moment.
#pragma once
#include "core/numbers/elementary.h"

namespace wisp {

// The bits that a few operations give.
struct ArithmeticProbe {
    uint64_t product_sum_64, excess_64, halved_64, doubled_64, quotients_64[4];
    uint32_t product_sum_32, excess_32, halved_32[8], doubled_32, quotients_32[4];
    uint32_t small_exp; // e^-100 in float, a subnormal number
};

namespace detail {
template <class T> inline BitsOf<T> product_sum_bits(T a_value, T c_value) {
    const volatile T a = a_value, c = c_value;
    const T first = a, second = a, addend = c;
    return to_bits(first * second + addend);
}
template <class T> inline BitsOf<T> excess_bits(T small_value) {
    const volatile T one = 1, small = small_value;
    const T start = one;
    return to_bits((start + small) - start);
}
template <class T> inline BitsOf<T> product_bits(T a_value, T b_value) {
    const volatile T a = a_value, b = b_value;
    return to_bits(static_cast<T>(a * b));
}
template <class T> inline BitsOf<T> quotient_bits(T a_value, T b_value) {
    const volatile T a = a_value, b = b_value;
    return to_bits(static_cast<T>(a / b));
}
} // namespace detail

inline ArithmeticProbe probe_arithmetic() {
    ArithmeticProbe probe = {};
    // Exactly 2^-60 and 2^-24 when the product is not rounded before the sum, 0 when it is. (hard case F2)
    probe.product_sum_64 = detail::product_sum_bits<double>(1 + 0x1p-30, -(1 + 0x1p-29));
    probe.product_sum_32 = detail::product_sum_bits<float>(1 + 0x1p-12f, -(1 + 0x1p-11f));
    // 0, unless a sum is kept in a longer format.
    probe.excess_64 = detail::excess_bits<double>(0x1p-60);
    probe.excess_32 = detail::excess_bits<float>(0x1p-30f);
    // A subnormal result, and a subnormal operand. (F3) A vector unit may have a mode of its own: eight lanes at once.
    probe.halved_64 = detail::product_bits<double>(0x1p-1022, 0.5);
    probe.doubled_64 = detail::product_bits<double>(0x1p-1074, 0x1p1000);
    probe.doubled_32 = detail::product_bits<float>(0x1p-149f, 0x1p100f);
    const volatile float smallest_normal = 0x1p-126f;
    float lane[8];
    for (float &x : lane) x = smallest_normal;
    for (float &x : lane) x *= 0.5f;
    for (int i = 0; i < 8; ++i) probe.halved_32[i] = detail::to_bits(lane[i]);
    // In double 1/3 goes down to the nearest number and 1/10 up: with both signs they tell the four modes apart. 1/3
    // alone does not, rounded towards zero it has the same bits. (F4)
    const int numerators[4] = {1, -1, 1, -1}, denominators[4] = {3, 3, 10, 10};
    for (int i = 0; i < 4; ++i) {
        probe.quotients_64[i] = detail::quotient_bits<double>(numerators[i], denominators[i]);
        probe.quotients_32[i] =
            detail::quotient_bits(static_cast<float>(numerators[i]), static_cast<float>(denominators[i]));
    }
    const volatile float exponent = -100;
    probe.small_exp = detail::to_bits(exp(exponent));
    return probe;
}

// What is wrong with the arithmetic that gave these bits, or nullptr.
inline const char *arithmetic_fault(const ArithmeticProbe &probe) {
    constexpr uint64_t quotients_64[4] = {0x3fd5555555555555, 0xbfd5555555555555, 0x3fb999999999999a,
                                          0xbfb999999999999a};
    constexpr uint32_t quotients_32[4] = {0x3eaaaaab, 0xbeaaaaab, 0x3dcccccd, 0xbdcccccd};
    for (int i = 0; i < 4; ++i)
        if (probe.quotients_64[i] != quotients_64[i] || probe.quotients_32[i] != quotients_32[i])
            return "results are not rounded to the nearest number";
    if (probe.excess_64 != 0 || probe.excess_32 != 0) return "sums are reordered or kept in a longer format";
    if (probe.product_sum_64 != 0 || probe.product_sum_32 != 0) return "a * b + c is contracted to one rounding";
    bool keeps_results = probe.halved_64 == 0x0008000000000000;
    for (const uint32_t bits : probe.halved_32) keeps_results = keeps_results && bits == 0x00400000;
    if (!keeps_results) return "subnormal results are flushed to zero";
    if (probe.doubled_64 != detail::to_bits(0x1p-74) || probe.doubled_32 != detail::to_bits(0x1p-49f))
        return "subnormal operands are taken as zero";
    if (probe.small_exp != 27) return "the elementary functions give other bits";
    return nullptr;
}

// What is wrong with the arithmetic of this machine at this moment, or nullptr when all is well.
inline const char *arithmetic_fault() { return arithmetic_fault(probe_arithmetic()); }

} // namespace wisp
