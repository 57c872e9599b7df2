// The elementary functions: double and Fixed against MPFR, float against double (whose own error, 2^-29 of a float's
// last place, does not count). Bounds are the largest errors that N-M (numbers/README) gives, less where these
// functions do better; the arguments are the same in every run.
#include "core/numbers/elementary.h"
#include "support/random_input.h"
#include <cmath>
#include <doctest/doctest.h>
#include <mpfr.h>
#include <utility>
#include <vector>

using wisp::Fixed;
using wisp::Random;
namespace detail = wisp::detail;

namespace {

constexpr int64_t one = int64_t{1} << 32;
constexpr double inf = detail::infinity<double>;

double from_bits(uint64_t bits) { return detail::from_bits<double>(bits); }
float float_from_bits(uint32_t bits) { return detail::from_bits<float>(bits); }

// A real number of 128 bits.
class Exact {
  public:
    explicit Exact(double x = 0) {
        mpfr_init2(value_, 128);
        mpfr_set_d(value_, x, MPFR_RNDN);
    }
    explicit Exact(Fixed x) {
        mpfr_init2(value_, 128);
        mpfr_set_sj_2exp(value_, x.raw(), -32, MPFR_RNDN);
    }
    Exact(const Exact &) = delete;
    Exact &operator=(const Exact &) = delete;
    ~Exact() { mpfr_clear(value_); }
    mpfr_ptr get() { return value_; }

    // |x - *this| in units of x's last place, as it is for the exact value; subnormal numbers count in 2^-1074.
    double ulps_off(double x) {
        if (mpfr_zero_p(value_)) return x == 0 ? 0 : inf;
        const mpfr_exp_t exponent = mpfr_get_exp(value_);
        return off(x, exponent - 53 < -1074 ? -1074 : exponent - 53);
    }
    // |x - *this| in units of 2^-32.
    double units_off(Fixed x) {
        Exact other(x);
        mpfr_sub(other.value_, other.value_, value_, MPFR_RNDN);
        mpfr_mul_2si(other.value_, other.value_, 32, MPFR_RNDN);
        return wisp::abs(mpfr_get_d(other.value_, MPFR_RNDN));
    }

