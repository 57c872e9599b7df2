// Adds samples to sums in integers, which do not depend on their order, and turns the sums into radiance.
#pragma once
#include "core/numbers/elementary.h"
#include "wisp/pixel_sums.h"

namespace wisp {

// Adds to a sum, which stays at the most that fits: the order of sums does not matter then either.
inline void add(WideSum &sum, uint64_t high, uint64_t low) {
    sum.low += low;
    const uint64_t carry = sum.low < low ? 1 : 0, before = sum.high;
    sum.high += high + carry;
    if (sum.high < before || (sum.high == before && high == UINT64_MAX)) sum.high = sum.low = UINT64_MAX;
}

// Adds a number, from 0 on, in units of 2^-32.
inline void add(WideSum &sum, Fixed number) { add(sum, 0, static_cast<uint64_t>(max(number, Fixed(0)).raw())); }
inline void add(WideSum &sum, double number) { add(sum, to_real<Fixed>(number)); }

// Samples are clamped to [0, 2^31). Only rounding makes negative samples. The rounding of a float is random, so that
// means far below a unit are right, too: `random` is uniform in 32 bits.
inline void add_sample(PixelSums::Channel &channel, Fixed sample, uint32_t = 0) {
    const int64_t units = sample < Fixed(0) ? 0 : sample.raw();
    const detail::Wide square = detail::product<detail::Wide>(units, units);
    add(channel.sum, 0, static_cast<uint64_t>(units));
    add(channel.square, static_cast<uint64_t>(detail::high_word(square)), detail::low_word(square));
}
inline void add_sample(PixelSums::Channel &channel, double sample, uint32_t random) {
    const double less_than_half_a_unit = scale_pow2(static_cast<double>(static_cast<int32_t>(random)), -64);
    add_sample(channel, to_real<Fixed>(sample + less_than_half_a_unit));
}

inline double to_double(const WideSum &sum) {
    return scale_pow2(static_cast<double>(sum.high), 64) + static_cast<double>(sum.low);
}

// A pixel's radiance from the mean of its samples in units of 2^-32; radiances were scaled by 2^-exponent.
inline float radiance_of(double mean, int exponent) { return to_float_scaled(mean, exponent - 32); }

} // namespace wisp
