// Shapes as triangles: spheres and cones are closed, as near to the true surface as promised and smooth; the triangles
// of a polygon are the polygon, whatever its outline does.
#include "host/base/double3_algebra.h"
#include "host/scene/tessellate.h"
#include "support/data.h"
#include "support/random_input.h"
#include <algorithm>
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>

using namespace wisp;

namespace {

// ---- Spheres and cones

// Each edge of the rows, from its first corner to its second.
std::multiset<std::pair<uint32_t, uint32_t>> edges_of(const Mesh &mesh) {
    std::multiset<std::pair<uint32_t, uint32_t>> edges;
    for (const Mesh::Row &row : mesh.rows)
        for (size_t k = 0; k < 3; ++k) edges.insert({row.corner[k], row.corner[(k + 1) % 3]});
    return edges;
}

std::array<Double3, 3> corners_of(const Mesh &mesh, const Mesh::Row &row) {
    return {mesh.positions[row.corner[0]], mesh.positions[row.corner[1]], mesh.positions[row.corner[2]]};
}

Double3 normal_of(const std::array<Double3, 3> &c) { return cross(c[1] - c[0], c[2] - c[0]); }

// Distances of the surface from the origin.
struct Range {
    double low = 1e300, high = 0;
    void add(double x) {
        low = std::min(low, x);
        high = std::max(high, x);
    }
};

double distance(const Double3 &a, const Double3 &b) { return length(a - b); }

void check_cone(const Double3 &base, double base_radius, const Double3 &apex, double apex_radius) {
    const Mesh mesh = cone_mesh(base, base_radius, apex, apex_radius);
    const double r = std::fabs(base_radius), s = std::fabs(apex_radius), size = std::max(r, s);
    const Double3 axis = unit(apex - base);
    const double height = distance(apex, base);
    CHECK(mesh.rows.size() == (r == 0 || s == 0 ? 32 : 64));
    Range error;
    double volume = 0; // between the surface and the middle of the base
    for (const Mesh::Row &row : mesh.rows) {
        const auto corners = corners_of(mesh, row);
        const Double3 outwards = normal_of(corners);
        volume += dot(corners[0] - base, outwards) / 6;
        for (int i = 0; i <= 4; ++i)
            for (int j = 0; i + j <= 4; ++j) {
                const Double3 p =
                    corners[0] + (corners[1] - corners[0]) * (i / 4.0) + (corners[2] - corners[0]) * (j / 4.0);
                const double along = dot(p - base, axis), far = length(p - base - axis * along);
                error.add(1 + (far - (r + (s - r) * along / height)) / size);
            }
        for (size_t k = 0; k < 3; ++k) {
            const Double3 &normal = mesh.normals[row.normal[k]], p = corners[k] - base;
            const Double3 from_axis = p - axis * dot(p, axis), beside_axis = normal - axis * dot(normal, axis);
            CHECK(length(normal) == doctest::Approx(1).epsilon(1e-15));
            CHECK(dot(normal, outwards) > 0.9 * length(outwards));
            CHECK(std::fabs(dot(normal, axis) - (r - s) / std::hypot(height, r - s)) < 1e-14);
            const bool is_tip = (s == 0 && dot(p, axis) > height / 2) || (r == 0 && dot(p, axis) < height / 2);
            // Coordinates are rounded to 2^-53 of a length that may be a million times the radius.
            if (!is_tip) CHECK(distance(unit(from_axis), unit(beside_axis)) < 1e-9);
        }
    }
    CHECK(error.high < 1.0033);
    CHECK(error.low > 1 - 0.0017);
    // With the cap at the apex, which has the area of its circle, it is all.
    const double whole = pi<double> * height * (r * r + r * s + s * s) / 3;
    CHECK(volume + pi<double> * s * s * height / 3 == doctest::Approx(whole).epsilon(1e-12));
    // Open at the rings, shared elsewhere.
    size_t open = 0;
    const auto edges = edges_of(mesh);
    for (const auto &[a, b] : edges) {
        CHECK(edges.count({a, b}) == 1);
        open += edges.count({b, a}) == 0;
    }
    CHECK(open == (r > 0 ? 32 : 0) + (s > 0 ? 32 : 0));
}

// ---- Polygons

struct Point {
    double x, y;
};
using Outline = std::vector<Point>;

double area(const Point &a, const Point &b, const Point &c) {
    return ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
}

double area(const Outline &outline) {
    double sum = 0;
    for (size_t i = 1; i + 1 < outline.size(); ++i) sum += area(outline[0], outline[i], outline[i + 1]);
    return sum;
}

// Whether the edge passes to the right of p; the same for both directions.
bool passes(Point a, Point b, const Point &p) {
    if (a.y > b.y) std::swap(a, b);
    return a.y <= p.y && p.y < b.y && area(a, b, p) > 0;
}

bool is_inside(const Outline &outline, const Point &p) {
    bool inside = false;
    for (size_t i = 0; i < outline.size(); ++i)
        inside = inside != passes(outline[i], outline[(i + 1) % outline.size()], p);
    return inside;
}

// In a plane that is not along an axis; its normal is largest along x, y or z by `turned`. Whole coordinates stay
// exact: what is in line remains so.
std::vector<Double3> placed(const Outline &outline, int turned) {
    const Double3 right = {1, 0, 2}, up = {0, 1, -3};
    std::vector<Double3> points;
    for (const Point &p : outline) {
        const Double3 q = Double3{3, -2, 1} + right * p.x + up * p.y;
        points.push_back(turned == 0 ? q : turned == 1 ? Double3{q.y, q.z, q.x} : Double3{q.z, q.x, q.y});
    }
    return points;
}

// The triangles turn as the outline does, add up to its area, and random points are in one exactly when they are in it.
void check_rows(const Outline &outline, const std::vector<Mesh::Row> &rows, Random &random) {
    const double whole = area(outline);
    double sum = 0;
    Point low = outline[0], high = outline[0];
    for (const Point &p : outline) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    std::vector<Outline> triangles;
    for (const Mesh::Row &row : rows) {
        triangles.push_back({outline[row.corner[0]], outline[row.corner[1]], outline[row.corner[2]]});
        const double part = area(triangles.back());
        CHECK(part * whole > 0);
        sum += part;
    }
    CHECK(sum == doctest::Approx(whole).epsilon(1e-12));
    size_t inside = 0;
    for (int i = 0; i < 200; ++i) {
        const Point p = {random.between(low.x, high.x), random.between(low.y, high.y)};
        const auto hits = std::count_if(triangles.begin(), triangles.end(),
                                        [&p](const Outline &triangle) { return is_inside(triangle, p); });
        CHECK(hits == (is_inside(outline, p) ? 1 : 0));
        inside += is_inside(outline, p);
    }
    CHECK(inside > 0);
}

// Both ways round, in each plane. `lost` points add nothing.
void check_polygon(const Outline &outline, size_t lost = 0) {
    Random random;
    for (int turned = 0; turned < 3; ++turned) {
        Outline way = outline;
        for (int reversed = 0; reversed < 2; ++reversed) {
            const std::vector<Mesh::Row> rows = polygon_mesh(placed(way, turned), {}).rows;
            CHECK(rows.size() == outline.size() - 2 - lost);
            check_rows(way, rows, random);
            std::reverse(way.begin(), way.end());
        }
    }
}

size_t rows_of(const Outline &outline) {
    const size_t rows = polygon_mesh(placed(outline, 0), {}).rows.size();
    CHECK(rows <= std::max(outline.size(), size_t{2}) - 2);
    return rows;
}

Outline star(size_t count, double least, Random &random) {
    Outline outline;
    for (size_t i = 0; i < count; ++i) {
        double sine, cosine;
        sincos_turns(static_cast<double>(i) / static_cast<double>(count), sine, cosine);
        const double radius = random.between(least, 1);
        outline.push_back({radius * cosine, radius * sine});
    }
    return outline;
}

// Teeth on a back, all of the same height or not.
Outline comb(size_t teeth, Random &random) {
    Outline outline = {{static_cast<double>(teeth), -1}};
    for (size_t i = teeth; i-- > 0;) {
        outline.push_back({i + 0.9, random.between(1, 2)});
        outline.push_back({i + 0.5, random.between(-0.9, 0)});
    }
    outline.push_back({0, -1});
    return outline;
}

// Columns of whole heights, a point at each whole number of the outline: many in line, many with the same x or y.
Outline columns(size_t count, Random &random) {
    Outline outline;
    double height = 0;
    for (size_t i = 0; i <= count; ++i) {
        const double x = static_cast<double>(i), goal = i < count ? 1 + static_cast<double>(random.bits() % 6) : 0;
        for (; height < goal; ++height) outline.push_back({x, height});
        for (; height > goal; --height) outline.push_back({x, height});
        outline.push_back({x, height});
    }
    for (size_t i = count; i-- > 1;) outline.push_back({static_cast<double>(i), 0});
    std::reverse(outline.begin(), outline.end());
    return outline;
}

// A corridor that winds inwards.
Outline spiral(int count) {
    Outline outline;
    const auto add = [&](int i, double width) {
        double sine, cosine;
        sincos_turns(i / 17.0, sine, cosine);
        outline.push_back({(1 + 0.1 * i + width) * cosine, (1 + 0.1 * i + width) * sine});
    };
    for (int i = 0; i < count; ++i) add(i, 1);
    for (int i = count; i-- > 0;) add(i, 0);
    return outline;
}

// What surrounds triangles of a lattice that were joined to each other along one edge each: other edges that two of
// them share are slits, passed twice, and points are passed again and again.
Outline slit(int side, size_t triangles, Random &random) {
    using Corner = std::pair<int, int>;
    std::map<std::pair<Corner, Corner>, Corner> third; // of the triangle on the left of an edge
    const auto add = [&third](Corner a, Corner b, Corner c) {
        third[{a, b}] = c;
        third[{b, c}] = a;
        third[{c, a}] = b;
    };
    for (int x = 0; x < side; ++x)
        for (int y = 0; y < side; ++y) {
            add({x, y}, {x + 1, y}, {x, y + 1});
            add({x + 1, y}, {x + 1, y + 1}, {x, y + 1});
        }
    const auto take = [&third](Corner a, Corner b, Corner c) {
        third.erase({a, b});
        third.erase({b, c});
        third.erase({c, a});
    };
    const int middle = side / 2;
    std::vector<Corner> corners = {{middle, middle}, {middle + 1, middle}, {middle, middle + 1}};
    take(corners[0], corners[1], corners[2]);
    for (size_t tries = 0; tries < 20 * triangles && corners.size() < triangles + 2; ++tries) {
        const size_t i = random.bits() % corners.size();
        const Corner a = corners[i], b = corners[(i + 1) % corners.size()];
        const auto found = third.find({b, a});
        if (found == third.end()) continue;
        const Corner c = found->second;
        take(b, a, c);
        corners.insert(corners.begin() + static_cast<std::ptrdiff_t>(i) + 1, c);
    }
    Outline outline;
    for (const Corner &corner : corners) outline.push_back({corner.first * 1.0, corner.second * 1.0});
    return outline;
}

} // namespace