  private:
    double off(double x, mpfr_exp_t last_place) {
        Exact other(x);
        mpfr_sub(other.value_, other.value_, value_, MPFR_RNDN);
        mpfr_mul_2si(other.value_, other.value_, -last_place, MPFR_RNDN);
        return wisp::abs(mpfr_get_d(other.value_, MPFR_RNDN));
    }
    mpfr_t value_;
};

using MpfrFunction = int (*)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
int sine_of_turns(mpfr_ptr result, mpfr_srcptr x, mpfr_rnd_t mode) { return mpfr_sinu(result, x, 1, mode); }
int cosine_of_turns(mpfr_ptr result, mpfr_srcptr x, mpfr_rnd_t mode) { return mpfr_cosu(result, x, 1, mode); }

template <class T> T sine_of_turns(T x) {
    T s, c;
    wisp::sincos_turns(x, s, c);
    return s;
}
template <class T> T cosine_of_turns(T x) {
    T s, c;
    wisp::sincos_turns(x, s, c);
    return c;
}

// Arguments in [low, high]: evenly spread, spread over the exponents from 2^-1074 up, and the ends with their
// neighbourhood.
std::vector<double> arguments(double low, double high, int count) {
    Random random;
    std::vector<double> list = {low, high};
    const auto add = [&](double x) {
        if (low <= x && x <= high) list.push_back(x);
    };
    for (int i = 0; i < count; ++i) {
        add(random.between(low, high));
        add(random.with_exponent(-60, 2));
        if (i % 8 == 0) add(random.with_exponent(-1023, 1023));
    }
    for (const double x : {0.25, 0.4, 0.5, 0.70710678118654752, 1.0, 1.4142135623730951, 2.0, 0x1p-1022, 0x1p-1074})
        for (int64_t step = -3; step <= 3; ++step) {
            const double near = from_bits(detail::to_bits(x) + static_cast<uint64_t>(step));
            if (near < inf) {
                add(near);
                add(-near);
            }
        }
    return list;
}

double largest_error(double (*function)(double), MpfrFunction exact_function, double low, double high, int count) {
    double largest = 0;
    Exact exact;
    for (const double x : arguments(low, high, count)) {
        exact_function(exact.get(), Exact(x).get(), MPFR_RNDN);
        largest = wisp::max(largest, exact.ulps_off(function(x)));
    }
    return largest;
}

// The largest error of a function of float over every 500th float, in units of the last place.
double largest_float_error(float (*function)(float), double (*reference)(double), float low, float high) {
    double largest = 0;
    for (uint64_t bits = 0; bits <= UINT32_MAX; bits += 499) {
        const float x = float_from_bits(static_cast<uint32_t>(bits));
        if (!(low <= x && x <= high)) continue;
        const double exact = reference(x);
        const uint64_t field = (detail::to_bits(exact) >> 52) & 0x7ff;
        const double last_place = detail::power_of_two<double>(wisp::max(static_cast<int>(field) - 1023 - 23, -149));
        largest = wisp::max(largest, wisp::abs(static_cast<double>(function(x)) - exact) / last_place);
    }
    return largest;
}

// Raw values of [low, high]: spread evenly, spread over the magnitudes, and the ends.
std::vector<Fixed> fixed_arguments(int64_t low, int64_t high, int count) {
    Random random;
    std::vector<Fixed> list;
    const auto add = [&](int64_t raw) {
        if (low <= raw && raw <= high) list.push_back(Fixed::from_raw(raw));
    };
    for (int64_t step = 0; step < 50; ++step) {
        add(low + step);
        add(high - step);
        add(one - step);
        add(one + step);
        add(step);
        add(-step);
    }
    const uint64_t width = static_cast<uint64_t>(high) - static_cast<uint64_t>(low);
    for (int i = 0; i < count; ++i) {
        const uint64_t bits = random.bits();
        add(static_cast<int64_t>(static_cast<uint64_t>(low) + (width == UINT64_MAX ? bits : bits % (width + 1))));
        add(static_cast<int64_t>(random.bits()) >> (bits % 64));
    }
    return list;
}

double largest_fixed_error(Fixed (*function)(Fixed), MpfrFunction exact_function, int64_t low, int64_t high) {
    double largest = 0;
    Exact exact;
    for (const Fixed x : fixed_arguments(low, high, 10000)) {
        exact_function(exact.get(), Exact(x).get(), MPFR_RNDN);
        largest = wisp::max(largest, exact.units_off(function(x)));
    }
    return largest;
}

} // namespace

// Cross and dot products of any magnitudes and of like magnitudes, all angles, the axes and the diagonals.
std::vector<std::pair<double, double>> vectors(int count, int exponents) {
    Random random;
    std::vector<std::pair<double, double>> list;
    for (int i = 0; i < count; ++i) {
        const double x = random.with_exponent(-exponents, exponents), y = random.with_exponent(-exponents, exponents);
        list.push_back({wisp::abs(y), x});
        const double turns = random.between(0, 0.5), scale = random.between(0, 2);
        list.push_back({scale * sine_of_turns(turns), scale * cosine_of_turns(turns)});
    }
    for (const double length : {1.0, 3.0, 1e30})
        for (const double ratio : {0.0, 1e-30, 0.5, 0.5000001, 1.0}) {
            list.push_back({ratio * length, length});
            list.push_back({ratio * length, -length});
            list.push_back({length, ratio * length});
            list.push_back({length, -ratio * length});
        }
    return list;
}

