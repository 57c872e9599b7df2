// The elementary functions: double and Fixed against MPFR, float against double (whose own error, 2^-29 of a float's
// last place, does not count). Bounds are the largest errors that numerics M gives; the arguments are the same in every
// run.
#include "wisp/elementary.h"
#include <doctest/doctest.h>
#include <mpfr.h>
#include <vector>

using wisp::Fixed;
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

// splitmix64.
class Random {
  public:
    uint64_t bits() {
        uint64_t x = state_ += 0x9e3779b97f4a7c15u;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
        return x ^ (x >> 31);
    }
    double between(double low, double high) { return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53; }
    // Of either sign and with an exponent in [low, high).
    double with_exponent(int low, int high) {
        const uint64_t exponent = static_cast<uint64_t>(low + 1023) + bits() % static_cast<uint64_t>(high - low);
        return from_bits((bits() & 0x800fffffffffffff) | exponent << 52);
    }

  private:
    uint64_t state_ = 7;
};

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

TEST_CASE("elementary: double against MPFR") {
    const int count = 15000;
    CHECK(largest_error(wisp::exp, mpfr_exp, -745.2, 709.78, count) <= 0.857);
    CHECK(largest_error(wisp::expm1, mpfr_expm1, -50, 709.78, count) <= 0.948);
    CHECK(largest_error(wisp::log, mpfr_log, 0x1p-1074, 0x1.fffffffffffffp1023, count) <= 0.828);
    CHECK(largest_error(wisp::log, mpfr_log, 0.5, 2, count) <= 0.828);
    CHECK(largest_error(wisp::log1p, mpfr_log1p, -0x1.fffffffffffffp-1, 3, count) <= 1.128);
    CHECK(largest_error(wisp::log1p, mpfr_log1p, 3, 0x1.fffffffffffffp1023, count) <= 1.128);
    CHECK(largest_error(sine_of_turns<double>, sine_of_turns, -2, 2, count) <= 0.884);
    CHECK(largest_error(cosine_of_turns<double>, cosine_of_turns, -2, 2, count) <= 0.887);
    CHECK(largest_error(wisp::acos, mpfr_acos, -1, 1, count) <= 0.874);
    CHECK(largest_error(wisp::asin, mpfr_asin, -1, 1, count) <= 1.2);
    CHECK(largest_error(wisp::cbrt, mpfr_cbrt, -0x1.fffffffffffffp1023, 0x1.fffffffffffffp1023, count) <= 0.667);
}

TEST_CASE("elementary: float against double") {
    const float most = 0x1.fffffep127f;
    CHECK(largest_float_error(wisp::exp, wisp::exp, -104, 88.72283f) <= 0.864);
    CHECK(largest_float_error(wisp::expm1, wisp::expm1, -104, 88.72283f) <= 1.067);
    CHECK(largest_float_error(wisp::log, wisp::log, 0x1p-149f, most) <= 0.840);
    CHECK(largest_float_error(wisp::log1p, wisp::log1p, -0x1.fffffep-1f, most) <= 1.235);
    CHECK(largest_float_error(sine_of_turns<float>, sine_of_turns<double>, 0x1p-100f, 0x1p30f) <= 0.890);
    CHECK(largest_float_error(sine_of_turns<float>, sine_of_turns<double>, -0x1p30f, -0x1p-100f) <= 0.890);
    CHECK(largest_float_error(sine_of_turns<float>, sine_of_turns<double>, -0x1p-100f, 0x1p-100f) <= 1); // subnormal
    CHECK(largest_float_error(cosine_of_turns<float>, cosine_of_turns<double>, -0x1p30f, 0x1p30f) <= 0.897);
    CHECK(largest_float_error(wisp::acos, wisp::acos, -1, 1) <= 0.889);
    CHECK(largest_float_error(wisp::asin, wisp::asin, -1, 1) <= 1.2);
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
