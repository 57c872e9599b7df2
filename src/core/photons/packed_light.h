// Light in 32 bits: a colour whose channels share an exponent (RGB9E5, after Ward's RGBE, 1991), relative to the
// largest channel of an array; and a flux relative to the fluence. Packing uses integers, so that equal numbers give
// equal bits in every arithmetic.
#pragma once
#include "core/numbers/vec.h"

namespace wisp {

// A packed colour, where 2^exponent is the scale of its array: channel = mantissa 2^(exponent - 40 + shift).
//
//   31    27 26       18 17        9 8         0
//   |shift | |  blue   | |  green  | |   red   |
//
// A packed flux: three signed numbers in units of 1 / 511; -1, 0 and 1 are exact.
//
//   31 30 29        20 19       10 9          0
//   | 0 | |    z     | |    y     | |    x     |
constexpr int32_t mantissa_bits = 9, shift_bits = 5, component_bits = 10;
static_assert(3 * mantissa_bits + shift_bits == 32, "a packed colour fills its word");
static_assert(3 * component_bits <= 32, "a packed flux fits its word");

constexpr int32_t max_mantissa = (1 << mantissa_bits) - 1, max_shift = (1 << shift_bits) - 1;
constexpr int32_t max_component = (1 << (component_bits - 1)) - 1;
constexpr int32_t color_bits = mantissa_bits + max_shift; // log2 of 2^exponent in units of shift 0
constexpr int64_t max_units = int64_t{max_mantissa} << max_shift;

namespace detail {

// Packs a colour that is given in half units of shift 0, each channel at most 2 max_units. Channels are rounded to
// nearest.
constexpr uint32_t pack_halves(int64_t red, int64_t green, int64_t blue) {
    const int64_t largest = max(red, max(green, blue));
    const auto rounded = [](int64_t halves, int32_t shift) {
        return static_cast<uint32_t>((halves + (int64_t{1} << shift)) >> (shift + 1));
    };
    const int32_t length = largest == 0 ? 0 : 64 - leading_zeros(static_cast<uint64_t>(largest));
    int32_t shift = max(0, length - mantissa_bits - 1);
    if (rounded(largest, shift) > static_cast<uint32_t>(max_mantissa)) ++shift;
    return static_cast<uint32_t>(shift) << 3 * mantissa_bits | rounded(blue, shift) << 2 * mantissa_bits |
           rounded(green, shift) << mantissa_bits | rounded(red, shift);
}

// floor(x 2^k), clamped to [0, limit]; 0 for NaN.
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

// The exponent of an array from its largest channel: the smallest exponent that packs it without saturation.
inline int32_t exponent_for(Real largest_channel) {
    constexpr Real limit = Real(max_mantissa / 512.0);
    static_assert(max_mantissa == 511, "mantissas are fractions of 512");
    int32_t exponent = 0;
    if (!(largest_channel > Real(0))) return exponent;
    while (scale_pow2(largest_channel, -exponent) > limit) ++exponent;
    while (!(scale_pow2(largest_channel, 1 - exponent) > limit)) --exponent;
    return exponent;
}

// The relative error of the largest channel is below 2^-9 if it is at least 2^(exponent - 32); the other channels have
// the same absolute error. Channels above the range saturate, channels below 0 become 0.
inline uint32_t pack_color(const Color &color, int32_t exponent) {
    const auto halves = [exponent](Real channel) {
        return detail::floor_scaled(channel, color_bits + 1 - exponent, 2 * max_units);
    };
    return detail::pack_halves(halves(color.x), halves(color.y), halves(color.z));
}

inline Color unpack_color(uint32_t packed, int32_t exponent) {
    const int32_t scale = static_cast<int32_t>(packed >> 3 * mantissa_bits) + exponent - color_bits;
    const auto channel = [packed, scale](int32_t i) {
        return scaled_integer<Real>(packed >> i * mantissa_bits & max_mantissa, scale);
    };
    return Color(channel(0), channel(1), channel(2));
}

// The scale of an array of colours, by channel. One that is weaker than another has a smaller exponent, so that its
// largest value keeps kept_bits at least: light of a weak lamp is not lost beside a strong one of another colour.
struct ColorScale {
    int32_t exponent[3];
    int32_t strongest() const { return max(exponent[0], max(exponent[1], exponent[2])); }
};
constexpr int32_t kept_bits = 7; // with more, the stronger channel would lose some where both are bright
inline ColorScale scale_for(const Color &largest_channels) {
    const int32_t strongest = exponent_for(largest(largest_channels));
    ColorScale scale;
    for (int32_t c = 0; c < 3; ++c) {
        const Real most = largest_channels[c];
        scale.exponent[c] = most > Real(0) ? min(strongest, exponent_for(most) + mantissa_bits - kept_bits) : strongest;
    }
    return scale;
}
inline uint32_t pack_color(const Color &color, const ColorScale &scale) {
    const int32_t strongest = scale.strongest();
    Color even;
    for (int32_t c = 0; c < 3; ++c) even[c] = scale_pow2(color[c], strongest - scale.exponent[c]);
    return pack_color(even, strongest);
}
// The colour in 2^unit.
inline Color unpack_color(uint32_t packed, const ColorScale &scale, int32_t unit = 0) {
    Color color;
    for (int32_t c = 0; c < 3; ++c) color[c] = unpack_color(packed, scale.exponent[c] - unit)[c];
    return color;
}

// Packs a vector with components in [-1, 1]; components outside saturate.
inline uint32_t pack_flux(const Vec3 &flux) {
    const auto component = [](Real x) {
        const int32_t units = round_to_int(min(max(x, Real(-1)), Real(1)) * Real(max_component));
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
    const auto component = [packed](int32_t i) { return Real(flux_units(packed, i)) / Real(max_component); };
    return Vec3(component(0), component(1), component(2));
}

} // namespace WISP_ARITH
} // namespace wisp
