// Random numbers for test input, a fixed sequence.
#pragma once
#include "core/numbers/fixed.h"

namespace wisp {

// splitmix64.
class Random {
  public:
    uint64_t bits() {
        uint64_t x = state_ += 0x9e3779b97f4a7c15u;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
        return x ^ (x >> 31);
    }
    double between(double low, double high) { return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53; }
    // Of either sign and with an exponent in [low, high).
    double with_exponent(int low, int high) {
        const uint64_t exponent = static_cast<uint64_t>(low + 1023) + bits() % static_cast<uint64_t>(high - low);
        return detail::from_bits<double>((bits() & 0x800fffffffffffff) | exponent << 52);
    }

  private:
    uint64_t state_ = 7;
};

} // namespace wisp