TEST_CASE("elementary: double against MPFR") {
    const int count = 15000;
    CHECK(largest_error(wisp::exp, mpfr_exp, -745.2, 709.78, count) <= 0.857);
    CHECK(largest_error(wisp::expm1, mpfr_expm1, -50, 709.78, count) <= 0.900);
    CHECK(largest_error(wisp::log, mpfr_log, 0x1p-1074, 0x1.fffffffffffffp1023, count) <= 0.828);
    CHECK(largest_error(wisp::log, mpfr_log, 0.5, 2, count) <= 0.828);
    CHECK(largest_error(wisp::log1p, mpfr_log1p, -0x1.fffffffffffffp-1, 3, count) <= 0.828);
    CHECK(largest_error(wisp::log1p, mpfr_log1p, 3, 0x1.fffffffffffffp1023, count) <= 0.828);
    CHECK(largest_error(sine_of_turns<double>, sine_of_turns, -2, 2, count) <= 0.884);
    CHECK(largest_error(cosine_of_turns<double>, cosine_of_turns, -2, 2, count) <= 0.887);
    CHECK(largest_error(wisp::acos, mpfr_acos, -1, 1, count) <= 0.874);
    CHECK(largest_error(wisp::asin, mpfr_asin, -1, 1, count) <= 0.828);
    CHECK(largest_error(wisp::cbrt, mpfr_cbrt, -0x1.fffffffffffffp1023, 0x1.fffffffffffffp1023, count) <= 0.667);
}

TEST_CASE("elementary: float against double") {
    const float most = 0x1.fffffep127f;
    CHECK(largest_float_error(wisp::exp, wisp::exp, -104, 88.72283f) <= 0.864);
    CHECK(largest_float_error(wisp::expm1, wisp::expm1, -104, 88.72283f) <= 1.067);
    CHECK(largest_float_error(wisp::log, wisp::log, 0x1p-149f, most) <= 0.840);
    CHECK(largest_float_error(wisp::log1p, wisp::log1p, -0x1.fffffep-1f, most) <= 0.840);
    CHECK(largest_float_error(sine_of_turns<float>, sine_of_turns<double>, 0x1p-100f, 0x1p30f) <= 0.890);
    CHECK(largest_float_error(sine_of_turns<float>, sine_of_turns<double>, -0x1p30f, -0x1p-100f) <= 0.890);
    CHECK(largest_float_error(sine_of_turns<float>, sine_of_turns<double>, -0x1p-100f, 0x1p-100f) <= 1); // subnormal
    CHECK(largest_float_error(cosine_of_turns<float>, cosine_of_turns<double>, -0x1p30f, 0x1p30f) <= 0.897);
    CHECK(largest_float_error(wisp::acos, wisp::acos, -1, 1) <= 0.889);
    CHECK(largest_float_error(wisp::asin, wisp::asin, -1, 1) <= 0.840);
    CHECK(largest_float_error(wisp::cbrt, wisp::cbrt, -most, most) <= 0.778);
}

TEST_CASE("elementary: Fixed against MPFR") {
    CHECK(largest_fixed_error(wisp::exp, mpfr_exp, -25 * one, one) <= 0.5002);
    CHECK(largest_fixed_error(wisp::expm1, mpfr_expm1, -25 * one, one) <= 0.5002);
    CHECK(largest_fixed_error(wisp::log, mpfr_log, 1, INT64_MAX) <= 0.50001);
    CHECK(largest_fixed_error(wisp::log, mpfr_log, one / 2, 2 * one) <= 0.50001);
    CHECK(largest_fixed_error(wisp::log1p, mpfr_log1p, 1 - one, INT64_MAX) <= 0.50001);
    CHECK(largest_fixed_error(sine_of_turns<Fixed>, sine_of_turns, INT64_MIN, INT64_MAX) <= 0.50001);
    CHECK(largest_fixed_error(cosine_of_turns<Fixed>, cosine_of_turns, INT64_MIN, INT64_MAX) <= 0.50001);
    CHECK(largest_fixed_error(wisp::cbrt, mpfr_cbrt, INT64_MIN, INT64_MAX) <= 0.51);
    CHECK(largest_fixed_error(wisp::acos, mpfr_acos, -one, one) <= 0.51);
    CHECK(largest_fixed_error(wisp::asin, mpfr_asin, -one, one) <= 0.51);
    // Above 1 the error is relative.
    double largest = 0;
    Exact exact;
    for (const Fixed x : fixed_arguments(one, 92288378626, 10000)) {
        mpfr_exp(exact.get(), Exact(x).get(), MPFR_RNDN);
        largest = wisp::max(largest, exact.units_off(exp(x)) * 0x1p-32 / mpfr_get_d(exact.get(), MPFR_RNDN));
    }
    CHECK(largest <= 1.2e-10);
}

