// The intersection of a ray with a triangle, without cracks between triangles (Woop, Benthin, Wald 2013).
//
// Corners are sheared along the ray, so that the ray becomes the z axis. Each corner is sheared by itself, so two
// triangles that share a corner have the same sheared corner. In the plane z = 0 a triangle is hit when the ray, the
// point (0, 0), does not lie strictly on different sides of two of its edges. The side of an edge is the sign of the
// cross product p x q of its ends. The sign is exact: for float, the products are taken in double, which holds them;
// for double, the rounding errors of the products are kept (Dekker 1971); for Fixed, products have 128 bits. To the
// bit, p x q = -(q x p), so of two triangles at an edge at least one is hit. A triangle is not hit if the ray lies on
// all of its edges: it is seen edge-on, or its corners coincide.
//
// The same cross products, with relative error below 2^-50 (Fixed: 2^-60), are the weights of the corners. Trees over
// triangles rely on this bound:
//
//   For each hit at `distance` there is a point of the triangle that differs from origin + distance * direction, in
//   each coordinate, by at most 14 e M; in Fixed by at most 2 + |D| units of 2^-32.
//
// M is the largest coordinate of corner - origin. D is the dominant component of the direction. e is half a unit in the
// last place: 2^-24 for float, 2^-53 for double. Derivation: the point is the triangle's point with the computed
// weights.
//   - The sheared x of a corner, x - (d_x / D) z, has five roundings, of numbers up to M and last of one up to 2 M. Its
//     error is at most 6 e M. So is the error of the weighted mean of the corners, whose computed value is 0 (within
//     2^-50 M).
//   - The depth of the point is the weighted mean of z, with weights of one sign. With the rounding of z,
//     products, sums and quotients its error is at most 8 e M. The ray's other coordinates change with the depth by at
//     most as much.
//   - In Fixed, sheared coordinates are in units of 2^-46, and err by at most three of them for M < 2^15. The distance
//     errs by 2^-33, and so the ray's point by 2^-33 |D|.
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
using Sheared = int64_t; // coordinates in units of 2^-46, shears in units of 2^-62
}

namespace WISP_ARITH {

// A ray with its shear. `direction` may have any length but 0; distances are in units of that length.
struct TriangleRay {
    TriangleRay(const Vec3 &origin_, const Vec3 &direction_);

