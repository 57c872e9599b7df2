// The self-test says what is wrong: on the running machine with its modes switched, and from bits that a wrong build
// would give.
#include "wisp/self_test.h"
#include <doctest/doctest.h>
#include <cfenv>
#include <cmath>
#include <string>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

using wisp::arithmetic_fault;
using wisp::ArithmeticProbe;

namespace {

std::string fault_of(const ArithmeticProbe &probe) {
    const char *fault = arithmetic_fault(probe);
    return fault == nullptr ? "none" : fault;
}

} // namespace

TEST_CASE("self test: this machine is fit") { CHECK(fault_of(wisp::probe_arithmetic()) == "none"); }

TEST_CASE("self test: contraction (hard case F2)") {
    ArithmeticProbe probe = wisp::probe_arithmetic();
    const double a = 1 + 0x1p-30;
    const float b = 1 + 0x1p-12f;
    CHECK(std::fma(a, a, -(1 + 0x1p-29)) == 0x1p-60);
    SUBCASE("in double") { probe.product_sum_64 = wisp::detail::to_bits(std::fma(a, a, -(1 + 0x1p-29))); }
    SUBCASE("in float") { probe.product_sum_32 = wisp::detail::to_bits(std::fma(b, b, -(1 + 0x1p-11f))); }
    CHECK(fault_of(probe) == "a * b + c is contracted to one rounding");
}

TEST_CASE("self test: a longer format for intermediate results") {
    ArithmeticProbe probe = wisp::probe_arithmetic();
    SUBCASE("in double") { probe.excess_64 = wisp::detail::to_bits(0x1p-60); }
    SUBCASE("in float") { probe.excess_32 = wisp::detail::to_bits(0x1p-30f); }
    CHECK(fault_of(probe) == "sums are reordered or kept in a longer format");
}

TEST_CASE("self test: one vector lane that flushes subnormal results") {
    ArithmeticProbe probe = wisp::probe_arithmetic();
    probe.halved_32[5] = 0;
    CHECK(fault_of(probe) == "subnormal results are flushed to zero");
}

TEST_CASE("self test: other elementary functions") {
    ArithmeticProbe probe = wisp::probe_arithmetic();
    probe.small_exp = 28;
    CHECK(fault_of(probe) == "the elementary functions give other bits");
}

TEST_CASE("self test: the rounding mode (hard case F4)") {
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
        std::fesetround(mode);
        const ArithmeticProbe probe = wisp::probe_arithmetic();
        std::fesetround(FE_TONEAREST);
        CHECK(fault_of(probe) == "results are not rounded to the nearest number");
    }
}

#ifdef __SSE2__
TEST_CASE("self test: subnormal numbers switched off (hard case F3)") {
    const unsigned mode = _mm_getcsr();
    constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
    _mm_setcsr(mode | flush_to_zero);
    const ArithmeticProbe flushed = wisp::probe_arithmetic();
    _mm_setcsr(mode | denormals_are_zero);
    const ArithmeticProbe zeroed = wisp::probe_arithmetic();
    _mm_setcsr(mode);
    CHECK(fault_of(flushed) == "subnormal results are flushed to zero");
    CHECK(fault_of(zeroed) == "subnormal operands are taken as zero");
    CHECK(arithmetic_fault() == nullptr);
}
#endif