TEST_CASE("a sphere is closed, around the sphere's volume and within the error that is stated") {
    for (const bool fine : {true, false}) {
        const size_t triangles = sphere_triangles(fine);
        const Double3 center = {1, -2, 0.5};
        const Mesh mesh = sphere_mesh(center, 0.25, fine);
        CHECK(mesh.node == -1);
        CHECK(mesh.material == 0);
        CHECK(mesh.texture == -1);
        CHECK(mesh.rows.size() == triangles);
        CHECK(mesh.positions.size() == 2 + triangles / 2); // Euler
        const auto edges = edges_of(mesh);
        CHECK(edges.size() == 3 * triangles);
        for (const auto &[a, b] : edges) {
            CHECK(edges.count({a, b}) == 1);
            CHECK(edges.count({b, a}) == 1);
        }
        Range error;
        double volume = 0, smallest = 1e300, largest_area = 0;
        for (const Mesh::Row &row : mesh.rows) {
            CHECK(row.normal == row.corner);
            auto corners = corners_of(mesh, row);
            for (Double3 &corner : corners) corner = (corner - center) * 4;
            const Double3 outwards = normal_of(corners);
            const double nearest = dot(unit(outwards), corners[0]); // of its plane: the foot is in the triangle
            error.add(nearest);
            for (const Double3 &corner : corners) error.add(length(corner));
            volume += dot(corners[0], outwards) / 6;
            smallest = std::min(smallest, length(outwards));
            largest_area = std::max(largest_area, length(outwards));
        }
        CHECK(error.low > 1 - (fine ? 0.0024 : 0.0088));
        CHECK(error.low < 1 - (fine ? 0.0023 : 0.0087));
        CHECK(error.high < 1 + (fine ? 0.0051 : 0.0205));
        CHECK(error.high > 1 + (fine ? 0.0050 : 0.0195));
        CHECK(volume == doctest::Approx(four_pi<double> / 3).epsilon(1e-13));
        CHECK(largest_area < 1.2 * smallest);
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            CHECK(length(mesh.normals[i]) == doctest::Approx(1).epsilon(1e-15));
            CHECK(distance(unit(mesh.positions[i] - center), mesh.normals[i]) < 1e-14); // 2^-53 |center| / 0.25
        }
    }
}

