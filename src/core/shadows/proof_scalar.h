// The scalar in which shadows are proved, wider than Real: double for float and double; for Fixed 64-bit integers, with
// lengths in units of 2^-18.
//
// The direction of a separating axis needs no accuracy: two sets on different sides of a plane across any axis are
// disjoint. Integer axes are shortened to 25 bits, so that their dot products with positions of 35 bits fit 64.
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

// x k / 256; x small / large.
inline double scaled_256(double x, int k) { return x * k * 0x1p-8; }
inline int64_t scaled_256(int64_t x, int k) { return (x * k) >> 8; }
inline double ratio(double x, double small, double large) { return x * (small / large); }
inline int64_t ratio(int64_t x, int64_t small, int64_t large) { return x * small / large; }

// Bounds of the length of t d' at t = ray_epsilon: the length of a computed direction d' is not exactly 1, and
// ray_epsilon is rounded.
inline double lower_bound(double ray_epsilon) { return ray_epsilon - ray_epsilon * 0x1p-10; }
inline int64_t lower_bound(int64_t ray_epsilon) {
    return min(max(int64_t{0}, ray_epsilon - (ray_epsilon >> 10) - 2), int64_t{1} << 28);
}
inline double upper_bound(double ray_epsilon) { return ray_epsilon + ray_epsilon * 0x1p-10; }
inline int64_t upper_bound(int64_t ray_epsilon) { return ray_epsilon + (ray_epsilon >> 10) + 2; }

// A component of a vector that leads out of the scene, parallel to a unit vector with this component. Coordinates of
// the scene are at most `largest`, in Fixed at most 2^14.
inline double far_along(float component, double largest) { return 4 * largest * component; }
inline double far_along(double component, double largest) { return 4 * largest * component; }
inline int64_t far_along(Fixed component, int64_t) { return component.raw() * 4; }
constexpr bool in_range(double) { return true; }
constexpr bool in_range(int64_t largest) { return largest <= int64_t{1} << (14 + length_bits); }

// The position of a node's plane; TriangleNode has the encoding.
inline double plane_at(uint32_t value, int, double) { return from_bits<float>(value); }
inline int64_t plane_at(uint32_t value, int step_exponent, int64_t) {
    const int64_t steps = static_cast<int32_t>(value);
    const int shift = step_exponent + length_bits;
    return shift >= 0 ? steps * (int64_t{1} << shift) : steps >> -shift;
}
// The same of a box (BoxNode), rounded down.
inline double plane_at(float plane, int, double) { return static_cast<double>(plane); }
inline int64_t plane_at(int32_t plane, int step_exponent, int64_t) {
    return plane_at(static_cast<uint32_t>(plane), step_exponent, int64_t());
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

// A vector along a x b, or nearly; a vector along v.
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

// The sign of the volume w . (a x b), or 0 if errors of up to `margin` in each coordinate of the three vectors may
// change it. With |v| the largest coordinate of v and |v|_1 the sum of all three, the volume changes by at most
//   margin (|a x b|_1 + |w x a|_1 + |w x b|_1)   by the error of each vector alone,
//   6 margin^2 (|a| + |b| + |w|)                 by errors of two: |error x b| <= 2 margin |b| in each coordinate,
//   6 margin^3                                   by errors of all three.
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
    if (max(wa.digits, wb.digits) - shift > 54)
        return 0; // a and b are almost parallel, and the other products have no room
    const Triple<int64_t> axis = shifted(ab, shift);
    const int64_t first = sum_of(axis) + sum_of(shifted(wa, shift)) + sum_of(shifted(wb, shift)) + 9;
    const int64_t second = (6 * margin * (largest_of(a) + largest_of(b) + largest_of(w) + margin)) >> shift;
    // The coordinates of the axis are off by up to 1: this adds sum_of(w) to the error.
    const int64_t volume = along(axis, w), error = margin * (first + second + 1) + sum_of(w);
    return volume > error ? 1 : -volume > error ? -1 : 0;
}

} // namespace detail
} // namespace wisp
