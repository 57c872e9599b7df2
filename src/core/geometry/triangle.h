// Where a ray meets a triangle, without cracks (Woop, Benthin, Wald 2013).
//
// Corners are sheared along the ray so that it becomes the axis z: each corner by itself, so two triangles that share
// a corner have the same sheared one. In that plane a triangle is hit when the ray (0, 0) lies on no two different
// sides of its edges. The side is that of the cross product p x q of an edge's ends, and its sign is exact: in float
// the products are taken in double, which holds them; in double their rounding errors are kept; in Fixed they have 128
// bits. p x q = -(q x p) to the bit, so of two triangles at an edge at least one is hit, and none is where all of its
// edges have the ray on them (one seen edge-on, one whose corners coincide).
//
// The same cross products, of relative error below 2^-50 (Fixed: 2^-60), are the weights of the corners. Hence what
// trees rest on:
//
//   Of each hit at `distance` there is a point of the triangle that differs from origin + distance * direction, in each
//   coordinate, by at most 14 e M; in Fixed by 2 + |D| units of 2^-32.
//
// M is the largest coordinate of corner - origin, D the dominant component of the direction, e = 2^-24, 2^-53 half a
// last place of float and double. The point is the triangle's with the computed weights. The sheared x of a corner,
// x - (d_x / D) z, has five roundings, of numbers up to M and last of one up to 2 M: it is off by at most 6 e M, and so
// is the mean of the corners' with the weights, which is 0 (but for 2^-50 M) as computed. The depth of the point is
// that mean of z, with weights of one sign, at most 8 e M off with the rounding of z, products, sums and quotients; the
// other coordinates of the ray follow it by at most as much. In Fixed sheared coordinates are in units of 2^-46, and
// three of them off where M < 2^15; the distance is 2^-33 off, so the ray's point 2^-33 |D|.
//
// Ranges: coordinates up to 2^14. Directions in the floating arithmetics between 2^-40 and 2^40.
#pragma once
#include "core/numbers/vec.h"

namespace wisp {

namespace f32 {
using Sheared = float;
}
namespace f64 {
using Sheared = double;
}
namespace fixed {
using Sheared = int64_t; // units of 2^-46, and of 2^-62 of the shear itself
}

namespace WISP_ARITH {

// A ray as triangles are tested against it; `direction` is of any length but 0, distances are in units of it.
struct TriangleRay {
    TriangleRay(const Vec3 &origin_, const Vec3 &direction_);

