// The point tree against brute force, bit for bit: layout, neighbours in a radius, the k nearest, leaves on a segment.
#include "wisp/point_tree.h"
#include "wisp/random.h"
#include <algorithm>
#include <doctest/doctest.h>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace wisp::WISP_ARITH {
namespace {

using Points = std::vector<Vec3>;

Real uniform(Mt19937 &random) { return Real(static_cast<int32_t>(random() >> 8)) * Real(0x1p-24); } // in [0, 1)

Vec3 uniform_point(Mt19937 &random) {
    const Real x = uniform(random), y = uniform(random), z = uniform(random);
    return Vec3(x, y, z);
}

Points random_points(uint32_t count, uint32_t seed) {
    Mt19937 random(seed, 1, 2, 3);
    Points points(count);
    for (Vec3 &p : points) p = (uniform_point(random) - Vec3(Real(0.5))) * Real(64);
    return points;
}

Points clustered_points(uint32_t count) {
    Mt19937 random(7, 1, 2, 3);
    Points points;
    Vec3 center(Real(0));
    while (points.size() < count) {
        if (points.size() % 100 == 0) center = (uniform_point(random) - Vec3(Real(0.5))) * Real(1000);
        const Vec3 offset = uniform_point(random);
        points.push_back(center + offset * offset * Real(0.5));
    }
    return points;
}

// Distances between these tie again and again.
Points lattice_points(int32_t edge, int32_t repeats) {
    Points points;
    for (int32_t r = 0; r < repeats; ++r)
        for (int32_t i = 0; i < edge * edge * edge; ++i)
            points.push_back(Vec3(Real(i % edge), Real(i / edge % edge), Real(i / (edge * edge))));
    return points;
}

Points flattened(Points points, bool x, bool y, bool z) {
    for (Vec3 &p : points) p = Vec3(x ? p.x : Real(3), y ? p.y : Real(-2), z ? p.z : Real(0));
    return points;
}

struct PointSet {
    std::string name;
    Points points;
};

std::vector<PointSet> point_sets() {
    std::vector<PointSet> sets;
    for (uint32_t count : {0, 1, 2, 7, 8, 9, 17, 63, 64, 65, 512, 513, 1000})
        sets.push_back({std::to_string(count) + " random", random_points(count, 100 + count)});
    sets.push_back({"clustered", clustered_points(1500)});
    sets.push_back({"lattice", lattice_points(9, 1)});
    sets.push_back({"doubled lattice", lattice_points(6, 3)});
    sets.push_back({"coincident", Points(700, Vec3(Real(5), Real(-1), Real(2)))});
    sets.push_back({"coplanar", flattened(random_points(600, 5), true, false, true)});
    sets.push_back({"collinear", flattened(random_points(600, 6), false, false, true)});
    sets.push_back({"tied on two axes", flattened(lattice_points(8, 1), true, true, false)});
    return sets;
}

// Owns the memory of one tree; room for the scratch of searches is left behind it.
struct Grown {
    std::vector<unsigned char> memory;
    Arena arena;
    PointTree tree;

