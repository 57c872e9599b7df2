// Comparison, sum and product of the doubles in scenes and settings, by integers, with the results of an FPU. So
// fixed-point programs need no floating-point code. Arguments must not be NaN or infinite.
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

// a + b, rounded to the nearest double; a sum of 0 is +0, whatever the signs.
constexpr double rounded_sum(double a, double b) {
    using namespace detail;
    if (to_bits(a) << 1 < to_bits(b) << 1) return rounded_sum(b, a);
    const Decomposed x = decompose(a), y = decompose(b);
    if (y.mantissa == 0) return a;
    // Mantissas end in ten bits of 0. If y loses bits it is shifted by more than that, so the sum has 62 bits or more;
    // its last bit is set if any bit is lost, which decides ties correctly.
    const int down = x.exponent - y.exponent;
    const int64_t kept = down < 63 ? y.mantissa >> down : 0, lost = down < 63 ? y.mantissa - (kept << down) : 1;
    const uint64_t larger = static_cast<uint64_t>(x.mantissa), smaller = static_cast<uint64_t>(kept | (lost != 0));
    const bool opposed = (to_bits(a) ^ to_bits(b)) >> 63 != 0;
    return nearest_float<double>(to_bits(a) >> 63 != 0, opposed ? larger - smaller : larger + smaller, x.exponent);
}

// A double that is computed with by integers.
struct DoubleByIntegers {
    double value;
};
constexpr DoubleByIntegers operator-(DoubleByIntegers a) {
    return {detail::from_bits<double>(detail::to_bits(a.value) ^ uint64_t{1} << 63)};
}
constexpr DoubleByIntegers operator+(DoubleByIntegers a, DoubleByIntegers b) { return {rounded_sum(a.value, b.value)}; }
constexpr DoubleByIntegers operator-(DoubleByIntegers a, DoubleByIntegers b) { return a + -b; }
constexpr DoubleByIntegers operator*(DoubleByIntegers a, DoubleByIntegers b) {
    return {rounded_product(a.value, b.value)};
}
constexpr bool operator<=(DoubleByIntegers a, DoubleByIntegers b) {
    return total_order_key(a.value) <= total_order_key(b.value);
}
constexpr DoubleByIntegers abs(DoubleByIntegers a) { return detail::to_bits(a.value) >> 63 != 0 ? -a : a; }

inline bool any_above_zero(const Double3 &v) {
    return total_order_key(v.x) > 0 || total_order_key(v.y) > 0 || total_order_key(v.z) > 0;
}

} // namespace wisp

// For GLM, as for Fixed.
template <> struct std::numeric_limits<wisp::DoubleByIntegers> : std::numeric_limits<double> {};
