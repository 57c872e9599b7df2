// Hard cases F of no arithmetic or of fixed alone: modes of the processor, the ends of fixed point, pixels that are no
// colour.
#include "host/images/picture.h"
#include "support/built.h"
#include "support/data.h"
#include "support/random_input.h"
#include "support/temporary_folder.h"
#include "core/numbers/self_test.h"
#include <cfenv>
#include <cmath>
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>
#include <limits>
#include <string>
#include <sys/wait.h>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

using namespace wisp;

namespace {

std::string fault_of(const ArithmeticProbe &probe) {
    const char *fault = arithmetic_fault(probe);
    return fault == nullptr ? "none" : fault;
}

// The exit status of a command, and the first line that it writes.
struct Ran {
    int status;
    std::string line;
};
Ran run(const std::string &command, const TemporaryFolder &folder) {
    const int status = std::system((command + " > " + folder.file("out") + " 2>&1").c_str());
    Ran ran = {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ""};
    std::ifstream file(folder.file("out"));
    std::getline(file, ran.line);
    return ran;
}

// Runs wisp with a library that executes `set_up` as it is loaded.
Ran wisp_beside(const std::string &set_up, const TemporaryFolder &folder, const std::string &flags = "") {
    std::ofstream(folder.file("a.c")) << "#include <fenv.h>\n__attribute__((constructor)) static void set_up(void) { "
                                      << set_up << " }\n";
    const Ran compiled =
        run("gcc -shared -fPIC " + flags + " -o " + folder.file("a.so") + " " + folder.file("a.c") + " -lm", folder);
    REQUIRE(compiled.status == 0);
    return run("LD_PRELOAD=" + folder.file("a.so") + " " + built("wisp") + " plan fixtures/small.aff", folder);
}
std::string refusal(const std::string &fault) {
    return "wisp: error: this process does not compute as wisp needs it: " + fault +
           "; either a library in it, as any that is built for 'fast math', has switched the processor's mode: run "
           "without it (LD_PRELOAD, plugins); or wisp was built with other flags than the Makefile's: 'wisp version' "
           "prints them";
}

constexpr int64_t one = int64_t{1} << 32, largest = INT64_MAX, smallest = INT64_MIN;
bool equal(detail::Saturated a, detail::Saturated b) { return a.raw == b.raw && a.overflow == b.overflow; }
bool is_saturated(detail::Saturated a, bool negative) { return a.overflow && a.raw == (negative ? smallest : largest); }

float float_of(uint32_t bits) { return detail::from_bits<float>(bits); }

} // namespace

TEST_CASE("hard case F2: contraction is found, and the elementary functions have the same bits everywhere") {
    // What a contracted a * b + c gives, in double and in float.
    const double a = 1 + 0x1p-30;
    const float b = 1 + 0x1p-12f;
    CHECK(std::fma(a, a, -(1 + 0x1p-29)) == 0x1p-60);
    ArithmeticProbe probe = probe_arithmetic();
    CHECK(fault_of(probe) == "none");
    CHECK(probe.product_sum_64 == 0);
    probe.product_sum_64 = detail::to_bits(std::fma(a, a, -(1 + 0x1p-29)));
    CHECK(fault_of(probe) == "a * b + c is contracted to one rounding");
    probe = probe_arithmetic();
    probe.product_sum_32 = detail::to_bits(std::fma(b, b, -(1 + 0x1p-11f)));
    CHECK(fault_of(probe) == "a * b + c is contracted to one rounding");
#ifdef __SSE2__
    if (__builtin_cpu_supports("fma")) { // a build that contracts
        const TemporaryFolder folder;
        std::ofstream(folder.file("a.cpp")) << "#include \"core/numbers/self_test.h\"\n#include <cstdio>\n"
                                               "int main() { const char *fault = wisp::arithmetic_fault(); "
                                               "std::puts(fault ? fault : \"none\"); }\n";
        const std::string compile =
            "g++ -std=c++17 -Iinclude -Isrc -o " + folder.file("a") + " " + folder.file("a.cpp");
        REQUIRE(run(compile + " -O2 -mfma -ffp-contract=fast", folder).status == 0);
        CHECK(run(folder.file("a"), folder).line == "a * b + c is contracted to one rounding");
    }
#endif

    // Every function over random arguments: any compiler, level of optimisation and machine must give this hash.
    uint64_t hash = 0xcbf29ce484222325;
    const auto mix = [&](uint64_t bits) { hash = (hash ^ bits) * 0x100000001b3; };
    Random random;
    for (int i = 0; i < 20000; ++i) {
        const double x = random.with_exponent(-12, 6), in_one = random.between(-1, 1), y = random.between(0, 2);
        double s, c;
        wisp::sincos_turns(x, s, c);
        for (const double value : {wisp::exp(x), wisp::expm1(x), wisp::log(wisp::abs(x)), wisp::log1p(wisp::abs(x)), s,
                                   c, wisp::acos(in_one), wisp::asin(in_one), wisp::cbrt(x), wisp::angle_between(y, x)})
            mix(detail::to_bits(value));
        const float xf = static_cast<float>(x), in_one_f = static_cast<float>(in_one), yf = static_cast<float>(y);
        float sf, cf;
        wisp::sincos_turns(xf, sf, cf);
        for (const float value :
             {wisp::exp(xf), wisp::expm1(xf), wisp::log(wisp::abs(xf)), wisp::log1p(wisp::abs(xf)), sf, cf,
              wisp::acos(in_one_f), wisp::asin(in_one_f), wisp::cbrt(xf), wisp::angle_between(yf, xf)})
            mix(detail::to_bits(value));
        const Fixed xq(x), in_one_q(in_one), yq(y), away = abs(xq) + Fixed(1);
        Fixed sq, cq;
        sincos_turns(xq, sq, cq);
        for (const Fixed value :
             {exp(Fixed(3) * in_one_q), expm1(in_one_q), log(away), log1p(abs(xq)), sq, cq, acos(in_one_q),
              asin(in_one_q), cbrt(xq), angle_between(yq, xq), sqrt(away), xq * yq, xq / away})
            mix(static_cast<uint64_t>(value.raw()));
    }
    CHECK(hash == 0x2da74b2324704825);
}

