// The positions of a pixel's samples; they are the same in every pixel.
#pragma once
#include "core/numbers/real.h"

namespace wisp::WISP_ARITH {

// If the number of samples is k^2, the centres of a k x k grid. Otherwise the first points of the R2 sequence (Roberts
// 2018): multiples of 1 / p and 1 / p^2 modulo 1, where p^3 = p + 1.
struct SamplePattern {
    explicit SamplePattern(uint32_t samples) {
        while (root * root < samples) ++root;
        square = root * root == samples;
    }
    // The position of sample i inside the pixel, 0 to 1 from the left and from the top.
    Real u(uint32_t i) const { return square ? center(i % root) : unit_half_open<Real>(half + i * first); }
    Real v(uint32_t i) const { return square ? center(i / root) : unit_half_open<Real>(half + i * second); }

  private:
    Real center(uint32_t k) const {
        return (Real(static_cast<int32_t>(k)) + Real(0.5)) / Real(static_cast<int32_t>(root));
    }
    static constexpr uint32_t half = 0x80000000u, first = 3242174889u, second = 2447445414u; // 2^32 / 2, / p, / p^2
    uint32_t root = 1;
    bool square;
};

} // namespace wisp::WISP_ARITH