    Vec3 origin, direction;
    uint32_t x, y, z; // axes; z: along which the direction is largest
    Sheared shear_x, shear_y;
};

// What was hit where: the weights of the corners are 1 - u - v, u, v.
struct TriangleHit {
    Real distance, u, v;
};

struct ShearedCorner {
    Sheared x, y;
    Real z; // of corner - origin, not divided by the direction's
};

} // namespace WISP_ARITH

namespace detail {

inline float shear_of(float component, float dominant) { return component / dominant; }
inline double shear_of(double component, double dominant) { return component / dominant; }
inline int64_t shear_of(Fixed component, Fixed dominant) {
    const auto magnitude = [](Fixed x) { return static_cast<uint64_t>(x.raw() < 0 ? -x.raw() : x.raw()); };
    const uint64_t a = magnitude(component), b = magnitude(dominant); // a <= b
    if (a == b) return (component < Fixed(0)) == (dominant < Fixed(0)) ? int64_t{1} << 62 : -(int64_t{1} << 62);
    const int64_t quotient = static_cast<int64_t>(divide(join<Wide>(a >> 2, a << 62), b).quotient);
    return (component < Fixed(0)) == (dominant < Fixed(0)) ? quotient : -quotient;
}

inline float sheared(float x, float z, float shear) { return x - shear * z; }
inline double sheared(double x, double z, double shear) { return x - shear * z; }
inline int64_t sheared(Fixed x, Fixed z, int64_t shear) {
    const Wide moved = product<Wide>(z.raw(), shear);
    const uint64_t in_units = (static_cast<uint64_t>(high_word(moved)) << 16) | (low_word(moved) >> 48);
    return static_cast<int64_t>((static_cast<uint64_t>(x.raw()) << 14) - in_units);
}

// A number as value + error, exactly, where nothing leaves the range of double.
struct Exact {
    double value, error;
};
inline Exact exact_product(double a, double b) { // Dekker's, with Veltkamp's splitting
    const double scaled_a = a * 0x8000001p0, scaled_b = b * 0x8000001p0;
    const double a_high = scaled_a - (scaled_a - a), a_low = a - a_high;
    const double b_high = scaled_b - (scaled_b - b), b_low = b - b_high;
    const double value = a * b;
    return {value, ((a_high * b_high - value) + a_high * b_low + a_low * b_high) + a_low * b_low};
}
// a + b = value + error, exactly.
inline Exact exact_sum(double a, double b) {
    const double sum = a + b, b_part = sum - a;
    return {sum, (a - (sum - b_part)) + (b - b_part)};
}

// a d - b c: sign exact, relative error below 2^-51.
inline double cross(float a, float b, float c, float d) {
    return static_cast<double>(a) * static_cast<double>(d) - static_cast<double>(b) * static_cast<double>(c);
}
inline double cross(double a, double b, double c, double d) {
    const Exact p = exact_product(a, d), q = exact_product(b, c);
    // The terms on the left cancel without rounding or not at all, those on the right are below their last place.
    const Exact values = exact_sum(p.value, -q.value), errors = exact_sum(p.error, -q.error);
    return (values.value + errors.value) + (values.error + errors.error);
}
inline Wide cross(int64_t a, int64_t b, int64_t c, int64_t d) { return product<Wide>(a, d) + product<Wide>(-b, c); }

inline bool is_zero(Wide w) { return high_word(w) == 0 && low_word(w) == 0; }
inline Wide negated(Wide w) {
    return join<Wide>(~static_cast<uint64_t>(high_word(w)), ~low_word(w)) + join<Wide>(0, 1);
}
// w / 2^k, rounded down, where that fits a word; 0 <= w, k < 128.
inline uint64_t shifted_down(Wide w, int k) {
    const uint64_t high = static_cast<uint64_t>(high_word(w));
    if (k >= 64) return high >> (k - 64);
    return k == 0 ? low_word(w) : (high << (64 - k)) | (low_word(w) >> k);
}

// Whether the cross products at the corners have one sign; then the distance and the weights of b and c.
template <class T>
bool weigh(double at_a, double at_b, double at_c, T a_z, T b_z, T c_z, T dominant, T &distance, T &u, T &v) {
    if (min(at_a, min(at_b, at_c)) < 0 && max(at_a, max(at_b, at_c)) > 0) return false;
    const double all = at_a + at_b + at_c;
    if (all == 0) return false;
    const double depth =
        at_a * static_cast<double>(a_z) + at_b * static_cast<double>(b_z) + at_c * static_cast<double>(c_z);
    distance = static_cast<T>(depth / (all * static_cast<double>(dominant)));
    u = static_cast<T>(at_b / all);
    v = static_cast<T>(at_c / all);
    return true;
}
inline bool weigh(Wide at_a, Wide at_b, Wide at_c, Fixed a_z, Fixed b_z, Fixed c_z, Fixed dominant, Fixed &distance,
                  Fixed &u, Fixed &v) {
    const bool negative = high_word(at_a) < 0 || high_word(at_b) < 0 || high_word(at_c) < 0;
    if (negative) {
        if ((high_word(at_a) >= 0 && !is_zero(at_a)) || (high_word(at_b) >= 0 && !is_zero(at_b)) ||
            (high_word(at_c) >= 0 && !is_zero(at_c)))
            return false;
        at_a = negated(at_a), at_b = negated(at_b), at_c = negated(at_c);
    }
    const Wide all = at_a + at_b + at_c; // below 2^127
    if (is_zero(all)) return false;
    // Weights in units of 2^-62, of products of 60 bits or more.
    const uint64_t high = static_cast<uint64_t>(high_word(all));
    const int k = high != 0 ? max(0, 66 - leading_zeros(high)) : low_word(all) >> 62 != 0 ? 2 : 0;
    const uint64_t part_b = shifted_down(at_b, k), part_c = shifted_down(at_c, k);
    const uint64_t parts = shifted_down(at_a, k) + part_b + part_c;
    const auto weight = [parts](uint64_t part) {
        return static_cast<int64_t>(divide(join<Wide>(part >> 2, part << 62), parts).quotient);
    };
    const int64_t weight_b = weight(part_b), weight_c = weight(part_c);
    const Wide deeper = product<Wide>(b_z.raw() - a_z.raw(), weight_b) + product<Wide>(c_z.raw() - a_z.raw(), weight_c);
    // In units of 2^-46.
    const int64_t depth =
        static_cast<int64_t>((static_cast<uint64_t>(a_z.raw()) << 14) +
                             ((static_cast<uint64_t>(high_word(deeper)) << 16) | (low_word(deeper) >> 48)));
    const uint64_t far = static_cast<uint64_t>(depth < 0 ? -depth : depth);
    const uint64_t divisor = static_cast<uint64_t>(dominant.raw() < 0 ? -dominant.raw() : dominant.raw());
    const bool behind = (depth < 0) != (dominant.raw() < 0);
    int64_t steps = fixed_max; // farther than can be said
    if (far >> 46 < divisor) {
        const Quotient q = divide(join<Wide>(far >> 46, far << 18), divisor);
        const uint64_t rounded = q.quotient + (q.remainder >= divisor - q.remainder);
        if (rounded < static_cast<uint64_t>(fixed_max)) steps = static_cast<int64_t>(rounded);
    }
    distance = Fixed::from_raw(behind ? -steps : steps);
    u = Fixed::from_raw((weight_b + (int64_t{1} << 29)) >> 30);
    v = Fixed::from_raw((weight_c + (int64_t{1} << 29)) >> 30);
    return true;
}

// Whether the sum is 0, exactly (Shewchuk 1997, grow-expansion): `part` are sums of it that do not overlap.
template <int count> bool sums_to_zero(const double (&terms)[count]) {
    double part[count] = {};
    for (int t = 0; t < count; ++t) {
        double rest = terms[t];
        for (int i = 0; i < t; ++i) {
            const Exact sum = exact_sum(rest, part[i]);
            rest = sum.value;
            part[i] = sum.error;
        }
        part[t] = rest;
    }
    for (const double p : part)
        if (p != 0) return false;
    return true;
}

// (b - a) x (c - a) = 0 in the plane, by the products of coordinates.
inline bool on_a_line(float ax, float ay, float bx, float by, float cx, float cy) {
    const auto times = [](float s, float t) { return static_cast<double>(s) * static_cast<double>(t); };
    return sums_to_zero<6>(
        {times(ax, by), -times(ay, bx), times(bx, cy), -times(by, cx), times(cx, ay), -times(cy, ax)});
}
inline bool on_a_line(double ax, double ay, double bx, double by, double cx, double cy) {
    const Exact p[6] = {exact_product(ax, by),  exact_product(-ay, bx), exact_product(bx, cy),
                        exact_product(-by, cx), exact_product(cx, ay),  exact_product(-cy, ax)};
    return sums_to_zero<12>({p[0].value, p[0].error, p[1].value, p[1].error, p[2].value, p[2].error, p[3].value,
                             p[3].error, p[4].value, p[4].error, p[5].value, p[5].error});
}
inline bool on_a_line(Fixed ax, Fixed ay, Fixed bx, Fixed by, Fixed cx, Fixed cy) {
    return is_zero(cross(bx.raw() - ax.raw(), by.raw() - ay.raw(), cx.raw() - ax.raw(), cy.raw() - ay.raw()));
}

} // namespace detail

namespace WISP_ARITH {

inline TriangleRay::TriangleRay(const Vec3 &origin_, const Vec3 &direction_) : origin(origin_), direction(direction_) {
    z = largest_axis(direction);
    x = z == 2 ? 0 : z + 1;
    y = x == 2 ? 0 : x + 1;
    shear_x = detail::shear_of(direction[static_cast<int>(x)], direction[static_cast<int>(z)]);
    shear_y = detail::shear_of(direction[static_cast<int>(y)], direction[static_cast<int>(z)]);
}

// Of a corner less the origin: its coordinates along the ray's axes.
inline ShearedCorner shear(const TriangleRay &ray, Real x, Real y, Real z) {
    return {detail::sheared(x, z, ray.shear_x), detail::sheared(y, z, ray.shear_y), z};
}

// Where the ray, as long as a line, meets the triangle; false: nowhere. Only for triangles that have an area.
inline bool intersect(const TriangleRay &ray, const ShearedCorner &a, const ShearedCorner &b, const ShearedCorner &c,
                 TriangleHit &hit) {
    using detail::cross;
    return detail::weigh(cross(c.x, c.y, b.x, b.y), cross(a.x, a.y, c.x, c.y), cross(b.x, b.y, a.x, a.y), a.z, b.z, c.z,
                         ray.direction[static_cast<int>(ray.z)], hit.distance, hit.u, hit.v);
}
inline bool intersect(const TriangleRay &ray, const Vec3 &a, const Vec3 &b, const Vec3 &c, TriangleHit &hit) {
    const int x = static_cast<int>(ray.x), y = static_cast<int>(ray.y), z = static_cast<int>(ray.z);
    const Vec3 to_a = a - ray.origin, to_b = b - ray.origin, to_c = c - ray.origin;
    return intersect(ray, shear(ray, to_a[x], to_a[y], to_a[z]), shear(ray, to_b[x], to_b[y], to_b[z]),
                shear(ray, to_c[x], to_c[y], to_c[z]), hit);
}

// Whether the corners are not on one line: exactly.
inline bool has_area(const Vec3 &a, const Vec3 &b, const Vec3 &c) {
    return !detail::on_a_line(a.x, a.y, b.x, b.y, c.x, c.y) || !detail::on_a_line(a.y, a.z, b.y, b.z, c.y, c.z) ||
           !detail::on_a_line(a.z, a.x, b.z, b.x, c.z, c.x);
}

} // namespace WISP_ARITH
} // namespace wisp
