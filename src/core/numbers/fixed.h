// Fixed: the scalar of the fixed-point arithmetic. It is Q32.32, a 64-bit integer in units of 2^-32: the range is
// [-2^31, 2^31), and the resolution is 2.3e-10 everywhere.
//
// * Every operation is computed exactly, then rounded once to the nearest unit. Ties round towards +infinity.
// * A result outside the range saturates. If the whole program is compiled with -DWISP_TRAP, as the tests are, it calls
//   fixed_overflow() instead, so that a scene or a formula that leaves the range is noticed.
// * Only integers are used: conversions from and to floats work on their bits. The square root may take its first guess
//   from an FPU; integers correct the guess, so the bits are the same with and without an FPU.
#pragma once
#include <cstdint>
#include <limits>
#include <type_traits>

#if defined(__SIZEOF_INT128__) && !defined(__wasm__) // on wasm a 128-bit product costs four times the portable one
#define WISP_NATIVE_INT128
#endif
// Targets with an FPU for double, unless the build excludes it with -DWISP_INTEGERS.
#if !defined(WISP_INTEGERS) &&                                                                                         \
    (defined(__SSE2__) || defined(__aarch64__) || defined(__wasm__) || defined(__powerpc64__) || defined(__s390x__) || \
     (defined(__ARM_FP) && (__ARM_FP & 8)) || (defined(__riscv_flen) && __riscv_flen >= 64))
#define WISP_HARDWARE_DOUBLE
#endif

