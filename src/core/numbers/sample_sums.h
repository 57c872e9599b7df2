// How samples are added to the sums of `--reference`, and how a picture is made of those.
#pragma once
#include "core/numbers/elementary.h"
#include "wisp/pixel_sums.h"

namespace wisp {

// Negative samples, which only rounding makes, count as 0; those of 2^31 and more as that.
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

// A pixel's value from a mean of its samples as they are summed, whose unit was 2^exponent.
inline float radiance_of(double mean, int exponent) { return to_float_scaled(mean, exponent - 32); }

} // namespace wisp