TEST_CASE("elementary: angle_between") {
    double largest = 0, largest_float = 0, largest_fixed = 0;
    Exact exact;
    for (const auto &[cross, dot] : vectors(10000, 1020)) {
        mpfr_atan2(exact.get(), Exact(cross).get(), Exact(dot).get(), MPFR_RNDN);
        largest = wisp::max(largest, exact.ulps_off(wisp::angle_between(cross, dot)));
    }
    for (const auto &[cross, dot] : vectors(300000, 120)) {
        const float y = static_cast<float>(cross), x = static_cast<float>(dot);
        const double angle = wisp::angle_between(static_cast<double>(y), static_cast<double>(x));
        const int field = static_cast<int>(detail::to_bits(angle) >> 52);
        const double last_place = detail::power_of_two<double>(wisp::max(field - 1023 - 23, -149));
        const double error = wisp::abs(static_cast<double>(wisp::angle_between(y, x)) - angle);
        largest_float = wisp::max(largest_float, error / last_place);
    }
    for (const auto &[cross, dot] : vectors(10000, 30)) {
        const Fixed y = wisp::to_real<Fixed>(cross), x = wisp::to_real<Fixed>(dot);
        if (y == Fixed(0) && x == Fixed(0)) continue;
        mpfr_atan2(exact.get(), Exact(y).get(), Exact(x).get(), MPFR_RNDN);
        largest_fixed = wisp::max(largest_fixed, exact.units_off(angle_between(y, x)));
    }
    CHECK(largest <= 1.6);
    CHECK(largest_float <= 1.6);
    CHECK(largest_fixed <= 0.501);

    CHECK(wisp::angle_between(0.0, 0.0) == 0);
    CHECK(wisp::angle_between(0.0f, 0.0f) == 0);
    CHECK(angle_between(Fixed(0), Fixed(0)) == Fixed(0));
    CHECK(wisp::angle_between(0.0, -3.0) == wisp::pi<double>);
    for (const double small : {0.0, 1e-3, 0.7, 1.0}) { // the sum of both would be infinite
        CHECK(wisp::angle_between(small * 1.7e308, 1.7e308) == doctest::Approx(std::atan(small)).epsilon(1e-15));
        CHECK(wisp::angle_between(static_cast<float>(small) * 3e38f, 3e38f) ==
              doctest::Approx(std::atan(small)).epsilon(1e-6));
    }
    CHECK(wisp::angle_between(5.0f, 0.0f) == wisp::half_pi<float>);
    CHECK(wisp::angle_between(0x1.fffffep127f, -0x1.fffffep127f) == 0.75f * wisp::pi<float>);
    CHECK(angle_between(Fixed::from_raw(1), Fixed::from_raw(-1)).raw() == 10119778278); // 3/4 pi
    CHECK(angle_between(Fixed(0), Fixed::from_raw(INT64_MIN)) == wisp::pi<Fixed>);
    CHECK(angle_between(Fixed::from_raw(INT64_MAX), Fixed::from_raw(INT64_MIN)).raw() == 10119778278);
}

