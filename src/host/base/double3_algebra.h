// Sums, products and rotations of vectors of doubles, in the units of a scene.
#pragma once
#include "core/numbers/elementary.h"
#include "wisp/scene.h"
#include <algorithm>
#include <cmath>

namespace wisp {

inline Double3 operator+(const Double3 &a, const Double3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Double3 operator-(const Double3 &a, const Double3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Double3 operator*(const Double3 &a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(const Double3 &a, const Double3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Double3 cross(const Double3 &a, const Double3 &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double component(const Double3 &a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }
inline double length(const Double3 &a) { return std::sqrt(dot(a, a)); }
inline double largest(const Double3 &a) { return std::max({a.x, a.y, a.z}); }
inline double largest_component(const Double3 &a) { return std::max({std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)}); }

// Of a box: bit 0 of `i` is set where the corner is high in x, bit 1 in y, bit 2 in z.
inline Double3 corner_of_box(const Double3 &low, const Double3 &high, int i) {
    return {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
}

// a / |a| for any a but 0: its largest component is made 1 first, so that no square underflows.
inline Double3 unit(const Double3 &a) {
    const double size = largest_component(a);
    const Double3 b = {a.x / size, a.y / size, a.z / size};
    return b * (1 / length(b));
}

// Whether one is a multiple of the other, to about ten digits, or 0.
inline bool are_parallel(const Double3 &a, const Double3 &b) {
    const Double3 side = cross(a, b);
    return !(dot(side, side) > 1e-20 * dot(a, a) * dot(b, b));
}

// The exponent e with 2^e <= x < 2^(e+1), x > 0.
inline int exponent_of(double x) {
    int e;
    std::frexp(x, &e);
    return e - 1;
}

// Rodrigues' rotation of p about an axis of any length but 0, which may be 0 where the angle is.
inline Double3 rotate(const Double3 &p, const Double3 &axis, double degrees) {
    if (degrees == 0) return p;
    double sine, cosine;
    sincos_turns(degrees / 360, sine, cosine);
    const Double3 k = unit(axis);
    return p * cosine + cross(k, p) * sine + k * (dot(k, p) * (1 - cosine));
}

} // namespace wisp