namespace wisp {

// Whether fixed point may use doubles to save time. The bits are the same either way.
#ifdef WISP_HARDWARE_DOUBLE
constexpr bool hardware_double = true;
#else
constexpr bool hardware_double = false;
#endif

#ifdef WISP_TRAP
// Called when a Fixed leaves its range or divides by zero. The test program defines it, and throws in it.
[[noreturn]] void fixed_overflow();
#endif

namespace detail {

constexpr int64_t fixed_max = INT64_MAX, fixed_min = INT64_MIN;

// The raw result of an operation after saturation, and whether it had to saturate.
struct Saturated {
    int64_t raw;
    bool overflow;
};

constexpr Saturated saturated(bool negative) { return {negative ? fixed_min : fixed_max, true}; }

// Leading zeros of x, which must not be 0.
constexpr int leading_zeros(uint64_t x) { return __builtin_clzll(x); }

// ---- 128-bit intermediate results, modulo 2^128: the compiler's type where it is fast, otherwise two words

struct PortableWide {
    uint64_t high, low;
};
struct Quotient {
    uint64_t quotient, remainder;
};

// a b + more, of signed factors; `more` is below 2^32.
template <class Wide> constexpr Wide product(int64_t a, int64_t b, uint64_t more = 0);
template <class Wide> constexpr Wide join(uint64_t high, uint64_t low);

constexpr int64_t high_word(PortableWide w) { return static_cast<int64_t>(w.high); }
constexpr uint64_t low_word(PortableWide w) { return w.low; }
constexpr PortableWide operator+(PortableWide a, PortableWide b) {
    const uint64_t low = a.low + b.low;
    return {a.high + b.high + (low < a.low), low};
}
template <> constexpr PortableWide join(uint64_t high, uint64_t low) { return {high, low}; }
template <> __attribute__((always_inline)) constexpr PortableWide product(int64_t a, int64_t b, uint64_t more) {
    // Signed high and unsigned low halves. No sum overflows: |high * low| <= 2^31 (2^32 - 1). The high halves are
    // shifts of unsigned numbers: shifts of signed ones g++ multiplies as numbers of 64 bits.
    constexpr int64_t mask = 0xffffffff;
    const int32_t a_high = static_cast<int32_t>(static_cast<uint64_t>(a) >> 32),
                  b_high = static_cast<int32_t>(static_cast<uint64_t>(b) >> 32);
    const int64_t a_low = a & mask, b_low = b & mask;
    const uint64_t low = static_cast<uint64_t>(a_low) * static_cast<uint64_t>(b_low) + more;
    const int64_t middle = a_high * b_low + static_cast<int64_t>(low >> 32);
    const int64_t carry = a_low * b_high + (middle & mask);
    const int64_t high = int64_t{a_high} * b_high + (middle >> 32) + (carry >> 32);
    return {static_cast<uint64_t>(high), (static_cast<uint64_t>(carry) << 32) | (low & 0xffffffff)};
}
// floor((2^64 - 1) / d) - 2^32, 2^31 <= d: by two digits of base 2^16, so that no number of 64 bits is divided (Knuth,
// The Art of Computer Programming 2, 4.3.1, algorithm D).
constexpr uint32_t reciprocal_of_word(uint32_t d) {
    const uint32_t d_high = d >> 16, d_low = d & 0xffff;
    uint32_t rest = ~d, reciprocal = 0;
    for (int half = 0; half < 2; ++half) {
        uint32_t digit = rest / d_high; // at most 2 too large
        const uint32_t taken = digit * d_low;
        rest = (rest - digit * d_high) << 16 | 0xffff;
        for (int i = 0; i < 2 && rest < taken; ++i) {
            --digit;
            rest += d;
            if (rest < d) break; // it is past 2^32
        }
        rest -= taken;
        reciprocal = reciprocal << 16 | digit;
    }
    return reciprocal;
}
// dividend / divisor; the quotient must fit one word (dividend.high < divisor). Long division by two digits of base
// 2^32, each found by a product with floor((2^96 - 1) / d) - 2^32, d the divisor without leading zeros (Moeller,
// Granlund 2011, algorithms 6 and 5).
constexpr Quotient divide(PortableWide dividend, uint64_t divisor) {
    const int shift = leading_zeros(divisor);
    const uint64_t d = divisor << shift, low = dividend.low << shift;
    const uint32_t d_high = static_cast<uint32_t>(d >> 32), d_low = static_cast<uint32_t>(d);
    uint32_t reciprocal = reciprocal_of_word(d_high), above = d_high * reciprocal + d_low;
    if (above < d_low) {
        --reciprocal;
        if (above >= d_high) {
            --reciprocal;
            above -= d_high;
        }
        above -= d_high;
    }
    const uint64_t more = uint64_t{reciprocal} * d_low;
    above += static_cast<uint32_t>(more >> 32);
    if (above < static_cast<uint32_t>(more >> 32)) {
        --reciprocal;
        if (((uint64_t{above} << 32) | static_cast<uint32_t>(more)) >= d) --reciprocal;
    }
    const uint64_t moved_up = shift == 0 ? 0 : dividend.low >> (64 - shift);
    uint64_t rest = (dividend.high << shift) | moved_up, quotient = 0;
    for (int half = 32; half >= 0; half -= 32) {
        const uint64_t guess = (rest >> 32) * reciprocal + rest;
        uint32_t digit = static_cast<uint32_t>(guess >> 32);
        rest = ((rest - uint64_t{digit} * d_high) << 32 | static_cast<uint32_t>(low >> half)) -
               uint64_t{digit} * d_low - d;
        ++digit;
        if (static_cast<uint32_t>(rest >> 32) >= static_cast<uint32_t>(guess)) {
            --digit;
            rest += d;
        }
        if (rest >= d) {
            ++digit;
            rest -= d;
        }
        quotient = (quotient << 32) | digit;
    }
    return {quotient, rest >> shift};
}

#ifdef WISP_NATIVE_INT128
__extension__ typedef unsigned __int128 NativeWide;
__extension__ typedef __int128 SignedNativeWide;

constexpr int64_t high_word(NativeWide w) { return static_cast<int64_t>(w >> 64); }
constexpr uint64_t low_word(NativeWide w) { return static_cast<uint64_t>(w); }
template <> constexpr NativeWide join(uint64_t high, uint64_t low) { return NativeWide{high} << 64 | low; }
template <> constexpr NativeWide product(int64_t a, int64_t b, uint64_t more) {
    return static_cast<NativeWide>(static_cast<SignedNativeWide>(a) * b) + more;
}
constexpr Quotient divide(NativeWide dividend, uint64_t divisor) {
    const uint64_t quotient = static_cast<uint64_t>(dividend / divisor);
    return {quotient, static_cast<uint64_t>(dividend) - quotient * divisor};
}
using Wide = NativeWide;
#else
using Wide = PortableWide;
#endif

// ---- The operations on raw values

// a b / 2^64, rounded down: for polynomials in units far below 2^-32.
constexpr int64_t multiply_high(int64_t a, int64_t b) { return high_word(product<Wide>(a, b)); }

// Half a unit of Fixed, in those of products: what is cut off after it was added is rounded to nearest.
constexpr uint64_t half_unit = uint64_t{1} << 31;
// w / 2^32, rounded down. If w does not fit, the result saturates; `negative` is the sign of the exact value, which w
// is modulo 2^128.
template <class Wide> constexpr Saturated cut_to_fixed(Wide w, bool negative) {
    const int64_t high = high_word(w);
    if (__builtin_expect(high != static_cast<int32_t>(high), 0)) return saturated(negative);
    return {static_cast<int64_t>((static_cast<uint64_t>(high) << 32) | (low_word(w) >> 32)), false};
}

constexpr Saturated add(int64_t a, int64_t b) {
    int64_t sum = 0;
    if (__builtin_expect(__builtin_add_overflow(a, b, &sum), 0)) return saturated(a < 0);
    return {sum, false};
}
constexpr Saturated subtract(int64_t a, int64_t b) {
    int64_t difference = 0;
    if (__builtin_expect(__builtin_sub_overflow(a, b, &difference), 0)) return saturated(a < 0);
    return {difference, false};
}
template <class Wide> constexpr Saturated multiply(int64_t a, int64_t b) {
    const Wide w = product<Wide>(a, b, half_unit);
    return cut_to_fixed(w, high_word(w) < 0);
}
// ax bx + ay by + az bz, rounded once. The sum may wrap around 2^127. Its high word then does not fit 32 bits either,
// so the result saturates, with the sign of the sum of the high words.
template <class Wide>
constexpr Saturated sum_of_products(int64_t ax, int64_t bx, int64_t ay, int64_t by, int64_t az, int64_t bz) {
    const Wide x = product<Wide>(ax, bx, half_unit), y = product<Wide>(ay, by), z = product<Wide>(az, bz);
    return cut_to_fixed(x + y + z, (high_word(x) >> 2) + (high_word(y) >> 2) + (high_word(z) >> 2) < 0);
}
// a / 0 is the limit with the sign of a, and 0 / 0 is 0; both are overflows.
template <class Wide> constexpr Saturated divide(int64_t a, int64_t b) {
    if (b == 0) return a == 0 ? Saturated{0, true} : saturated(a < 0);
    const bool negative = (a < 0) != (b < 0);
    const uint64_t n = a < 0 ? 0 - static_cast<uint64_t>(a) : static_cast<uint64_t>(a);
    const uint64_t d = b < 0 ? 0 - static_cast<uint64_t>(b) : static_cast<uint64_t>(b);
    if (__builtin_expect((n >> 32) >= d, 0)) return saturated(negative);
    const Quotient exact = divide(join<Wide>(n >> 32, n << 32), d);
    const bool up = exact.remainder > d - exact.remainder - !negative; // ties round up: away from 0 if positive
    const uint64_t largest = static_cast<uint64_t>(fixed_max) + negative;
    if (__builtin_expect(exact.quotient > largest - up, 0)) return saturated(negative);
    const uint64_t magnitude = exact.quotient + up;
    return {static_cast<int64_t>(negative ? 0 - magnitude : magnitude), false};
}
// x 2^k.
constexpr Saturated scale(int64_t x, int k) {
    if (k >= 0) {
        if (x == 0) return {0, false};
        if (k > 62) return saturated(x < 0);
        const int64_t shifted = static_cast<int64_t>(static_cast<uint64_t>(x) << k);
        return (shifted >> k) == x ? Saturated{shifted, false} : saturated(x < 0);
    }
    if (k < -63) return {0, false};
    return {(x >> -k) + ((x >> (-k - 1)) & 1), false};
}

// The integer nearest to sqrt(X), X = x 2^32, 0 < x, from a guess that is within 1 of it. One test on either side
// suffices: sqrt(X) lies in (root - 1/2, root + 1/2) exactly if -root < X - root^2 <= root. That difference is small
// enough to be computed modulo 2^64.
constexpr int64_t corrected_root(int64_t x, int64_t guess) {
    const uint64_t root = static_cast<uint64_t>(guess);
    const int64_t excess = static_cast<int64_t>((static_cast<uint64_t>(x) << 32) - root * root);
    return guess + (excess > guess) - (excess <= -guess);
}
constexpr uint32_t high_of_words(uint32_t a, uint32_t b) { return static_cast<uint32_t>(uint64_t{a} * b >> 32); }
// The integer nearest to sqrt(x 2^32) by integers only, 0 < x. Let a = x 2^(shift - 64), in [1/4, 1). Newton's method
// gives r = 1 / sqrt(a) to 28 bits without a division: r (3 - a r^2) / 2. It starts from the line 2.1328 - 1.2187 a,
// within 8.6 % of r. Then sqrt(a) is a r to 27 bits; what a lacks to its square gives as many more.
__attribute__((noinline)) constexpr int64_t root_by_integers(int64_t x) {
    const int shift = leading_zeros(static_cast<uint64_t>(x)) & ~1;
    const uint64_t n = static_cast<uint64_t>(x) << shift;   // in units of 2^-64
    const uint32_t a = static_cast<uint32_t>(n >> 32);      // of 2^-32
    uint32_t r = 0x88800000 - high_of_words(0x4e000000, a); // of 2^-30
    for (int step = 0; step < 4; ++step) {
        const uint32_t square = high_of_words(high_of_words(r, r), a); // a r^2, in units of 2^-28
        r = static_cast<uint32_t>(uint64_t{r} * ((3u << 28) - square) >> 29);
    }
    const uint64_t rounded = uint64_t{a} * r >> 30;
    const uint32_t root = rounded >> 32 == 0 ? static_cast<uint32_t>(rounded) : 0xffffffff; // a may be nearly 1
    const int64_t excess = static_cast<int64_t>(n - uint64_t{root} * root);
    const int64_t fine = static_cast<int64_t>(uint64_t{root} << 16) + ((excess >> 8) * static_cast<int64_t>(r) >> 39);
    return corrected_root(x, shift == 0 ? fine : (fine + (int64_t{1} << (shift / 2 - 1))) >> shift / 2); // as scale()
}
#ifdef WISP_HARDWARE_DOUBLE
inline int64_t root_by_hardware(int64_t x) {
    return corrected_root(x, static_cast<int64_t>(__builtin_sqrt(static_cast<double>(x)) * 65536 + 0.5));
}
#endif
inline int64_t root(int64_t x) {
#ifdef WISP_HARDWARE_DOUBLE
    return root_by_hardware(x);
#else
    return root_by_integers(x);
#endif
}

// ---- Floating-point formats by their bits

template <class Float> struct FloatFormat;
template <> struct FloatFormat<float> {
    using Bits = uint32_t;
    static constexpr int fraction_bits = 23, bias = 127, min_exponent = -149; // min_exponent: of the last place
    static constexpr Bits infinity = 0x7f800000;
};
template <> struct FloatFormat<double> {
    using Bits = uint64_t;
    static constexpr int fraction_bits = 52, bias = 1023, min_exponent = -1074;
    static constexpr Bits infinity = 0x7ff0000000000000;
};
template <class Float> using BitsOf = typename FloatFormat<Float>::Bits;

template <class Float> constexpr BitsOf<Float> to_bits(Float x) { return __builtin_bit_cast(BitsOf<Float>, x); }
template <class Float> constexpr Float from_bits(BitsOf<Float> bits) { return __builtin_bit_cast(Float, bits); }

// The Float nearest to +-magnitude 2^exponent, ties to even. The result may be subnormal or infinite, as in IEEE 754.
template <class Float> constexpr Float nearest_float(bool negative, uint64_t magnitude, int exponent) {
    using Format = FloatFormat<Float>;
    using Bits = BitsOf<Float>;
    if (magnitude == 0) return 0;
    const int top_exponent = 63 - leading_zeros(magnitude) + exponent;
    int last_exponent = top_exponent - Format::fraction_bits; // of the last place that is kept
    if (last_exponent < Format::min_exponent) last_exponent = Format::min_exponent;
    const int dropped = last_exponent - exponent;
    uint64_t kept = 0;
    if (dropped <= 0) {
        kept = magnitude << -dropped;
    } else if (dropped <= 64) {
        const uint64_t half = uint64_t{1} << (dropped - 1), rest = magnitude & (half | (half - 1));
        kept = magnitude >> (dropped - 1) >> 1;
        kept += rest > half || (rest == half && (kept & 1) != 0);
    }
    // The leading bit of a normal number carries into the exponent field.
    const uint64_t steps = static_cast<uint64_t>(last_exponent - Format::min_exponent);
    uint64_t bits = Format::infinity;
    if (steps < (Format::infinity >> Format::fraction_bits)) bits = (steps << Format::fraction_bits) + kept;
    if (bits > Format::infinity) bits = Format::infinity;
    const Bits sign = static_cast<Bits>(Bits{negative} << (8 * sizeof(Bits) - 1));
    return from_bits<Float>(static_cast<Bits>(bits) | sign);
}

// x in units of 2^-32. Infinities and NaN saturate. Always inlined, with the constructors: of constants nothing is
// left, also where the compiler is asked for little code.
template <class Float> __attribute__((always_inline)) constexpr Saturated raw_from_float(Float x) {
    using Format = FloatFormat<Float>;
    const uint64_t bits = to_bits(x), magnitude = bits & (Format::infinity | (Format::infinity - 1));
    const int field = static_cast<int>(magnitude >> Format::fraction_bits);
    const int64_t leading = int64_t{1} << Format::fraction_bits;
    const int64_t fraction = static_cast<int64_t>(magnitude) & (leading - 1);
    const int64_t mantissa = field == 0 ? fraction : fraction | leading;
    return scale(bits != magnitude ? -mantissa : mantissa, (field == 0 ? 0 : field - 1) + Format::min_exponent + 32);
}
template <class Integer> __attribute__((always_inline)) constexpr Saturated raw_from_integer(Integer i) {
    int64_t raw = 0;
    if (__builtin_mul_overflow(i, int64_t{1} << 32, &raw)) return saturated(!(i > 0));
    return {raw, false};
}

constexpr int64_t checked(Saturated result) {
#ifdef WISP_TRAP
    if (__builtin_expect(result.overflow, 0)) fixed_overflow();
#endif
    return result.raw;
}

// The operations as functions of integers: 32-bit ARM returns those in registers, and a Fixed in memory. Where the
// compiler is asked for little code, sums are calls, too: in that they saturate, they are long.
#ifdef __OPTIMIZE_SIZE__
#define WISP_SUM __attribute__((noinline)) constexpr
#else
#define WISP_SUM constexpr
#endif
WISP_SUM int64_t raw_sum(int64_t a, int64_t b) { return checked(add(a, b)); }
WISP_SUM int64_t raw_difference(int64_t a, int64_t b) { return checked(subtract(a, b)); }
#undef WISP_SUM
constexpr int64_t raw_product(int64_t a, int64_t b) { return checked(multiply<Wide>(a, b)); }
constexpr int64_t raw_quotient(int64_t a, int64_t b) { return checked(divide<Wide>(a, b)); }

// a + t (b - a), with the bits of those three operations.
constexpr int64_t raw_mix_by_operations(int64_t a, int64_t b, int64_t t) {
    return raw_sum(a, raw_product(t, raw_difference(b, a)));
}
// Where t is in [0, 1), the result is between a and b, and a product of two words suffices.
constexpr int64_t raw_mix_by_words(int64_t a, int64_t b, int64_t t) {
    int64_t way = 0;
    if (__builtin_expect(t >> 32 != 0 || __builtin_sub_overflow(b, a, &way), 0)) return raw_mix_by_operations(a, b, t);
    const uint32_t fraction = static_cast<uint32_t>(t);
    const uint64_t low = uint64_t{static_cast<uint32_t>(way)} * fraction + half_unit;
    return a + (way >> 32) * int64_t{fraction} + static_cast<int64_t>(low >> 32);
}
constexpr int64_t raw_mix(int64_t a, int64_t b, int64_t t) {
    return std::is_same_v<Wide, PortableWide> ? raw_mix_by_words(a, b, t) : raw_mix_by_operations(a, b, t);
}
} // namespace detail

struct Fixed {
    Fixed() = default;
    // Integers outside [-2^31, 2^31) overflow.
    template <class Integer, class = std::enable_if_t<std::is_integral<Integer>::value>>
    __attribute__((always_inline)) constexpr explicit Fixed(Integer i)
        : raw_(detail::checked(detail::raw_from_integer(i))) {}
    // The nearest Fixed. This is for constants; run-time values that may not fit are converted by to_real.
    __attribute__((always_inline)) constexpr explicit Fixed(double x)
        : raw_(detail::checked(detail::raw_from_float(x))) {}