TEST_CASE("a sphere seen from inside is the same sphere") {
    const Mesh a = sphere_mesh({1, 2, 3}, 4, true), b = sphere_mesh({1, 2, 3}, -4, true);
    for (size_t i = 0; i < a.positions.size(); ++i) CHECK(distance(a.positions[i], b.positions[i]) == 0);
    for (size_t i = 0; i < a.rows.size(); ++i) CHECK(a.rows[i].corner == b.rows[i].corner);
    CHECK(largest_component(a.normals[0] - b.normals[0]) == 0);
}

TEST_CASE("cones and cylinders are as near to the true surface as stated, open at their ends") {
    check_cone({0, 0, 0}, 1, {0, 0, 2}, 1);
    check_cone({0, 0, 0}, 1, {0, 0, -2}, 1);
    check_cone({1, 2, 3}, 0.5, {4, -1, 2}, 0.25);
    check_cone({1, 2, 3}, -0.25, {4, -1, 2}, -0.5);
    check_cone({0, 1, 0}, 1, {3, 1, 0}, 0);
    check_cone({0, 1, 0}, 0, {0, 4, 0}, 1);
    check_cone({0, 0, 0}, 1, {1e-9, 1, -1e-9}, 0.5); // almost along an axis
    check_cone({0, 0, 0}, 1e-3, {1000, 1000, 1000}, 1e-3);
}

