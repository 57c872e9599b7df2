// Fixed: each operation is the exact result rounded to the nearest unit (ties upwards), in every one of its forms, and
// what leaves the range traps, where the release saturates.
#include "core/numbers/elementary.h"
#include "core/numbers/random.h"
#define GLM_FORCE_PURE
#define GLM_FORCE_XYZW_ONLY
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <doctest/doctest.h>
#include <vector>

using wisp::Fixed;
namespace detail = wisp::detail;

namespace {

constexpr int64_t one = int64_t{1} << 32, largest = INT64_MAX, smallest = INT64_MIN;

// Bits of every magnitude: 64 random bits (splitmix64) shifted down by a random count.
class AnyMagnitude {
  public:
    int64_t operator()() {
        const uint64_t bits = next();
        return static_cast<int64_t>(bits) >> (next() % 64);
    }

  private:
    uint64_t next() {
        uint64_t x = state_ += 0x9e3779b97f4a7c15u;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
        return x ^ (x >> 31);
    }
    uint64_t state_ = 1;
};

// Powers of two and their neighbours, of both signs, and the limits.
std::vector<int64_t> edges() {
    std::vector<int64_t> values = {0, smallest, smallest + 1, largest};
    for (int bit = 0; bit < 63; ++bit)
        for (int64_t offset = -1; offset <= 1; ++offset) {
            const int64_t magnitude = (int64_t{1} << bit) + offset;
            values.push_back(magnitude);
            values.push_back(-magnitude);
        }
    return values;
}

// Calls check(a, b) for all pairs of edges and for random pairs.
template <class Check> void for_pairs(Check check) {
    const std::vector<int64_t> edge = edges();
    for (const int64_t a : edge)
        for (const int64_t b : edge) check(a, b);
    AnyMagnitude random;
    for (int i = 0; i < 300000; ++i) {
        const int64_t a = random(), b = random();
        check(a, b);
    }
}

bool equal(detail::Saturated a, detail::Saturated b) { return a.raw == b.raw && a.overflow == b.overflow; }
bool is_saturated(detail::Saturated a, bool negative) { return a.overflow && a.raw == (negative ? smallest : largest); }

} // namespace

#ifdef __SIZEOF_INT128__
__extension__ typedef __int128 Exact;
__extension__ typedef unsigned __int128 WideWord;

namespace {

// `result` is exact / unit to the nearest, a tie upwards; or the limit, if that lies beyond it.
bool is_nearest(detail::Saturated result, Exact exact, Exact unit) {
    if (exact - largest * unit >= unit - unit / 2) return is_saturated(result, false);
    if (smallest * unit - exact > unit / 2) return is_saturated(result, true);
    const Exact above = 2 * (result.raw * unit - exact); // twice the rounding error
    return !result.overflow && -unit < above && above <= unit;
}

} // namespace

TEST_CASE("fixed: sums and differences are exact") {
    int wrong = 0;
    for_pairs([&](int64_t a, int64_t b) {
        wrong += !is_nearest(detail::add(a, b), Exact{a} + b, 1);
        wrong += !is_nearest(detail::subtract(a, b), Exact{a} - b, 1);
    });
    CHECK(wrong == 0);
}

TEST_CASE("fixed: a product is rounded once, the portable form has the same bits") {
    int wrong = 0, different = 0;
    for_pairs([&](int64_t a, int64_t b) {
        const detail::Saturated product = detail::multiply<detail::Wide>(a, b);
        wrong += !is_nearest(product, Exact{a} * b, one);
        different += !equal(product, detail::multiply<detail::PortableWide>(a, b));
    });
    CHECK(wrong == 0);
    CHECK(different == 0);
}

TEST_CASE("fixed: a quotient is rounded once, the portable form has the same bits") {
    int wrong = 0, different = 0;
    for_pairs([&](int64_t a, int64_t b) {
        if (b == 0) return;
        const detail::Saturated quotient = detail::divide<detail::Wide>(a, b);
        wrong += !is_nearest(quotient, b < 0 ? Exact{a} * -one : Exact{a} * one, b < 0 ? -Exact{b} : Exact{b});
        different += !equal(quotient, detail::divide<detail::PortableWide>(a, b));
    });
    CHECK(wrong == 0);
    CHECK(different == 0);
}