TEST_CASE("elementary: special values") {
    const double nan = detail::not_a_number<double>;
    const float float_inf = detail::infinity<float>;
    CHECK(wisp::exp(0.0) == 1);
    CHECK(wisp::exp(0.0f) == 1);
    CHECK(exp(Fixed(0)) == Fixed(1));
    CHECK(wisp::exp(710.0) == inf);
    CHECK(wisp::exp(inf) == inf);
    CHECK(wisp::exp(-inf) == 0);
    CHECK(wisp::exp(89.0f) == float_inf);
    CHECK(wisp::exp(nan) != wisp::exp(nan));
    CHECK(wisp::expm1(-inf) == -1);
    CHECK(wisp::expm1(1e300) == inf);
    CHECK(wisp::expm1(0.0f) == 0);
    CHECK(wisp::log(1.0) == 0);
    CHECK(wisp::log(1.0f) == 0);
    CHECK(log(Fixed(1)) == Fixed(0));
    CHECK(wisp::log(0.0) == -inf);
    CHECK(wisp::log(inf) == inf);
    CHECK(wisp::log(-1.0) != wisp::log(-1.0));
    CHECK(wisp::log1p(-1.0f) == -float_inf);
    CHECK(wisp::log1p(-2.0f) != wisp::log1p(-2.0f));
    CHECK(wisp::log1p(float_inf) == float_inf);
    CHECK(wisp::log1p(0x1p-1074) == 0x1p-1074);
    CHECK(wisp::cbrt(-27.0) == -3);
    CHECK(wisp::cbrt(0.125f) == 0.5f);
    CHECK(cbrt(Fixed(-27)) == Fixed(-3));
    CHECK(cbrt(Fixed::from_raw(INT64_MIN)).raw() == -5541191377757);
    CHECK(wisp::sqrt(2.0) == 0x1.6a09e667f3bcdp0);
    CHECK(wisp::sqrt(2.0f) == 0x1.6a09e6p0f);
    // Whole and quarter turns are exact, at any distance.
    for (const double turns : {0.0, 1.0, -7.0, 0x1p40, 0x1p60}) {
        CHECK(sine_of_turns(turns) == 0);
        CHECK(cosine_of_turns(turns) == 1);
    }
    for (const float turns : {0.25f, -0.75f, 1048576.25f}) {
        CHECK(sine_of_turns(turns) == 1);
        CHECK(cosine_of_turns(turns) == 0);
    }
    CHECK(sine_of_turns(Fixed(-0.25)) == Fixed(-1));
    CHECK(cosine_of_turns(Fixed::from_raw(INT64_MIN)) == Fixed(1));
    CHECK(sine_of_turns(inf) != sine_of_turns(inf));
    // Outside [-1, 1] the argument is clamped. (hard case A11)
    CHECK(wisp::acos(1.0000001f) == 0);
    CHECK(wisp::acos(-1.5) == wisp::pi<double>);
    CHECK(wisp::asin(1.0000001f) == wisp::half_pi<float>);
    CHECK(wisp::asin(-2.0) == -wisp::half_pi<double>);
    CHECK(acos(Fixed(2)) == Fixed(0));
    CHECK(acos(Fixed(-2)) == wisp::pi<Fixed>);
    CHECK(asin(Fixed(-1)) == -wisp::half_pi<Fixed>);
}

TEST_CASE("elementary: the forms without branches have the same bits") {
    int different = 0;
    for (uint64_t bits = 0; bits <= UINT32_MAX; bits += 997) {
        const float x = float_from_bits(static_cast<uint32_t>(bits));
        if (x <= 0) different += detail::to_bits(wisp::exp_finite(x)) != detail::to_bits(wisp::exp(x));
        if (0x1p-126f <= x && x <= 0x1.fffffep127f)
            different += detail::to_bits(wisp::log_positive(x)) != detail::to_bits(wisp::log(x));
    }
    for (const double x : arguments(-800, 0, 100000))
        different += detail::to_bits(wisp::exp_finite(x)) != detail::to_bits(wisp::exp(x));
    for (const double x : arguments(0x1p-1022, 0x1.fffffffffffffp1023, 100000))
        different += detail::to_bits(wisp::log_positive(x)) != detail::to_bits(wisp::log(x));
    CHECK(different == 0);
    CHECK(wisp::exp_finite(-1e30f) == 0);
    CHECK(wisp::exp_finite(-inf) == 0);
    CHECK(exp_finite(Fixed(-3)) == exp(Fixed(-3)));
    CHECK(log_positive(Fixed(3)) == log(Fixed(3)));
}

