// What the searches of both trees share: the ray as it is tested against planes, and the triangles of a leaf.
//
// A ray's crossing with a plane is an interval: a margin to either side covers the error of hits (triangle.h), and the
// rounding of the crossing. Components of the direction below e times the largest one (e = 2^-24, 2^-53, in Fixed as
// far as lengths have room) are raised to that. This moves the ray by e M at most, which is in the margin. So there is
// no division by 0, and a ray in a plane, with a component of +0 or of -0, crosses it everywhere.
#pragma once
#include "core/geometry/point_kdtree.h" // WISP_NO_UNROLL, WISP_INLINE
#include "core/surfaces/triangle_tree.h"

namespace wisp::WISP_ARITH {

inline float position_of(float x) { return x; }
inline double position_of(double x) { return x; }
inline int64_t position_of(Fixed x) { return x.raw(); }

inline float times(float a, float b) { return a * b; }
inline double times(double a, double b) { return a * b; }
inline int64_t times(int64_t a, int64_t b) { // b in units of 2^-32
    const detail::Wide w = detail::product<detail::Wide>(a, b);
    return static_cast<int64_t>((static_cast<uint64_t>(detail::high_word(w)) << 32) | (detail::low_word(w) >> 32));
}

// The ray's parameter at a distance, rounded to either side.
template <class T> struct Span { T low, high; };
inline Span<float> span_of(float distance, float) { return {distance, distance}; }
inline Span<double> span_of(double distance, double) { return {distance, distance}; }
inline Span<int64_t> span_of(Fixed distance, Fixed dominant) {
    constexpr int64_t far = int64_t{1} << 61;
    const int64_t high = detail::high_word(detail::product<detail::Wide>(distance.raw(), abs(dominant).raw()));
    if (high >= far >> 32) return {far, far};
    if (high < -far >> 32) return {-far, -far};
    const int64_t low = times(distance.raw(), abs(dominant).raw());
    return {low, low + 1};
}

// `inverse`: how far the parameter grows per unit of length along an axis. `margin`: the margin of plane crossings, as
// a parameter. `component` and `dominant` are the direction's component along the axis and its largest one. `reach` is
// at least the magnitude of any corner's coordinate plus that of the origin's.
template <class T> struct Slope { T inverse, margin; };
template <class T> Slope<T> slope_of(T component, T dominant, T reach) {
    constexpr T e = sizeof(T) == 4 ? T(0x1p-24) : T(0x1p-53);
    const T least = abs(dominant) * e, size = max(abs(component), least);
    const T inverse = T(1) / (component < 0 ? -size : size);
    // In units of e reach: 14 for the hit (triangle.h), 1 for raising the component, 1 for the inverse, 4 for the
    // products and sums in to_low and to_high, less than a half for the margin itself. The sum is below 24.
    return {inverse, T(24) * e * reach * abs(inverse)};
}
inline Slope<int64_t> slope_of(Fixed component, Fixed dominant, Fixed reach) {
    using namespace detail;
    const int64_t size = component.raw() < 0 ? -component.raw() : component.raw();
    const int64_t most = dominant.raw() < 0 ? -dominant.raw() : dominant.raw();
    // Lengths of up to `far` are multiplied by inverses of up to 2^room.
    int64_t margin = 8 + (most >> 32) + (reach.raw() >> 32);
    const int64_t far = reach.raw() + 2 * margin;
    const int room = min(30, leading_zeros(static_cast<uint64_t>(far)) - 3);
    int64_t inverse = int64_t{1} << (32 + room);
    if (most >> room < size)
        inverse = static_cast<int64_t>(
            divide(join<Wide>(static_cast<uint64_t>(most) >> 32, static_cast<uint64_t>(most) << 32),
                   static_cast<uint64_t>(size))
                .quotient);
    else
        margin += (reach.raw() >> room) + 1;
    return {component.raw() < 0 ? -inverse : inverse, times(margin, inverse) + 1};
}

// An upper bound of a corner's coordinate less the origin's, in magnitude.
inline Real reach_of(const TriangleTree &tree, const TriangleRay &ray) {
    return tree.largest + largest(absolute(ray.origin));
}

// A ray as it is tested against planes, in numbers of its own. `dominant` is the direction's largest component.
template <class Number> struct PlaneRay {
    using Position = decltype(position_of(Number()));
    // A plane is crossed at a parameter from plane * inverse - to_low to plane * inverse - to_high.
    Position inverse[3], to_low[3], to_high[3];
    uint32_t backward[3]; // 1: the direction's component is negative

    PlaneRay(const Number (&origin)[3], const Number (&direction)[3], Number dominant, Number reach) {
        for (uint32_t a = 0; a < 3; ++a) {
            const Slope<Position> slope = slope_of(direction[a], dominant, reach);
            const Position to_origin = times(position_of(origin[a]), slope.inverse);
            inverse[a] = slope.inverse;
            to_low[a] = to_origin + slope.margin;
            to_high[a] = to_origin - slope.margin;
            backward[a] = direction[a] < Number(0) ? 1 : 0;
        }
    }
};

inline PlaneRay<Real> plane_ray(const TriangleTree &tree, const TriangleRay &ray) {
    const Real origin[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
    const Real direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
    return {origin, direction, direction[ray.z], reach_of(tree, ray)};
}
// Fixed: from steps of planes to units of 2^-32.
inline int plane_shift(const TriangleTree &tree) { return tree.step_exponent + 32; }
inline int64_t position_of_steps(int32_t plane, int shift) {
    return static_cast<int64_t>(static_cast<uint64_t>(int64_t{plane}) << shift);
}

// A filter finds the triangles of a group that may be hit: all that are hit, and few others. In f32 and f64 it computes
// the test's own sheared corners; the sign of a difference of rounded products is that of the exact difference, or 0.
template <class T> struct ExactFiltering {
    using Number = T;
    using Product = T;

    explicit ExactFiltering(T) {}
    static Number number_of(T shear) { return shear; }
    static Number difference(T a, T b) { return a - b; }
    static Number sheared(Number x, Number z, Number shear) { return x - shear * z; }
    static Product room(Number) { return Product(0); }
};

// For Fixed, by doubles in units of 2^-32. Differences from the test's own numbers:
//   - A corner less the origin is exact, and at most M = 2^47.
//   - A sheared corner differs by less than 2^-51 M + 2^-14: 2^-53 M by the shear, as much by its product, twice as
//     much by the difference, and 2^-14 because the test rounds down. `slack` is twice that.
//   - The cross product of corners p and q differs by less than slack / 2 (|p_x| + |p_y| + |q_x| + |q_y| + slack), and
//     by as much again through three roundings of 2^-53 of products below 2 M (|q_x| + |q_y|). `room` is twice their
//     sum.
struct DoubleFiltering {
    using Number = double;
    using Product = double;
    static constexpr double slack = 0x1p-3 + 0x1p-13;

    explicit DoubleFiltering(Fixed) {}
    static Number number_of(int64_t shear) { return static_cast<double>(shear) * 0x1p-62; }
    static Number difference(Fixed a, Fixed b) { // 2^52 + 2^51 + the integer, less 2^52 + 2^51
        const uint64_t integer = static_cast<uint64_t>(a.raw()) - static_cast<uint64_t>(b.raw());
        return detail::from_bits<double>(integer + 0x4338000000000000) - 0x1.8p52;
    }
    static Number sheared(Number x, Number z, Number shear) { return x - shear * z; }
    static Product room(Number sum) { return 2 * slack * (sum + slack); }
};

// For Fixed, by words of 32 bits, in units such that a corner less the origin is at most 2^27. Differences from the
// test's own numbers:
//   - A sheared corner differs by less than 3.2: 1 each by rounding down the coordinate, the coordinate along the ray
//     and their product, 2^-3 by the shear in units of 2^-30.
//   - The cross product of corners p and q differs by less than 3.2 (|p_x| + |p_y| + |q_x| + |q_y|) + 2 * 3.2^2. `room`
//     is more than that.
struct IntegerFiltering {
    using Number = int32_t;
    using Product = int64_t;
    int shift;

    explicit IntegerFiltering(Fixed reach)
        : shift(max(0, 37 - detail::leading_zeros(static_cast<uint64_t>(reach.raw()) | 1))) {}
    static Number number_of(int64_t shear) { return static_cast<Number>(shear >> 32); }
    Number difference(Fixed a, Fixed b) const { return static_cast<Number>((a.raw() - b.raw()) >> shift); }
    static Number sheared(Number x, Number z, Number shear) {
        return x - static_cast<Number>((Product{shear} * z) >> 30);
    }
    static Product room(Number sum) { return 4 * (Product{sum} + 8); }
};

using Filtering = std::conditional_t<!std::is_same_v<Real, Fixed>, ExactFiltering<Real>,
                                     std::conditional_t<hardware_double, DoubleFiltering, IntegerFiltering>>;

struct Filter : Filtering {
    uint32_t axis[3];
    Real from[3];
    Number shear_x, shear_y;

    Filter(const TriangleTree &tree, const TriangleRay &ray)
        : Filtering(reach_of(tree, ray)), axis{ray.x, ray.y, ray.z}, shear_x(number_of(ray.shear_x)),
          shear_y(number_of(ray.shear_y)) {
        for (int i = 0; i < 3; ++i) from[i] = ray.origin[static_cast<int>(axis[i])];
    }

    // A mask of the first `count` triangles that may be hit.
    WISP_INLINE uint32_t candidates(const TriangleGroup &group, uint32_t count) const {
        Number x[3][group_triangles], y[3][group_triangles];
        for (uint32_t c = 0; c < 3; ++c) {
            const Real *const from_x = group.corner[c][axis[0]], *const from_y = group.corner[c][axis[1]],
                              *const from_z = group.corner[c][axis[2]];
            WISP_NO_UNROLL for (uint32_t l = 0; l < group_triangles; ++l) {
                const Number z = difference(from_z[l], from[2]);
                x[c][l] = sheared(difference(from_x[l], from[0]), z, shear_x);
                y[c][l] = sheared(difference(from_y[l], from[1]), z, shear_y);
            }
        }
        const auto cross = [&](uint32_t p, uint32_t q, uint32_t l) {
            return Product{x[p][l]} * y[q][l] - Product{y[p][l]} * x[q][l];
        };
        const auto size = [](auto v) {
            if constexpr (std::is_integral_v<decltype(v)>)
                return v < 0 ? -v : v;
            else
                return abs(v);
        };
        Product least[group_triangles], most[group_triangles], space[group_triangles], below[group_triangles];
        WISP_NO_UNROLL for (uint32_t l = 0; l < group_triangles; ++l) {
            const Product a = cross(2, 1, l), b = cross(0, 2, l), c = cross(1, 0, l);
            least[l] = min(a, min(b, c));
            most[l] = max(a, max(b, c));
            space[l] =
                room(size(x[0][l]) + size(x[1][l]) + size(x[2][l]) + size(y[0][l]) + size(y[1][l]) + size(y[2][l]));
            below[l] = -space[l];
        }
        const uint32_t mask = lanes_not_less(least, below) | lanes_not_less(space, most);
        return mask & ((1u << count) - 1);
    }
};

// Calls visit(triangle, hit) for those of the first `count` triangles of the group that the ray's line hits, until it
// returns true. Returns whether it did. `last` is not tested, and becomes the last that was.
template <class Visit>
WISP_INLINE bool search_group(const TriangleGroup &group, uint32_t count, const TriangleRay &ray, const Filter &filter,
                              uint32_t ignore_triangle, uint32_t &last, Visit &&visit) {
    for (uint32_t mask = filter.candidates(group, count); mask != 0; mask &= mask - 1) {
        const uint32_t lane = static_cast<uint32_t>(__builtin_ctz(mask));
        const uint32_t triangle = group.triangle[lane];
        if (triangle == last || (triangle & ~transmissive_bit) == ignore_triangle) continue;
        last = triangle;
        const auto sheared = [&](uint32_t c) {
            const auto along = [&](uint32_t i) { return group.corner[c][filter.axis[i]][lane] - filter.from[i]; };
            return shear(ray, along(0), along(1), along(2));
        };
        TriangleHit hit;
        if (intersect(ray, sheared(0), sheared(1), sheared(2), hit) && visit(triangle, hit)) return true;
    }
    return false;
}

} // namespace wisp::WISP_ARITH