TEST_CASE("at the tip of a cone each side has a normal of its own") {
    for (const Mesh &mesh : {cone_mesh({0, 0, 0}, 1, {0, 0, 1}, 0), cone_mesh({0, 0, 1}, 0, {0, 0, 0}, 1)}) {
        CHECK(mesh.positions.size() == 33);
        for (const Mesh::Row &row : mesh.rows) {
            const Double3 plane = unit(normal_of(corners_of(mesh, row)));
            for (size_t k = 0; k < 3; ++k) {
                const Double3 normal = mesh.normals[row.normal[k]];
                CHECK(normal.z == doctest::Approx(std::sqrt(0.5)).epsilon(1e-14));
                if (mesh.positions[row.corner[k]].z == 1)
                    CHECK(std::fabs(normal.x * plane.y - normal.y * plane.x) < 1e-15);
            }
        }
    }
}

TEST_CASE("a cone without height or radius has no rows") {
    for (const Mesh &mesh : {cone_mesh({1, 2, 3}, 1, {1, 2, 3}, 2), cone_mesh({1, 2, 3}, 0, {1, 2, 4}, 0)}) {
        CHECK(mesh.rows.empty());
        CHECK(mesh.normals.empty());
    }
}

TEST_CASE("small polygons are cut as one would by hand") {
    check_polygon({{0, 0}, {1, 0}, {0, 1}});
    check_polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    check_polygon({{0, 0}, {4, 0}, {1, 1}, {0, 4}});                         // an arrowhead
    check_polygon({{0, 0}, {1, 0}, {2, 0}, {1, 1}});                         // a point within an edge
    check_polygon({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {2, 1}, {0, 1}}); // several
    check_polygon({{0, 0}, {6, 0}, {6, 1}, {1, 1}, {1, 5}, {6, 5}, {6, 6}, {0, 6}});
}

