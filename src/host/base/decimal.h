// A whole number as text, without heap.
#pragma once
#include <cstdint>

namespace wisp {

class Decimal {
  public:
    explicit Decimal(uint64_t number) {
        *first_ = 0;
        do *--first_ = static_cast<char>('0' + number % 10);
        while ((number /= 10) > 0);
    }
    Decimal(const Decimal &) = delete;
    Decimal &operator=(const Decimal &) = delete;
    const char *text() const { return first_; }

  private:
    char digits_[21];
    char *first_ = digits_ + sizeof digits_ - 1;
};

} // namespace wisp
