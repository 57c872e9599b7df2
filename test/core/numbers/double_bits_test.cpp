// Doubles by their bits: integers order, add and multiply them as an FPU does.
#include "core/numbers/double_bits.h"
#include "core/numbers/elementary.h"
#include <doctest/doctest.h>
#include <vector>

using wisp::total_order_key;
using wisp::detail::from_bits;
using wisp::detail::to_bits;

namespace {

// Zero, one, the limits of normal and subnormal numbers and their neighbours, of both signs; then any bits
// (splitmix64).
std::vector<double> numbers() {
    std::vector<double> all;
    for (const double x : {0.0, 0.75, 1.0, 0x1p-1074, 0x1p-1022, 0x1p-537, 0x1p-511, 0x1p511, 0x1.fffffffffffffp1023})
        for (const int64_t step : {-1, 0, 1}) {
            const uint64_t bits = to_bits(x) + static_cast<uint64_t>(step);
            const double near = from_bits<double>(bits);
            if (bits >> 52 < 0x7ff) all.insert(all.end(), {near, -near});
        }
    uint64_t state = 1;
    while (all.size() < 1500) {
        uint64_t x = state += 0x9e3779b97f4a7c15u;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
        x ^= x >> 31;
        // Every third has few digits, so that products tie; most are near 1, so that some are in range.
        if (state % 3 == 0) x &= ~uint64_t{0} << (26 + x % 20);
        if (state % 8 != 0) x = (x & 0x807fffffffffffff) | 0x3000000000000000;
        if ((x >> 52 & 0x7ff) < 0x7ff) all.push_back(from_bits<double>(x));
    }
    return all;
}

} // namespace

TEST_CASE("double bits: numbers have the order of an FPU") {
    int wrong = 0;
    const std::vector<double> all = numbers();
    for (const double a : all)
        for (const double b : all)
            wrong += (total_order_key(a) < total_order_key(b)) != (a < b) ||
                     (total_order_key(a) == total_order_key(b)) != (a == b);
    CHECK(wrong == 0);
    CHECK(total_order_key(-0.0) == 0);
    CHECK(total_order_key(0x1p-149f) > 0);
    CHECK(total_order_key(-0x1p-149f) < 0);
}

TEST_CASE("double bits: products are those of an FPU") {
    int wrong = 0;
    const std::vector<double> all = numbers();
    for (const double a : all)
        for (const double b : all) {
            const double expected = a * b, product = wisp::rounded_product(a, b);
            wrong += a == 0 || b == 0 ? to_bits(product) != 0 : to_bits(product) != to_bits(expected);
        }
    CHECK(wrong == 0);
}

TEST_CASE("double bits: sums are those of an FPU") {
    int wrong = 0;
    std::vector<double> all = numbers();
    for (size_t i = 0; i + 1 < all.size(); i += 3) all[i + 1] = -all[i] / (1 + static_cast<double>(i) * 0x1p-40);
    for (const double a : all)
        for (const double b : all) {
            const double expected = a + b, sum = wisp::rounded_sum(a, b);
            wrong += expected == 0 ? sum != 0 : to_bits(sum) != to_bits(expected);
        }
    CHECK(wrong == 0);
}

TEST_CASE("double bits: a float becomes the Fixed that its double becomes") {
    int wrong = 0;
    for (uint64_t bits = 0; bits <= UINT32_MAX; bits += 1019) {
        const float x = from_bits<float>(static_cast<uint32_t>(bits));
        if (x == x) wrong += wisp::to_real<wisp::Fixed>(x) != wisp::to_real<wisp::Fixed>(static_cast<double>(x));
    }
    CHECK(wrong == 0);
}
