// What `--reference` keeps of a pixel: sums of its samples and of their squares, in integers, so that any division of
// the work into passes adds up to the same bits.
#pragma once
#include <cstdint>

namespace wisp {

struct WideSum {
    uint64_t high, low;
};

struct PixelSums {
    struct Channel {
        WideSum sum;    // of the samples, in units of 2^-32
        WideSum square; // of their squares, in units of 2^-64
    } channels[3];
};

} // namespace wisp
