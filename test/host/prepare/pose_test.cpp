// Surfaces at a time against products of 4 x 4 matrices, written out anew.
#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/prepare/motion.h"
#include "host/prepare/pose.h"
#include "support/random_input.h"
#include <doctest/doctest.h>

using namespace wisp;

namespace {

using Corners = std::array<Double3, 3>;

bool equal(const Double3 &a, const Double3 &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
double distance(const Double3 &a, const Double3 &b) { return length(a - b); }
Double3 place(const Instance &b, const Double3 &p) {
    return b.axis[0] * p.x + b.axis[1] * p.y + b.axis[2] * p.z + b.origin;
}

// Rows of a matrix of homogeneous coordinates.
struct Square {
    double m[4][4];
};
Square operator*(const Square &a, const Square &b) {
    Square c = {};
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k) c.m[i][j] += a.m[i][k] * b.m[k][j];
    return c;
}
Double3 operator*(const Square &a, const Double3 &p) {
    const double v[4] = {p.x, p.y, p.z, 1};
    double r[3] = {};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 4; ++k) r[i] += a.m[i][k] * v[k];
    return {r[0], r[1], r[2]};
}
Square diagonal(const Double3 &s) { return {{{s.x, 0, 0, 0}, {0, s.y, 0, 0}, {0, 0, s.z, 0}, {0, 0, 0, 1}}}; }
Square translation(const Double3 &t) { return {{{1, 0, 0, t.x}, {0, 1, 0, t.y}, {0, 0, 1, t.z}, {0, 0, 0, 1}}}; }
Square rotation(const Double3 &k, double degrees) {
    const double a = degrees * 3.14159265358979323846 / 180, c = std::cos(a), s = std::sin(a), d = 1 - c;
    return {{{c + k.x * k.x * d, k.x * k.y * d - k.z * s, k.x * k.z * d + k.y * s, 0},
             {k.y * k.x * d + k.z * s, c + k.y * k.y * d, k.y * k.z * d - k.x * s, 0},
             {k.z * k.x * d - k.y * s, k.z * k.y * d + k.x * s, c + k.z * k.z * d, 0},
             {0, 0, 0, 1}}};
}
Square square_of(const Placement &p) {
    return translation(p.translation) * rotation(p.axis, p.degrees) * diagonal(p.scale);
}

Double3 random_point(Random &random) { return {random.between(-2, 2), random.between(-2, 2), random.between(-2, 2)}; }
Placement random_placement(Random &random) {
    Placement p;
    const auto scale = [&random] { return random.between(0.3, 2) * (random.bits() % 4 == 0 ? -1 : 1); };
    p.scale.x = scale();
    p.scale.y = scale();
    p.scale.z = scale();
    p.axis = unit(random_point(random));
    p.degrees = random.between(-400, 400);
    p.translation = random_point(random);
    return p;
}

// Keys at -1, 0, 1, 2, of which those at 0 and 1 are met: the placement `a` at 0, `b` at 1.
Motion motion_between(const Placement &a, const Placement &b) {
    Motion motion;
    for (int i = 0; i < 4; ++i) {
        const Placement &p = i < 2 ? a : b;
        motion.translation.push_back({i - 1.0, p.translation, 0, 0, 0, 0});
        motion.rotation.push_back({i - 1.0, p.axis, p.degrees, 0, 0, 0});
        motion.scale.push_back({i - 1.0, p.scale, 0, 0, 0, 0});
    }
    return motion;
}
Motion moved_by(const Double3 &way) { // from 0 to 1
    Placement end;
    end.translation = way;
    return motion_between(Placement(), end);
}

Mesh one_triangle(int32_t node, const Corners &corners = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}) {
    Mesh mesh = {};
    mesh.node = node;
    mesh.texture = -1;
    mesh.positions.assign(corners.begin(), corners.end());
    mesh.rows.push_back({{0, 1, 2}, {}, {}});
    return mesh;
}
Node placed(int32_t parent, const Placement &placement) { return {parent, "", placement}; }
Node named(int32_t parent, const std::string &name) { return {parent, name, Placement()}; }
Placement shifted(double x) {
    Placement p;
    p.translation.x = x;
    return p;
}

