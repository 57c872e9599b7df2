// What `--reference` keeps of a pixel: sums of its samples and of their squares, in integers, so that any division of
// the work into passes adds up to the same bits.
#pragma once
#include <cstdint>

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

} // namespace wisp