TEST_CASE("hard case F3: a process that flushes subnormal numbers is found, and refused at the start") {
    CHECK(exp(-100.0f) == 27 * 0x1p-149f); // 3.783506e-44
#ifdef __SSE2__
    const unsigned mode = _mm_getcsr();
    constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
    _mm_setcsr(mode | flush_to_zero);
    const ArithmeticProbe flushed = probe_arithmetic();
    _mm_setcsr(mode | denormals_are_zero);
    const ArithmeticProbe zeroed = probe_arithmetic();
    _mm_setcsr(mode);
    CHECK(fault_of(flushed) == "subnormal results are flushed to zero");
    CHECK(flushed.small_exp == 0);
    CHECK(fault_of(zeroed) == "subnormal operands are taken as zero");
    CHECK(arithmetic_fault() == nullptr);

    if (has_address_sanitizer) return skip_case("AddressSanitizer must be loaded before what sets the mode");
    const TemporaryFolder folder;
    CHECK(wisp_beside("", folder).status == 0);
    const Ran flushing = wisp_beside("__builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8000);", folder);
    CHECK(flushing.status == 2);
    CHECK(flushing.line == refusal("subnormal results are flushed to zero"));
    CHECK(wisp_beside("__builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x0040);", folder).status == 2);
    // An empty library built with -ffast-math does so, too.
    CHECK(wisp_beside("", folder, "-ffast-math").line == refusal("subnormal results are flushed to zero"));
#endif
}

TEST_CASE("hard case F4: another rounding mode is found, and refused at the start") {
    const TemporaryFolder folder;
    const struct {
        int mode;
        const char *name;
    } modes[] = {{FE_UPWARD, "FE_UPWARD"}, {FE_DOWNWARD, "FE_DOWNWARD"}, {FE_TOWARDZERO, "FE_TOWARDZERO"}};
    for (const auto &mode : modes) {
        std::fesetround(mode.mode);
        const ArithmeticProbe probe = probe_arithmetic();
        std::fesetround(FE_TONEAREST);
        CHECK(fault_of(probe) == "results are not rounded to the nearest number");
        if (has_address_sanitizer) continue;
        const Ran ran = wisp_beside(std::string("fesetround(") + mode.name + ");", folder);
        CHECK(ran.status == 2);
        CHECK(ran.line == refusal("results are not rounded to the nearest number"));
    }
    CHECK(arithmetic_fault() == nullptr);
}

