// Vectors of Real. The types, + - * / and cross are GLM's; products that round once in Fixed are defined here.
#pragma once
#define GLM_FORCE_PURE
#define GLM_FORCE_XYZW_ONLY
#include "core/numbers/real.h"
#include "wisp/double3.h"
#include <glm/vec3.hpp>
#include <glm/geometric.hpp>

namespace wisp::WISP_ARITH {

using Vec3 = glm::vec<3, Real, glm::defaultp>;
using Color = Vec3; // linear R G B

inline Double3 to_double3(const Vec3 &v) { return {to_double(v.x), to_double(v.y), to_double(v.z)}; }
inline Vec3 vec_of(const Double3 &v) { return Vec3(to_real<Real>(v.x), to_real<Real>(v.y), to_real<Real>(v.z)); }

// The scalar product; in Fixed rounded once, from the exact 128-bit sum.
inline Real dot(const Vec3 &a, const Vec3 &b) { return sum_of_products(a.x, b.x, a.y, b.y, a.z, b.z); }
inline Real length(const Vec3 &v) { return sqrt(dot(v, v)); }
// v / |v|; v must not be zero.
inline Vec3 normalize(const Vec3 &v) { return v / length(v); }
// A unit vector: any, where the points are one.
inline Vec3 direction_between(const Vec3 &from, const Vec3 &to) {
    const Vec3 way = to - from;
    const Real distance = length(way);
    return distance > Real(0) ? way / distance : Vec3(Real(0), Real(0), Real(1));
}

using wisp::max;
using wisp::min;
using wisp::mix;
inline Vec3 min(const Vec3 &a, const Vec3 &b) { return Vec3(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)); }
inline Vec3 max(const Vec3 &a, const Vec3 &b) { return Vec3(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)); }
inline Vec3 absolute(const Vec3 &v) { return Vec3(abs(v.x), abs(v.y), abs(v.z)); }
inline Real largest(const Color &c) { return max(c.x, max(c.y, c.z)); }
inline Real all_channels(const Color &c) { return c.x + c.y + c.z; }

using wisp::scale_pow2;
inline Vec3 scale_pow2(const Vec3 &v, int k) {
    return Vec3(scale_pow2(v.x, k), scale_pow2(v.y, k), scale_pow2(v.z, k));
}

// The axis of the component that is largest in magnitude; of equal ones, the last.
inline uint32_t largest_axis(const Vec3 &v) {
    const Real x = abs(v.x), y = abs(v.y), z = abs(v.z);
    return x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
}

} // namespace wisp::WISP_ARITH
