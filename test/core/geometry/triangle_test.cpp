// Ray against triangle: no cracks, no hits of triangles without area, precision for small triangles, and agreement with
// a second implementation.
#include "support/triangle_sets.h"
#include <algorithm>
#include <cmath>

namespace wisp::WISP_ARITH {
namespace {

Vec3 vec(double x, double y, double z) { return vec_of({x, y, z}); }
Double3 between(const Double3 &a, const Double3 &b, double t) {
    return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
}

// A ray in long double: origin and direction after rounding to Real.
using Far = long double;
struct FarPoint {
    Far x, y, z;
};
FarPoint far_of(const Vec3 &v) { return {to_double(v.x), to_double(v.y), to_double(v.z)}; }
FarPoint minus(const FarPoint &a, const FarPoint &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FarPoint cross(const FarPoint &a, const FarPoint &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Far dot(const FarPoint &a, const FarPoint &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// The algorithm of Moeller and Trumbore (1997): the distance, and the weights of the corners.
struct FarHit {
    Far distance, weight[3];
};
FarHit moeller(const Vec3 &origin, const Vec3 &direction, const Triangle &t) {
    const FarPoint a = far_of(corner(t, 0)), d = far_of(direction), p = minus(far_of(origin), a);
    const FarPoint ab = minus(far_of(corner(t, 1)), a), ac = minus(far_of(corner(t, 2)), a);
    const FarPoint n = cross(d, ac), q = cross(p, ab);
    const Far all = dot(ab, n), u = dot(p, n) / all, v = dot(d, q) / all;
    return {dot(ac, q) / all, {1 - u - v, u, v}};
}

// The triangles of a fan lie between consecutive points of `rim` and `middle`. Counts the rays from around `from` to
// points of the fan's edges that hit no triangle, and those that hit more than one.
struct Cracks {
    uint32_t missed, doubled;
};
Cracks cracks_of(const Triangles &triangles, const std::vector<Double3> &targets, const Double3 &from, double spread,
                 uint32_t seed) {
    Mt19937 random(seed, 5, 6, 7);
    Cracks cracks = {0, 0};
    for (const Double3 &target : targets) {
        const Vec3 origin = vec_of(moved(from, point_within(random, spread)));
        const TriangleRay ray(origin, vec_of(target) - origin);
        uint32_t met = 0;
        for (const Triangle &t : triangles) {
            TriangleHit hit;
            if (!intersect(ray, t, hit)) continue;
            // A ray that lies exactly on the edge may hit both.
            const bool on_edge = hit.u == Real(0) || hit.v == Real(0) || hit.u + hit.v == Real(1);
            met += on_edge ? 1 : 2;
        }
        cracks.missed += met == 0 ? 1 : 0;
        cracks.doubled += met > 2 ? 1 : 0;
    }
    return cracks;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a triangle is met where long doubles meet it") {
    Mt19937 random(1, 5, 6, 7);
    // The error of sheared coordinates, in units of the triangle: coordinates up to 16 with 24 or 53 bits, or 2^-32.
    const double digit = sizeof(Real) == 4 ? 0x1p-24 : std::is_same_v<Real, Fixed> ? 0x1p-45 : 0x1p-53;
    uint32_t met = 0, decided = 0;
    for (int i = 0; i < 20000; ++i) {
        const double size = i % 4 == 0 ? 0x1p-10 : 2; // edges of 1e-3
        const Double3 a = point_within(random, 4), b = moved(a, point_within(random, size)),
                      c = moved(a, point_within(random, size));
        const Triangle t = triangle_of(a, b, c);
        const Vec3 origin = vec_of(point_within(random, 8));
        const double u = 1.6 * unit(random) - 0.3, v = 1.6 * unit(random) - 0.3;
        const Double3 aim = moved(between(a, b, u), {v * (c.x - a.x), v * (c.y - a.y), v * (c.z - a.z)});
        const Vec3 direction = vec_of(aim) - origin;
        TriangleHit hit;
        const bool intersects = intersect(TriangleRay(origin, direction), t, hit);
        const FarHit far = moeller(origin, direction, t);
        // The apparent height of the triangle from the origin: weights err by rounding / height.
        const FarPoint ab = minus(far_of(corner(t, 1)), far_of(corner(t, 0))),
                       ac = minus(far_of(corner(t, 2)), far_of(corner(t, 0))), d = far_of(direction);
        const Far along = std::sqrt(dot(d, d)), across = std::abs(dot(cross(ab, ac), d)) / along;
        const Far longest = std::sqrt(std::max(dot(ab, ab), dot(ac, ac))) * 2;
        const double error = static_cast<double>(16 * 16 * digit * longest / across);
        const double smallest = static_cast<double>(std::min({far.weight[0], far.weight[1], far.weight[2]}));
        if (!(error < 0.05) || std::abs(smallest) < error) continue;
        CHECK(intersects == (smallest > 0));
        ++decided;
        if (!intersects) continue;
        ++met;
        const double last = std::is_same_v<Real, Fixed> ? 0x1p-32 : sizeof(Real) == 4 ? 0x1p-23 : 0x1p-52;
        CHECK(std::abs(to_double(hit.u) - static_cast<double>(far.weight[1])) <= error + last);
        CHECK(std::abs(to_double(hit.v) - static_cast<double>(far.weight[2])) <= error + last);
        const double distance = static_cast<double>(far.distance);
        const double depth = error * static_cast<double>(longest / along);
        CHECK(std::abs(to_double(hit.distance) - distance) <=
              4 * (depth + 16 * digit / static_cast<double>(along)) + last * distance);
    }
    CHECK(decided > 15000);
    CHECK(met > 3000);
}

TEST_CASE(WISP_ARITH_NAME ": distances are in units of the direction, behind the origin they are negative") {
    const Triangle t = triangle_of({-1, -1, 2}, {1, -1, 2}, {0, 1, 2});
    for (const double length : {0.25, 1.0, 8.0})
        for (const double sign : {1.0, -1.0}) {
            TriangleHit hit;
            REQUIRE(intersect(TriangleRay(vec(0, 0, 0), vec(0, 0, sign * length)), t, hit));
            CHECK(to_double(hit.distance) == sign * 2 / length);
            CHECK(to_double(hit.u) == 0.25);
            CHECK(to_double(hit.v) == 0.5);
        }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E1: triangles without area are never hit") {
    Mt19937 random(2, 5, 6, 7);
    Triangles all;
    for (int i = 0; i < 2000; ++i) {
        // On a lattice, so that points of a line are exact.
        const auto whole = [&] { return static_cast<double>(random() % 65) - 32; };
        const double ax = whole(), ay = whole(), az = whole(), dx = whole(), dy = whole(), dz = whole();
        const double first = std::ldexp(whole(), -4), second = std::ldexp(whole(), -7);
        const Double3 a = {ax, ay, az}, b = {ax + first * dx, ay + first * dy, az + first * dz},
                      c = {ax + second * dx, ay + second * dy, az + second * dz};
        all.push_back(i % 4 == 0   ? triangle_of(a, a, b)
                      : i % 4 == 1 ? triangle_of(a, b, c)
                      : i % 4 == 2 ? triangle_of(b, c, b)
                                   : triangle_of(c, c, c));
    }
    for (const Triangle &t : all) CHECK(!has_area(t));
    const Planted planted(all, each_kind_of_tree());
    CHECK(planted.tree.triangle_count == 0);
    TreeCounts counts = {0, 0};
    SurfaceHit hit;
    uint32_t hits = 0;
    for (const Triangle &t : all) {
        const Vec3 origin = vec_of(point_within(random, 40));
        const TriangleRay ray(origin, vec_of(between(t.corner[0], t.corner[1], 0.5)) - origin);
        hits += nearest_hit(planted.tree, ray, Real(0), Real(20000), no_triangle, hit, counts) ? 1 : 0;
        TriangleHit met; // equal corners are never hit
        if (corner(t, 0) == corner(t, 1) || corner(t, 1) == corner(t, 2) || corner(t, 2) == corner(t, 0))
            hits += intersect(ray, t, met) ? 1 : 0;
    }
    CHECK(hits == 0);
    // The thinnest triangles: one unit in the last place off the line.
    CHECK(has_area(vec(1, 1, 0), vec(2, 2, 0), Vec3(Real(3), Real(3), Real(0x1p-30))));
    const Real above = sizeof(Real) == 4             ? Real(3 + 0x1p-22)
                       : std::is_same_v<Real, Fixed> ? Real(3 + 0x1p-32)
                                                     : Real(3 + 0x1p-51);
    CHECK(has_area(vec(1, 1, 0), vec(2, 2, 0), Vec3(Real(3), above, Real(0))));
}

TEST_CASE(WISP_ARITH_NAME ": hard case E2: no crack beside slivers") {
    // A strip of two large triangles with slivers between them: apexes 1e-3 and 1e-6 off the edge.
    for (const double height : {1e-3, 1e-6}) {
        const Double3 a = {-3, 0.1, 1}, b = {3, -0.2, 0.5}, above = {0.3, 4, 1.2}, below = {-0.4, -4, 0.7};
        const Double3 apex = moved(between(a, b, 0.4), {0, height, 0.3 * height});
        const Triangles all = {triangle_of(a, b, below), triangle_of(a, apex, b), triangle_of(a, above, apex),
                               triangle_of(apex, above, b)};
        Mt19937 random(3, 5, 6, 7);
        std::vector<Double3> targets;
        for (int i = 0; i < 30000; ++i) {
            const double t = 0.02 + 0.96 * unit(random);
            targets.push_back(i % 3 == 0 ? between(a, b, t) : i % 3 == 1 ? between(a, apex, t) : between(apex, b, t));
        }
        CHECK(cracks_of(all, targets, {0.2, 0.1, 9}, 1, 4).missed == 0);
        CHECK(cracks_of(all, targets, {7, 2, 6}, 1, 5).missed == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E3: of 100,000 rays at a shared edge none passes, none meets both triangles") {
    Mt19937 random(6, 5, 6, 7);
    for (const double offset : {0.0, 1000.0}) {
        Cracks cracks = {0, 0};
        for (int pair = 0; pair < 50; ++pair) {
            const Double3 by = {offset, -offset, offset};
            const Double3 a = moved(point_within(random, 1), by), b = moved(point_within(random, 1), by);
            // On either side of the edge as seen from above, so that no ray meets them edge-on.
            const Double3 left = moved(between(a, b, unit(random)), {-(b.y - a.y), b.x - a.x, 0.3}),
                          right = moved(between(a, b, unit(random)), {b.y - a.y, -(b.x - a.x), 0.2});
            if (std::hypot(b.x - a.x, b.y - a.y) < 0.2) continue;
            std::vector<Double3> targets;
            for (int i = 0; i < 1000; ++i) targets.push_back(between(a, b, 0.02 + 0.96 * unit(random)));
            const Cracks here = cracks_of({triangle_of(a, b, left), triangle_of(b, a, right)}, targets,
                                          moved(a, {0, 0, 20}), 1, 100 + static_cast<uint32_t>(pair));
            const Cracks turned = cracks_of({triangle_of(left, a, b), triangle_of(a, b, right)}, targets,
                                            moved(a, {0, 0, -20}), 1, 200 + static_cast<uint32_t>(pair));
            cracks.missed += here.missed + turned.missed, cracks.doubled += here.doubled + turned.doubled;
        }
        CHECK(cracks.missed == 0);
        CHECK(cracks.doubled == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E4: no ray passes through the corner of a closed fan") {
    Mt19937 random(7, 5, 6, 7);
    uint32_t missed = 0, rays = 0;
    for (int fan = 0; fan < 500; ++fan) {
        const double offset = fan % 2 == 0 ? 0 : 1000;
        const Double3 middle = moved(point_within(random, 1), {offset, offset, -offset});
        std::vector<Double3> rim;
        for (int i = 0; i < 6; ++i) {
            const double turn = (i + 0.6 * unit(random)) * 1.0472, radius = 0.5 + unit(random);
            rim.push_back(moved(middle, {radius * std::cos(turn), radius * std::sin(turn), within(random, 0.2)}));
        }
        Triangles all;
        for (size_t i = 0; i < 6; ++i)
            all.push_back(fan % 3 == 0 ? triangle_of(middle, rim[i], rim[(i + 1) % 6])
                                       : triangle_of(rim[(i + 1) % 6], middle, rim[i]));
        const std::vector<Double3> targets(100, middle);
        const double side = fan % 4 < 2 ? 15 : -15;
        missed += cracks_of(all, targets, moved(middle, {0, 0, side}), 3, 300 + static_cast<uint32_t>(fan)).missed;
        rays += 100;
    }
    CHECK(rays == 50000);
    CHECK(missed == 0);
}

TEST_CASE(WISP_ARITH_NAME ": hard case E5: a ray in the plane of a triangle misses it") {
    Mt19937 random(8, 5, 6, 7);
    uint32_t met = 0;
    for (int i = 0; i < 5000; ++i) {
        const uint32_t normal = static_cast<uint32_t>(i) % 4;
        // Planes x, y, z = a constant, and x = y + a constant: every point of them is exact.
        const auto in_plane = [&](double u, double v) {
            const double at = 0.5;
            return normal == 0   ? vec(at, u, v)
                   : normal == 1 ? vec(u, at, v)
                   : normal == 2 ? vec(u, v, at)
                                 : vec(u + at, u, v);
        };
        const auto coordinate = [&] { return std::ldexp(static_cast<double>(random() % 4096) - 2048, -8); };
        Vec3 p[5];
        for (Vec3 &q : p) {
            const double u = coordinate(), v = coordinate();
            q = in_plane(u, v);
        }
        if (!has_area(p[0], p[1], p[2]) || p[3] == p[4]) continue;
        TriangleHit hit = {Real(0), Real(0), Real(0)};
        met += intersect(TriangleRay(p[3], p[4] - p[3]), p[0], p[1], p[2], hit) ? 1 : 0;
        met += intersect(TriangleRay(p[3], p[0] - p[3]), p[0], p[1], p[2], hit) ? 1 : 0; // at a corner
        met += intersect(TriangleRay(p[0], p[1] - p[0]), p[0], p[1], p[2], hit) ? 1 : 0; // along an edge
    }
    CHECK(met == 0);
}

} // namespace wisp::WISP_ARITH