TEST_CASE("hard case F6: what leaves the range of fixed point saturates as documented, and is seen in the test build") {
    CHECK(sqrt(Fixed(0)).raw() == 0);
    const Fixed high = Fixed::from_raw(largest), low = Fixed::from_raw(smallest), zero(0), unit = Fixed::from_raw(1);
    // A division by zero goes to the limit on the dividend's side.
    CHECK(is_saturated(detail::divide<detail::Wide>(1, 0), false));
    CHECK(is_saturated(detail::divide<detail::Wide>(-1, 0), true));
    CHECK(equal(detail::divide<detail::Wide>(0, 0), {0, true}));
    CHECK(is_saturated(detail::exp_fixed(30 * one), false));
    CHECK(is_saturated(detail::exp_fixed(largest), false));
    CHECK(is_saturated(detail::scale(1, 63), false));
    CHECK(is_saturated(detail::scale(-1, 64), true));
    CHECK(is_saturated(detail::scale(one, 31), false));
    CHECK(equal(detail::scale(-one, 31), {smallest, false}));
    CHECK(equal(detail::scale(0, 1000), {0, false}));
    CHECK(equal(detail::scale(smallest, -1000), {0, false}));
    CHECK(equal(detail::scale(smallest, -63), {-1, false}));
    CHECK(equal(detail::scale(smallest, -64), {0, false}));
#ifdef WISP_TRAP
    CHECK_THROWS(high + unit);
    CHECK_THROWS(low - unit);
    CHECK_THROWS(-low);
    CHECK_THROWS(abs(low));
    CHECK_THROWS(Fixed(65536) * Fixed(32768));
    CHECK_THROWS(Fixed(65536) / Fixed(0x1p-15));
    CHECK_THROWS(Fixed(1) / zero);
    CHECK_THROWS(sum_of_products(high, high, zero, zero, zero, zero));
    CHECK_THROWS(sqrt(-unit));
    CHECK_THROWS(log(zero));
    CHECK_THROWS(log1p(Fixed(-1)));
    CHECK_THROWS(exp(Fixed(30)));
    CHECK_THROWS(scale_pow2(Fixed(1), 31));
    CHECK_THROWS(Fixed(int64_t{1} << 31));
    CHECK_THROWS(Fixed(UINT32_MAX));
    CHECK_THROWS(Fixed(0x1p31));
#else
    CHECK(high + unit == high);
    CHECK(low - unit == low);
    CHECK(-low == high);
    CHECK(Fixed(65536) * Fixed(-32769) == low);
    CHECK(Fixed(65536) / Fixed(0x1p-15) == high);
    CHECK(Fixed(-1) / zero == low);
    CHECK(sum_of_products(low, high, zero, zero, zero, zero) == low);
    CHECK(sqrt(-unit) == zero);
    CHECK(log(zero) == low);
    CHECK(log1p(Fixed(-1)) == low);
    CHECK(exp(Fixed(30)) == high);
    CHECK(scale_pow2(Fixed(-1), 32) == low);
    CHECK(Fixed(0x1p31) == high);
#endif
    CHECK(Fixed(65536) * Fixed(-32768) == low);
    CHECK(Fixed(65536) / Fixed(-0x1p-15) == low);
    CHECK(low / Fixed(1) == low);
    CHECK(-high - unit == low);
    CHECK(log(unit).raw() == -95265423098); // -32 ln 2 = -95265423098.23 units
}

TEST_CASE("hard case F8: NaN, infinite, negative and huge pixels have fixed colours, and a PNG fixed bytes") {
    const float inf = std::numeric_limits<float>::infinity();
    const Picture picture{6,
                          1,
                          {inf, 0, 1, -inf, -1, -0.0f, 1e30f, -1e30f, 0.5f, float_of(0x7fc00000), 0, 0, 1,
                           float_of(0xffc00000), 1, 0.5f, 0.5f, float_of(0x7f800001)}};
    const Bytes expected = {255, 0, 255, 0, 0, 0, 255, 0, 188, 255, 0, 255, 255, 0, 255, 255, 0, 255};
    CHECK(srgb_bytes(picture) == expected);
    const Bytes brighter = {255, 0, 255, 0, 0, 0, 255, 0, 255, 255, 0, 255, 255, 0, 255, 255, 0, 255};
    CHECK(srgb_bytes(picture, 1000) == brighter);
    CHECK(png_bytes(picture) == png_bytes(picture));
    // Bytes are rounded to nearest: from 127.5 on, the sRGB curve's 0.5, the byte is 128.
    const float below = 0x1.b65b32p-3f, above = 0x1.b65b34p-3f; // neighbours of 0.21404114048223255
    CHECK((below < 0.21404114048223255 && 0.21404114048223255 < above));
    CHECK(srgb_bytes({1, 1, {below, above, 0}}) == Bytes{127, 128, 0});
}
