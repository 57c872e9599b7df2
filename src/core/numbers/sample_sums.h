// Adds samples to the sums of `--reference`, and turns the sums into radiance.
#pragma once
#include "core/numbers/elementary.h"
#include "wisp/pixel_sums.h"

namespace wisp {

// Samples are clamped to [0, 2^31). Only rounding makes negative samples.
inline void add_sample(PixelSums::Channel &channel, Fixed sample) {
    const int64_t units = sample < Fixed(0) ? 0 : sample.raw();
    const detail::Wide square = detail::product<detail::Wide>(units, units);
    channel.sum.add(0, static_cast<uint64_t>(units));
    channel.square.add(static_cast<uint64_t>(detail::high_word(square)), detail::low_word(square));
}
inline void add_sample(PixelSums::Channel &channel, double sample) { add_sample(channel, to_real<Fixed>(sample)); }

inline double to_double(const WideSum &sum) {
    return scale_pow2(static_cast<double>(sum.high), 64) + static_cast<double>(sum.low);
}

// A pixel's radiance from the mean of its samples in units of 2^-32; radiances were scaled by 2^-exponent.
inline float radiance_of(double mean, int exponent) { return to_float_scaled(mean, exponent - 32); }

} // namespace wisp
