// Both trees over triangles against testing every triangle, bit for bit; their memory.
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_kdtree.h"
#include "support/triangle_sets.h"
#include <algorithm>
#include <cstring>
#include <set>

namespace wisp::WISP_ARITH {
namespace {

// ---- triangles ----

Triangles random_triangles(uint32_t count, uint32_t seed, double limit, double size) {
    Mt19937 random(seed, 1, 2, 3);
    Triangles all;
    for (uint32_t i = 0; i < count; ++i) {
        const Double3 a = point_within(random, limit), b = moved(a, point_within(random, size)),
                      c = moved(a, point_within(random, size));
        all.push_back(triangle_of(a, b, c, i % 3 == 0 ? clear : opaque));
    }
    return all;
}

// Apexes 2^-10 to 2^-24 above long edges.
Triangles slivers(uint32_t count) {
    Mt19937 random(21, 1, 2, 3);
    Triangles all;
    for (uint32_t i = 0; i < count; ++i) {
        const Double3 a = point_within(random, 4), d = point_within(random, 4);
        const double t = unit(random), height = std::ldexp(1, -10 - static_cast<int>(i % 15));
        const Double3 apex = moved({a.x + t * d.x, a.y + t * d.y, a.z + t * d.z}, point_within(random, height));
        all.push_back(triangle_of(a, moved(a, d), apex, i % 4 == 0 ? clear : opaque));
    }
    return all;
}

// Squares of a lattice in planes along the axes: shared edges and corners, planes of the tree in their planes; each
// twice, so that distances tie.
Triangles lattice_squares() {
    Triangles all;
    for (int twice = 0; twice < 2; ++twice)
        for (int level = -1; level <= 1; ++level)
            for (int i = -2; i < 2; ++i)
                for (int j = -2; j < 2; ++j)
                    for (int axis = 0; axis < 3; ++axis) {
                        const auto at = [&](double u, double v) {
                            const double w = level;
                            return axis == 0 ? Double3{w, u, v} : axis == 1 ? Double3{v, w, u} : Double3{u, v, w};
                        };
                        const uint32_t material = (i + j) % 2 == 0 ? opaque : clear;
                        all.push_back(triangle_of(at(i, j), at(i + 1, j), at(i + 1, j + 1), material));
                        all.push_back(triangle_of(at(i, j), at(i + 1, j + 1), at(i, j + 1), material));
                    }
    return all;
}

Triangles fan() {
    Mt19937 random(22, 1, 2, 3);
    Triangles all;
    std::vector<Double3> rim;
    for (int i = 0; i < 12; ++i)
        rim.push_back({3 * std::cos(i * 0.5236) + within(random, 0.1), 3 * std::sin(i * 0.5236), within(random, 0.5)});
    for (size_t i = 0; i < rim.size(); ++i) all.push_back(triangle_of({0.1, 0.2, 0.3}, rim[i], rim[(i + 1) % 12]));
    return all;
}

// Equal corners, collinear ones; one good triangle between them.
Triangles degenerate() {
    Triangles all;
    all.push_back(triangle_of({0, 0, 0}, {0, 0, 0}, {0, 0, 0}));
    all.push_back(triangle_of({1, 1, 1}, {1, 1, 1}, {2, 0, 1}));
    all.push_back(triangle_of({-3, -2, 0.5}, {3, -2, 0.5}, {0, 3, 0.5}));
    all.push_back(triangle_of({0, 0, 0}, {1, 1, 1}, {3, 3, 3}));
    all.push_back(triangle_of({-4, 0, 1}, {4, 0, 1}, {0.5, 0, 1}));
    all.push_back(triangle_of({0.125, 0.25, 0.5}, {0.25, 0.5, 1}, {1, 2, 4}));
    return all;
}

// Clusters of triangles, each at half of the last one's distance from 0, and half as large: a tree of boxes about
// them is as deep as there are clusters.
Triangles shrinking(int clusters, uint32_t members) {
    Triangles all;
    for (int k = 0; k < clusters; ++k) {
        const double size = std::ldexp(1, 1 - k);
        for (Triangle t : random_triangles(members, 80 + static_cast<uint32_t>(k), size, size / 8)) {
            for (Double3 &p : t.corner) p = moved(p, {2 * size, 2 * size, 2 * size});
            all.push_back(t);
        }
    }
    return all;
}

struct TriangleSet {
    std::string name;
    Triangles triangles;
};

Triangles joined(std::initializer_list<Triangles> parts) {
    Triangles all;
    for (const Triangles &part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

std::vector<TriangleSet> triangle_sets() {
    std::vector<TriangleSet> sets;
    for (uint32_t count : {0, 1, 2, 3, 4, 5, 8, 9, 60, 400})
        sets.push_back({std::to_string(count) + " random", random_triangles(count, 30 + count, 4, 1.5)});
    sets.push_back({"small and many", random_triangles(1500, 11, 4, 0.15)});
    sets.push_back({"all overlapping", random_triangles(300, 12, 0.1, 6)});
    sets.push_back({"slivers", slivers(300)});
    sets.push_back({"lattice", lattice_squares()});
    sets.push_back({"fan", fan()});
    sets.push_back({"degenerate", degenerate()});
    sets.push_back({"one triangle 200 times", Triangles(200, triangle_of({-3, -2, 1}, {3, -2, 0}, {0, 3, 0.5}))});
    sets.push_back({"huge and tiny", joined({random_triangles(20, 13, 1000, 4000), random_triangles(200, 14, 4, 0.01),
                                             random_triangles(200, 15, 0.01, 0.001)})});
    sets.push_back({"shrinking", shrinking(20, 60)});
    Triangles offset = random_triangles(300, 16, 2, 1);
    for (Triangle &t : offset)
        for (Double3 &p : t.corner) p = moved(p, {4000, -3000, 2500});
    sets.push_back({"far from 0", offset});
    sets.push_back({"a mixture",
                    joined({random_triangles(200, 17, 4, 1.5), slivers(100), lattice_squares(), fan(), degenerate()})});
    return sets;
}

// ---- rays ----

struct Query {
    Vec3 origin, direction;
    Real begin, end;
    uint32_t ignore_triangle;
};

Vec3 vec(double x, double y, double z) { return vec_of({x, y, z}); }

std::vector<Query> queries_for(const Triangles &triangles) {
    Mt19937 random(41, 1, 2, 3);
    std::vector<Query> queries;
    const uint32_t count = static_cast<uint32_t>(triangles.size());
    const Real far(20000);
    const auto any_triangle = [&] { return count > 0 ? random() % count : no_triangle; };
    const auto any_corner = [&] {
        const uint32_t i = any_triangle(), c = random() % 3;
        return count > 0 ? triangles[i].corner[c] : Double3{0, 0, 0};
    };
    const auto any_point = [&] { // of a triangle: inside, or on an edge
        if (count == 0) return Double3{0, 0, 0};
        const Double3 *p = triangles[any_triangle()].corner;
        const bool edge = random() % 2 == 0;
        const double u = unit(random), v = edge ? 0 : (1 - u) * unit(random), w = 1 - u - v;
        return Double3{w * p[0].x + u * p[1].x + v * p[2].x, w * p[0].y + u * p[1].y + v * p[2].y,
                       w * p[0].z + u * p[1].z + v * p[2].z};
    };
    const Double3 middle = any_corner();
    const auto add = [&](const Vec3 &origin, const Vec3 &direction, Real end, uint32_t ignore_triangle = no_triangle) {
        if (!(dot(direction, direction) > Real(0x1p-20))) return;
        queries.push_back({origin, direction, Real(0), end, ignore_triangle});
    };
    for (int i = 0; i < 120; ++i) {
        const Vec3 from = vec_of(moved(middle, point_within(random, 8))), to = vec_of(any_point());
        add(from, to - from, far); // aimed at a point; in units of its distance
        add(from, normalize(vec_of(point_within(random, 1)) + Vec3(Real(2), Real(0), Real(0))), far);
        add(vec_of(any_corner()), vec_of(point_within(random, 1)), far, any_triangle()); // from a corner
        const Vec3 corner = vec_of(any_corner()), other = vec_of(any_corner());
        add(corner, other - corner, Real(1), any_triangle()); // from corner to corner: along edges, in planes
        add(from, vec_of(any_corner()) - from, far);          // at a corner
        const Vec3 start = vec_of(any_point()), target = vec_of(any_point());
        add(start, target - start, Real(1) - Real(0x1p-10), any_triangle()); // shadow rays
        const double sign = i % 2 == 0 ? 1 : -1, zero = i % 4 < 2 ? 0.0 : -0.0;
        const Vec3 axis = i % 3 == 0   ? vec(sign, zero, zero)
                          : i % 3 == 1 ? vec(zero, sign, -zero)
                                       : vec(zero, zero, sign);
        add(to - axis * Real(7), axis, far);     // along an axis, at a point
        add(corner - axis * Real(7), axis, far); // at a corner, so along planes of the tree
        add(corner, axis, far);
        const Vec3 slanted = i % 3 == 0   ? vec(1, sign * 1e-7, zero)
                             : i % 3 == 1 ? vec(zero, 1, 1e-9)
                                          : vec(1, 0.5, zero);
        add(to - slanted * Real(5), slanted, far); // nearly along an axis, or in a plane of two
        add(vec_of(moved(any_point(), {200 * sign, 900, -300})), vec(-200 * sign, -900, 300), far); // from far away
        queries.push_back({from, to - from, Real(0.5), Real(1.5), any_triangle()});
        queries.push_back({from, to - from, Real(1.25), Real(1), no_triangle});  // an interval of nothing
        queries.push_back({from, to - from, Real(-3), Real(0.25), no_triangle}); // behind the origin
    }
    return queries;
}

// ---- testing every triangle ----

struct Every {
    std::vector<std::pair<uint32_t, TriangleHit>> hits; // in the interval, but for `ignore_triangle`
    bool occluded = false;
    SurfaceHit nearest;
    bool found = false;

    Every(const Triangles &triangles, const TriangleRay &ray, const Query &query) {
        for (uint32_t i = 0; i < triangles.size(); ++i) {
            TriangleHit hit;
            if (i == query.ignore_triangle || !has_area(triangles[i]) || !intersect(ray, triangles[i], hit)) continue;
            if (!(query.begin < hit.distance && hit.distance < query.end)) continue;
            hits.push_back({i, hit});
            occluded = occluded || triangles[i].material == opaque;
            if (!found || hit.distance < nearest.distance) nearest = {hit.distance, i, hit.u, hit.v, i};
            found = true;
        }
    }
    bool has(uint32_t triangle) const {
        return std::any_of(hits.begin(), hits.end(), [&](const auto &hit) { return hit.first == triangle; });
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": the triangle tree finds the hits of testing every triangle, to the bit") {
    const TreeKind kind = each_kind_of_tree();
    uint32_t hits = 0, occluded = 0, ties = 0;
    for (const TriangleSet &set : triangle_sets()) {
        CAPTURE(set.name);
        const Planted planted(set.triangles, kind);
        uint32_t wrong = 0;
        for (const Query &query : queries_for(set.triangles)) {
            const TriangleRay ray(query.origin, query.direction);
            const Every every(set.triangles, ray, query);
            TreeCounts counts = {0, 0};
            SurfaceHit hit;
            const bool found =
                nearest_hit(planted.tree, ray, query.begin, query.end, query.ignore_triangle, hit, counts);
            bool same = found == every.found;
            if (found && every.found)
                same = hit.distance == every.nearest.distance && hit.triangle == every.nearest.triangle &&
                       hit.u == every.nearest.u && hit.v == every.nearest.v;
            uint32_t occluder = 0;
            const bool stopped =
                any_hit(planted.tree, ray, query.begin, query.end, query.ignore_triangle, occluder, counts);
            same = same && stopped == every.occluded;
            if (stopped) same = same && every.has(occluder) && set.triangles[occluder].material == opaque;
            wrong += same ? 0 : 1;
            hits += found ? 1 : 0;
            occluded += stopped ? 1 : 0;
            for (const auto &other : every.hits)
                ties += found && other.first != hit.triangle && other.second.distance == hit.distance ? 1 : 0;
        }
        CHECK(wrong == 0);
    }
    CHECK(hits > 8000);
    CHECK(occluded > 6000);
    CHECK(ties > 1000);
}

TEST_CASE(WISP_ARITH_NAME ": rays of +0 and of -0, along planes of the tree and in faces of its box, see the same") {
    const TreeKind kind = each_kind_of_tree();
    const Triangles triangles = lattice_squares(); // in -2 ... 2, planes at whole numbers
    const Planted planted(triangles, kind);
    uint32_t wrong = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {1.0, -1.0})
            for (int i = -6; i <= 6; ++i)
                for (int j = -6; j <= 6; ++j)
                    for (const double behind : {-10.0, -2.0, -1.0, 0.0}) {
                        double from[3] = {i * 0.5, j * 0.5, sign * behind};
                        double forward[3] = {0, 0, sign}, negative[3] = {-0.0, -0.0, sign};
                        for (double *v : {from, forward, negative}) std::rotate(v, v + axis, v + 3);
                        const Query query = {vec(from[0], from[1], from[2]), vec(forward[0], forward[1], forward[2]),
                                             Real(0), Real(100), no_triangle};
                        const TriangleRay plus(query.origin, query.direction),
                            minus(query.origin, vec(negative[0], negative[1], negative[2]));
                        const Every every(triangles, plus, query);
                        for (const TriangleRay &ray : {plus, minus}) {
                            TreeCounts counts = {0, 0};
                            SurfaceHit hit;
                            const bool found =
                                nearest_hit(planted.tree, ray, query.begin, query.end, no_triangle, hit, counts);
                            const bool same =
                                found == every.found && (!found || (hit.triangle == every.nearest.triangle &&
                                                                    hit.distance == every.nearest.distance));
                            wrong += same ? 0 : 1;
                        }
                    }
    CHECK(wrong == 0);
}

TEST_CASE(WISP_ARITH_NAME ": the ends of an interval are outside, a hit at the origin is none") {
    const TreeKind kind = each_kind_of_tree();
    const Triangles triangles = {triangle_of({-4, -4, 2}, {4, -4, 2}, {0, 4, 2}),
                                 triangle_of({-4, -4, 3}, {4, -4, 3}, {0, 4, 3})};
    const Planted planted(triangles, kind);
    TreeCounts counts = {0, 0};
    SurfaceHit hit;
    uint32_t occluder = 7;
    const TriangleRay ray(vec(0, 0, 0), vec(0, 0, 1)), from_plane(vec(0, 0, 2), vec(0, 0, 1));
    CHECK_FALSE(nearest_hit(planted.tree, ray, Real(0), Real(2), no_triangle, hit, counts));
    CHECK_FALSE(any_hit(planted.tree, ray, Real(0), Real(2), no_triangle, occluder, counts));
    REQUIRE(nearest_hit(planted.tree, ray, Real(2), Real(4), no_triangle, hit, counts));
    CHECK(hit.triangle == 1);
    REQUIRE(nearest_hit(planted.tree, from_plane, Real(0), Real(4), no_triangle, hit, counts));
    CHECK(hit.triangle == 1);
    REQUIRE(any_hit(planted.tree, ray, Real(0), Real(4), 0, occluder, counts));
    CHECK(occluder == 1);
    CHECK_FALSE(any_hit(planted.tree, ray, Real(0), Real(3), 0, occluder, counts));
    CHECK_FALSE(nearest_hit(planted.tree, ray, Real(3), Real(1), no_triangle, hit, counts));
}

TEST_CASE(WISP_ARITH_NAME ": the same triangles make the same tree, of no more bytes than planned") {
    const TreeKind kind = each_kind_of_tree();
    Mt19937 random(51, 1, 2, 3);
    for (int run = 0; run < 60; ++run) {
        const uint32_t count = random() % 700;
        const double limit = std::ldexp(1, static_cast<int>(random() % 12) - 4);
        const double size = limit * std::ldexp(2, -static_cast<int>(random() % 8));
        const Triangles triangles = random_triangles(count, 60 + static_cast<uint32_t>(run), limit, size);
        const Planted one(triangles, kind), two(triangles, kind);
        CHECK(one.arena.mark() < one.arena.peak());
        REQUIRE(one.tree.node_count == two.tree.node_count);
        REQUIRE(one.tree.group_count == two.tree.group_count);
        const size_t bytes = one.tree.node_count * (kind == TreeKind::bvh ? sizeof(BoxNode) : sizeof(TriangleNode));
        const auto nodes = [kind](const Planted &planted) {
            return kind == TreeKind::bvh ? static_cast<const void *>(planted.tree.boxes) : planted.tree.nodes;
        };
        if (bytes > 0) CHECK(std::memcmp(nodes(one), nodes(two), bytes) == 0);
        CHECK(one.tree.root == two.tree.root);
        std::set<uint32_t> listed;
        for (uint32_t i = 0; i < one.tree.group_count; ++i)
            for (const uint32_t t : one.tree.groups[i].triangle)
                if (t != no_triangle) listed.insert(t & ~transmissive_bit);
        CHECK(listed.size() == one.tree.triangle_count);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a search of the deepest tree of boxes has room on its stack") {
    uint32_t most = 0, narrow = 0;
    for (const uint32_t members : {8, 60, 2000}) {
        const Planted planted(shrinking(24, members), TreeKind::bvh);
        std::vector<std::pair<uint32_t, uint32_t>> stack = {{planted.tree.root, 0}}; // and what waits above
        while (!stack.empty()) {
            const auto [node, waiting] = stack.back();
            stack.pop_back();
            most = std::max(most, waiting + 1);
            if (is_leaf(node)) continue;
            const BoxNode &box = planted.tree.boxes[node];
            uint32_t children = 0;
            for (uint32_t lane = 0; lane < lanes; ++lane)
                children += box.plane[0][0][lane] <= box.plane[1][0][lane] ? 1 : 0;
            for (uint32_t lane = 0; lane < children; ++lane) stack.push_back({box.child[lane], waiting + children - 1});
            narrow += waiting > 60 && children == 2 && !is_leaf(box.child[0]) ? 1 : 0;
        }
    }
    CHECK(most > 80); // 123, if no node were divided in two
    CHECK(most <= bvh_stack);
    CHECK(narrow > 0); // what is below many waiting children is divided in two, not in eight
}

TEST_CASE(WISP_ARITH_NAME ": 20,000 triangles that all overlap fit the plan") {
    const TreeKind kind = each_kind_of_tree();
    for (const double limit : {0.01, 3.0}) {
        const Triangles triangles = random_triangles(20000, 71, limit, 6);
        const Planted planted(triangles, kind);
        const Vec3 origin = vec(7, 8, 9);
        uint32_t wrong = 0;
        for (int i = 0; i < 8; ++i) {
            const TriangleRay ray(origin, vec(-7 + 0.1 * i, -8, -9));
            const Query query = {origin, ray.direction, Real(0), Real(100), no_triangle};
            const Every every(triangles, ray, query);
            TreeCounts counts = {0, 0};
            SurfaceHit hit;
            const bool found = nearest_hit(planted.tree, ray, query.begin, query.end, no_triangle, hit, counts);
            wrong += found != every.found || (found && hit.triangle != every.nearest.triangle) ? 1 : 0;
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": few nodes and triangles are looked at") {
    const TreeKind kind = each_kind_of_tree();
    const Triangles triangles = random_triangles(3000, 72, 4, 0.1);
    const Planted planted(triangles, kind);
    Mt19937 random(73, 1, 2, 3);
    TreeCounts counts = {0, 0};
    for (int i = 0; i < 1000; ++i) {
        const Vec3 from = vec_of(point_within(random, 4)), to = vec_of(point_within(random, 4));
        SurfaceHit hit;
        nearest_hit(planted.tree, TriangleRay(from, to - from), Real(0), Real(1000), no_triangle, hit, counts);
    }
    CHECK(counts.node_visits < 100 * 1000);
    CHECK(counts.triangle_tests < 100 * 1000);
}

TEST_CASE(WISP_ARITH_NAME ": an arena that is too small gives no tree, and is left as it was") {
    const TreeKind kind = each_kind_of_tree();
    const Triangles triangles = random_triangles(100, 81, 4, 1);
    std::vector<unsigned char> memory(static_cast<size_t>(triangle_tree_bytes(kind, 100)));
    for (const size_t size : {size_t{0}, memory.size() / 8, memory.size() / 2, memory.size() - 600}) {
        Arena arena(memory.data(), size);
        CHECK_FALSE(make_triangle_tree(kind, triangles.data(), 100, materials, arena).ready);
        CHECK(arena.mark() == 0);
    }
}

} // namespace wisp::WISP_ARITH