    explicit Grown(const Points &points, size_t more = 1 << 16)
        : memory(static_cast<size_t>(point_tree_bytes(static_cast<uint32_t>(points.size()))) + more),
          arena(memory.data(), memory.size()),
          tree(build_point_tree(points.data(), static_cast<uint32_t>(points.size()), arena)) {
        REQUIRE(tree.ready);
    }
};

Vec3 point_at(const PointTree &tree, uint32_t slot) { return Vec3(tree.x[slot], tree.y[slot], tree.z[slot]); }

Real squared_distance(const Vec3 &a, const Vec3 &b) {
    const Vec3 d = a - b;
    return sum_of_products(d.x, d.x, d.y, d.y, d.z, d.z);
}

using Neighbour = std::pair<Real, uint32_t>; // squared distance, id

std::vector<Neighbour> neighbours_by_brute_force(const Points &points, const Vec3 &center, Real radius) {
    std::vector<Neighbour> all;
    for (uint32_t i = 0; i < points.size(); ++i) {
        const Real d = squared_distance(points[i], center);
        if (d < radius * radius) all.push_back({d, i});
    }
    std::sort(all.begin(), all.end());
    return all;
}

std::vector<Neighbour> nearest_by_tree(Grown &grown, const Vec3 &center, uint32_t k, Real radius) {
    const PointTree &tree = grown.tree;
    const size_t mark = grown.arena.mark();
    NearestScratch scratch;
    REQUIRE(make_nearest_scratch(k, grown.arena, scratch));
    std::vector<uint32_t> slots(k + 1, 12345);
    std::vector<Real> distances(k + 1, Real(54321));
    const Nearest found = nearest(tree, center, k, radius, scratch, slots.data(), distances.data());
    grown.arena.rewind(mark);
    REQUIRE(found.count <= k);
    CHECK(slots[found.count] == 12345); // nothing is written behind what was found
    std::vector<Neighbour> result;
    for (uint32_t i = 0; i < found.count; ++i) {
        if (i > 0) CHECK(slots[i - 1] < slots[i]);
        CHECK(distances[i] == squared_distance(point_at(tree, slots[i]), center));
        result.push_back({distances[i], tree.id[slots[i]]});
    }
    const auto farthest = std::max_element(result.begin(), result.end());
    if (found.count > 0) CHECK(found.farthest == farthest - result.begin());
    CHECK(found.radius_squared == (found.count > 0 ? farthest->first : Real(0)));
    std::sort(result.begin(), result.end());
    return result;
}

std::vector<Vec3> centers_for(const Points &points) {
    Mt19937 random(11, 1, 2, 3);
    std::vector<Vec3> centers = {Vec3(Real(0)), Vec3(Real(5), Real(-1), Real(2)),
                                 Vec3(Real(300), Real(-200), Real(90))};
    for (uint32_t i = 0; i < 12; ++i) {
        const Vec3 offset = uniform_point(random) - Vec3(Real(0.5));
        const size_t i_point = points.empty() ? 0 : random() % points.size();
        centers.push_back(points.empty() ? offset : points[i_point] + (i % 3 == 0 ? Vec3(Real(0)) : offset));
    }
    return centers;
}

// The box of block b's child `lane` at height h.
Box child_box(const PointTree &tree, uint32_t h, uint32_t child, Bound (&low)[3], Bound (&high)[3]) {
    const BoxBlock &block = tree.blocks[tree.first_block[h] + child / lanes];
    const uint32_t l = child % lanes;
    low[0] = block.low_x[l], low[1] = block.low_y[l], low[2] = block.low_z[l];
    high[0] = block.high_x[l], high[1] = block.high_y[l], high[2] = block.high_z[l];
    return {};
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": point tree: slots, ids and leaves") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        const PointTree &tree = grown.tree;
        const uint32_t count = static_cast<uint32_t>(set.points.size());
        CHECK(tree.count == count);
        CHECK(tree.leaf_count == (count + leaf_points - 1) / leaf_points);
        std::set<uint32_t> ids;
        for (uint32_t slot = 0; slot < count; ++slot) {
            REQUIRE(tree.id[slot] < count);
            ids.insert(tree.id[slot]);
            CHECK(point_at(tree, slot) == set.points[tree.id[slot]]);
            if (slot % leaf_points != 0) CHECK(tree.id[slot - 1] < tree.id[slot]);
        }
        CHECK(ids.size() == count);
        for (uint32_t slot = count; slot < point_tree_slots(count); ++slot) {
            CHECK(tree.id[slot] == no_point);
            for (const Vec3 &center : centers_for(set.points))
                CHECK(squared_distance(point_at(tree, slot), center) > Real(8192) * Real(8192));
        }
    }
}

} // namespace wisp::WISP_ARITH