    Vec3 origin, direction;
    uint32_t x, y, z; // the axes in cyclic order; z is that of the direction's largest component
    Sheared shear_x, shear_y;
};

// The weights of the corners a, b, c are 1 - u - v, u, v.
struct TriangleHit {
    Real distance, u, v;
};

struct ShearedCorner {
    Sheared x, y;
    Real z; // of corner - origin, not divided by the direction's z
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

// value + error is the exact result, if nothing leaves the range of double.
struct Exact {
    double value, error;
};
// a b = value + error (Dekker 1971, with Veltkamp's splitting).
inline Exact exact_product(double a, double b) {
    const double scaled_a = a * 0x8000001p0, scaled_b = b * 0x8000001p0;
    const double a_high = scaled_a - (scaled_a - a), a_low = a - a_high;
    const double b_high = scaled_b - (scaled_b - b), b_low = b - b_high;
    const double value = a * b;
    return {value, ((a_high * b_high - value) + a_high * b_low + a_low * b_high) + a_low * b_low};
}
// a + b = value + error (Knuth's two-sum).
inline Exact exact_sum(double a, double b) {
    const double sum = a + b, b_virtual = sum - a;
    return {sum, (a - (sum - b_virtual)) + (b - b_virtual)};
}

// a d - b c. The sign is exact, the relative error below 2^-51.
inline double cross(float a, float b, float c, float d) {
    return static_cast<double>(a) * static_cast<double>(d) - static_cast<double>(b) * static_cast<double>(c);
}
inline double cross(double a, double b, double c, double d) {
    const Exact p = exact_product(a, d), q = exact_product(b, c);
    // values.value + errors.value cancels without rounding or not at all; the other sum is below its last place.
    const Exact values = exact_sum(p.value, -q.value), errors = exact_sum(p.error, -q.error);
    return (values.value + errors.value) + (values.error + errors.error);
}
inline Wide cross(int64_t a, int64_t b, int64_t c, int64_t d) { return product<Wide>(a, d) + product<Wide>(-b, c); }

inline bool is_zero(Wide w) { return high_word(w) == 0 && low_word(w) == 0; }
inline Wide negated(Wide w) {
    return join<Wide>(~static_cast<uint64_t>(high_word(w)), ~low_word(w)) + join<Wide>(0, 1);
}
// w / 2^k, rounded down; 0 <= w, k < 128, and the result must fit one word.
inline uint64_t shifted_down(Wide w, int k) {
    const uint64_t high = static_cast<uint64_t>(high_word(w));
    if (k >= 64) return high >> (k - 64);
    return k == 0 ? low_word(w) : (high << (64 - k)) | (low_word(w) >> k);
}

// Whether the cross products, given at the opposite corners, have one sign. If so, sets the distance and the weights u
// of b and v of c. a_z, b_z, c_z are the corners' z, and `dominant` is the direction's.
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
    // Weights in units of 2^-62, from products that are shifted down to 60 bits or more.
    const uint64_t high = static_cast<uint64_t>(high_word(all));
    const int k = high != 0 ? max(0, 66 - leading_zeros(high)) : low_word(all) >> 62 != 0 ? 2 : 0;
    const uint64_t short_b = shifted_down(at_b, k), short_c = shifted_down(at_c, k);
    const uint64_t sum = shifted_down(at_a, k) + short_b + short_c;
    const auto weight = [sum](uint64_t product) {
        return static_cast<int64_t>(divide(join<Wide>(product >> 2, product << 62), sum).quotient);
    };
    const int64_t weight_b = weight(short_b), weight_c = weight(short_c);
    const Wide deeper = product<Wide>(b_z.raw() - a_z.raw(), weight_b) + product<Wide>(c_z.raw() - a_z.raw(), weight_c);
    // In units of 2^-46.
    const int64_t depth =
        static_cast<int64_t>((static_cast<uint64_t>(a_z.raw()) << 14) +
                             ((static_cast<uint64_t>(high_word(deeper)) << 16) | (low_word(deeper) >> 48)));
    const uint64_t far = static_cast<uint64_t>(depth < 0 ? -depth : depth);
    const uint64_t divisor = static_cast<uint64_t>(dominant.raw() < 0 ? -dominant.raw() : dominant.raw());
    const bool behind = (depth < 0) != (dominant.raw() < 0);
    int64_t steps = fixed_max; // the distance does not fit
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

// Whether the exact sum of the terms is 0, by the grow-expansion algorithm (Shewchuk 1997). The components of the
// expansion do not overlap, so their sum is 0 only if each of them is.
template <int count> bool sums_to_zero(const double (&terms)[count]) {
    double component[count] = {};
    for (int t = 0; t < count; ++t) {
        double rest = terms[t];
        for (int i = 0; i < t; ++i) {
            const Exact sum = exact_sum(rest, component[i]);
            rest = sum.value;
            component[i] = sum.error;
        }
        component[t] = rest;
    }
    for (const double c : component)
        if (c != 0) return false;
    return true;
}

// Whether (b - a) x (c - a) = 0 in the plane: the exact sum of six products of coordinates.
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

// Shears a corner, given by the coordinates of corner - origin along the axes ray.x, ray.y, ray.z.
inline ShearedCorner shear(const TriangleRay &ray, Real x, Real y, Real z) {
    return {detail::sheared(x, z, ray.shear_x), detail::sheared(y, z, ray.shear_y), z};
}

// Intersects the whole line of the ray with the triangle: hit.distance may be negative. Returns false if there is no
// hit. The triangle must have an area.
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

// Whether the corners do not lie on one line. The test is exact.
inline bool has_area(const Vec3 &a, const Vec3 &b, const Vec3 &c) {
    return !detail::on_a_line(a.x, a.y, b.x, b.y, c.x, c.y) || !detail::on_a_line(a.y, a.z, b.y, b.z, c.y, c.z) ||
           !detail::on_a_line(a.z, a.x, b.z, b.x, c.z, c.x);
}

} // namespace WISP_ARITH
} // namespace wisp