DeformingTriangle one_deforming(int32_t node, std::initializer_list<double> times) {
    DeformingTriangle triangle = {node, 7, {}};
    for (double t : times)
        triangle.keyframes.push_back(
            {t, {{{t, 0, 0}, {t + 1, 0, 0}, {t, 1, t * t}}}, {{{0, 0, 1}, {0, 1, 0}, {1, 0, 0}}}});
    return triangle;
}

Shapes shapes_at(const SceneGraph &graph, double time) {
    Shapes shapes = make_shapes("scene.aff", graph);
    pose_shapes("scene.aff", graph, time, shapes);
    return shapes;
}
const Triangle &deforming_of(const Shapes &s, size_t i = 0) {
    return s.triangles[s.static_count + s.instance_triangle_count + i];
}

} // namespace

namespace {

// Whether a map of points changes the orientation.
template <class Map> bool mirrors(Map &&map) {
    const Double3 o = map(Double3{0, 0, 0}), x = map(Double3{1, 0, 0}) - o, y = map(Double3{0, 1, 0}) - o,
                  z = map(Double3{0, 0, 1}) - o;
    return dot(x, cross(y, z)) < 0;
}

} // namespace

TEST_CASE("pose: random trees of nodes are products of their matrices") {
    Random random;
    size_t unmoving = 0, instances = 0, nested = 0;
    for (int round = 0; round < 300; ++round) {
        SceneGraph graph;
        std::vector<Square> world[2]; // at 0 and at 1
        std::vector<int32_t> mover;
        const int32_t nodes = 1 + static_cast<int32_t>(random.bits() % 8);
        for (int32_t i = 0; i < nodes; ++i) {
            const int32_t parent = static_cast<int32_t>(random.bits() % static_cast<uint64_t>(i + 1)) - 1;
            const Placement a = random_placement(random), b = random_placement(random);
            const uint64_t kind = random.bits() % 4; // two of them placements, one with a motion, one without
            graph.nodes.push_back(kind < 2 ? placed(parent, a) : named(parent, "x" + std::to_string(i)));
            if (kind == 2) graph.motions["x" + std::to_string(i)] = motion_between(a, b);
            for (int t = 0; t < 2; ++t) {
                const Square local = kind < 2    ? square_of(a)
                                     : kind == 2 ? square_of(t == 0 ? a : b)
                                                 : diagonal({1, 1, 1});
                world[t].push_back(parent < 0 ? local : world[t][static_cast<size_t>(parent)] * local);
            }
            const int32_t above = parent < 0 ? -1 : mover[static_cast<size_t>(parent)];
            nested += kind == 2 && above >= 0;
            mover.push_back(kind == 2 ? i : above);
        }
        for (int m = 0; m < 6; ++m) {
            const int32_t node = static_cast<int32_t>(random.bits() % static_cast<uint64_t>(nodes + 1)) - 1;
            graph.meshes.push_back(
                one_triangle(node, {random_point(random), random_point(random), random_point(random)}));
            graph.meshes.back().material = static_cast<uint32_t>(m); // to find it by
        }
        graph.deforming.push_back(one_deforming(nodes - 1, {0, 1}));

        Shapes shapes = make_shapes("scene.aff", graph);
        REQUIRE(shapes.triangles.size() == 7);
        REQUIRE(shapes.static_count + shapes.instance_triangle_count == 6);
        REQUIRE(shapes.deforming_count == 1);
        for (int t = 0; t < 2; ++t) {
            pose_shapes("scene.aff", graph, t, shapes);
            std::vector<bool> seen(6);
            const auto check = [&](uint32_t i, const Instance *instance, int32_t node) {
                const Mesh &mesh = graph.meshes[shapes.triangles[i].material];
                seen[shapes.triangles[i].material] = true;
                CHECK((mesh.node < 0 ? -1 : mover[static_cast<size_t>(mesh.node)]) == node);
                const auto in_world = [&](const Double3 &p) {
                    return mesh.node < 0 ? p : world[t][static_cast<size_t>(mesh.node)] * p;
                };
                const auto placed = [&](const Double3 &p) { return instance ? place(*instance, p) : p; };
                // What mirrors a triangle where it is baked turns it round.
                const bool turned = mirrors(in_world) != mirrors(placed);
                for (size_t k = 0; k < 3; ++k) {
                    const Double3 expected = in_world(mesh.positions[turned ? (3 - k) % 3 : k]),
                                  found = placed(shapes.triangles[i].corner[k]);
                    CHECK(distance(found, expected) < 1e-11 * (1 + length(expected)));
                }
            };
            for (uint32_t i = 0; i < shapes.static_count; ++i) check(i, nullptr, -1);
            uint32_t next = shapes.static_count;
            for (size_t b = 0; b < shapes.instances.size(); ++b) {
                const Instance &instance = shapes.instances[b];
                CHECK(instance.first == next);
                CHECK(instance.count > 0);
                CHECK(instance.visible);
                next += instance.count;
                for (uint32_t i = instance.first; i < next; ++i) check(i, &instance, shapes.instance_nodes[b]);
            }
            CHECK(next == 6);
            CHECK(std::count(seen.begin(), seen.end(), true) == 6);
            for (size_t k = 0; k < 3; ++k) {
                const Double3 expected = world[t][static_cast<size_t>(nodes - 1)] *
                                         graph.deforming[0].keyframes[static_cast<size_t>(t)].corners[k];
                CHECK(distance(deforming_of(shapes).corner[k], expected) < 1e-11 * (1 + length(expected)));
            }
        }
        unmoving += shapes.static_count;
        instances += shapes.instances.size();
    }
    CHECK(unmoving > 300);
    CHECK(instances > 200);
    CHECK(nested > 50);
}