TEST_CASE("fixed: two digits of base 2^32 are right where the guess of each is corrected") {
    // Words of all bits, of few, and any, as divisors, quotients and remainders: guesses of digits are rarely wrong.
    wisp::Pcg32 random(1);
    const auto word = [&]() -> uint64_t {
        const uint32_t drawn = random(), few = drawn & 3;
        const uint32_t words[] = {0, 0xffffffff, 0x7fffffff + few, few, ~few, drawn};
        return words[(drawn >> 8) % 6];
    };
    int wrong = 0;
    for (int i = 0; i < 1000000; ++i) {
        const uint64_t divisor = (word() << 32 | word()) >> (random() & 63), quotient = word() << 32 | word();
        if (divisor == 0) continue;
        const uint64_t rests[] = {0, divisor - 1, (word() << 32 | word()) % divisor}, rest = rests[random() % 3];
        const auto dividend = static_cast<WideWord>(quotient) * divisor + rest;
        const detail::Quotient found = detail::divide(
            detail::PortableWide{static_cast<uint64_t>(dividend >> 64), static_cast<uint64_t>(dividend)}, divisor);
        wrong += found.quotient != quotient || found.remainder != rest;
    }
    CHECK(wrong == 0);
}

TEST_CASE("fixed: a sum of three products is rounded once") {
    int wrong = 0, different = 0;
    AnyMagnitude random;
    const std::vector<int64_t> edge = edges();
    for (int i = 0; i < 300000; ++i) {
        int64_t v[6];
        for (int64_t &x : v) {
            const int64_t drawn = random();
            // Exact holds three products below 2^125.
            x = (drawn & 7) == 0 ? edge[static_cast<uint64_t>(drawn >> 3) % edge.size()] / 2 : drawn / 2;
        }
        const detail::Saturated sum = detail::sum_of_products<detail::Wide>(v[0], v[1], v[2], v[3], v[4], v[5]);
        wrong += !is_nearest(sum, Exact{v[0]} * v[1] + Exact{v[2]} * v[3] + Exact{v[4]} * v[5], one);
        different += !equal(sum, detail::sum_of_products<detail::PortableWide>(v[0], v[1], v[2], v[3], v[4], v[5]));
    }
    CHECK(wrong == 0);
    CHECK(different == 0);
}

TEST_CASE("fixed: mixing by words is a + t (b - a)") {
    int different = 0;
    AnyMagnitude random;
    for (int i = 0; i < 300000; ++i) {
        const int64_t a = random(), b = random(), t = random(), fraction = t & 0xffffffff;
        const bool fits = (a < 0) == (b < 0); // else b - a may overflow, which a test build traps
        different += fits && detail::raw_mix_by_words(a, b, fraction) != detail::raw_mix_by_operations(a, b, fraction);
        const int64_t x = a >> 32, y = b >> 32; // t is not in [0, 1)
        different += detail::raw_mix_by_words(x, y, t >> 30) != detail::raw_mix_by_operations(x, y, t >> 30);
    }
    CHECK(different == 0);
}

TEST_CASE("fixed: a root is correctly rounded, with and without an FPU") {
    int wrong = 0, different = 0;
    const auto check = [&](int64_t x) {
        if (x <= 0) return;
        const int64_t root = detail::root_by_integers(x);
        // (root - 1/2)^2 < x 2^32 < (root + 1/2)^2
        const Exact radicand = Exact{x} << 32, square = Exact{root} * root;
        wrong += !(square - root < radicand && radicand <= square + root);
        different += detail::root(x) != root;
    };
    for (const int64_t x : edges()) check(x);
    AnyMagnitude random;
    for (int i = 0; i < 300000; ++i) {
        const int64_t x = random();
        check(x < 0 ? ~x : x);
        // Around (n + 1/2)^2 2^-32 the root changes from n to n + 1.
        const int64_t n = (x < 0 ? ~x : x) >> 16;
        const int64_t x_near = static_cast<int64_t>((Exact{n} * n + n) >> 32);
        check(x_near);
        check(x_near + 1);
    }
    for (int64_t x = 1; x < 100000; ++x) check(x);
    // Just below a power of 4, the root of what is shifted to [1/4, 1) rounds to 1.
    for (int k = 2; k < 63; k += 2)
        for (int64_t below = 1; below < 1000 && below < int64_t{1} << k; ++below) check((int64_t{1} << k) - below);
    CHECK(wrong == 0);
    CHECK(different == 0);
    CHECK(sqrt(Fixed(0)) == Fixed(0));
    CHECK(sqrt(Fixed(2)).raw() == 6074001000); // 6074000999.95
}
#endif