TEST_CASE("the triangles of a concave polygon are the polygon") {
    Random random;
    for (size_t count : {5, 8, 13, 50, 144})
        for (double least : {0.9, 0.3, 0.01}) check_polygon(star(count, least, random));
    for (size_t count : {1, 2, 3, 10, 60}) check_polygon(comb(count, random));
    for (size_t count : {1, 2, 3, 5, 8, 20, 40})
        for (int round = 0; round < 4; ++round) check_polygon(columns(count, random));
    check_polygon(spiral(100));
}

TEST_CASE("repeated points and spikes add nothing") {
    Random random;
    const Outline whole = star(40, 0.2, random);
    Outline twice, spiked;
    for (const Point &p : whole) {
        twice.push_back(p);
        twice.push_back(p);
        spiked.push_back(p);
    }
    check_polygon(twice, whole.size());
    // Out and back from a corner, along a line of its own.
    check_polygon({{0, 0}, {4, 0}, {4, 4}, {5, 5}, {4, 4}, {0, 4}}, 2);
    check_polygon({{0, 0}, {4, 0}, {4, 4}, {3, 3}, {2, 2}, {3, 3}, {4, 4}, {0, 4}}, 4); // inwards
    check_polygon({{0, 0}, {7, 0}, {4, 0}, {4, 4}, {0, 4}}, 1);                         // beyond an edge
}

TEST_CASE("outlines that touch themselves") {
    // A square hole, joined to the outside by a bridge that is passed twice.
    check_polygon({{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}});
    // Two holes by bridges from the same corner; and the second from the first.
    check_polygon({{0, 0},
                   {9, 0},
                   {9, 9},
                   {0, 9},
                   {0, 0},
                   {1, 4},
                   {1, 8},
                   {3, 8},
                   {3, 4},
                   {1, 4},
                   {0, 0},
                   {4, 1},
                   {4, 3},
                   {8, 3},
                   {8, 1},
                   {4, 1}});
    check_polygon({{0, 0},
                   {9, 0},
                   {9, 9},
                   {0, 9},
                   {0, 0},
                   {1, 1},
                   {1, 3},
                   {3, 3},
                   {5, 5},
                   {5, 7},
                   {7, 7},
                   {7, 5},
                   {5, 5},
                   {3, 3},
                   {3, 1},
                   {1, 1}});
    // Two squares that share a corner; a tooth whose tip is on the opposite edge.
    check_polygon({{0, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}}, 2);
    check_polygon({{0, 0}, {4, 0}, {4, 4}, {3, 4}, {2, 0}, {1, 4}, {0, 4}}, 1);
}

TEST_CASE("outlines with slits everywhere") {
    Random random;
    for (int side : {2, 3, 5, 8, 12})
        for (int round = 0; round < 40; ++round) {
            const Outline outline = slit(side, 2 + random.bits() % static_cast<size_t>(2 * side * side), random);
            CAPTURE(side);
            CAPTURE(round);
            check_rows(outline, polygon_mesh(placed(outline, round % 3), {}).rows, random);
        }
}

TEST_CASE("an outline without area has no rows") {
    CHECK(rows_of({}) == 0);
    CHECK(rows_of({{1, 2}}) == 0);
    CHECK(rows_of({{1, 2}, {3, 4}}) == 0);
    CHECK(rows_of({{1, 2}, {1, 2}, {1, 2}}) == 0);
    CHECK(rows_of({{0, 0}, {0.1, 0.3}, {0.2, 0.6}}) == 0);
    CHECK(rows_of({{0, 0}, {0.1, 0.3}, {0.3, 0.9}, {0.2, 0.6}, {0.7, 2.1}}) == 0);
    CHECK(rows_of({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {1, 1}, {1, 0}}) == 0); // there and back
}

TEST_CASE("an outline that crosses itself gives some triangles") {
    CHECK(rows_of({{0, 0}, {2, 2}, {2, 0}, {0, 1}}) > 0);
    CHECK(rows_of({{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 0}, {1, 1}}) > 0); // twice round
    Random random;
    for (size_t count = 4; count < 200; ++count) {
        Outline outline, lattice;
        for (size_t i = 0; i < count; ++i) {
            outline.push_back({random.between(0, 1), random.between(0, 1)});
            lattice.push_back({static_cast<double>(random.bits() % 4), static_cast<double>(random.bits() % 4)});
        }
        CHECK(rows_of(outline) > 0);
        rows_of(lattice);
    }
}

