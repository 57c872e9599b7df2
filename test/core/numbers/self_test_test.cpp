// The self-test says what is wrong: on the running machine with its modes switched, and from bits that a wrong build
// would give.
#include "core/numbers/self_test.h"
#include <doctest/doctest.h>
#include <string>

using wisp::arithmetic_fault;
using wisp::ArithmeticProbe;

namespace {

std::string fault_of(const ArithmeticProbe &probe) {
    const char *fault = arithmetic_fault(probe);
    return fault == nullptr ? "none" : fault;
}

} // namespace

TEST_CASE("self test: this machine is fit") { CHECK(fault_of(wisp::probe_arithmetic()) == "none"); }

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