TEST_CASE("pose: what moves is a body with all that does not move in it") {
    SceneGraph graph;
    graph.nodes = {placed(-1, shifted(1)), named(0, "car"),         placed(1, shifted(10)), named(2, "none"),
                   named(3, "wheel"),      placed(4, shifted(100)), named(-1, "idle"),      named(-1, "empty")};
    graph.motions["car"] = moved_by({0, 5, 0});
    graph.motions["wheel"] = moved_by({0, 0, 7});
    graph.motions["idle"] = Motion(); // no keys: does not move
    graph.motions["empty"] = moved_by({1, 1, 1});
    for (int32_t node : {5, 0, 3, 1, 6, -1, 4}) graph.meshes.push_back(one_triangle(node));
    const Shapes s = shapes_at(graph, 1);
    CHECK(s.static_count == 3);
    CHECK(s.instance_triangle_count == 4);
    CHECK(s.deforming_count == 0);
    REQUIRE(s.instances.size() == 2); // `empty` has no triangles
    CHECK(s.instance_nodes == std::vector<int32_t>{1, 4});
    CHECK(s.instances[0].first == 3);
    CHECK(s.instances[0].count == 2);
    CHECK(s.instances[1].first == 5);
    CHECK(s.instances[1].count == 2);
    // In the order of the meshes, in the world or the body.
    const double expected[] = {1, 0, 0, 10, 0, 100, 0};
    for (size_t i = 0; i < 7; ++i) CHECK(equal(s.triangles[i].corner[0], {expected[i], 0, 0}));
    CHECK(distance(s.instances[0].origin, {1, 5, 0}) < 1e-14);
    CHECK(distance(s.instances[1].origin, {11, 5, 7}) < 1e-14);
}

TEST_CASE("pose: one motion for several nodes") {
    SceneGraph graph;
    graph.nodes = {named(-1, "wheel"), placed(-1, shifted(3)), named(1, "wheel")};
    graph.motions["wheel"] = moved_by({0, 5, 0});
    graph.meshes = {one_triangle(0), one_triangle(2)};
    const Shapes s = shapes_at(graph, 1);
    REQUIRE(s.instances.size() == 2);
    CHECK(distance(s.instances[0].origin, {0, 5, 0}) < 1e-14);
    CHECK(distance(s.instances[1].origin, {3, 5, 0}) < 1e-14);
}

