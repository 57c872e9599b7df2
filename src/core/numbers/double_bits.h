// Comparison and product of the doubles in scenes and settings, by integers, with the results of an FPU. So fixed-point
// programs need no floating-point code. Arguments must not be NaN or infinite.
#pragma once
#include "core/numbers/fixed.h"
#include "wisp/double3.h"

namespace wisp {

// An integer that increases with x; 0 for +0 and -0.
template <class Float> constexpr auto total_order_key(Float x) {
    using Signed = std::make_signed_t<detail::BitsOf<Float>>;
    const Signed bits = static_cast<Signed>(detail::to_bits(x));
    return bits < 0 ? std::numeric_limits<Signed>::min() - bits : bits;
}

namespace detail {
// |x| = mantissa 2^exponent, 2^62 <= mantissa < 2^63 or 0.
struct Decomposed {
    int64_t mantissa;
    int exponent;
};
constexpr Decomposed decompose(double x) {
    const uint64_t bits = to_bits(x) & (UINT64_MAX >> 1), field = bits >> 52;
    const uint64_t mantissa = field == 0 ? bits : (bits & 0xfffffffffffff) | 0x10000000000000;
    if (mantissa == 0) return {0, 0};
    const int up = leading_zeros(mantissa) - 1;
    return {static_cast<int64_t>(mantissa << up), static_cast<int>(field == 0 ? 1 : field) - 1075 - up};
}
} // namespace detail

// a b, rounded to the nearest double; a product of 0 is +0, whatever the signs.
constexpr double rounded_product(double a, double b) {
    using namespace detail;
    const Decomposed x = decompose(a), y = decompose(b);
    const Wide exact = detail::product<Wide>(x.mantissa, y.mantissa);
    // The high word has 60 bits or more. Its last bit is set if the low word is not 0, which decides ties correctly.
    const uint64_t magnitude = static_cast<uint64_t>(high_word(exact)) | (low_word(exact) != 0);
    return nearest_float<double>((to_bits(a) ^ to_bits(b)) >> 63 != 0, magnitude, x.exponent + y.exponent + 64);
}

inline bool any_above_zero(const Double3 &v) {
    return total_order_key(v.x) > 0 || total_order_key(v.y) > 0 || total_order_key(v.z) > 0;
}

} // namespace wisp
