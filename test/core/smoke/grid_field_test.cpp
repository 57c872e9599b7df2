// Density grids and boxes against the definition: every sample's tent summed in double, integrated piece by piece.
#include "support/built_smoke.h"
#include "support/worst.h"
#include <doctest/doctest.h>
#include <functional>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

Double3 operator+(const Double3 &a, const Double3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Double3 operator-(const Double3 &a, const Double3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Double3 operator*(const Double3 &a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(const Double3 &a, const Double3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double norm(const Double3 &a) { return std::sqrt(dot(a, a)); }
Double3 doubles(const Vec3 &v) { return {at(v.x), at(v.y), at(v.z)}; }
Vec3 vec(const Double3 &v) { return vec_of(v); }

// The tent of sample i of `count`, at u cells from the first cell's outer wall. Outside the samples' centres the
// nearest centre stands for the point.
double tent(double u, int i, int count) {
    const double centered = std::min(std::max(u, 0.5), count - 0.5);
    return std::max(0.0, 1 - std::fabs(centered - (i + 0.5)));
}

// A grid by its definition, in double.
struct Grid {
    int n[3];
    std::vector<float> density;
    double sigma; // sigma_t of density 1
    Double3 center, half;
    Double3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

    Grid(int nx, int ny, int nz, double sigma_, const Double3 &center_, const Double3 &half_, uint64_t seed)
        : n{nx, ny, nz}, density(static_cast<size_t>(nx * ny * nz)), sigma(sigma_), center(center_), half(half_) {
        Sequence next{seed};
        for (float &value : density) value = static_cast<float>(next() < 0.1 ? 0 : 2 * next());
    }
    // Rotates about (1, 2, 2) / 3 by the angle with cosine 0.6 and sine 0.8, which changes every coordinate.
    Grid rotated() const {
        Grid grid = *this;
        const double k[3] = {1.0 / 3, 2.0 / 3, 2.0 / 3};
        const auto image = [&](int i) {
            double v[3] = {0, 0, 0};
            for (int j = 0; j < 3; ++j) v[j] = k[j] * k[i] * 0.4;
            v[i] += 0.6;
            v[(i + 1) % 3] += 0.8 * k[(i + 2) % 3]; // k x e_i
            v[(i + 2) % 3] -= 0.8 * k[(i + 1) % 3];
            return Double3{v[0], v[1], v[2]};
        };
        for (int i = 0; i < 3; ++i) grid.axis[i] = image(i);
        return grid;
    }
    GridDescription source() const {
        GridDescription grid = {};
        grid.nx = n[0];
        grid.ny = n[1];
        grid.nz = n[2];
        grid.density = density.empty() ? nullptr : density.data();
        grid.extinction = sigma;
        grid.center = center;
        grid.half = half;
        for (int i = 0; i < 3; ++i) grid.axis[i] = axis[i];
        return grid;
    }

    double side(int i) const { return 2 * (i == 0 ? half.x : i == 1 ? half.y : half.z); }
    double edge(int i) const { return side(i) / n[i]; }
    // A point of the scene in cells from the lower walls.
    Double3 cells(const Double3 &x) const {
        const Double3 d = x - center;
        return {(dot(axis[0], d) + half.x) / edge(0), (dot(axis[1], d) + half.y) / edge(1),
                (dot(axis[2], d) + half.z) / edge(2)};
    }
    Double3 point(const Double3 &u) const {
        return center + axis[0] * (u.x * edge(0) - half.x) + axis[1] * (u.y * edge(1) - half.y) +
               axis[2] * (u.z * edge(2) - half.z);
    }
    double sample(int x, int y, int z) const {
        return density.empty() ? 1 : static_cast<double>(density[static_cast<size_t>((z * n[1] + y) * n[0] + x)]);
    }
    double at_cells(const Double3 &u) const { // u inside
        double sum = 0;
        for (int z = 0; z < n[2]; ++z)
            for (int y = 0; y < n[1]; ++y)
                for (int x = 0; x < n[0]; ++x)
                    sum += sample(x, y, z) * tent(u.x, x, n[0]) * tent(u.y, y, n[1]) * tent(u.z, z, n[2]);
        return sum * sigma;
    }
    // The distance from the nearest wall, in cells; negative outside.
    double inside(const Double3 &u) const { return std::min({u.x, u.y, u.z, n[0] - u.x, n[1] - u.y, n[2] - u.z}); }
    double largest() const {
        double value = density.empty() ? 1 : 0;
        for (float d : density) value = std::max(value, static_cast<double>(d));
        return value * sigma;
    }

    // Clips the ray to the box, up to `end`; false if nothing is left.
    bool clipped(const Double3 &origin, const Double3 &direction, double &begin, double &end) const {
        const Double3 a = cells(origin), b = cells(origin + direction);
        const double from[3] = {a.x, a.y, a.z}, slope[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
        begin = 0;
        for (int i = 0; i < 3; ++i) {
            if (slope[i] == 0 && !(from[i] >= 0 && from[i] <= n[i])) return false;
            if (slope[i] == 0) continue;
            begin = std::max(begin, ((slope[i] > 0 ? 0 : n[i]) - from[i]) / slope[i]);
            end = std::min(end, ((slope[i] > 0 ? n[i] : 0) - from[i]) / slope[i]);
        }
        return begin < end;
    }
    // Between the planes of samples the density along the ray is a cubic, which Simpson's rule integrates exactly.
    double depth(const Double3 &origin, const Double3 &direction, double end) const {
        double begin;
        if (!clipped(origin, direction, begin, end)) return 0;
        const Double3 a = cells(origin), b = cells(origin + direction);
        const double from[3] = {a.x, a.y, a.z}, slope[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
        std::vector<double> cuts = {begin, end};
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < n[i] && slope[i] != 0; ++k) {
                const double t = (k + 0.5 - from[i]) / slope[i];
                if (t > begin && t < end) cuts.push_back(t);
            }
        std::sort(cuts.begin(), cuts.end());
        double sum = 0;
        for (size_t i = 1; i < cuts.size(); ++i) {
            const double t0 = cuts[i - 1], t1 = cuts[i];
            const auto value = [&](double t) { return at_cells(cells(origin + direction * t)); };
            sum += (t1 - t0) / 6 * (value(t0) + 4 * value(0.5 * (t0 + t1)) + value(t1));
        }
        return sum;
    }

    // The rounding error of a point in the frame: 9 operations on coordinates of this size (6 of the rotation, the
    // axes' own rounding, the subtraction of the wall, and a ray's step).
    double position_error(double reach) const { return 9 * unit_error * (1 + reach); }
    // The resulting error of a value: that of the point in cells, whose reciprocal edge is rounded too, and 9
    // operations on the value. A value changes by at most the largest sample per cell and axis.
    double value_error(double reach) const {
        double cells_off = 0;
        for (int i = 0; i < 3; ++i)
            cells_off += (position_error(reach) + 2 * unit_error * side(i)) / std::min(1.0, edge(i));
        return largest() * cells_off + 9 * unit_error * (1 + largest());
    }
};

// Grids along the axes and rotated, with cells of any shape and with single layers; and boxes of one sample.
std::vector<Grid> grids() {
    const Grid uneven(5, 4, 3, 0.75, {0.5, -1.25, 2}, {2, 1.5, 0.75}, 1), odd(3, 7, 5, 1.3, {0, 0, 0}, {1, 1, 1}, 2),
        layer(6, 1, 4, 2, {-3, 0.125, 1}, {1.5, 0.4, 2}, 3);
    Grid box(1, 1, 1, 0.9, {1, 0.5, -0.25}, {1, 0.75, 1.5}, 4);
    box.density.clear();
    Grid ends(4, 3, 2, 3, {0, 0, 0}, {2, 1.5, 1}, 5); // no smoke in the first samples and in the last
    for (size_t i = 0; i < 3; ++i) ends.density[i] = ends.density[ends.density.size() - 1 - i] = 0;
    return {uneven, uneven.rotated(), odd, odd.rotated(), layer, layer.rotated(), box, box.rotated(), ends};
}

Double3 random_unit(Sequence &next) {
    for (;;) {
        const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
        const Double3 v = {x, y, z};
        if (norm(v) > 0.1 && norm(v) < 1) return v * (1 / norm(v));
    }
}
// A point in the box of the grid, enlarged on each side by `margin` of its edges.
Double3 random_point(const Grid &grid, Sequence &next, double margin = 0) {
    double u[3];
    for (int i = 0; i < 3; ++i) u[i] = grid.n[i] * ((1 + 2 * margin) * next() - margin);
    return grid.point({u[0], u[1], u[2]});
}

// The error of a wall's position and of its crossing along the ray, which grows as the ray's slope decreases.
double crossing_error(const Grid &grid, const Double3 &origin, const Double3 &direction, double end) {
    double slowest = 1;
    for (const Double3 &axis : grid.axis) {
        const double speed = std::fabs(dot(axis, direction));
        if (speed > 0) slowest = std::min(slowest, speed);
    }
    return grid.position_error(norm(origin - grid.center) + norm(grid.half) + std::min(end, 100.0)) / slowest;
}

constexpr uint64_t keys = 6000;

bool collides(const GridField &field, const Ray &ray, Real end, Event event, Real &distance) {
    const Collision collision = first_collision(field, ray, end, event);
    distance = collision.distance;
    return collision.found;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a grid's density is the sum of all samples' tents") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        REQUIRE(built.field.ready);
        Sequence next;
        int inside = 0, outside = 0;
        for (int i = 0; i < 1500; ++i) {
            const Vec3 x = vec(random_point(grid, next, 0.2));
            const Double3 u = grid.cells(doubles(x));
            const double reach = norm(doubles(x) - grid.center), wall = grid.inside(u);
            if (std::fabs(wall) * grid.edge(0) < 100 * grid.position_error(reach)) continue;
            const double found = at(extinction(built.field, x));
            if (wall < 0) {
                ++outside;
                CHECK(found == 0);
                continue;
            }
            ++inside;
            CHECK(std::fabs(found - grid.at_cells(u)) < grid.value_error(reach));
        }
        CHECK(inside > 300);
        CHECK(outside > 300);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a grid's density is exact on samples, even in the border's half cells, 0 outside") {
    // Edges are powers of two, so that nothing is rounded.
    const Grid grid(4, 2, 8, 0.5, {1, -2, 0.5}, {2, 0.5, 1}, 9);
    const BuiltGrid built(grid.source());
    const auto value = [&](double x, double y, double z) {
        return at(extinction(built.field, vec(grid.point({x, y, z}))));
    };
    const double beyond = 0x1p-18; // in cells
    for (int z = 0; z < grid.n[2]; ++z)
        for (int y = 0; y < grid.n[1]; ++y)
            for (int x = 0; x < grid.n[0]; ++x) {
                const double expected = at(real(grid.sigma) * real(grid.sample(x, y, z)));
                CHECK(value(x + 0.5, y + 0.5, z + 0.5) == expected);
                // From the border's samples outwards, to the wall and to the corner.
                const double to_x = x == 0 ? 0 : x == grid.n[0] - 1 ? grid.n[0] : x + 0.5;
                const double to_y = y == 0 ? 0 : y == grid.n[1] - 1 ? grid.n[1] : y + 0.5;
                const double to_z = z == 0 ? 0 : z == grid.n[2] - 1 ? grid.n[2] : z + 0.5;
                CHECK(value(to_x, y + 0.5, z + 0.5) == expected);
                CHECK(value(to_x, to_y, to_z) == expected);
                CHECK(value(0.75 * to_x + 0.25 * (x + 0.5), to_y, 0.5 * to_z + 0.5 * (z + 0.5)) == expected);
            }
    for (double u = 0.5; u < 2; u += 0.5) {
        CHECK(value(-beyond, u, u) == 0);
        CHECK(value(4 + beyond, u, u) == 0);
        CHECK(value(u, -beyond, u) == 0);
        CHECK(value(u, 2 + beyond, u) == 0);
        CHECK(value(u, u, -beyond) == 0);
        CHECK(value(u, u, 8 + beyond) == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a grid of equal samples is exactly constant") {
    for (Grid grid : grids()) {
        std::fill(grid.density.begin(), grid.density.end(), 0.7f);
        const BuiltGrid built(grid.source());
        const Real sigma = built.field.extinction[0];
        CHECK(at(sigma) == doctest::Approx(grid.largest()).epsilon(4 * unit_error));
        Sequence next;
        for (int i = 0; i < 300; ++i) {
            const Vec3 x = vec(random_point(grid, next, -0.01));
            CHECK(extinction(built.field, x) == sigma);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a grid's bounds are those of its rotated corners") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        Double3 low = {1e9, 1e9, 1e9}, high = low * -1;
        for (int corner = 0; corner < 8; ++corner) {
            const Double3 p = grid.point(
                {corner & 1 ? grid.n[0] + 0.0 : 0, corner & 2 ? grid.n[1] + 0.0 : 0, corner & 4 ? grid.n[2] + 0.0 : 0});
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        const double error = grid.position_error(norm(grid.center) + norm(grid.half));
        CHECK(norm(doubles(built.field.bounds.low) - low) < error);
        CHECK(norm(doubles(built.field.bounds.high) - high) < error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a grid's optical depth is the integral of its density") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        Sequence next;
        int met = 0;
        for (int i = 0; i < 400; ++i) {
            // From outside through a point inside; from inside; and up to an end inside.
            const Vec3 direction = vec(random_unit(next));
            const Double3 target = random_point(grid, next);
            const Vec3 origin = vec(target - doubles(direction) * (i % 2 ? 0 : 8));
            const Real end = real(i % 3 == 0 ? 0.75 + (i % 2 ? 0 : 8) : 100);
            const Ray ray = {origin, direction};
            const double expected = grid.depth(doubles(origin), doubles(direction), at(end));
            const double found = at(optical_depth(built.field, ray, end));
            const double reach = norm(doubles(origin) - grid.center) + norm(grid.half);
            // Values along the ray, and at both ends.
            const double length = 2 * norm(grid.half);
            const double bar = length * grid.value_error(reach) +
                               4 * grid.largest() * crossing_error(grid, doubles(origin), doubles(direction), at(end)) +
                               40 * unit_error * (1 + expected);
            CHECK(std::fabs(found - expected) < bar);
            met += expected > 0.01;
        }
        CHECK(met > 300);
    }
}

TEST_CASE(WISP_ARITH_NAME ": rays along a grid's axes have the integral of its density") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        Sequence next;
        for (int i = 0; i < 120; ++i) {
            const int along = i % 3;
            double u[3];
            for (int k = 0; k < 3; ++k) u[k] = grid.n[k] * (0.01 + 0.98 * next());
            u[along] = i % 2 ? -2 : grid.n[along] + 2;
            const Vec3 direction = vec(grid.axis[along] * (i % 2 ? 1 : -1)),
                       origin = vec(grid.point({u[0], u[1], u[2]}));
            const double reach = norm(doubles(origin) - grid.center) + norm(grid.half);
            CHECK(std::fabs(at(optical_depth(built.field, {origin, direction}, Real(100))) -
                            grid.depth(doubles(origin), doubles(direction), 100)) <
                  grid.side(along) * grid.value_error(reach) + 4 * grid.largest() * grid.position_error(reach));
            CHECK(optical_depth(built.field, {origin, -direction}, Real(100)) == Real(0));
            CHECK(optical_depth(built.field, {origin, direction}, real(1.9 * grid.edge(along))) == Real(0));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": rays along walls and planes of samples, and just outside") { // E7
    // Edges are powers of two: a point on a wall is exactly on it in every arithmetic.
    const Grid grid(4, 2, 8, 0.5, {1, -2, 0.5}, {2, 0.5, 1}, 9);
    const BuiltGrid built(grid.source());
    const double out = 0x1p-18; // in cells
    int met = 0, missed = 0;
    for (int along = 0; along < 3; ++along) {
        const int a = (along + 1) % 3, b = (along + 2) % 3;
        std::vector<double> positions[2];
        for (int j : {a, b}) {
            std::vector<double> &list = positions[j == a ? 0 : 1];
            for (double u = 0; u <= grid.n[j]; u += 0.5) list.push_back(u);
            list.push_back(-out);
            list.push_back(grid.n[j] + out);
        }
        for (double from : {-1.0, 0.0, 0.5, 1.0, grid.n[along] + 1.0})
            for (double ua : positions[0])
                for (double ub : positions[1])
                    for (int sign : {1, -1}) {
                        double u[3], v[3] = {0, 0, 0};
                        u[a] = ua;
                        u[b] = ub;
                        u[along] = from;
                        v[along] = sign;
                        const Double3 origin = grid.point({u[0], u[1], u[2]}), direction = {v[0], v[1], v[2]};
                        const double expected = grid.depth(origin, direction, 100);
                        CHECK(std::fabs(at(optical_depth(built.field, {vec(origin), vec(direction)}, Real(100))) -
                                        expected) < 40 * unit_error * (1 + expected));
                        ++(expected > 0 ? met : missed);
                    }
    }
    CHECK(met > 500);
    CHECK(missed > 500);
}

TEST_CASE(WISP_ARITH_NAME ": a grazing ray takes no more than the corner that it cuts") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        // Rays across the edge between two walls, at decreasing distances from it; the chord is a few distances long.
        for (int i = 2; i < 40; ++i) {
            const double near = std::ldexp(1.0, -i);
            const Double3 touched = grid.point({near / grid.edge(0), near / grid.edge(1), grid.n[2] * 0.4});
            const Double3 across = (grid.axis[0] - grid.axis[1]) * std::sqrt(0.5);
            const Vec3 direction = vec(across), origin = vec(touched - across * 4);
            const double found = at(optical_depth(built.field, {origin, direction}, Real(100)));
            const double expected = grid.depth(doubles(origin), doubles(direction), 100);
            const double reach = 4 + norm(grid.half);
            const double bar = 2 * near * grid.value_error(reach) +
                               4 * grid.largest() * crossing_error(grid, doubles(origin), doubles(direction), 100);
            CHECK(found >= 0);
            CHECK(std::fabs(found - expected) < bar);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a box's optical depth is its extinction times the chord") {
    Grid box(1, 1, 1, 0.8125, {0.5, 0, -1}, {1, 2, 0.5}, 1);
    box.density.clear();
    const BuiltGrid built(box.source());
    // Axis by axis nothing is rounded.
    CHECK(at(optical_depth(built.field, {vec(-4, 0.5, -1.25), vec(1, 0, 0)}, Real(100))) == 2 * 0.8125);
    CHECK(at(optical_depth(built.field, {vec(1, 8, -1.25), vec(0, -1, 0)}, Real(100))) == 4 * 0.8125);
    CHECK(at(optical_depth(built.field, {vec(1, 1, -1.25), vec(0, 0, 1)}, Real(100))) == 0.75 * 0.8125);
    CHECK(at(optical_depth(built.field, {vec(1, 1, -1.25), vec(0, 0, 1)}, real(0.5))) == 0.5 * 0.8125);
    CHECK(at(optical_depth(built.field, {vec(-4, 2, -0.5), vec(1, 0, 0)}, Real(100))) == 2 * 0.8125); // along an edge
    // Oblique: the chord in double.
    for (const Grid &grid : {box, box.rotated()}) {
        const BuiltGrid rotated(grid.source());
        Sequence next;
        for (int i = 0; i < 300; ++i) {
            const Vec3 direction = vec(random_unit(next)),
                       origin = vec(random_point(grid, next) - doubles(direction) * 6);
            double begin, end = 100;
            REQUIRE(grid.clipped(doubles(origin), doubles(direction), begin, end));
            CHECK(std::fabs(at(optical_depth(rotated.field, {origin, direction}, Real(100))) - 0.8125 * (end - begin)) <
                  2 * 0.8125 * crossing_error(grid, doubles(origin), doubles(direction), 10) + 10 * unit_error);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": no density in a box is above its majorant, and the majorant is a sample's") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        const double far = 2 * (norm(grid.center) + norm(grid.half));
        CHECK(at(majorant(built.field, {vec(-far, -far, -far), vec(far, far, far)})) ==
              doctest::Approx(grid.largest()).epsilon(4 * unit_error));
        CHECK(majorant(built.field, {vec(far, -1, -1), vec(far + 1, 1, 1)}) == Real(0));
        CHECK(majorant(built.field, {vec(-1, -far - 1, -1), vec(1, -far, 1)}) == Real(0));
        CHECK(majorant(built.field, {vec(-1, -1, far), vec(1, 1, far + 1)}) == Real(0));

        Sequence next;
        const bool upright = grid.axis[0].x == 1;
        for (int i = 0; i < 150; ++i) {
            const Double3 middle = random_point(grid, next, 0.1);
            const double a = next(), b = next(), c = next();
            const Double3 reach = {a * grid.edge(0), b * grid.edge(1), c * grid.edge(2)};
            const Box box = {vec(middle - reach), vec(middle + reach)};
            const double bound = at(majorant(built.field, box));
            const Double3 low = doubles(box.low), high = doubles(box.high);
            for (int k = 0; k < 60; ++k) {
                const double s[3] = {next(), next(), next()};
                const auto corner = [&](int j) { return k < 8 ? (k >> j & 1) + 0.0 : s[j]; };
                const Vec3 x = vec(low.x + corner(0) * (high.x - low.x), low.y + corner(1) * (high.y - low.y),
                                   low.z + corner(2) * (high.z - low.z));
                const double sigma = at(extinction(built.field, x));
                CHECK(sigma <= bound + grid.value_error(norm(doubles(x) - grid.center)));
            }
            if (!upright) continue;
            // The majorant is the largest of the samples whose tents reach into the box.
            const Double3 u0 = grid.cells(low), u1 = grid.cells(high);
            double expected = 0;
            const auto reaches = [](double from, double to, int j, int count) {
                return to > (j == 0 ? 0 : j - 0.5) && from < (j == count - 1 ? count : j + 1.5);
            };
            for (int z = 0; z < grid.n[2]; ++z)
                for (int y = 0; y < grid.n[1]; ++y)
                    for (int x = 0; x < grid.n[0]; ++x)
                        if (reaches(u0.x, u1.x, x, grid.n[0]) && reaches(u0.y, u1.y, y, grid.n[1]) &&
                            reaches(u0.z, u1.z, z, grid.n[2]))
                            expected = std::max(expected, grid.sample(x, y, z) * grid.sigma);
            CHECK(bound == doctest::Approx(expected).epsilon(4 * unit_error));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": the sample of a collision is drawn in proportion to its tent's value") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        Sequence next{9};
        const Double3 direction = random_unit(next);
        const Ray ray = {vec(grid.center - direction * 6), vec(direction)};
        std::vector<double> expected(grid.density.empty() ? 1 : grid.density.size()), hits(expected.size());
        double found = 0;
        for (uint64_t i = 0; i < 4000; ++i) {
            const Collision c = first_collision(built.field, ray, Real(100), photon_event(i, 3));
            if (!c.found) continue;
            ++found;
            REQUIRE(c.element < hits.size());
            ++hits[c.element];
            const Double3 u = grid.cells(doubles(ray.origin + ray.direction * c.distance));
            const double all = grid.at_cells(u);
            for (int z = 0, k = 0; z < grid.n[2]; ++z)
                for (int y = 0; y < grid.n[1]; ++y)
                    for (int x = 0; x < grid.n[0] && k < int(expected.size()); ++x, ++k)
                        expected[size_t(k)] += grid.sigma * grid.sample(x, y, z) * tent(u.x, x, grid.n[0]) *
                                               tent(u.y, y, grid.n[1]) * tent(u.z, z, grid.n[2]) / all;
        }
        REQUIRE(found > 500);
        for (size_t k = 0; k < hits.size(); ++k) // a sum of Bernoulli draws
            CHECK(std::fabs(hits[k] - expected[k]) < 4.5 * std::sqrt(expected[k]) + 1);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the optical depth up to a grid's collision is exponential") { // N-E3
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        Sequence next{7};
        const Double3 direction = random_unit(next), middle = grid.center;
        for (const Ray &ray :
             {Ray{vec(middle - direction * 6), vec(direction)}, Ray{vec(middle), vec(direction * -1)}}) {
            const double whole = at(optical_depth(built.field, ray, Real(100)));
            REQUIRE(whole > 0.2);
            std::vector<double> depths;
            double worst = 0;
            for (uint64_t i = 0; i < keys; ++i) {
                Real distance = Real(-1);
                if (!collides(built.field, ray, Real(100), photon_event(i, 9), distance)) continue;
                REQUIRE(distance >= Real(0));
                depths.push_back(at(optical_depth(built.field, ray, distance)));
                // The depth that was drawn, up to the rounding of the distance and of the sum over cells.
                const double drawn = -std::log1p(-at(unit_open<Real>(draw(photon_event(i, 9), 0))));
                worst = worst_of(worst, std::fabs(depths.back() - drawn));
            }
            const double n = double(keys), hit = 1 - std::exp(-whole);
            CHECK(std::fabs(double(depths.size()) / n - hit) < 4 * std::sqrt(hit * (1 - hit) / n));
            CHECK(distance_from_exponential(depths, whole) < 1.95);
            CHECK(worst < 2 * grid.largest() * grid.position_error(6) + 40 * unit_error * (1 + whole));
            // A flight that ends before the collision has none; one that ends behind it has the same.
            Real distance, again;
            for (uint64_t i = 0; i < 50; ++i) {
                if (!collides(built.field, ray, Real(100), photon_event(i, 9), distance)) continue;
                const double margin = 1e-3;
                CHECK(!collides(built.field, ray, distance - real(margin), photon_event(i, 9), again));
                REQUIRE(collides(built.field, ray, distance + real(margin), photon_event(i, 9), again));
                CHECK(std::fabs(at(again - distance)) < margin);
            }
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": no draw gives a grid an endless path or one through a wall of smoke") { // B1, B2
    Grid grid(3, 3, 3, 20000, {0, 0, 0}, {1, 1, 1}, 5);
    std::fill(grid.density.begin(), grid.density.end(), 1.0f);
    Grid empty = grid, box = grid, islet = grid;
    std::fill(empty.density.begin(), empty.density.end(), 0.0f);
    box.density.clear();
    std::fill(islet.density.begin(), islet.density.end() - 1, 0.0f); // one sample in a corner
    const BuiltGrid nothing(empty.source()), wall(grid.source()), solid(box.source()), corner(islet.source());
    const Ray ray = {vec(-5, -0.25, 0.125), vec(1, 0, 0)}, through = {vec(-5, 0.75, 0.75), vec(1, 0, 0)};
    for (uint64_t key = 0; key < 1000; ++key) {
        Real distance;
        CHECK(!collides(nothing.field, ray, Real(20), photon_event(key, 1), distance));
        CHECK(!collides(corner.field, ray, Real(20), photon_event(key, 1), distance));
        for (const BuiltGrid *thick : {&wall, &solid}) {
            REQUIRE(collides(thick->field, ray, Real(20), photon_event(key, 1), distance));
            CHECK(std::fabs(at(distance) - 4) < 25.0 / 20000 + 10 * 5 * unit_error); // -ln xi is below 25
        }
        // The tent of the corner's sample begins at the middle one's centre.
        REQUIRE(collides(corner.field, through, Real(20), photon_event(key, 1), distance));
        CHECK(at(distance) > 5 - 100 * unit_error);
        CHECK(at(distance) < 6);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a walk visits the cells along a ray once each, in order, and no length twice") {
    const Lattice lattices[] = {make_lattice(vec(-1, 0.5, -2), vec(0.5, 0.25, 1), {7, 9, 4}),
                                make_lattice(vec(-3, -3, -3), vec(0.7, 1.1, 0.3), {8, 5, 19}),
                                make_lattice(vec(0, 0, 0), vec(1, 1, 1), {1, 1, 1})};
    for (const Lattice &lattice : lattices) {
        const Vec3 count(Real(lattice.count.x), Real(lattice.count.y), Real(lattice.count.z));
        const Box box = {lattice.low, lattice.low + lattice.edge * count};
        Sequence next;
        int walks = 0;
        for (int i = 0; i < 1500; ++i) {
            double p[3], v[3] = {0, 0, 0};
            for (int k = 0; k < 3; ++k) {
                const double cells = next() * at(count[k]); // a third of them on planes between cells
                p[k] = at(lattice.low[k]) + at(lattice.edge[k]) * (i % 3 ? cells : std::floor(cells + 0.5));
            }
            Double3 direction = random_unit(next);
            if (i % 4 == 1) { // along an axis
                v[i / 4 % 3] = i / 12 % 2 ? 1 : -1;
                direction = {v[0], v[1], v[2]};
            } else if (i % 4 == 2) { // in a plane of axes
                (i / 4 % 3 == 0 ? direction.x : i / 4 % 3 == 1 ? direction.y : direction.z) = 0;
                direction = direction * (1 / norm(direction));
            } else if (i % 4 == 3) { // all but along a plane
                (i / 4 % 3 == 0 ? direction.x : i / 4 % 3 == 1 ? direction.y : direction.z) = unit_error * 3;
            }
            const double back = i % 5 ? 0 : 3;
            const Ray ray = {vec(p[0], p[1], p[2]) - vec(direction) * real(back), vec(direction)};
            Real begin = Real(0), end = Real(100);
            if (!clip(box, ray, begin, end)) continue;
            if (i % 7 == 0) end = begin + (end - begin) * real(0.6);
            if (i % 11 == 0) begin = begin + (end - begin) * real(0.3);
            if (i % 13 == 0) end += real(20 * unit_error); // an end just behind the wall
            ++walks;

            // The error of a position along one axis, for any slope: the wall's, the ray's and the quotient's
            // rounding.
            const double tolerance =
                10 * unit_error * (1 + 2 * norm(doubles(box.high - box.low)) + 3 + norm(doubles(lattice.low)));
            Real reached = begin;
            Cell before = {-1, -1, -1};
            bool sound = true, ordered = true;
            for_each_cell(lattice, ray, begin, end, [&](const Cell &cell, Real from, Real to) {
                if (from != reached || !(from < to)) sound = false;
                reached = to;
                const int32_t c[3] = {cell.x, cell.y, cell.z}, b[3] = {before.x, before.y, before.z};
                bool moved = false;
                for (int k = 0; k < 3; ++k) {
                    if (c[k] < 0 || Real(c[k]) >= count[k]) sound = false;
                    const double wall = at(lattice.low[k]) + c[k] * at(lattice.edge[k]);
                    for (Real t : {from, to}) {
                        const double x = at(ray.origin[k]) + at(t) * at(ray.direction[k]);
                        if (x < wall - tolerance || x > wall + at(lattice.edge[k]) + tolerance) sound = false;
                    }
                    if (before.x >= 0 && c[k] != b[k]) {
                        moved = true;
                        if ((c[k] > b[k]) != (ray.direction[k] > Real(0))) ordered = false;
                    }
                }
                if (before.x >= 0 && !moved) ordered = false;
                before = cell;
                return true;
            });
            CHECK(sound);
            CHECK(ordered);
            CHECK(reached == end);

            int visits = 0; // a visitor that returns false is not called again
            for_each_cell(lattice, ray, begin, end, [&](const Cell &, Real, Real) { return ++visits < 2; });
            CHECK(visits <= 2);
        }
        CHECK(walks > 800);
    }
}

namespace {

// Chi-square of points against the density. The bins lie between the planes of samples and the walls of cells. The
// density is trilinear in a bin, so its integral is the value at the middle times the volume.
void check_points(const Grid &grid, int number, const std::function<Double3(int)> &point) {
    const int nx = 2 * grid.n[0], ny = 2 * grid.n[1], nz = 2 * grid.n[2];
    std::vector<double> found(static_cast<size_t>(nx * ny * nz)), expected = found;
    double whole = 0, outside = 0;
    for (int i = 0; i < nx * ny * nz; ++i)
        whole += expected[size_t(i)] =
            grid.at_cells({(i % nx + 0.5) / 2, (i / nx % ny + 0.5) / 2, (i / nx / ny + 0.5) / 2});
    for (int i = 0; i < number; ++i) {
        const Double3 u = grid.cells(point(i));
        const int x = int(std::floor(2 * u.x)), y = int(std::floor(2 * u.y)), z = int(std::floor(2 * u.z));
        if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) {
            outside += grid.inside(u) < -10 * grid.position_error(norm(grid.half)) / grid.edge(0) ? 1 : 0;
            continue;
        }
        found[size_t((z * ny + y) * nx + x)] += 1;
    }
    CHECK(outside == 0);
    double chi_square = 0, freedom = -1;
    for (size_t i = 0; i < found.size(); ++i) {
        const double mean = number * expected[i] / whole;
        if (mean == 0) CHECK(found[i] == 0);
        if (mean < 5) continue;
        chi_square += (found[i] - mean) * (found[i] - mean) / mean;
        freedom += 1;
    }
    CHECK(freedom >= 7);
    CHECK(std::fabs(chi_square - freedom) < 4 * std::sqrt(2 * freedom));
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": points around samples are spread as the density") {
    for (const Grid &grid : grids()) {
        const BuiltGrid built(grid.source());
        std::vector<double> before = {0};
        for (uint64_t i = 0; i < samples_of_box(grid.source()); ++i)
            before.push_back(before.back() + (grid.density.empty() ? 1 : static_cast<double>(grid.density[i])));
        check_points(grid, 40000, [&](int i) {
            const Event event = photon_event(uint64_t(i), 3);
            const double target = draw(event, 0) * 0x1p-32 * before.back();
            const auto above = std::upper_bound(before.begin(), before.end(), target);
            const Vec3 uniform(unit_open<Real>(draw(event, 1)), unit_open<Real>(draw(event, 2)),
                               unit_open<Real>(draw(event, 3)));
            return doubles(point_of_sample(built.field, static_cast<uint32_t>(above - before.begin() - 1), uniform));
        });
    }
}

TEST_CASE(WISP_ARITH_NAME ": a grid emits in proportion to its density, uniformly in all directions") { // S2
    for (const Grid &grid : grids()) {
        SmokeDescription source = grid_smoke_of(grid.source());
        source.emission = {1, 1, 1};
        const BuiltMedium built({source});
        REQUIRE(built.medium.ready);
        const int n = 20000;
        Double3 mean = {0, 0, 0}, square = mean;
        check_points(grid, n, [&](int i) {
            const Photon photon =
                emit_from_smoke(built.medium.smokes[0], Color(Real(1)), photon_event(uint64_t(i) * 7919, 0));
            const Double3 d = doubles(photon.ray.direction);
            mean = mean + d * (1.0 / n);
            square = square + Double3{d.x * d.x, d.y * d.y, d.z * d.z} * (1.0 / n);
            return doubles(photon.ray.origin);
        });
        // A component of a uniform direction has mean 0 and mean square 1/3, with variances 1/3 and 4/45.
        for (double m : {mean.x, mean.y, mean.z}) CHECK(std::fabs(m) < 4 * std::sqrt(1.0 / 3 / n));
        for (double s : {square.x, square.y, square.z}) CHECK(std::fabs(s - 1.0 / 3) < 4 * std::sqrt(4.0 / 45 / n));
        // 4 pi (1 - albedo) L_e times the integral of sigma_t, which is the mean over the pieces' middles.
        double whole = 0;
        const Double3 cell = {0.5 * grid.edge(0), 0.5 * grid.edge(1), 0.5 * grid.edge(2)};
        for (int z = 0; z < 2 * grid.n[2]; ++z)
            for (int y = 0; y < 2 * grid.n[1]; ++y)
                for (int x = 0; x < 2 * grid.n[0]; ++x)
                    whole += grid.at_cells({(x + 0.5) / 2, (y + 0.5) / 2, (z + 0.5) / 2}) * cell.x * cell.y * cell.z;
        CHECK(at(built.medium.smokes[0].emitted_power.x) ==
              doctest::Approx(4 * 3.14159265358979 * 0.1 * whole).epsilon(10 * unit_error));
    }
}

TEST_CASE(WISP_ARITH_NAME ": the sphere around a medium holds the corners of its grids") {
    for (const Grid &grid : grids()) {
        const auto particles = cloud(5, 0.5, 0.25, 1);
        const BuiltMedium built({smoke_of(particles), grid_smoke_of(grid.source())});
        const Double3 center = doubles(built.medium.sphere.center);
        for (int corner = 0; corner < 8; ++corner) {
            const Double3 p = grid.point(
                {corner & 1 ? grid.n[0] + 0.0 : 0, corner & 2 ? grid.n[1] + 0.0 : 0, corner & 4 ? grid.n[2] + 0.0 : 0});
            CHECK(norm(p - center) < at(built.medium.sphere.radius) + grid.position_error(10));
        }
    }
}