TEST_CASE("pose: materials, textures, texels and normals") {
    SceneGraph graph;
    Mesh mesh = one_triangle(-1);
    mesh.material = 3;
    mesh.normals = {{1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
    mesh.rows[0].normal = {2, 0, 1};
    graph.meshes.push_back(mesh);
    mesh.texture = 2;
    mesh.texels = {{0.1, 0.2}, {0.3, 0.4}};
    mesh.rows[0].texel = {1, 0, 1};
    mesh.rows.push_back({{2, 1, 0}, {}, {0, 0, 1}});
    graph.meshes.push_back(mesh);
    const Shapes s = shapes_at(graph, 0);
    REQUIRE(s.static_count == 3);
    for (const Triangle &t : s.triangles) CHECK(t.material == 3);
    CHECK(s.triangles[0].texture == -1);
    CHECK(s.triangles[0].texel[2][1] == 0);
    CHECK(equal(s.triangles[0].normal[0], {0, 0, 1}));
    CHECK(equal(s.triangles[0].normal[1], {1, 0, 0}));
    CHECK(equal(s.triangles[0].normal[2], {0, 1, 0}));
    CHECK(s.triangles[1].texture == 2);
    const double expected[2][3][2] = {{{0.3, 0.4}, {0.1, 0.2}, {0.3, 0.4}}, {{0.1, 0.2}, {0.1, 0.2}, {0.3, 0.4}}};
    for (size_t i = 0; i < 2; ++i)
        for (size_t k = 0; k < 3; ++k)
            for (size_t c = 0; c < 2; ++c) CHECK(s.triangles[1 + i].texel[k][c] == expected[i][k][c]);
    CHECK(equal(s.triangles[2].corner[0], {0, 1, 0}));
    CHECK(equal(s.triangles[2].corner[1], {1, 0, 0}));
}

TEST_CASE("pose: normals stay on their side of the surface, and of unit length") {
    Random random;
    for (int round = 0; round < 500; ++round) {
        SceneGraph graph;
        Placement inner = random_placement(random), outer = random_placement(random);
        inner.scale.x *= 20; // very uneven, and mirrored in places
        outer.scale.y *= 0.05;
        graph.nodes = {placed(-1, outer), placed(0, inner)};
        const Corners corners = {random_point(random), random_point(random), random_point(random)};
        const Double3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
        Mesh mesh = one_triangle(1, corners);
        mesh.normals = {random_point(random), normal, normal * 1e-3};
        mesh.rows[0].normal = {1, 2, 0};
        graph.meshes.push_back(mesh);
        graph.deforming.push_back({1, 0, {{0, corners, {normal, normal, mesh.normals[0]}}}});
        const Shapes s = shapes_at(graph, 0);
        const Square world = square_of(outer) * square_of(inner);
        for (size_t which = 0; which < 2; ++which) {
            const Triangle &t = s.triangles[which];
            for (const Double3 &n : t.normal) CHECK(std::fabs(length(n) - 1) < 1e-14);
            for (size_t k = 0; k < 3; ++k) {
                const Double3 edge = unit(t.corner[(k + 1) % 3] - t.corner[k]);
                CHECK(std::fabs(dot(t.normal[0], edge)) < 1e-10);
                CHECK(std::fabs(dot(t.normal[1], edge)) < 1e-10);
            }
            // n.v = 0 and n.v > 0 stay, for any vector v that goes with the surface.
            for (int sample = 0; sample < 5; ++sample) {
                const Double3 v = random_point(random), to = world * v - world * Double3{0, 0, 0};
                CHECK((dot(t.normal[2], to) > 0) == (dot(mesh.normals[0], v) > 0));
            }
        }
    }
}

TEST_CASE("pose: no normals where the file has none, or a transform leaves none") {
    SceneGraph graph;
    Placement flat, line, gone;
    flat.scale = {1, 1, 0};
    line.scale = {1, 0, 0};
    gone.scale = {0, 0, 0};
    graph.nodes = {placed(-1, flat), placed(-1, line), placed(-1, gone)};
    graph.meshes.push_back(one_triangle(-1));
    for (int32_t node : {0, 1, 2}) {
        Mesh mesh = one_triangle(node);
        mesh.normals = {{0, 0, 2}, {0, 1, 0}};
        mesh.rows[0].normal = {0, 0, 0};
        mesh.rows.push_back({{1, 1, 1}, {0, 0, 1}, {}});
        graph.meshes.push_back(mesh);
    }
    Mesh zero = one_triangle(-1); // one of three without direction: flat, all of it
    zero.normals = {{0, 0, 1}, {0, 0, 0}};
    zero.rows[0].normal = {0, 0, 1};
    graph.meshes.push_back(zero);
    const Shapes s = shapes_at(graph, 0);
    REQUIRE(s.static_count == 8);
    for (size_t i = 0; i < 8; ++i)
        for (const Double3 &n : s.triangles[i].normal)
            CHECK(equal(n, i == 1 ? Double3{0, 0, 1} : Double3{0, 0, 0})); // in a plane it is the plane's
    CHECK(equal(s.triangles[3].corner[2], {0, 0, 0}));
    CHECK(equal(s.triangles[2].corner[0], s.triangles[2].corner[2])); // equal corners stay
}

TEST_CASE("pose: an invisible node hides what is in it") {
    SceneGraph graph;
    graph.nodes = {named(-1, "blinking"), placed(0, shifted(1)), named(1, "moving"), named(-1, "other")};
    graph.motions["blinking"].visibility = {{1, false}, {2, true}};
    graph.motions["moving"] = moved_by({0, 5, 0});
    graph.motions["moving"].visibility = {{3, false}};
    graph.motions["other"] = moved_by({0, 5, 0});
    graph.meshes = {one_triangle(1), one_triangle(2), one_triangle(3)};
    graph.deforming = {one_deforming(2, {0, 1}), one_deforming(-1, {0, 1})};
    Shapes s = make_shapes("scene.aff", graph);
    CHECK(s.static_count == 0); // `blinking` is a body although it stays where it is
    REQUIRE(s.instances.size() == 3);
    const struct {
        double time;
        bool blinking, moving;
    } expected[] = {{0, true, true}, {1, false, false}, {1.5, false, false}, {2, true, true}, {3, true, false}};
    for (const auto &e : expected) {
        pose_shapes("scene.aff", graph, e.time, s);
        CHECK(s.instances[0].visible == e.blinking);
        CHECK(s.instances[1].visible == e.moving);
        CHECK(s.instances[2].visible);
        CHECK(s.triangles.size() == 5);
        CHECK(s.deforming_count == 2);
        const auto area = [](const Triangle &t) {
            return length(cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]));
        };
        CHECK((area(deforming_of(s, 0)) > 0) == e.moving);
        CHECK(area(deforming_of(s, 1)) > 0);
    }
}