TEST_CASE("an outline that crosses itself is found; one that touches itself does not cross") {
    const auto crosses = [](const Outline &outline, double turned = 0) {
        std::vector<Double3> points;
        for (const auto &[u, v] : outline) { // in a plane that is turned, with six digits as files have them
            const auto digits = [](double x) { return std::round(x * 1e5) * 1e-5; };
            const double c = std::cos(turned), s = std::sin(turned);
            points.push_back({digits(c * u - s * v), digits(s * u + c * v), digits(0.3 * (c * u - s * v))});
        }
        return crosses_itself(points);
    };
    const Outline star = {{0, 1}, {0.588, -0.809}, {-0.951, 0.309}, {0.951, 0.309}, {-0.588, -0.809}};
    const Outline simple = {{0, 0}, {4, 0}, {4, 4}, {3, 1}, {1, 1}, {0, 4}};
    const Outline hole = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}};
    const Outline corner_on_edge = {{0, 0}, {4, 0}, {4, 4}, {2.2, 0}, {1, 3}};
    for (double turned = 0; turned < 6; turned += 0.1) {
        CAPTURE(turned);
        CHECK(crosses({{0, 0}, {2, 2}, {2, 0}, {0, 1}}, turned)); // a bow tie
        CHECK(crosses(star, turned));
        CHECK(crosses({{0, 0}, {4, 0}, {4, 4}, {2.2, -0.01}, {1, 3}}, turned));
        CHECK_FALSE(crosses(simple, turned));
        CHECK_FALSE(crosses(hole, turned));
        CHECK_FALSE(crosses(corner_on_edge, turned));
    }
    CHECK_FALSE(crosses({{0, 0}, {1, 0}, {0, 1}}));
    CHECK_FALSE(crosses({{0, 0}, {1, 1}, {2, 2}}));
    CHECK_FALSE(crosses({}));
}

TEST_CASE("a polygon has the normals of its points, and sizes of any kind") {
    const std::vector<Double3> normals = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}};
    for (double size : {1e-310, 1e-30, 1.0, 1e30, 1.7e308}) {
        const Mesh mesh =
            polygon_mesh({{-size, -size, 0}, {size, -size, 0}, {size, size, 0}, {-size, size, 0}}, normals);
        CHECK(mesh.positions.size() == 4);
        CHECK(mesh.normals.size() == 4);
        REQUIRE(mesh.rows.size() == 2);
        for (const Mesh::Row &row : mesh.rows) CHECK(row.normal == row.corner);
    }
}

TEST_CASE("many points are cut in bounded work, too many are refused") {
    Random random;
    CHECK(rows_of(star(max_polygon_points, 0.5, random)) == max_polygon_points - 2);
    Outline chaos;
    for (size_t i = 0; i < max_polygon_points; ++i) chaos.push_back({random.between(0, 1), random.between(0, 1)});
    CHECK(rows_of(chaos) > 0);
    chaos.push_back({0, 0});
    CHECK_THROWS_WITH_AS(rows_of(chaos), "a polygon of 16385 points, expected at most 16384", std::invalid_argument);
}

TEST_CASE("real polygons: the gears of SPD") {
    WISP_NEEDS_DATA("nff/gears.nff");
    std::ifstream file(data_path("nff/gears.nff"));
    std::string word;
    size_t faces = 0;
    Random random;
    while (file >> word) {
        size_t count = 0;
        if (word != "p" || !(file >> count)) continue;
        std::vector<Double3> points(count);
        for (Double3 &p : points) file >> p.x >> p.y >> p.z;
        REQUIRE(file);
        if (count != 144) continue;
        ++faces;
        Double3 normal = {0, 0, 0};
        for (size_t i = 0; i < count; ++i)
            normal = normal + cross(points[i] - points[0], points[(i + 1) % count] - points[0]);
        Outline outline;
        for (const Double3 &p : points)
            outline.push_back(largest_component(normal) == std::fabs(normal.z)   ? Point{p.x, p.y}
                              : largest_component(normal) == std::fabs(normal.x) ? Point{p.y, p.z}
                                                                                 : Point{p.z, p.x});
        const std::vector<Mesh::Row> rows = polygon_mesh(points, {}).rows;
        CHECK(rows.size() == 142);
        check_rows(outline, rows, random);
    }
    CHECK(faces == 128);
}
