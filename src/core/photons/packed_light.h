// Light in 32 bits: a colour with one exponent for its channels, relative to the largest of an array, and a flux
// relative to its power. The code packs in integers, so equal numbers give equal bits in every arithmetic.
#pragma once
#include "core/numbers/vec.h"

namespace wisp {

// A packed colour, relative to 2^exponent of its array: channel = mantissa 2^(exponent - 40 + shift).
//
//   31    27 26       18 17        9 8         0
//   |shift | |  blue   | |  green  | |   red   |
//
// A packed flux: three signed numbers in units of 1 / 511, so that -1, 0 and 1 are exact.
//
//   31 30 29        20 19       10 9          0
//   | 0 | |    z     | |    y     | |    x     |
constexpr int32_t mantissa_bits = 9, shift_bits = 5, component_bits = 10;
static_assert(3 * mantissa_bits + shift_bits == 32, "a packed colour fills its word");
static_assert(3 * component_bits <= 32, "a packed flux fits its word");

constexpr int32_t greatest_mantissa = (1 << mantissa_bits) - 1, greatest_shift = (1 << shift_bits) - 1;
constexpr int32_t greatest_component = (1 << (component_bits - 1)) - 1;
constexpr int32_t color_bits = mantissa_bits + greatest_shift; // 2^exponent in units of shift 0
constexpr int64_t brightest_units = int64_t{greatest_mantissa} << greatest_shift;

namespace detail {

// Packs three numbers of half units of shift 0, each at most 2 * brightest_units, rounded to nearest.
constexpr uint32_t pack_halves(int64_t red, int64_t green, int64_t blue) {
    const int64_t largest_channel = max(red, max(green, blue));
    const auto rounded = [](int64_t halves, int32_t shift) {
        return static_cast<uint32_t>((halves + (int64_t{1} << shift)) >> (shift + 1));
    };
    const int32_t length = largest_channel == 0 ? 0 : 64 - leading_zeros(static_cast<uint64_t>(largest_channel));
    int32_t shift = max(0, length - mantissa_bits - 1);
    if (rounded(largest_channel, shift) > static_cast<uint32_t>(greatest_mantissa)) ++shift;
    return static_cast<uint32_t>(shift) << 3 * mantissa_bits | rounded(blue, shift) << 2 * mantissa_bits |
           rounded(green, shift) << mantissa_bits | rounded(red, shift);
}

// floor(x 2^k), clamped to 0 to `limit`; NaN gives 0.
template <class T> constexpr int64_t floor_scaled(T x, int32_t k, int64_t limit) {
    if (!(x > T(0))) return 0;
    const T scaled = scale_pow2(x, k);
    return scaled < static_cast<T>(limit) ? static_cast<int64_t>(scaled) : limit;
}
template <> constexpr int64_t floor_scaled(Fixed x, int32_t k, int64_t limit) {
    const int64_t raw = max(x.raw(), int64_t{0});
    k -= 32;
    if (k < 0) return min(k > -64 ? raw >> -k : 0, limit);
    return k < 63 && raw <= limit >> k ? raw << k : raw > 0 ? limit : 0;
}

} // namespace detail

namespace WISP_ARITH {

// The exponent for an array with this largest channel: the smallest that packs it without saturation.
inline int32_t exponent_for(Real largest_channel) {
    constexpr Real limit = Real(greatest_mantissa / 512.0);
    static_assert(greatest_mantissa == 511, "of 512");
    int32_t exponent = 0;
    if (!(largest_channel > Real(0))) return exponent;
    while (scale_pow2(largest_channel, -exponent) > limit) ++exponent;
    while (!(scale_pow2(largest_channel, 1 - exponent) > limit)) --exponent;
    return exponent;
}

// If the largest channel is at least 2^(exponent - 32), every channel errs by less than 2^-9 of the largest. Channels
// above the range saturate; channels below 0 become 0.
inline uint32_t pack_color(const Color &color, int32_t exponent) {
    const auto halves = [exponent](Real channel) {
        return detail::floor_scaled(channel, color_bits + 1 - exponent, 2 * brightest_units);
    };
    return detail::pack_halves(halves(color.x), halves(color.y), halves(color.z));
}

inline Color unpack_color(uint32_t packed, int32_t exponent) {
    const int32_t scale = static_cast<int32_t>(packed >> 3 * mantissa_bits) + exponent - color_bits;
    const auto channel = [packed, scale](int32_t i) {
        return scaled_integer<Real>(packed >> i * mantissa_bits & greatest_mantissa, scale);
    };
    return Color(channel(0), channel(1), channel(2));
}

// Components are from -1 to 1; larger ones saturate. Each errs by at most 1/1022.
inline uint32_t pack_flux(const Vec3 &flux) {
    const auto component = [](Real x) {
        const int32_t units = round_to_int(min(max(x, Real(-1)), Real(1)) * Real(greatest_component));
        return static_cast<uint32_t>(units) & ((1u << component_bits) - 1);
    };
    return component(flux.z) << 2 * component_bits | component(flux.y) << component_bits | component(flux.x);
}

// Component i of a packed flux, in units of 1 / 511.
constexpr int32_t flux_units(uint32_t packed, int32_t i) {
    const int32_t value = static_cast<int32_t>(packed >> i * component_bits & ((1u << component_bits) - 1));
    const int32_t sign = value >> (component_bits - 1);
    return value - (sign << component_bits);
}
inline Vec3 unpack_flux(uint32_t packed) {
    const auto component = [packed](int32_t i) { return Real(flux_units(packed, i)) / Real(greatest_component); };
    return Vec3(component(0), component(1), component(2));
}

} // namespace WISP_ARITH
} // namespace wisp