TEST_CASE("fixed: ties go towards +infinity in every operation") {
    const Fixed unit = Fixed::from_raw(1), half = Fixed(0.5), two = Fixed(2);
    CHECK((unit * half).raw() == 1);
    CHECK((-unit * half).raw() == 0);
    CHECK((unit / two).raw() == 1);
    CHECK((-unit / two).raw() == 0);
    CHECK((unit / -two).raw() == 0);
    CHECK((-unit / -two).raw() == 1);
    CHECK(scale_pow2(unit, -1).raw() == 1);
    CHECK(scale_pow2(-unit, -1).raw() == 0);
    CHECK(Fixed(0x1p-33).raw() == 1);
    CHECK(Fixed(-0x1p-33).raw() == 0);
    CHECK(Fixed(-0x1.8p-32).raw() == -1);
    const Fixed zero(0);
    CHECK(sum_of_products(unit, half, zero, zero, zero, zero).raw() == 1);
    CHECK(sum_of_products(-unit, half, zero, zero, zero, zero).raw() == 0);
    // Three quarters of a unit: each product alone would become 0.
    CHECK(sum_of_products(unit, Fixed(0.25), unit, Fixed(0.25), unit, Fixed(0.25)).raw() == 1);
}

TEST_CASE("fixed: saturation of sums beyond 128 bits has the right sign") {
    const int64_t low = smallest, high = largest;
    for (const bool portable : {false, true}) {
        const auto sum = [&](int64_t a, int64_t b, int64_t c, int64_t d, int64_t e, int64_t f) {
            return portable ? detail::sum_of_products<detail::PortableWide>(a, b, c, d, e, f)
                            : detail::sum_of_products<detail::Wide>(a, b, c, d, e, f);
        };
        CHECK(is_saturated(sum(low, low, low, low, low, low), false)); // 3 2^126 wraps around
        CHECK(is_saturated(sum(low, low, low, low, 0, 0), false));     // 2^127 too
        CHECK(is_saturated(sum(low, high, low, high, low, high), true));
        CHECK(is_saturated(sum(low, low, low, low, low, high), false));
        CHECK(is_saturated(sum(one, high, one, 1, 0, 0), false)); // 2^63
        CHECK(is_saturated(sum(-one, high, -one, 2, 0, 0), true));
        CHECK(equal(sum(low, low, low, high, 0, 0), {int64_t{1} << 31, false})); // 2^63 units of 2^-64
        CHECK(equal(sum(one, low, 0, 0, 0, 0), {low, false}));
        CHECK(equal(sum(low, one, high, one, one, one), {one - 1, false}));
    }
}

TEST_CASE("fixed: integers and constants") {
    static_assert(Fixed(1).raw() == one && Fixed(-3).raw() == -3 * one, "constant expressions");
    static_assert((Fixed(1) / Fixed(3)).raw() == 1431655765, "division too");
    CHECK(Fixed(uint32_t{7}).raw() == 7 * one);
    CHECK(Fixed(int64_t{INT32_MIN}).raw() == smallest);
    CHECK(Fixed(INT32_MAX).raw() == largest - (one - 1));
    CHECK(Fixed(uint64_t{12}).raw() == 12 * one);
    CHECK(Fixed(0.5).raw() == one / 2);
    CHECK(Fixed(-0.1f).raw() == -429496736); // the float -0.1, -0.100000001490...
    CHECK(Fixed(-0x1p31).raw() == smallest);
    CHECK(Fixed(0x1p-34).raw() == 0);
    CHECK(Fixed(-0x1p-1074).raw() == 0);
    // pi 2^32 = 13493037704.52...
    CHECK(wisp::pi<Fixed>.raw() == 13493037705);
    CHECK(wisp::two_pi<Fixed>.raw() == 26986075409);
    CHECK(wisp::four_pi<Fixed>.raw() == 53972150818);
    CHECK(wisp::half_pi<Fixed>.raw() == 6746518852);
    CHECK(wisp::inv_pi<Fixed>.raw() == 1367130551);
    CHECK(wisp::inv_two_pi<Fixed>.raw() == 683565276);
    CHECK(wisp::inv_four_pi<Fixed>.raw() == 341782638);
}

TEST_CASE("fixed: doubles of run time saturate without a trap") {
    using wisp::to_real;
    CHECK(to_real<Fixed>(1e30).raw() == largest);
    CHECK(to_real<Fixed>(-1e30).raw() == smallest);
    CHECK(to_real<Fixed>(0x1p31).raw() == largest);
    CHECK(to_real<Fixed>(0x1.fffffffffffffp30).raw() == largest - 1023);
    CHECK(to_real<Fixed>(detail::infinity<double>).raw() == largest);
    CHECK(to_real<Fixed>(-detail::infinity<double>).raw() == smallest);
    CHECK(to_real<Fixed>(1.25).raw() == one + one / 4);
}