TEST_CASE("elementary: transmittance from thin to black (hard cases B3, B10, B11, F3)") {
    // B3: 1 - e^-s over s.
    CHECK(-wisp::expm1(-1e-12) / 1e-12 == doctest::Approx(1 - 5e-13).epsilon(1e-16));
    CHECK(-wisp::expm1(-1e-12f) / 1e-12f == 1);
    // B10: where e^-tau leaves the numbers, and F3: what lies between 0 and the normal numbers is kept.
    CHECK(exp(Fixed(-22.2)).raw() == 1);
    CHECK(exp(Fixed(-22.873)).raw() == 1);
    CHECK(exp(Fixed(-22.874)).raw() == 0);
    CHECK(exp(std::numeric_limits<Fixed>::lowest()).raw() == 0);
    CHECK(wisp::exp(-87.33f) > 0x1p-126f);
    CHECK(wisp::exp(-87.34f) < 0x1p-126f);
    CHECK(wisp::exp(-100.0f) == 27 * 0x1p-149f);
    CHECK(wisp::exp(-103.97f) == 0x1p-149f);
    CHECK(wisp::exp(-103.98f) == 0);
    CHECK(wisp::exp(-745.13) == 0x1p-1074);
    CHECK(wisp::exp(-745.14) == 0);
    // B11: the product of many transmittances loses what the transmittance of the sum keeps.
    float product = 1;
    Fixed fixed_product(1), depth(0);
    for (int i = 0; i < 1000; ++i) {
        product *= wisp::exp(-0.01f);
        fixed_product *= exp(Fixed(-0.01));
        depth += Fixed(0.01);
    }
    const double exact = wisp::exp(-10.0);
    CHECK(wisp::abs(product / exact - 1) < 7e-6);
    CHECK(wisp::abs(to_double(fixed_product) / exact - 1) < 1.15e-5);
    CHECK(wisp::abs(to_double(exp(-depth)) - exact) < 0x1p-32);
}

TEST_CASE("elementary: random bits as numbers, and the longest path that they give (hard case A1)") {
    using wisp::unit_half_open;
    using wisp::unit_open;
    const uint32_t last = UINT32_MAX;
    CHECK(unit_half_open<float>(0) == 0);
    CHECK(unit_half_open<float>(last) == 1 - 0x1p-24f);
    CHECK(unit_half_open<double>(last) == 1 - 0x1p-32);
    CHECK(unit_half_open<Fixed>(last).raw() == one - 1);
    CHECK(unit_half_open<float>(0x80000000) == 0.5f);
    CHECK(unit_open<float>(0) == 0x1p-33f);
    CHECK(unit_open<double>(0) == 0x1p-33);
    CHECK(unit_open<Fixed>(0).raw() == 1);
    CHECK(unit_open<float>(last) == 1 - 0x1p-24f);
    CHECK(unit_open<double>(last) == 1 - 0x1p-33);
    CHECK(unit_open<Fixed>(last).raw() == one - 1);
    CHECK(unit_open<Fixed>(5).raw() == 5);
    Random random;
    int wrong = 0;
    for (int i = 0; i < 1000000; ++i) {
        const uint32_t u = static_cast<uint32_t>(random.bits() >> (random.bits() % 33));
        const double centre = (u + 0.5) * 0x1p-32;
        wrong += unit_open<double>(u) != centre;
        wrong += unit_open<float>(u) != wisp::min(static_cast<float>(centre), 1 - 0x1p-24f);
    }
    CHECK(wrong == 0);
    CHECK(to_double(-log(unit_open<Fixed>(0))) == doctest::Approx(22.18070978).epsilon(1e-9));
    CHECK(-wisp::log(unit_open<float>(0)) == doctest::Approx(22.8738570).epsilon(1e-7));
    CHECK(-wisp::log(unit_open<double>(0)) == doctest::Approx(22.8738570).epsilon(1e-8));
    CHECK(-wisp::log1p(-unit_half_open<float>(last)) == doctest::Approx(16.6355324).epsilon(1e-7));
    CHECK(-wisp::log1p(-unit_half_open<double>(last)) == doctest::Approx(22.1807098).epsilon(1e-8));
    CHECK(-wisp::log1p(-unit_half_open<double>(0)) == 0);
}

