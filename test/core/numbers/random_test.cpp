// The generator equals the standard's, and the draws of a photon are uniform and independent.
#include "core/numbers/random.h"
#include <cmath>
#include <doctest/doctest.h>
#include <random>
#include <vector>

using namespace wisp;

TEST_CASE("Mt19937 is the standard's generator behind the standard's seed sequence") {
    for (uint32_t batch : {0u, 1u, 77u, 0xffffffffu}) {
        std::seed_seq seed{1u, 2u, batch, 4u};
        std::mt19937 expected(seed);
        Mt19937 found(1, 2, batch, 4);
        for (int i = 0; i < 2000; ++i) REQUIRE(found() == static_cast<uint32_t>(expected()));
    }
}

namespace {

// Chi-square of values 0 to cells - 1 against even counts, in standard deviations from its mean.
double chi_square(const std::vector<uint32_t> &counts, double total) {
    const double expected = total / double(counts.size()), freedom = double(counts.size()) - 1;
    double sum = 0;
    for (uint32_t count : counts) sum += (count - expected) * (count - expected) / expected;
    return (sum - freedom) / std::sqrt(2 * freedom);
}

} // namespace

TEST_CASE("draws are even in each dimension, and pairs of neighbours are too") {
    // Pairs: successive dimensions of one event, successive events, successive photons.
    Mt19937 keys(1, 0, 0, 0);
    std::vector<uint32_t> single(256), dimensions(4096), events(4096), photons(4096);
    uint32_t before = 0;
    const int n = 400000;
    for (int i = 0; i < n; ++i) {
        const uint64_t high = keys(), low = keys(), key = high << 32 | low;
        const uint32_t dimension = static_cast<uint32_t>(i) % 1000;
        const uint32_t a = draw(photon_event(key, 1), dimension), b = draw(photon_event(key, 1), dimension + 1);
        const uint32_t c = draw(photon_event(key, 2), dimension);
        ++single[a >> 24];
        ++dimensions[(a >> 26) << 6 | b >> 26];
        ++events[(a >> 26) << 6 | c >> 26];
        ++photons[(a >> 26) << 6 | before >> 26];
        before = a;
    }
    for (const auto &counts : {single, dimensions, events, photons}) CHECK(std::fabs(chi_square(counts, n)) < 4);
}

TEST_CASE("draws of many dimensions of one event are even, in their low bits too") {
    std::vector<uint32_t> high(1024), low(1024);
    const Event event = photon_event(12345, 6);
    const int n = 1 << 20;
    for (uint32_t d = 0; d < uint32_t(n); ++d) {
        ++high[draw(event, d) >> 22];
        ++low[draw(event, d) & 1023];
    }
    CHECK(std::fabs(chi_square(high, n)) < 4);
    CHECK(std::fabs(chi_square(low, n)) < 4);
}

TEST_CASE("keys in arithmetic progression share no events") {
    for (uint64_t step : {uint64_t{1}, uint64_t{0x9e3779b97f4a7c15u}, uint64_t{0xd6e8feb86659fd93u}})
        for (uint64_t n = 0; n < 200; ++n)
            for (uint64_t event = 1; event < 30; ++event) {
                const Event a = photon_event(n * step, event), b = photon_event((n + 1) * step, event - 1);
                CHECK((a.low != b.low || a.high != b.high));
            }
}

TEST_CASE("one bit of the key changes half of the bits of a draw") {
    double changed = 0;
    for (uint64_t key = 1; key <= 200; ++key)
        for (int bit = 0; bit < 64; ++bit)
            changed += __builtin_popcount(draw(photon_event(key * 977, 3), 5) ^
                                          draw(photon_event(key * 977 ^ 1ull << bit, 3), 5));
    CHECK(changed / (200 * 64) == doctest::Approx(16).epsilon(0.01));
}
