#include "core/numbers/elementary.h"
#include "host/base/double3_algebra.h"
#include "host/scene/tessellate.h"
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace wisp {
namespace {

Mesh empty_mesh() { return {-1, 0, -1, {}, {}, {}, {}}; }

// ---- Spheres: an icosahedron with subdivided edges, projected to the sphere

std::vector<Double3> icosahedron_corners() {
    const double golden = (1 + std::sqrt(5.0)) / 2;
    std::vector<Double3> corners;
    for (double a : {-1.0, 1.0})
        for (double b : {-golden, golden})
            for (const Double3 &corner : {Double3{0, a, b}, Double3{a, b, 0}, Double3{b, 0, a}})
                corners.push_back(corner);
    return corners;
}

// A point as weights of the icosahedron's corners, in units of 1 / segments: the same for all faces that share the
// point.
using Blend = std::array<uint8_t, 12>;

class UnitSphere {
  public:
    explicit UnitSphere(uint32_t segments_) : segments(segments_) { // of each edge
        for (uint32_t a = 0; a < corners_.size(); ++a)
            for (uint32_t b = a + 1; b < corners_.size(); ++b)
                for (uint32_t c = b + 1; c < corners_.size(); ++c) add_face(a, b, c);
        double volume = 0; // six times that of the polyhedron
        for (const auto &row : rows)
            volume += dot(normals[row.corner[0]], cross(normals[row.corner[1]], normals[row.corner[2]]));
        corner_radius = cbrt(6 * four_pi<double> / 3 / volume);
    }

    const uint32_t segments;
    std::vector<Double3> normals;
    std::vector<Mesh::Row> rows;
    double corner_radius; // of the polyhedron with the sphere's volume

  private:
    void add_face(uint32_t a, uint32_t b, uint32_t c) {
        const auto adjacent = [this](uint32_t i, uint32_t j) { return dot(corners_[i], corners_[j]) > 1; };
        if (!adjacent(a, b) || !adjacent(b, c) || !adjacent(c, a)) return;
        if (dot(corners_[a], cross(corners_[b], corners_[c])) < 0) std::swap(b, c);
        const auto at = [&](uint32_t i, uint32_t j) { // i steps from a towards b, j towards c
            Blend blend{};
            blend[a] = static_cast<uint8_t>(segments - i - j);
            blend[b] = static_cast<uint8_t>(i);
            blend[c] = static_cast<uint8_t>(j);
            return index_of(blend);
        };
        for (uint32_t i = 0; i < segments; ++i)
            for (uint32_t j = 0; i + j < segments; ++j) {
                add_row({at(i, j), at(i + 1, j), at(i, j + 1)});
                if (i + j + 1 < segments) add_row({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
            }
    }

    void add_row(const std::array<uint32_t, 3> &corner) { rows.push_back({corner, corner, {}}); }

    uint32_t index_of(const Blend &blend) {
        const auto [found, is_new] = indices_.emplace(blend, static_cast<uint32_t>(normals.size()));
        if (is_new) {
            constexpr double edge_turns = 0.17620819117478337; // atan(2) / (2 pi)
            Double3 sum = {0, 0, 0};
            for (size_t i = 0; i < blend.size(); ++i) {
                // Sines divide the edges into equal arcs.
                double sine, cosine;
                sincos_turns(edge_turns * blend[i] / segments, sine, cosine);
                sum = sum + corners_[i] * sine;
            }
            normals.push_back(unit(sum));
        }
        return found->second;
    }

    const std::vector<Double3> corners_ = icosahedron_corners();
    std::map<Blend, uint32_t> indices_;
};

// ---- Cones

constexpr uint32_t sides = 32;

// ---- Polygons: ear clipping, with exact decisions about points that are rounded to a fine lattice in the plane

using Point = std::array<int64_t, 2>; // |coordinate| <= 2^60

// The sign of the area of a, b, c: 1 where they turn to the left.
int turn(const Point &a, const Point &b, const Point &c) {
    const auto left = detail::product<detail::Wide>(b[0] - a[0], c[1] - a[1]);
    const auto right = detail::product<detail::Wide>(b[1] - a[1], c[0] - a[0]);
    const int64_t left_high = detail::high_word(left), right_high = detail::high_word(right);
    if (left_high != right_high) return left_high > right_high ? 1 : -1;
    const uint64_t left_low = detail::low_word(left), right_low = detail::low_word(right);
    return (left_low > right_low) - (left_low < right_low);
}

// The outline projected to a plane, counter-clockwise; empty when it has no area.
std::vector<Point> flattened(const std::vector<Double3> &points) {
    std::vector<Double3> relative; // halved, so that no difference is infinite
    double size = 0;
    for (const Double3 &p : points) {
        relative.push_back(p * 0.5 - points[0] * 0.5);
        size = std::max(size, largest_component(relative.back()));
    }
    int exponent;
    std::frexp(size, &exponent);
    Double3 normal = {0, 0, 0}; // Newell's: twice the area
    for (Double3 &p : relative)
        p = {scale_pow2(p.x, -exponent), scale_pow2(p.y, -exponent), scale_pow2(p.z, -exponent)};
    for (size_t i = 1; i < relative.size(); ++i) normal = normal + cross(relative[i - 1], relative[i]);
    const double longest = largest_component(normal);
    if (longest <= 0x1p-44) return {}; // a line up to the rounding of the sum, for outlines of size 1/2 to 1

    const bool along_x = std::fabs(normal.x) == longest, along_y = !along_x && std::fabs(normal.y) == longest;
    const bool swap = (along_x ? normal.x : along_y ? normal.y : normal.z) < 0;
    std::vector<Point> flat;
    for (const Double3 &p : relative) {
        const double u = along_x ? p.y : along_y ? p.z : p.x, v = along_x ? p.z : along_y ? p.x : p.y;
        const Point point = {static_cast<int64_t>(u * 0x1p60), static_cast<int64_t>(v * 0x1p60)};
        flat.push_back(swap ? Point{point[1], point[0]} : point);
    }
    return flat;
}

// An edge of an outline, and its range along the first axis of the plane.
struct Edge {
    std::array<double, 2> a, b;
    double low, high;
};

// Whether the ends of `of` lie more than 2^-16 on both sides of the line of `line`. The size of the outline is 1/2
// to 1.
bool straddles(const Edge &of, const Edge &line) {
    const double u = line.b[0] - line.a[0], v = line.b[1] - line.a[1], least = std::sqrt(u * u + v * v) * 0x1p-16;
    const double a = u * (of.a[1] - line.a[1]) - v * (of.a[0] - line.a[0]),
                 b = u * (of.b[1] - line.a[1]) - v * (of.b[0] - line.a[0]);
    return (a > least && b < -least) || (a < -least && b > least);
}

// Ears are cut one after the other. Only the two neighbours of an ear can become ears when it is cut, so each point is
// visited at most three times for each rule. Where a rule finds no more ears, the next rule applies. An outline that
// neither touches nor crosses itself needs only the first two rules.
class EarCutter {
  public:
    explicit EarCutter(std::vector<Point> points)
        : points_(std::move(points)), previous_(points_.size()), next_(points_.size()), turns_(points_.size()),
          place_(points_.size()), left_(points_.size()) {
        const uint32_t count = static_cast<uint32_t>(points_.size());
        for (uint32_t i = 0; i < count; ++i) {
            previous_[i] = (i + count - 1) % count;
            next_[i] = (i + 1) % count;
        }
    }

    std::vector<Mesh::Row> cut() {
        for (Rule rule : {Rule::spikes, Rule::clear, Rule::touched, Rule::convex, Rule::any}) {
            if (left_ < 3) break;
            uint32_t i = first_;
            do {
                enqueue(i);
                i = next_[i];
            } while (i != first_);
            for (; visited_ < queue_.size() && left_ > 2; ++visited_) {
                i = queue_[visited_];
                if (place_[i] == visited_ && can_be_cut(i, rule)) remove(i);
            }
        }
        return std::move(rows_);
    }

  private:
    enum class Rule {
        spikes,  // points that add no area: repeated, or where the outline turns back
        clear,   // and ears that no other point touches
        touched, // and ears that no other edge enters
        convex,  // and all convex points
        any      // and all points
    };

    void enqueue(uint32_t i) {
        turns_[i] = static_cast<int8_t>(turn(points_[previous_[i]], points_[i], points_[next_[i]]));
        place_[i] = queue_.size();
        queue_.push_back(i);
    }

    bool can_be_cut(uint32_t i, Rule rule) const {
        const Point &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
        if (turns_[i] == 0 && !(a < b && b < c) && !(c < b && b < a)) return true;
        if (rule == Rule::spikes) return false;
        if (rule == Rule::any) return true;
        return turns_[i] > 0 && (rule == Rule::convex || is_ear(i, rule));
    }

    // Whether no other point is in the ear. Only points that are not convex need a test: an outline that enters the ear
    // has one there.
    bool is_ear(uint32_t i, Rule rule) const {
        const std::array<Point, 3> ear = {points_[previous_[i]], points_[i], points_[next_[i]]};
        for (uint32_t q = next_[next_[i]]; q != previous_[i]; q = next_[q])
            if (turns_[q] <= 0 && blocks(q, ear, rule)) return false;
        return true;
    }

    bool blocks(uint32_t q, const std::array<Point, 3> &ear, Rule rule) const {
        int side[3], on_edges = 0;
        for (size_t k = 0; k < 3; ++k) {
            side[k] = turn(ear[k], ear[(k + 1) % 3], points_[q]);
            if (side[k] < 0) return false;
            on_edges += side[k] == 0;
        }
        if (on_edges == 1 && rule == Rule::clear) return true;
        const auto enters = [&](uint32_t to) {
            for (size_t k = 0; k < 3; ++k)
                if (side[k] == 0 && turn(ear[k], ear[(k + 1) % 3], points_[to]) <= 0) return false;
            return true;
        };
        return enters(previous_[q]) || enters(next_[q]);
    }

    void remove(uint32_t i) {
        const uint32_t a = previous_[i], c = next_[i];
        if (turns_[i] > 0) rows_.push_back({{a, i, c}, {}, {}});
        if (turns_[i] < 0) rows_.push_back({{c, i, a}, {}, {}});
        place_[i] = SIZE_MAX;
        next_[a] = c;
        previous_[c] = a;
        first_ = a;
        --left_;
        enqueue(a);
        enqueue(c);
    }

    const std::vector<Point> points_;
    std::vector<uint32_t> previous_, next_; // of the points that remain
    std::vector<int8_t> turns_;             // turn() at each point
    std::vector<uint32_t> queue_;           // points to visit; only the last occurrence of a point counts
    std::vector<size_t> place_;
    size_t visited_ = 0, left_;
    uint32_t first_ = 0;
    std::vector<Mesh::Row> rows_;
};

} // namespace

const UnitSphere &unit_sphere(bool fine) {
    static const UnitSphere spheres[] = {UnitSphere(3), UnitSphere(6)};
    return spheres[fine];
}

SphereError sphere_error(bool fine) {
    const UnitSphere &sphere = unit_sphere(fine);
    double nearest = sphere.corner_radius; // of the triangles' planes
    for (const Mesh::Row &row : sphere.rows) {
        const Double3 &a = sphere.normals[row.corner[0]], &b = sphere.normals[row.corner[1]],
                      &c = sphere.normals[row.corner[2]];
        nearest = std::min(nearest, sphere.corner_radius * std::fabs(dot(a, unit(cross(b - a, c - a)))));
    }
    return {1 - nearest, sphere.corner_radius - 1};
}

Mesh sphere_mesh(const Double3 &center, double radius, bool fine) {
    const UnitSphere &sphere = unit_sphere(fine);
    const double corner_radius = std::fabs(radius) * sphere.corner_radius;
    Mesh mesh = empty_mesh();
    for (const Double3 &normal : sphere.normals) mesh.positions.push_back(center + normal * corner_radius);
    mesh.normals = sphere.normals;
    mesh.rows = sphere.rows;
    return mesh;
}

Mesh cone_mesh(const Double3 &base, double base_radius, const Double3 &apex, double apex_radius) {
    Mesh mesh = empty_mesh();
    const Double3 height_vector = apex - base;
    base_radius = std::fabs(base_radius);
    apex_radius = std::fabs(apex_radius);
    if (largest_component(height_vector) == 0 || (base_radius == 0 && apex_radius == 0)) return mesh;

    const Double3 axis = unit(height_vector);
    const double height = dot(height_vector, axis);
    const Double3 size = {std::fabs(axis.x), std::fabs(axis.y), std::fabs(axis.z)};
    const Double3 other = size.x <= size.y && size.x <= size.z ? Double3{1, 0, 0}
                          : size.y <= size.z                   ? Double3{0, 1, 0}
                                                               : Double3{0, 0, 1};
    const Double3 right = unit(cross(other, axis)), up = cross(axis, right);
    double sine, cosine;
    const auto outwards = [&](double side) {
        sincos_turns(side / sides, sine, cosine);
        return right * cosine + up * sine;
    };
    const auto normal = [&](double side) { return unit(outwards(side) * height + axis * (base_radius - apex_radius)); };
    sincos_turns(1.0 / sides, sine, cosine);
    const double corner_radius = std::sqrt(two_pi<double> / (sides * sine)); // of the polygon with the circle's area
    const auto add_ring = [&](const Double3 &center, double radius) {
        const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
        for (uint32_t i = 0; i < (radius > 0 ? sides : 1); ++i)
            mesh.positions.push_back(center + outwards(i) * (radius * corner_radius));
        return first;
    };
    const uint32_t b = add_ring(base, base_radius), a = add_ring(apex, apex_radius);
    for (uint32_t i = 0; i < sides; ++i) mesh.normals.push_back(normal(i));
    if (base_radius == 0 || apex_radius == 0)
        for (uint32_t i = 0; i < sides; ++i) mesh.normals.push_back(normal(i + 0.5)); // at the tip

    for (uint32_t i = 0; i < sides; ++i) {
        const uint32_t j = (i + 1) % sides, middle = sides + i;
        if (apex_radius == 0) {
            mesh.rows.push_back({{b + i, b + j, a}, {i, j, middle}, {}});
        } else if (base_radius == 0) {
            mesh.rows.push_back({{b, a + j, a + i}, {middle, j, i}, {}});
        } else {
            mesh.rows.push_back({{b + i, b + j, a + j}, {i, j, j}, {}});
            mesh.rows.push_back({{b + i, a + j, a + i}, {i, j, i}, {}});
        }
    }
    return mesh;
}

Mesh polygon_mesh(const std::vector<Double3> &points, const std::vector<Double3> &normals) {
    if (points.size() > max_polygon_points)
        throw std::invalid_argument("a polygon of " + std::to_string(points.size()) + " points, expected at most " +
                                    std::to_string(max_polygon_points));
    Mesh mesh = empty_mesh();
    mesh.positions = points;
    mesh.normals = normals;
    std::vector<Point> flat;
    if (points.size() > 2) flat = flattened(points);
    if (flat.empty()) return mesh;
    mesh.rows = EarCutter(std::move(flat)).cut();
    if (!normals.empty())
        for (Mesh::Row &row : mesh.rows) row.normal = row.corner;
    return mesh;
}

bool crosses_itself(const std::vector<Double3> &points) {
    if (points.size() < 4) return false;
    std::vector<Edge> edges;
    const auto place = [](const Point &p) {
        return std::array<double, 2>{static_cast<double>(p[0]) * 0x1p-60, static_cast<double>(p[1]) * 0x1p-60};
    };
    const std::vector<Point> flat = flattened(points);
    for (size_t i = 0; i < flat.size(); ++i) {
        const std::array<double, 2> a = place(flat[i]), b = place(flat[(i + 1) % flat.size()]);
        edges.push_back({a, b, std::min(a[0], b[0]), std::max(a[0], b[0])});
    }
    std::sort(edges.begin(), edges.end(), [](const Edge &e, const Edge &f) { return e.low < f.low; });
    for (size_t i = 0; i < edges.size(); ++i)
        for (size_t j = i + 1; j < edges.size() && edges[j].low < edges[i].high; ++j)
            if (straddles(edges[i], edges[j]) && straddles(edges[j], edges[i])) return true;
    return false;
}

} // namespace wisp
