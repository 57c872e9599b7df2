// What proofs of shadows reckon with, wider than Real: double for float and double; in Fixed integers, lengths in units
// of 2^-18.
//
// Directions need no digits: whatever vector they are, sides told by them are told. Integer ones are shortened to 25
// bits, so that their products with positions of 35 bits add up in 64.
#pragma once
#include "core/geometry/triangle.h"

namespace wisp {

namespace f32 {
using ProofScalar = double;
}
namespace f64 {
using ProofScalar = double;
}
namespace fixed {
using ProofScalar = int64_t;
}

namespace detail {

template <class T> using Triple = glm::vec<3, T, glm::defaultp>;

constexpr int length_bits = 18, position_bits = 35, axis_bits = 25;

inline double to_proof_scalar(float x) { return x; }
inline double to_proof_scalar(double x) { return x; }
inline int64_t to_proof_scalar(Fixed x) { return x.raw() >> (32 - length_bits); } // rounded down

template <class T> T size_of(T x) { return x < 0 ? -x : x; }
template <class T> T largest_of(const Triple<T> &v) { return max(size_of(v.x), max(size_of(v.y), size_of(v.z))); }
template <class T> T sum_of(const Triple<T> &v) { return size_of(v.x) + size_of(v.y) + size_of(v.z); }
template <class T> T along(const Triple<T> &axis, const Triple<T> &v) {
    return axis.x * v.x + axis.y * v.y + axis.z * v.z;
}

// Not less than the vector's length.
inline double length_bound(const Triple<double> &v) { return (largest_of(v) + sum_of(v)) * 0.5; }
inline int64_t length_bound(const Triple<int64_t> &v) { return ((largest_of(v) + sum_of(v)) >> 1) + 1; }

// x part / 256; x small / large.
inline double share(double x, int part) { return x * part * 0x1p-8; }
inline int64_t share(int64_t x, int part) { return (x * part) >> 8; }
inline double ratio(double x, double small, double large) { return x * (small / large); }
inline int64_t ratio(int64_t x, int64_t small, int64_t large) { return x * small / large; }

// The skin at least, at most: that of a direction's length, and of the skin itself.
inline double at_least(double ray_epsilon) { return ray_epsilon - ray_epsilon * 0x1p-10; }
inline int64_t at_least(int64_t ray_epsilon) { return min(max(int64_t{0}, ray_epsilon - (ray_epsilon >> 10) - 2), int64_t{1} << 28); }
inline double at_most(double ray_epsilon) { return ray_epsilon + ray_epsilon * 0x1p-10; }
inline int64_t at_most(int64_t ray_epsilon) { return ray_epsilon + (ray_epsilon >> 10) + 2; }

// What is far enough along a unit vector's component where nothing is farther than `largest` from 0, and that within
// 2^14 in Fixed.
inline double far_along(float component, double largest) { return 4 * largest * component; }
inline double far_along(double component, double largest) { return 4 * largest * component; }
inline int64_t far_along(Fixed component, int64_t) { return component.raw() * 4; }
constexpr bool in_range(double) { return true; }
constexpr bool in_range(int64_t largest) { return largest <= int64_t{1} << (14 + length_bits); }

// A plane of a TriangleTree.
inline double plane_at(uint32_t value, int, double) { return from_bits<float>(value); }
inline int64_t plane_at(uint32_t value, int step_exponent, int64_t) {
    const int64_t steps = static_cast<int32_t>(value);
    const int shift = step_exponent + length_bits;
    return shift >= 0 ? steps * (int64_t{1} << shift) : steps >> -shift;
}

// a x b, exactly but for the sign.
struct WideProduct {
    bool negative[3];
    Wide size[3];
    int digits; // of the largest
};
inline WideProduct wide_product(const Triple<int64_t> &a, const Triple<int64_t> &b) {
    WideProduct result = {};
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1, k = j == 2 ? 0 : j + 1;
        const Wide w = product<Wide>(a[j], b[k]) + product<Wide>(-a[k], b[j]);
        result.negative[i] = high_word(w) < 0;
        result.size[i] = result.negative[i] ? negated(w) : w;
        const uint64_t high = static_cast<uint64_t>(high_word(result.size[i])), low = low_word(result.size[i]);
        const int digits = high != 0 ? 128 - leading_zeros(high) : low != 0 ? 64 - leading_zeros(low) : 0;
        result.digits = max(result.digits, digits);
    }
    return result;
}
inline Triple<int64_t> shifted(const WideProduct &w, int shift) {
    Triple<int64_t> result;
    for (int i = 0; i < 3; ++i) {
        const int64_t size = static_cast<int64_t>(shifted_down(w.size[i], shift));
        result[i] = w.negative[i] ? -size : size;
    }
    return result;
}

// A vector along a x b, or nearly; along v.
inline Triple<double> across(const Triple<double> &a, const Triple<double> &b) { return glm::cross(a, b); }
inline Triple<int64_t> across(const Triple<int64_t> &a, const Triple<int64_t> &b) {
    const WideProduct w = wide_product(a, b);
    return shifted(w, max(0, w.digits - axis_bits));
}
inline Triple<double> axis_along(const Triple<double> &v) { return v; }
inline Triple<int64_t> axis_along(const Triple<int64_t> &v) {
    constexpr int shift = position_bits - axis_bits;
    return Triple<int64_t>(v.x >> shift, v.y >> shift, v.z >> shift);
}

// The sign of w . (a x b), or 0 where it might be another with each coordinate of the three `margin` off. The terms of
// an error of one are at most margin |a x b|_1 and so on; of two, where |error x b| <= 2 margin |b| in each coordinate,
// 6 margin^2 |b|; of three, 6 margin^3.
inline int sure_side(const Triple<double> &a, const Triple<double> &b, const Triple<double> &w, double margin) {
    const Triple<double> ab = glm::cross(a, b);
    const double first = sum_of(ab) + sum_of(glm::cross(w, a)) + sum_of(glm::cross(w, b));
    const double second = largest_of(a) + largest_of(b) + largest_of(w);
    const double volume = along(ab, w), rounding = 0x1p-46 * largest_of(a) * largest_of(b) * largest_of(w);
    const double error = margin * (first + 6 * margin * (second + margin)) + rounding;
    return volume > error ? 1 : -volume > error ? -1 : 0;
}
inline int sure_side(const Triple<int64_t> &a, const Triple<int64_t> &b, const Triple<int64_t> &w, int64_t margin) {
    const WideProduct ab = wide_product(a, b), wa = wide_product(w, a), wb = wide_product(w, b);
    const int shift = max(0, ab.digits - axis_bits);
    if (max(wa.digits, wb.digits) - shift > 54) return 0; // no room; seen from there, a and b are nearly one
    const Triple<int64_t> axis = shifted(ab, shift);
    const int64_t first = sum_of(axis) + sum_of(shifted(wa, shift)) + sum_of(shifted(wb, shift)) + 9;
    const int64_t second = (6 * margin * (largest_of(a) + largest_of(b) + largest_of(w) + margin)) >> shift;
    const int64_t volume = along(axis, w), error = margin * (first + second + 1) + sum_of(w); // the axis' own: 1
    return volume > error ? 1 : -volume > error ? -1 : 0;
}

} // namespace detail
} // namespace wisp