TEST_CASE("pose: a deforming triangle at its times, between and beyond") {
    SceneGraph graph;
    graph.deforming = {one_deforming(-1, {-1, 1, 1, 3})};
    Shapes s = make_shapes("scene.aff", graph);
    const auto corner_at = [&](double time, size_t i) {
        pose_shapes("scene.aff", graph, time, s);
        return deforming_of(s).corner[i];
    };
    const std::vector<DeformingTriangle::Keyframe> &poses = graph.deforming[0].keyframes;
    for (size_t i = 0; i < 3; ++i) {
        for (const DeformingTriangle::Keyframe &pose : poses) CHECK(equal(corner_at(pose.time, i), pose.corners[i]));
        CHECK(equal(corner_at(-1e30, i), poses.front().corners[i]));
        CHECK(equal(corner_at(1e30, i), poses.back().corners[i]));
    }
    CHECK(equal(corner_at(1.5, 2), {1.5, 1, 3})); // a quarter from 1 to 9
    CHECK(deforming_of(s).material == 7);
    CHECK(deforming_of(s).texture == -1);
    // At a time that two keyframes have, the later one.
    graph.deforming[0].keyframes[2].corners[0] = {50, 0, 0};
    CHECK(equal(corner_at(1, 0), {50, 0, 0}));
    CHECK(corner_at(1 - 1e-12, 0).x == doctest::Approx(1));
}