TEST_CASE("elementary: integers") {
    using wisp::floor_to_int;
    using wisp::round_to_int;
    CHECK(floor_to_int(-0.0) == 0);
    CHECK(floor_to_int(-1e-30) == -1);
    CHECK(floor_to_int(-1e-30f) == -1);
    CHECK(floor_to_int(Fixed::from_raw(-1)) == -1);
    CHECK(floor_to_int(2.999f) == 2);
    CHECK(floor_to_int(-3.0f) == -3);
    CHECK(floor_to_int(Fixed(-3)) == -3);
    CHECK(round_to_int(2.5) == 3);
    CHECK(round_to_int(-2.5) == -2);
    CHECK(round_to_int(Fixed(-2.5)) == -2);
    CHECK(round_to_int(Fixed(2.5)) == 3);
    CHECK(round_to_int(0x1.fffffep-2f) == 0); // the float below 1/2
    CHECK(round_to_int(8388609.0f) == 8388609);
    CHECK(round_to_int(-0.5f) == 0);
    for (const double huge : {1e10, 1e300, inf}) {
        CHECK(floor_to_int(huge) == INT32_MAX);
        CHECK(round_to_int(huge) == INT32_MAX);
        CHECK(floor_to_int(-huge) == INT32_MIN);
        CHECK(round_to_int(-huge) == INT32_MIN);
        CHECK(floor_to_int(static_cast<float>(huge)) == INT32_MAX - 127); // the largest float in the range
        CHECK(round_to_int(static_cast<float>(-huge)) == INT32_MIN);
    }
    CHECK(round_to_int(2147483647.5) == INT32_MAX);
    CHECK(round_to_int(std::numeric_limits<Fixed>::max()) == INT32_MAX);
    CHECK(floor_to_int(std::numeric_limits<Fixed>::lowest()) == INT32_MIN);
    CHECK(floor_to_int(detail::not_a_number<float>) == INT32_MIN);
}

TEST_CASE("elementary: powers of two scale with one rounding") {
    using wisp::scale_pow2;
    CHECK(scale_pow2(1.5, 1023) == 0x1.8p1023);
    CHECK(scale_pow2(1.5, 1024) == inf);
    CHECK(scale_pow2(0x1p-1074, 2097) == 0x1p1023);
    CHECK(scale_pow2(0x1.8p1023, -2098) == 0x1p-1074); // 0.75 of the smallest number
    CHECK(scale_pow2(0x1p1023, -2098) == 0);           // half of it: a tie, to even
    CHECK(scale_pow2(0x1.000001p0f, -149) == 0x1p-149f);
    CHECK(scale_pow2(0x1.8p0f, -149) == 0x1p-148f);
    CHECK(scale_pow2(0x1.7ffffep0f, -149) == 0x1p-149f);
    CHECK(scale_pow2(1.0f, 100000) == detail::infinity<float>);
    CHECK(scale_pow2(1.0f, -100000) == 0);
    CHECK(scale_pow2(-3.0f, 4) == -48);
    CHECK(scale_pow2(Fixed(-3), 4) == Fixed(-48));
    CHECK(scale_pow2(Fixed(-3), -2) == Fixed(-0.75));
    CHECK(wisp::to_float_scaled(0x1.0000010000001p0, 0) == 0x1.000002p0f);
    CHECK(wisp::to_float_scaled(0x1.8p0, -150) == 0x1p-149f);
    CHECK(wisp::to_float_scaled(1e300, -900) == static_cast<float>(1e300 * 0x1p-900));
    CHECK(wisp::to_float_scaled(1.0f, 3) == 8);
    // By powers of two from the edge of the subnormal numbers, against MPFR.
    Random random;
    Exact exact;
    int wrong = 0;
    for (int i = 0; i < 20000; ++i) {
        const double x = random.with_exponent(-1022, 1022);
        const int exponent = static_cast<int>(detail::to_bits(x) >> 52 & 0x7ff) - 1023;
        const int k = -1074 - exponent + static_cast<int>(random.bits() % 60) - 3;
        mpfr_set_d(exact.get(), x, MPFR_RNDN);
        mpfr_mul_2si(exact.get(), exact.get(), k, MPFR_RNDN);
        wrong += scale_pow2(x, k) != mpfr_get_d(exact.get(), MPFR_RNDN);
    }
    CHECK(wrong == 0);
}

TEST_CASE("elementary: a sum of products goes from left to right") {
    CHECK(wisp::sum_of_products(1e8f, 1e8f, -1e8f, 1e8f, 1.0f, 3.0f) == 3);
    CHECK(wisp::sum_of_products(1.0f, 3.0f, 1e8f, 1e8f, -1e8f, 1e8f) == 0);
    CHECK(wisp::sum_of_products(1e16, 1.0, 1.0, 1.0, -1e16, 1.0) == 0);
}