    static constexpr Fixed from_raw(int64_t raw) {
        Fixed x(0);
        x.raw_ = raw;
        return x;
    }
    constexpr int64_t raw() const { return raw_; } // the value times 2^32

  private:
    int64_t raw_;
};

static_assert(std::is_trivial<Fixed>::value && sizeof(Fixed) == 8, "arrays of Fixed need no initialisation");

constexpr bool operator==(Fixed a, Fixed b) { return a.raw() == b.raw(); }
constexpr bool operator!=(Fixed a, Fixed b) { return a.raw() != b.raw(); }
constexpr bool operator<(Fixed a, Fixed b) { return a.raw() < b.raw(); }
constexpr bool operator>(Fixed a, Fixed b) { return a.raw() > b.raw(); }
constexpr bool operator<=(Fixed a, Fixed b) { return a.raw() <= b.raw(); }
constexpr bool operator>=(Fixed a, Fixed b) { return a.raw() >= b.raw(); }

#define WISP_OPERATOR __attribute__((always_inline)) constexpr Fixed
WISP_OPERATOR operator+(Fixed a, Fixed b) { return Fixed::from_raw(detail::raw_sum(a.raw(), b.raw())); }
WISP_OPERATOR operator-(Fixed a, Fixed b) { return Fixed::from_raw(detail::raw_difference(a.raw(), b.raw())); }
WISP_OPERATOR operator*(Fixed a, Fixed b) { return Fixed::from_raw(detail::raw_product(a.raw(), b.raw())); }
// a / 0 is an overflow: it gives the limit with the sign of a, and 0 for a = 0.
WISP_OPERATOR operator/(Fixed a, Fixed b) { return Fixed::from_raw(detail::raw_quotient(a.raw(), b.raw())); }
WISP_OPERATOR operator-(Fixed a) { return Fixed::from_raw(0) - a; }
WISP_OPERATOR operator+(Fixed a) { return a; }
WISP_OPERATOR &operator+=(Fixed &a, Fixed b) { return a = a + b; }
WISP_OPERATOR &operator-=(Fixed &a, Fixed b) { return a = a - b; }
WISP_OPERATOR &operator*=(Fixed &a, Fixed b) { return a = a * b; }
WISP_OPERATOR &operator/=(Fixed &a, Fixed b) { return a = a / b; }
#undef WISP_OPERATOR

} // namespace wisp

// GLM accepts a scalar only if its limits call it a floating-point type. The values are those of units of 2^-32.
template <> struct std::numeric_limits<wisp::Fixed> {
    static constexpr bool is_specialized = true, is_iec559 = true, is_signed = true, is_integer = false;
    static constexpr bool is_exact = false, is_bounded = true, is_modulo = false, has_infinity = false;
    static constexpr int radix = 2, digits = 63;
    static constexpr wisp::Fixed max() { return wisp::Fixed::from_raw(INT64_MAX); }
    static constexpr wisp::Fixed lowest() { return wisp::Fixed::from_raw(INT64_MIN); }
    static constexpr wisp::Fixed min() { return wisp::Fixed::from_raw(1); } // the smallest above 0, as for floats
    static constexpr wisp::Fixed epsilon() { return wisp::Fixed::from_raw(1); }
};