TEST_CASE("pose: a deforming triangle's normals are linear and then of unit length") {
    SceneGraph graph;
    graph.deforming = {one_deforming(-1, {0, 4})};
    std::vector<DeformingTriangle::Keyframe> &poses = graph.deforming[0].keyframes;
    poses[0].normals = {{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}};
    poses[1].normals = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Shapes s = shapes_at(graph, 1);
    CHECK(distance(deforming_of(s).normal[0], unit({0.25, 0, 0.75})) < 1e-15);
    CHECK(distance(deforming_of(s).normal[1], unit({0, 0.25, 0.75})) < 1e-15);
    CHECK(distance(deforming_of(s).normal[2], {0, 0, 1}) < 1e-15);
    poses[1].normals[0] = {0, 0, -1}; // half-way it has no direction
    pose_shapes("scene.aff", graph, 2, s);
    for (const Double3 &n : deforming_of(s).normal) CHECK(equal(n, {0, 0, 0}));
    // A deforming triangle in a moving, uneven node.
    graph.nodes = {named(-1, "x")};
    graph.deforming[0].node = 0;
    Placement wide;
    wide.scale = {4, 1, 1};
    graph.motions["x"] = motion_between(wide, wide);
    pose_shapes("scene.aff", graph, 1, s);
    CHECK(distance(deforming_of(s).normal[1], unit({0, 0.25, 0.75})) < 1e-14);
    poses[1].normals[0] = {1, 0, 0};
    pose_shapes("scene.aff", graph, 1, s);
    CHECK(distance(deforming_of(s).normal[0], unit({0.25 / 4, 0, 0.75})) < 1e-14);
}

TEST_CASE("pose: a body without volume is not seen") {
    SceneGraph graph;
    graph.nodes = {named(-1, "x")};
    graph.meshes = {one_triangle(0)};
    Placement flat;
    flat.scale = {1, 0, 1};
    graph.motions["x"] = motion_between(Placement(), flat);
    CHECK(shapes_at(graph, 0).instances[0].visible);
    CHECK(shapes_at(graph, 0.5).instances[0].visible);
    CHECK(!shapes_at(graph, 1).instances[0].visible);
    flat.scale = {1e-9, 1e-3, 1}; // thin is not flat
    graph.motions["x"] = motion_between(flat, flat);
    CHECK(shapes_at(graph, 0).instances[0].visible);
}

TEST_CASE("pose: no scene at all, and meshes without triangles") {
    const Shapes none = shapes_at(SceneGraph(), 0);
    CHECK(none.triangles.empty());
    CHECK(none.instances.empty());
    SceneGraph graph;
    graph.nodes = {named(-1, "x")};
    graph.motions["x"] = moved_by({1, 0, 0});
    graph.meshes = {one_triangle(0)};
    graph.meshes[0].rows.clear();
    CHECK(shapes_at(graph, 0).instances.empty());
}

TEST_CASE("pose: scales beyond all numbers are refused") {
    const auto huge_tree = [](double factor) {
        SceneGraph graph;
        Placement huge;
        huge.scale = {factor, factor, factor};
        for (int32_t i = 0; i < 15; ++i) graph.nodes.push_back(placed(i - 1, huge));
        return graph;
    };
    const auto message = [](const SceneGraph &graph) -> std::string {
        try {
            shapes_at(graph, 0);
        } catch (const InputError &error) {
            return error.what();
        }
        return "";
    };
    const std::string refused =
        "scene.aff:1: the transforms of a scene enlarge it beyond +-1e100, expected smaller scales";
    SceneGraph unmoved = huge_tree(1e30), instance = unmoved, deforming = unmoved, fits = huge_tree(1e6),
               small = huge_tree(1e-30);
    unmoved.meshes = {one_triangle(14)};
    CHECK(message(unmoved) == refused);
    instance.nodes.push_back(named(14, "x"));
    instance.motions["x"] = moved_by({1, 0, 0});
    instance.meshes = {one_triangle(15)};
    CHECK(message(instance) == refused);
    deforming.deforming = {one_deforming(14, {0, 1})};
    CHECK(message(deforming) == refused);
    fits.meshes = {one_triangle(14)};
    CHECK(message(fits) == "");
    small.meshes = {one_triangle(14)};
    small.meshes[0].normals = {{0, 0, 1}};
    CHECK(message(small) == "");
    CHECK(equal(shapes_at(small, 0).triangles[0].normal[0], {0, 0, 0}));
}