TEST_CASE("fixed: conversions to and from float and double are nearest, by integers only") {
    int wrong = 0;
    const auto check = [&](int64_t raw) {
        const Fixed x = Fixed::from_raw(raw);
        // The conversion of an integer is the hardware's, rounded once; the scaling is exact.
        const double as_double = static_cast<double>(raw) * 0x1p-32;
        wrong += to_double(x) != as_double;
        wrong += to_float(x) != static_cast<float>(raw) * 0x1p-32f;
        const int64_t magnitude = raw < 0 ? ~raw : raw;
        const bool fits_double = magnitude < int64_t{1} << 53;
        wrong += fits_double && wisp::to_real<Fixed>(to_double(x)) != x;
        for (const int exponent : {-200, -170, -150, -140, -126, -20, 3, 97, 98, 130})
            wrong += fits_double && to_float_scaled(x, exponent) != wisp::to_float_scaled(as_double, exponent);
    };
    for (const int64_t raw : edges()) check(raw);
    AnyMagnitude random;
    for (int i = 0; i < 100000; ++i) check(random());
    CHECK(wrong == 0);
    CHECK(to_float_scaled(Fixed::from_raw(1), -117) == 0x1p-149f);
    CHECK(to_float_scaled(Fixed::from_raw(1), -118) == 0); // the tie goes to even
    CHECK(to_float_scaled(Fixed::from_raw(3), -118) == 0x1p-148f);
    CHECK(to_float_scaled(Fixed(1), 127) == 0x1p127f);
    CHECK(to_float_scaled(Fixed(-1), 128) == -detail::infinity<float>);
    CHECK(to_float_scaled(Fixed::from_raw(largest), 97) == detail::infinity<float>); // rounds up to 2^128
    CHECK(to_float_scaled(Fixed(0), 100000) == 0);
    CHECK(to_float_scaled(Fixed(1), 100000) == detail::infinity<float>);
}

TEST_CASE("fixed: GLM vectors") {
    using Vec3 = glm::vec<3, Fixed, glm::defaultp>;
    static_assert(std::is_trivially_copyable<Vec3>::value && sizeof(Vec3) == 24, "three numbers");
    const Vec3 a(Fixed(1), Fixed(2), Fixed(3)), b(Fixed(-4), Fixed(0.5), Fixed(8));
    const Fixed two(2);
    CHECK(a + b == Vec3(Fixed(-3), Fixed(2.5), Fixed(11)));
    CHECK(a - b == Vec3(Fixed(5), Fixed(1.5), Fixed(-5)));
    CHECK(a * b == Vec3(Fixed(-4), Fixed(1), Fixed(24)));
    CHECK(b / two == Vec3(Fixed(-2), Fixed(0.25), Fixed(4)));
    CHECK(two * a == a * two);
    CHECK(a / b == Vec3(Fixed(-0.25), Fixed(4), Fixed(0.375)));
    CHECK(-a == Vec3(Fixed(-1), Fixed(-2), Fixed(-3)));
    Vec3 c = a;
    c += b;
    c *= two;
    c -= a;
    c /= two;
    CHECK(c == Vec3(Fixed(-3.5), Fixed(1.5), Fixed(9.5)));
    CHECK(cross(a, b) == Vec3(Fixed(14.5), Fixed(-20), Fixed(8.5)));
    CHECK(glm::dot(a, b) == Fixed(21));
}

TEST_CASE("fixed: order and limits") {
    using Limits = std::numeric_limits<Fixed>;
    CHECK(Limits::max().raw() == largest);
    CHECK(Limits::lowest().raw() == smallest);
    CHECK(Limits::epsilon().raw() == 1);
    CHECK(Fixed(-1) < Fixed(0));
    CHECK(Fixed(1) > Fixed::from_raw(one - 1));
    CHECK(Fixed(1) <= Fixed(1));
    CHECK(Fixed(1) >= Fixed(1));
    CHECK(Fixed(1) != Fixed(2));
    CHECK(abs(Fixed(-2)) == Fixed(2));
    CHECK(wisp::min(Fixed(-2), Fixed(1)) == Fixed(-2));
    CHECK(wisp::max(Fixed(-2), Fixed(1)) == Fixed(1));
}
