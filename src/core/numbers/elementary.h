// The functions that core code calls on its scalar, each for float, double and Fixed.
//
// * float and double use only + - * / sqrt, comparisons and integer operations on their bits. So every IEEE 754 machine
//   gives the same bits if it rounds to nearest, keeps subnormal numbers and does not contract a * b + c (self_test.h
//   checks this). libm is not used: its results differ between libraries, and even between CPUs.
// * Fixed uses integers. Results are rounded from intermediates in units of 2^-50 or finer.
// * The largest errors measured are 0.9 units in the last place for float and double (N-M). Exceptions: 1.07 for expm1
//   in float, 1.6 for angle_between, and 1 for sines below 2^-100 in float. For Fixed the largest error is 0.51 units
//   of 2^-32; exp above 1 has a relative error of 1.2e-10.
#pragma once
#include "core/numbers/elementary_coefficients.h"
#include "core/numbers/fixed.h"
#include <cstddef>

namespace wisp {

// ---- Constants

template <class T> constexpr T pi = T(3.14159265358979323846);
template <class T> constexpr T two_pi = T(6.28318530717958647693);
template <class T> constexpr T four_pi = T(12.5663706143591729539);
template <class T> constexpr T half_pi = T(1.57079632679489661923);
template <class T> constexpr T inv_pi = T(0.318309886183790671538);
template <class T> constexpr T inv_two_pi = T(0.159154943091895335769);
template <class T> constexpr T inv_four_pi = T(0.0795774715459476678844);

// ---- Comparison, conversion, scaling

template <class T> constexpr T min(T a, T b) { return b < a ? b : a; }
template <class T> constexpr T max(T a, T b) { return a < b ? b : a; }
// On some 32-bit machines int32_t is `long`, which is not the type of an integer literal; these overloads accept both.
template <class A, class B>
using SameInteger = std::enable_if_t<!std::is_same_v<A, B> && std::is_integral_v<A> && std::is_integral_v<B> &&
                                         sizeof(A) == sizeof(B) && std::is_signed_v<A> == std::is_signed_v<B>,
                                     A>;
template <class A, class B> constexpr SameInteger<A, B> min(A a, B b) { return b < a ? static_cast<A>(b) : a; }
template <class A, class B> constexpr SameInteger<A, B> max(A a, B b) { return a < b ? static_cast<A>(b) : a; }

constexpr float abs(float x) { return __builtin_fabsf(x); }
constexpr double abs(double x) { return __builtin_fabs(x); }
constexpr Fixed abs(Fixed x) { return x < Fixed(0) ? -x : x; }

// The nearest T. For Fixed, a number outside [-2^31, 2^31) becomes the nearer limit; it does not trap.
// Not inlined for Fixed: numbers of scenes are converted in many places, none of which is called often.
template <class T> constexpr T to_real(double x) { return static_cast<T>(x); }
template <> __attribute__((noinline)) constexpr Fixed to_real(double x) {
    return Fixed::from_raw(detail::raw_from_float(x).raw);
}
template <class T> constexpr T to_real(float x) { return static_cast<T>(x); }
template <> __attribute__((noinline)) constexpr Fixed to_real(float x) {
    return Fixed::from_raw(detail::raw_from_float(x).raw);
}

namespace detail {
template <class Float> constexpr Float fixed_to_float(Fixed x, int exponent) {
    const uint64_t bits = static_cast<uint64_t>(x.raw());
    const bool negative = x.raw() < 0;
    // Outside these limits the result is 0 or infinite for every x.
    const int clamped = min(max(exponent, -2000), 2000);
    return nearest_float<Float>(negative, negative ? 0 - bits : bits, clamped - 32);
}

// 2^k, in the range of normal numbers.
template <class T> constexpr T power_of_two(int k) {
    return from_bits<T>(static_cast<BitsOf<T>>(k + FloatFormat<T>::bias) << FloatFormat<T>::fraction_bits);
}

// x 2^k, rounded once. k is split into factors within the exponent range. After all but the last, the product is either
// a normal number, which is exact, or so small that the last factor makes it 0.
template <class T> constexpr T scale_float(T x, int k) {
    constexpr int largest = FloatFormat<T>::bias, smallest = 1 - largest;
    constexpr int step_down = smallest + FloatFormat<T>::fraction_bits + 1;
    k = min(max(k, 4 * smallest), 4 * largest);
    for (; k > largest; k -= largest) x *= power_of_two<T>(largest);
    for (; k < smallest; k -= step_down) x *= power_of_two<T>(step_down);
    return x * power_of_two<T>(k);
}
} // namespace detail

// x 2^k, rounded once.
constexpr float scale_pow2(float x, int k) { return detail::scale_float(x, k); }
constexpr double scale_pow2(double x, int k) { return detail::scale_float(x, k); }
constexpr Fixed scale_pow2(Fixed x, int k) { return Fixed::from_raw(detail::checked(detail::scale(x.raw(), k))); }

// n 2^k, rounded to nearest.
template <class T> constexpr T scaled_integer(int64_t n, int k) { return scale_pow2(static_cast<T>(n), k); }
template <> constexpr Fixed scaled_integer(int64_t n, int k) {
    return Fixed::from_raw(detail::checked(detail::scale(n, k + 32)));
}

// The nearest double; the nearest float, ties to even; and the float nearest to x 2^exponent, infinite if too large.
constexpr double to_double(float x) { return x; }
constexpr double to_double(double x) { return x; }
constexpr double to_double(Fixed x) { return detail::fixed_to_float<double>(x, 0); }
constexpr float to_float(float x) { return x; }
constexpr float to_float(double x) { return static_cast<float>(x); }
constexpr float to_float(Fixed x) { return detail::fixed_to_float<float>(x, 0); }
constexpr float to_float_scaled(float x, int exponent) { return scale_pow2(x, exponent); }
constexpr float to_float_scaled(double x, int exponent) { return static_cast<float>(scale_pow2(x, exponent)); }
constexpr float to_float_scaled(Fixed x, int exponent) { return detail::fixed_to_float<float>(x, exponent); }

namespace detail {
// x clamped to the range of int32_t; NaN becomes its lower end.
template <class T> constexpr T clamped_to_int(T x) {
    constexpr T low = T(-2147483648.0), high = T(sizeof(T) == 4 ? 2147483520.0 : 2147483647.0);
    return x > low ? (x < high ? x : high) : low;
}
template <class T> constexpr int32_t floor_float(T x) {
    const T inside = clamped_to_int(x);
    const int32_t truncated = static_cast<int32_t>(inside);
    return truncated - (inside < static_cast<T>(truncated));
}
template <class T> constexpr int32_t round_float(T x) {
    const T inside = clamped_to_int(x);
    const int32_t below = floor_float(inside);
    return below + (below < INT32_MAX && inside - static_cast<T>(below) >= T(0.5));
}
} // namespace detail

// floor(x), clamped to int32_t.
constexpr int32_t floor_to_int(float x) { return detail::floor_float(x); }
constexpr int32_t floor_to_int(double x) { return detail::floor_float(x); }
constexpr int32_t floor_to_int(Fixed x) { return static_cast<int32_t>(x.raw() >> 32); }

// floor(x) for 0 <= x < 2^31, without a branch, for loops over lanes.
constexpr int32_t truncate(float x) { return static_cast<int32_t>(x); }
constexpr int32_t truncate(double x) { return static_cast<int32_t>(x); }
constexpr int32_t truncate(Fixed x) { return floor_to_int(x); }

// The nearest integer, ties upwards, clamped to int32_t.
constexpr int32_t round_to_int(float x) { return detail::round_float(x); }
constexpr int32_t round_to_int(double x) { return detail::round_float(x); }
constexpr int32_t round_to_int(Fixed x) {
    const int32_t below = floor_to_int(x);
    return below + (below < INT32_MAX && ((x.raw() >> 31) & 1) != 0);
}

// 32 random bits as a number in [0, 1): multiples of 2^-24 in float, of 2^-32 otherwise.
template <class T> constexpr T unit_half_open(uint32_t u);
template <> constexpr float unit_half_open(uint32_t u) {
    return static_cast<float>(static_cast<int32_t>(u >> 8)) * 0x1p-24f;
}
template <> constexpr double unit_half_open(uint32_t u) { return u * 0x1p-32; }
template <> constexpr Fixed unit_half_open(uint32_t u) { return Fixed::from_raw(u); }

// 32 random bits as a number in (0, 1), ends excluded: the centre (u + 1/2) 2^-32 of their bin, rounded. Fixed cannot
// represent the centre; it takes the lower end of the bin, or 2^-32 if that is 0.
template <class T> constexpr T unit_open(uint32_t u);
template <> constexpr float unit_open(uint32_t u) {
    // Both halves are exact, so the sum rounds once.
    const float high = static_cast<float>(static_cast<int32_t>(u >> 16)) * 0x1p-16f;
    const float low = (static_cast<float>(static_cast<int32_t>(u & 0xffff)) + 0.5f) * 0x1p-32f;
    return min(high + low, 1 - 0x1p-24f);
}
template <> constexpr double unit_open(uint32_t u) { return (u + 0.5) * 0x1p-32; }
template <> constexpr Fixed unit_open(uint32_t u) { return Fixed::from_raw(max(u, uint32_t{1})); }

// ax bx + ay by + az bz. float and double add from left to right; Fixed computes it exactly, then rounds once.
constexpr float sum_of_products(float ax, float bx, float ay, float by, float az, float bz) {
    return ax * bx + ay * by + az * bz;
}
constexpr double sum_of_products(double ax, double bx, double ay, double by, double az, double bz) {
    return ax * bx + ay * by + az * bz;
}
constexpr Fixed sum_of_products(Fixed ax, Fixed bx, Fixed ay, Fixed by, Fixed az, Fixed bz) {
    return Fixed::from_raw(detail::checked(
        detail::sum_of_products<detail::Wide>(ax.raw(), bx.raw(), ay.raw(), by.raw(), az.raw(), bz.raw())));
}

// a + t (b - a): exact where a = b.
constexpr float mix(float a, float b, float t) { return a + t * (b - a); }
constexpr double mix(double a, double b, double t) { return a + t * (b - a); }
constexpr Fixed mix(Fixed a, Fixed b, Fixed t) {
    return Fixed::from_raw(detail::raw_mix(a.raw(), b.raw(), t.raw()));
}

// The square root, correctly rounded. For Fixed, x < 0 is an overflow and gives 0.
inline float sqrt(float x) { return __builtin_sqrtf(x); }
inline double sqrt(double x) { return __builtin_sqrt(x); }
inline Fixed sqrt(Fixed x) {
    if (x.raw() <= 0) return Fixed::from_raw(detail::checked({0, x.raw() < 0}));
    return Fixed::from_raw(detail::root(x.raw()));
}

// ---- float and double

namespace detail {

// c[0] + c[1] x + c[2] x^2 + ... by Horner's rule, unrolled so that loops over lanes can call it.
template <size_t i = 0, class T, size_t n> constexpr T polynomial(T x, const T (&c)[n]) {
    if constexpr (i + 1 == n)
        return c[i];
    else
        return c[i] + x * polynomial<i + 1>(x, c);
}

// Limits and bit patterns that the algorithms below need for each type.
template <class T> struct Shape;
template <> struct Shape<float> {
    using Integer = int32_t;
    static constexpr float exp_vanishes = -105, exp_overflows = 90, expm1_is_minus_one = -18;
    static constexpr uint32_t sqrt_half_bits = 0x3f3504f3, upper_bits = 0xfffff000, cbrt_guess = 0x2a5119f2;
    static constexpr int cbrt_steps = 1;
};
template <> struct Shape<double> {
    using Integer = int64_t;
    static constexpr double exp_vanishes = -750, exp_overflows = 720, expm1_is_minus_one = -45;
    static constexpr uint64_t sqrt_half_bits = 0x3fe6a09e667f3bcd, upper_bits = 0xfffffffff8000000;
    static constexpr uint64_t cbrt_guess = 0x2a9f7893b9ea8000;
    static constexpr int cbrt_steps = 2;
};

template <class T> constexpr T infinity = from_bits<T>(FloatFormat<T>::infinity);
template <class T> constexpr T not_a_number = from_bits<T>(FloatFormat<T>::infinity | FloatFormat<T>::infinity >> 1);

// The leading 12 (float) or 26 (double) bits of x, whose products with each other are exact.
template <class T> constexpr T upper_part(T x) { return from_bits<T>(to_bits(x) & Shape<T>::upper_bits); }

// e^x = 2^k (1 + r + tail), |r| <= ln(2)/2, k integer.
template <class T> struct ReducedExp {
    typename Shape<T>::Integer k;
    T r, tail;
};
template <class T> constexpr ReducedExp<T> reduce_exp(T x) {
    using C = Coefficients<T>;
    using Integer = typename Shape<T>::Integer;
    // Adding 1.5 2^52 (2^23 in float) leaves the nearest integer in the last bits of the sum.
    constexpr T rounder = static_cast<T>(Integer{3} << (FloatFormat<T>::fraction_bits - 1));
    const T shifted = x * C::inv_ln2 + rounder, multiple = shifted - rounder;
    const T high = x - multiple * C::ln2_high, low = multiple * C::ln2_low;
    const T r = high - low, lost = (high - r) - low;
    const Integer k = static_cast<Integer>(to_bits(shifted)) - static_cast<Integer>(to_bits(rounder));
    return {k, r, r * r * polynomial(r, C::exp) + lost};
}
// x 2^k for x near 1, by two normal factors. Only the last product may round.
template <class T> constexpr T scale_in_halves(T x, typename Shape<T>::Integer k) {
    constexpr int shift = FloatFormat<T>::fraction_bits;
    const BitsOf<T> both = static_cast<BitsOf<T>>(k + 2 * FloatFormat<T>::bias), first = both >> 1;
    return x * from_bits<T>(first << shift) * from_bits<T>((both - first) << shift);
}

template <class T> constexpr T exp_finite_float(T x) {
    const ReducedExp<T> e = reduce_exp(x < Shape<T>::exp_vanishes ? Shape<T>::exp_vanishes : x);
    return scale_in_halves(1 + (e.r + e.tail), e.k);
}
template <class T> constexpr T exp_float(T x) {
    return exp_finite_float(x > Shape<T>::exp_overflows ? Shape<T>::exp_overflows : x);
}
template <class T> constexpr T expm1_float(T x) {
    if (x < Shape<T>::expm1_is_minus_one) return -1;
    const ReducedExp<T> e = reduce_exp(x > Shape<T>::exp_overflows ? Shape<T>::exp_overflows : x);
    if (e.k == 0) return e.r + e.tail;
    if (e.k > FloatFormat<T>::fraction_bits + 1) {
        const T one_scaled = e.k < 100 ? power_of_two<T>(static_cast<int>(-e.k)) : T(0);
        return scale_in_halves(1 + (e.r + (e.tail - one_scaled)), e.k);
    }
    // (2^k - 1) + 2^k r with the rounding error of the sum, then 2^k tail.
    const T power = power_of_two<T>(static_cast<int>(e.k)), a = power - 1, b = power * e.r;
    const T sum = a + b, b_seen = sum - a, error = (a - (sum - b_seen)) + (b - b_seen);
    return sum + (error + power * e.tail);
}

// high + low + ln(1 + f) for f in [sqrt(1/2) - 1, sqrt(2) - 1): with s = f / (2 + f) and h = f^2 / 2,
// ln(1 + f) = 2s + s^3 P(s^2) = f - (h - s (h + s^2 P)).
template <class T> constexpr T log_kernel(T f, T high, T low) {
    const T s = f / (2 + f), z = s * s, h = T(0.5) * f * f;
    const T tail = z * polynomial(z, Coefficients<T>::log);
    return high - ((h - (s * (h + tail) + low)) - f);
}
// x = 2^(k + shift) (1 + f) for normal x > 0, f as above, k an integer.
template <class T> struct ReducedLog { T f, k; };
template <class T> constexpr ReducedLog<T> reduce_log(T x, int shift) {
    using Bits = BitsOf<T>;
    constexpr int fraction_bits = FloatFormat<T>::fraction_bits;
    constexpr Bits sqrt_half = Shape<T>::sqrt_half_bits, fraction = (Bits{1} << fraction_bits) - 1;
    const Bits moved = to_bits(x) + (to_bits(T(1)) - sqrt_half);
    const T m = from_bits<T>((moved & fraction) + sqrt_half);
    // An integer that is put into the last bits of 2^52 (2^23 in float) is added to it.
    constexpr T counter = static_cast<T>(Bits{1} << fraction_bits);
    const T k = from_bits<T>(to_bits(counter) | (moved >> fraction_bits)) -
                (counter + static_cast<T>(FloatFormat<T>::bias + shift));
    return {m - 1, k};
}
// ln(x 2^-shift) for normal x > 0.
template <class T> constexpr T log_normal(T x, int shift) {
    using C = Coefficients<T>;
    const ReducedLog<T> r = reduce_log(x, shift);
    return log_kernel(r.f, r.k * C::ln2_high, r.k * C::ln2_low);
}
template <class T> constexpr T log_float(T x) {
    constexpr int shift = FloatFormat<T>::fraction_bits + 2;
    if (!(x > 0)) return x == 0 ? -infinity<T> : not_a_number<T>;
    if (x == infinity<T>) return x;
    if (x < power_of_two<T>(1 - FloatFormat<T>::bias)) return log_normal(x * power_of_two<T>(shift), shift);
    return log_normal(x, 0);
}
template <class T> constexpr T log1p_float(T x) {
    using C = Coefficients<T>;
    if (x > T(-0.2928) && x < T(0.4142)) return log_kernel(x, T(0), T(0));
    const T sum = 1 + x;
    if (!(sum > 0) || sum == infinity<T>) return log_float(sum);
    const T lost = x >= 1 ? 1 - (sum - x) : x - (sum - 1); // the rounding error; ln(1 + x) = ln(sum) + lost / sum
    const ReducedLog<T> r = reduce_log(sum, 0);
    return log_kernel(r.f, r.k * C::ln2_high, r.k * C::ln2_low + lost / sum);
}

template <class T> constexpr void sincos_turns_float(T x, T &s, T &c) {
    using C = Coefficients<T>;
    using Integer = typename Shape<T>::Integer;
    constexpr T all_even = static_cast<T>(Integer{1} << (FloatFormat<T>::fraction_bits + 1));
    if (!(abs(x) < all_even)) {
        s = x - x; // a whole number of turns; NaN if x is infinite or NaN
        c = 1 + s;
        return;
    }
    const T quarters = 4 * x;
    Integer n = static_cast<Integer>(quarters);
    const T rest = quarters - static_cast<T>(n);
    n += (rest >= T(0.5)) - (rest < T(-0.5));
    const T r = x - T(0.25) * static_cast<T>(n); // exact, |r| <= 1/8
    const T z = r * r, r_high = upper_part(r), r_low = r - r_high;
    const T sine = r_high * C::two_pi_high + (r_low * C::two_pi_high + r * (C::two_pi_low + z * polynomial(z, C::sin)));
    const T square = z * C::cos[0], head = 1 + square;
    const T cosine = head + (((1 - head) + square) + z * z * polynomial<1>(z, C::cos));
    const bool odd = (n & 1) != 0, flip_s = (n & 2) != 0, flip_c = ((n + 1) & 2) != 0;
    s = odd ? cosine : sine;
    c = odd ? sine : cosine;
    if (flip_s) s = 0 - s; // never -0
    if (flip_c) c = 0 - c;
}

// (asin(x) - x) / x for z = x^2 <= 1/4.
template <class T> constexpr T asin_tail(T z) { return z * polynomial(z, Coefficients<T>::asin); }

template <class T> inline T acos_float(T x) {
    using C = Coefficients<T>;
    constexpr T high = C::quarter_pi_high[2], low = C::quarter_pi_low[2]; // pi/2
    if (abs(x) < T(0.5)) return high - (x - (low - x * asin_tail(x * x)));
    const T z = max(T(0), (1 - abs(x)) * T(0.5)), root = sqrt(z), tail = asin_tail(z); // acos = 2 asin(root)
    if (x < 0) return 2 * (high - (root + (tail * root - low)));
    if (z == 0) return 0;
    const T head = upper_part(root), rest = (z - head * head) / (root + head);
    return 2 * (head + (tail * root + rest));
}
template <class T> inline T asin_float(T x) {
    using C = Coefficients<T>;
    if (abs(x) < T(0.5)) return x + x * asin_tail(x * x);
    const T z = max(T(0), (1 - abs(x)) * T(0.5)); // asin = pi/2 - 2 asin(sqrt(z))
    if (z == 0) return x < 0 ? -half_pi<T> : half_pi<T>;
    const T root = sqrt(z), head = upper_part(root), rest = (z - head * head) / (root + head);
    const T low = C::quarter_pi_low[1] - (asin_tail(z) * root + rest);
    const T angle = C::quarter_pi_high[1] + ((C::quarter_pi_high[1] - 2 * head) + 2 * low);
    return x < 0 ? -angle : angle;
}

template <class T> constexpr T cbrt_float(T x) {
    if (x == 0 || !(abs(x) < infinity<T>)) return x;
    T a = abs(x), unscale = 1;
    if (a < power_of_two<T>(1 - FloatFormat<T>::bias)) {
        a *= power_of_two<T>(54);
        unscale = power_of_two<T>(-18);
    } else if (a > power_of_two<T>(100)) { // keeps 3 a finite
        a *= power_of_two<T>(-54);
        unscale = power_of_two<T>(18);
    }
    T root = from_bits<T>(to_bits(a) / 3 + Shape<T>::cbrt_guess); // within 3.4 %
    for (int step = 0; step < Shape<T>::cbrt_steps; ++step) {     // Halley's iteration triples the digits
        const T cube = root * root * root;
        root *= (cube + a + a) / (cube + cube + a);
    }
    constexpr BitsOf<T> dropped = static_cast<BitsOf<T>>(~Shape<T>::upper_bits);
    root = upper_part(from_bits<T>(to_bits(root) + dropped / 2 + 1)); // few enough bits that its square is exact
    const T quotient = a / (root * root);
    root += root * ((quotient - root) / ((root + root) + quotient));
    return (x < 0 ? -root : root) * unscale;
}

template <class T> constexpr T angle_between_float(T cross, T dot) {
    using C = Coefficients<T>;
    T a = cross, b = abs(dot);
    const bool steep = a > b;
    if (steep) {
        a = abs(dot);
        b = cross;
    }
    if (b == 0) return 0;
    if (b > power_of_two<T>(FloatFormat<T>::bias - 1)) { // a + b must not overflow
        a *= T(0.25);
        b *= T(0.25);
    }
    // a / b = tan of an angle up to pi/4; in its upper part atan(a/b) = pi/4 - atan((b - a)/(a + b)).
    const bool upper = a > T(0.5) * b;
    const T t = upper ? (b - a) / (a + b) : a / b, z = t * t;
    const T tail = t * (z * polynomial(z, C::atan));
    // The angle is k pi/4 +- atan(t).
    int k = upper;
    bool minus = upper;
    if (steep) {
        k = 2 - k;
        minus = !minus;
    }
    if (dot < 0) {
        k = 4 - k;
        minus = !minus;
    }
    if (k == 0) return t + tail;
    const T high = C::quarter_pi_high[k], low = C::quarter_pi_low[k];
    return minus ? high - (t + (tail - low)) : high + (t + (tail + low));
}
} // namespace detail

// ---- Fixed

namespace detail {

// c[0] + c[1] x + ... in the unit of the coefficients, for x in units of 2^-64, |x| <= 1/2.
template <size_t i = 0, size_t n> constexpr int64_t polynomial_2_64(int64_t x, const int64_t (&c)[n]) {
    if constexpr (i + 1 == n)
        return c[i];
    else
        return c[i] + multiply_high(polynomial_2_64<i + 1>(x, c), x);
}

// Results in units of 2^-61 or 2^-57 are rounded to 2^-32 by scale().
constexpr Saturated exp_fixed(int64_t x) {
    using C = Coefficients<Fixed>;
    constexpr int64_t one = int64_t{1} << 32;
    if (x > 22 * one) return saturated(false); // e^22 > 2^31
    if (x < -23 * one) return {0, false};      // e^-23 < 2^-33
    // x / ln 2 in units of 2^-64: k in the high word and f in the low one, which is negative from 1/2 on.
    const Wide turns = product<Wide>(x, C::inv_ln2);
    const int64_t f = static_cast<int64_t>((static_cast<uint64_t>(high_word(turns)) << 35) | (low_word(turns) >> 29));
    const int k = static_cast<int>(high_word(turns) >> 29) + (f < 0);
    return scale(polynomial_2_64(f, C::exp2), k - 29);
}

constexpr int64_t log_fixed(uint64_t x) { // x > 0
    using C = Coefficients<Fixed>;
    constexpr int64_t one = int64_t{1} << 62;
    constexpr uint64_t sqrt_2 = 0xb504f333f9de6484; // in units of 2^-63
    const int shift = leading_zeros(x);
    const uint64_t leading = x << shift; // in [1, 2)
    const bool halve = leading > sqrt_2;
    const int64_t m = static_cast<int64_t>(halve ? leading >> 2 : leading >> 1); // in [sqrt(1/2), sqrt(2)], 2^-62
    const int64_t k = 31 - shift + halve;
    const int64_t numerator = m - one;
    const uint64_t magnitude = static_cast<uint64_t>(numerator < 0 ? -numerator : numerator);
    const uint64_t sum = static_cast<uint64_t>(m) + static_cast<uint64_t>(one);
    const int64_t ratio = static_cast<int64_t>(divide(join<Wide>(magnitude, 0), sum).quotient);
    const int64_t s = numerator < 0 ? -ratio : ratio; // (m - 1) / (m + 1)
    const int64_t log_m = multiply_high(polynomial_2_64(multiply_high(s, s), C::log), s);
    return scale(k * (C::ln2 >> 4) + (log_m >> 4), -25).raw;
}

constexpr void sincos_turns_fixed(int64_t x, int64_t &s, int64_t &c) {
    using C = Coefficients<Fixed>;
    const uint32_t turn = static_cast<uint32_t>(x), quarter = (turn + 0x20000000u) >> 30;
    const int64_t rest = static_cast<int32_t>(turn - (quarter << 30)); // |rest| <= 2^29: an eighth of a turn
    const int64_t y = rest * (int64_t{1} << 34);                       // quarters of a turn
    const int64_t z = multiply_high(y, y);
    const int64_t sine = scale(multiply_high(polynomial_2_64(z, C::sin), y), -29).raw;
    const int64_t cosine = scale(polynomial_2_64(z, C::cos), -29).raw;
    s = (quarter & 1) != 0 ? cosine : sine;
    c = (quarter & 1) != 0 ? sine : cosine;
    if ((quarter & 2) != 0) s = -s;
    if (((quarter + 1) & 2) != 0) c = -c;
}

// The angle in units of 2^-61 of a vector (x, y), y >= 0, given by y, |x| and the sign of x; 0 for (0, 0).
constexpr int64_t angle_fixed(uint64_t y, uint64_t abs_x, bool negative_x) {
    using C = Coefficients<Fixed>;
    const bool steep = y > abs_x;
    const uint64_t a = steep ? abs_x : y, b = steep ? y : abs_x;
    if (b == 0) return 0;
    // a / b = tan of an angle up to pi/4; in its upper part atan(a/b) = pi/4 - atan((b - a)/(a + b)).
    const bool upper = a >= b - a;
    const Quotient ratio = upper ? divide(join<Wide>(b - a, 0), a + b) : divide(join<Wide>(a, 0), b);
    const int64_t t = static_cast<int64_t>(ratio.quotient);
    const int64_t atan_t = multiply_high(polynomial_2_64(multiply_high(t, t), C::atan), t);
    int64_t angle = upper ? C::quarter_pi - atan_t : atan_t;
    if (steep) angle = 2 * C::quarter_pi - angle;
    return negative_x ? 4 * C::quarter_pi - angle : angle;
}

// acos(x) in units of 2^-61, for x clamped to [-1, 1].
inline int64_t acos_fixed(int64_t x) {
    constexpr int64_t one = int64_t{1} << 32;
    if (x >= one) return 0;
    if (x <= -one) return 4 * Coefficients<Fixed>::quarter_pi;
    // (1 - x^2) / 4 in units of 2^-64 has its root, scaled by root(), in units of 2^-47.
    const uint64_t abs_x = static_cast<uint64_t>(x < 0 ? -x : x);
    const int64_t sine = root((int64_t{1} << 62) - static_cast<int64_t>(abs_x * abs_x >> 2));
    return angle_fixed(static_cast<uint64_t>(sine), abs_x << 15, x < 0);
}

constexpr int64_t cbrt_fixed(uint64_t x) { // x > 0
    // x 2^shift = a in [1/8, 1), and x in units of 2^-64 is a 2^(128 - shift), a power that 3 divides.
    const int zeros = leading_zeros(x), shift = zeros - (zeros + 1) % 3;
    const uint64_t a = shift < 0 ? x >> 1 : x << shift; // units of 2^-64
    // u -> a^(-1/3) in (1, 2], units of 2^-61, by Newton's u += u (1 - a u^3) / 3 from a line within 12 %.
    const int64_t half_a = static_cast<int64_t>(a >> 1);            // a in units of 2^-63
    int64_t u = 4381101717506018304 - static_cast<int64_t>(a >> 3); // 1.9 - a
    for (int step = 0; step < 5; ++step) {
        const int64_t a_u3 = multiply_high(multiply_high(u, u), multiply_high(u, half_a)); // units of 2^-54
        u += multiply_high(u, ((int64_t{1} << 54) - a_u3) / 3) * (1 << 10);
    }
    return scale(multiply_high(multiply_high(u, half_a), u), (128 - shift) / 3 - 57).raw; // a u^2
}
} // namespace detail

// ---- The functions

// The cube root.
constexpr float cbrt(float x) { return detail::cbrt_float(x); }
constexpr double cbrt(double x) { return detail::cbrt_float(x); }
constexpr Fixed cbrt(Fixed x) {
    if (x.raw() == 0) return x;
    const uint64_t bits = static_cast<uint64_t>(x.raw());
    const int64_t root = detail::cbrt_fixed(x.raw() < 0 ? 0 - bits : bits);
    return Fixed::from_raw(x.raw() < 0 ? -root : root);
}

// e^x. A result that is too large is infinite; in Fixed, from x = 21.4876 on, it is an overflow and the largest Fixed.
constexpr float exp(float x) { return detail::exp_float(x); }
constexpr double exp(double x) { return detail::exp_float(x); }
constexpr Fixed exp(Fixed x) { return Fixed::from_raw(detail::checked(detail::exp_fixed(x.raw()))); }

// exp for x <= 0, without a branch, for loops over lanes. It has the bits of exp.
constexpr float exp_finite(float x) { return detail::exp_finite_float(x); }
constexpr double exp_finite(double x) { return detail::exp_finite_float(x); }
constexpr Fixed exp_finite(Fixed x) { return exp(x); }

// e^x - 1, accurate near 0.
constexpr float expm1(float x) { return detail::expm1_float(x); }
constexpr double expm1(double x) { return detail::expm1_float(x); }
constexpr Fixed expm1(Fixed x) { return exp(x) - Fixed(1); }

// ln(x): minus infinity at 0, NaN below. In Fixed x <= 0 is an overflow and gives the smallest value.
constexpr float log(float x) { return detail::log_float(x); }
constexpr double log(double x) { return detail::log_float(x); }
constexpr Fixed log(Fixed x) {
    if (x.raw() <= 0) return Fixed::from_raw(detail::checked(detail::saturated(true)));
    return Fixed::from_raw(detail::log_fixed(static_cast<uint64_t>(x.raw())));
}

// log for normal x > 0, without a branch, for loops over lanes. It has the bits of log.
constexpr float log_positive(float x) { return detail::log_normal(x, 0); }
constexpr double log_positive(double x) { return detail::log_normal(x, 0); }
constexpr Fixed log_positive(Fixed x) { return log(x); }

// ln(1 + x), accurate near 0. Outside x > -1 it behaves as log outside x > 0.
constexpr float log1p(float x) { return detail::log1p_float(x); }
constexpr double log1p(double x) { return detail::log1p_float(x); }
constexpr Fixed log1p(Fixed x) {
    constexpr int64_t one = int64_t{1} << 32;
    if (x.raw() <= -one) return Fixed::from_raw(detail::checked(detail::saturated(true)));
    return Fixed::from_raw(detail::log_fixed(static_cast<uint64_t>(x.raw()) + one));
}

// The sine s and cosine c of the angle 2 pi x.
constexpr void sincos_turns(float x, float &s, float &c) { detail::sincos_turns_float(x, s, c); }
constexpr void sincos_turns(double x, double &s, double &c) { detail::sincos_turns_float(x, s, c); }
constexpr void sincos_turns(Fixed x, Fixed &s, Fixed &c) {
    int64_t s_raw = 0, c_raw = 0;
    detail::sincos_turns_fixed(x.raw(), s_raw, c_raw);
    s = Fixed::from_raw(s_raw);
    c = Fixed::from_raw(c_raw);
}

// acos in [0, pi] and asin in [-pi/2, pi/2]; x is clamped to [-1, 1].
inline float acos(float x) { return detail::acos_float(x); }
inline double acos(double x) { return detail::acos_float(x); }
inline Fixed acos(Fixed x) { return Fixed::from_raw(detail::scale(detail::acos_fixed(x.raw()), -29).raw); }
inline float asin(float x) { return detail::asin_float(x); }
inline double asin(double x) { return detail::asin_float(x); }
inline Fixed asin(Fixed x) {
    constexpr int64_t half_pi_raw = 2 * detail::Coefficients<Fixed>::quarter_pi;
    return Fixed::from_raw(detail::scale(half_pi_raw - detail::acos_fixed(x.raw()), -29).raw);
}

// The angle in [0, pi] between two vectors, from the length of their cross product (>= 0) and their dot product; both
// may have a common positive factor. 0 for (0, 0).
constexpr float angle_between(float cross, float dot) { return detail::angle_between_float(cross, dot); }
constexpr double angle_between(double cross, double dot) { return detail::angle_between_float(cross, dot); }
constexpr Fixed angle_between(Fixed cross, Fixed dot) {
    const uint64_t x = static_cast<uint64_t>(dot.raw()), y = static_cast<uint64_t>(cross.raw());
    const bool negative = dot.raw() < 0;
    return Fixed::from_raw(detail::scale(detail::angle_fixed(y, negative ? 0 - x : x, negative), -29).raw);
}

} // namespace wisp
