// What `--reference` keeps of a pixel: sums of its samples and of their squares, in integers, so that any division of
// the work into passes adds up to the same bits.
#pragma once
#include "core/numbers/elementary.h"

namespace wisp {

struct WideSum {
    uint64_t high, low;

    // Stays at the most that fits: the order of sums does not matter then either.
    void add(uint64_t more_high, uint64_t more_low) {
        low += more_low;
        const uint64_t carry = low < more_low ? 1 : 0, before = high;
        high += more_high + carry;
        if (high < before || (high == before && more_high == UINT64_MAX)) high = low = UINT64_MAX;
    }
};

struct PixelSums {
    struct Channel {
        WideSum sum;    // of the samples, in units of 2^-32
        WideSum square; // of their squares, in units of 2^-64
    } channels[3];
};

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
