// The point tree against brute force, bit for bit: layout, neighbours in a radius, the k nearest, leaves on a segment.
#include "core/geometry/point_kdtree.h"
#include "core/numbers/random.h"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <set>
#include <string>
#include <type_traits>
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

// Many distances between these points are equal.
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
    Points minute = random_points(600, 8); // in fixed, squares of distances are 0
    for (Vec3 &p : minute) p *= Real(0x1p-26);
    sets.push_back({"minute", minute});
    sets.push_back({"doubled lattice", lattice_points(6, 3)});
    sets.push_back({"coincident", Points(700, Vec3(Real(5), Real(-1), Real(2)))});
    sets.push_back({"coplanar", flattened(random_points(600, 5), true, false, true)});
    sets.push_back({"collinear", flattened(random_points(600, 6), false, false, true)});
    sets.push_back({"tied on two axes", flattened(lattice_points(8, 1), true, true, false)});
    return sets;
}

// Owns the memory of one tree, and memory for the scratch of searches behind it.
struct Grown {
    std::vector<unsigned char> memory;
    Arena arena;
    PointTree tree;

    explicit Grown(const Points &points, size_t more = 1 << 18)
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
    CHECK(slots[found.count] == 12345); // nothing is written behind the last result
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

// Box `lane` of a block, as bounds that can be compared with those of points.
struct Bounds {
    Bound low[3], high[3];
};
Bounds bounds_of_child(const PointTree &tree, uint32_t height, uint32_t child) {
    const BoxBlock &block = tree.blocks[tree.first_block[height] + child / children];
    const uint32_t l = child % children;
    return {{block.low_x[l], block.low_y[l], block.low_z[l]}, {block.high_x[l], block.high_y[l], block.high_z[l]}};
}

// Exact bounds, and the rounding that is allowed outwards.
template <class T> double value_of(T x) {
    if constexpr (std::is_same_v<T, Fixed>) {
        return static_cast<double>(x.raw()) * 0x1p-32;
    } else if constexpr (std::is_same_v<T, int32_t>) {
        return x * 0x1p-12;
    } else {
        return static_cast<double>(x);
    }
}
double bound_resolution(double x) {
    if (std::is_same_v<Real, float>) return 0;
    return std::is_same_v<Real, double> ? std::abs(x) * 0x1p-23 + 0x1p-149 : 0x1p-12;
}

std::vector<uint32_t> leaves_near(const PointTree &tree, const Vec3 &center, Real radius) {
    std::vector<uint32_t> leaves;
    for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) { leaves.push_back(leaf); });
    return leaves;
}

struct Segment {
    Vec3 origin, direction;
    Real t0, t1;
};

std::vector<uint32_t> leaves_on(const PointTree &tree, const Segment &s, Real radius) {
    std::vector<uint32_t> leaves;
    for_each_leaf_on_segment(tree, s.origin, s.direction, s.t0, s.t1, radius,
                             [&](uint32_t leaf) { leaves.push_back(leaf); });
    return leaves;
}

// The distance of a point from a segment, in double whatever Real is.
double distance_from(const Segment &s, const Vec3 &p) {
    const double o[3] = {value_of(s.origin.x), value_of(s.origin.y), value_of(s.origin.z)};
    const double d[3] = {value_of(s.direction.x), value_of(s.direction.y), value_of(s.direction.z)};
    const double q[3] = {value_of(p.x), value_of(p.y), value_of(p.z)};
    double along = 0, length = 0, squared = 0;
    for (int a = 0; a < 3; ++a) along += (q[a] - o[a]) * d[a], length += d[a] * d[a];
    const double t = std::min(std::max(along / length, value_of(s.t0)), value_of(s.t1));
    for (int a = 0; a < 3; ++a) squared += (q[a] - o[a] - t * d[a]) * (q[a] - o[a] - t * d[a]);
    return std::sqrt(squared);
}

std::vector<Segment> segments_for(const Points &points) {
    Mt19937 random(13, 1, 2, 3);
    std::vector<Segment> segments;
    const Vec3 axes[] = {Vec3(Real(1), Real(0), Real(0)), Vec3(Real(0), Real(-1), Real(0)),
                         Vec3(Real(0), Real(0), Real(1)), Vec3(Real(-1), -Real(0), -Real(0))};
    for (const Vec3 &axis : axes)
        for (int i = 0; i < 4;
             ++i) { // through points, hence along the planes of boxes, from far outside and from inside
            const Vec3 p = points.empty() ? Vec3(Real(0)) : points[random() % points.size()];
            segments.push_back({p - axis * Real(i % 2 == 0 ? 2000 : 0), axis, Real(0), Real(4000)});
        }
    for (int i = 0; i < 30; ++i) {
        const Vec3 p = points.empty() ? Vec3(Real(0)) : points[random() % points.size()];
        const Vec3 toward = uniform_point(random) - Vec3(Real(0.5));
        const Vec3 direction = normalize(toward + Vec3(Real(0x1p-10)));
        const Real back = uniform(random) * Real(i % 3 == 0 ? 1000 : 10), length = uniform(random) * Real(30);
        segments.push_back({p - direction * back, direction, Real(0), back + length});
        segments.push_back({p, direction, Real(-5), length - Real(4)});
        segments.push_back({p + Vec3(Real(3)), direction, Real(0), Real(0)}); // a point
    }
    return segments;
}

// The layout as the header defines it, by sorting: ids in the order of slots.
void lay_out(const Points &points, std::vector<uint32_t>::iterator first, std::vector<uint32_t>::iterator end,
             uint32_t height) {
    uint64_t child = leaf_points;
    for (uint32_t h = 0; h < height; ++h) child *= children;
    const uint64_t count = static_cast<uint64_t>(end - first), child_count = (count + child - 1) / child;
    if (child_count == 1 && height == 0) return std::sort(first, end);
    if (child_count == 1) return lay_out(points, first, end, height - 1);
    const auto coordinate = [&](uint32_t id, int axis) { return points[id][axis]; };
    int widest = 0;
    Real extents[3];
    for (int axis = 0; axis < 3; ++axis) {
        Real low = coordinate(*first, axis), high = low;
        for (auto i = first; i != end; ++i) {
            low = min(low, coordinate(*i, axis));
            high = max(high, coordinate(*i, axis));
        }
        extents[axis] = high - low;
        if (extents[widest] < extents[axis]) widest = axis;
    }
    std::sort(first, end, [&](uint32_t a, uint32_t b) {
        return std::make_pair(coordinate(a, widest), a) < std::make_pair(coordinate(b, widest), b);
    });
    const auto cut = first + static_cast<std::ptrdiff_t>((child_count + 1) / 2 * child);
    lay_out(points, first, cut, height);
    lay_out(points, cut, end, height);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": point tree: every point has one slot, leaves are full and ordered by id") {
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

TEST_CASE(WISP_ARITH_NAME ": point tree: boxes are tight at every height") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        const PointTree &tree = grown.tree;
        uint64_t leaves_of_child = 1;
        for (uint32_t h = 0; h < tree.height; ++h, leaves_of_child *= children) {
            const uint32_t child_count =
                static_cast<uint32_t>((tree.leaf_count + leaves_of_child - 1) / leaves_of_child);
            const uint32_t padded = (child_count + children - 1) / children * children;
            for (uint32_t child = 0; child < padded; ++child) {
                const Bounds box = bounds_of_child(tree, h, child);
                if (child >= child_count) {
                    for (int a = 0; a < 3; ++a) CHECK(box.low[a] > box.high[a]);
                    continue;
                }
                const uint64_t points_of_child = leaves_of_child * leaf_points;
                const uint32_t first = static_cast<uint32_t>(child * points_of_child);
                const uint32_t end = static_cast<uint32_t>(std::min<uint64_t>(first + points_of_child, tree.count));
                for (int a = 0; a < 3; ++a) {
                    const Real *coordinate = a == 0 ? tree.x : a == 1 ? tree.y : tree.z;
                    const Real low = *std::min_element(coordinate + first, coordinate + end);
                    const Real high = *std::max_element(coordinate + first, coordinate + end);
                    const double below = value_of(low) - value_of(box.low[a]);
                    const double above = value_of(box.high[a]) - value_of(high);
                    CHECK(below >= 0);
                    CHECK(below <= bound_resolution(value_of(low)));
                    CHECK(above >= 0);
                    CHECK(above <= bound_resolution(value_of(high)));
                }
            }
        }
        if (tree.height > 0) CHECK(leaves_of_child >= tree.leaf_count);
        if (tree.height > 1) CHECK(leaves_of_child / children < tree.leaf_count); // every height is needed
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: cuts are medians across the widest extent") {
    // 3 leaves: two of them before the cut, across y; then one each, across x.
    Points points;
    for (int32_t i = 0; i < static_cast<int32_t>(3 * leaf_points); ++i)
        points.push_back(Vec3(Real(i * 7 % 16), Real(i * 100), Real(1)));
    const Grown grown(points);
    for (uint32_t slot = 2 * leaf_points; slot < 3 * leaf_points; ++slot) CHECK(grown.tree.id[slot] == slot);
    Points flat = points;
    for (Vec3 &p : flat) p.y = Real(0);
    const Grown wide(flat);
    Real largest_before = Real(-1), least_behind = Real(99);
    for (uint32_t slot = 0; slot < 3 * leaf_points; ++slot) {
        const Real x = wide.tree.x[slot];
        if (slot < 2 * leaf_points)
            largest_before = max(largest_before, x);
        else
            least_behind = min(least_behind, x);
    }
    CHECK(largest_before <= least_behind);
}

TEST_CASE(WISP_ARITH_NAME ": point tree: the layout is the one that its definition gives") {
    auto sets = point_sets();
    sets.push_back({"10,000 random", random_points(10000, 4)});
    sets.push_back({"8,000 of few coordinates", lattice_points(4, 125)});
    for (const PointSet &set : sets) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        std::vector<uint32_t> ids(set.points.size());
        for (uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
        if (!ids.empty()) lay_out(set.points, ids.begin(), ids.end(), grown.tree.height - 1);
        CHECK(ids == std::vector<uint32_t>(grown.tree.id, grown.tree.id + grown.tree.count));
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: a permuted input has the same points in the same leaves") {
    for (const Points &points : {random_points(1000, 42), clustered_points(1100)}) {
        Points permuted = points;
        Mt19937 random(3, 1, 2, 3);
        for (size_t i = permuted.size(); i > 1; --i) std::swap(permuted[i - 1], permuted[random() % i]);
        const Grown first(points), second(permuted);
        const auto key = [](const Vec3 &p) {
            return std::make_pair(value_of(p.x), std::make_pair(value_of(p.y), value_of(p.z)));
        };
        for (uint32_t leaf = 0; leaf < first.tree.leaf_count; ++leaf) {
            std::multiset<decltype(key(points[0]))> a, b;
            for (uint32_t slot = leaf * leaf_points; slot < min((leaf + 1) * leaf_points, first.tree.count); ++slot) {
                a.insert(key(point_at(first.tree, slot)));
                b.insert(key(point_at(second.tree, slot)));
            }
            CHECK(a == b);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: the k nearest equal brute force, ties by id") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        Grown grown(set.points);
        for (const Vec3 &center : centers_for(set.points))
            for (const uint32_t k : {1u, 2u, 7u, 64u, 500u, 2000u})
                for (const Real radius : {Real(30000), Real(3), Real(0.25), Real(0)}) {
                    CAPTURE(k);
                    auto expected = neighbours_by_brute_force(set.points, center, radius);
                    if (expected.size() > k) expected.resize(k);
                    CHECK(nearest_by_tree(grown, center, k, radius) == expected);
                }
        CHECK(nearest_by_tree(grown, Vec3(Real(0)), 0, Real(10)).empty());
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: points in a radius equal brute force") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        for (const Vec3 &center : centers_for(set.points))
            for (const Real radius : {Real(0), Real(0.25), Real(1), Real(20), Real(30000)}) {
                const auto expected = neighbours_by_brute_force(set.points, center, radius);
                std::vector<uint32_t> slots(expected.size() + 1, 12345);
                const uint32_t capacity = static_cast<uint32_t>(expected.size());
                REQUIRE(in_radius(grown.tree, center, radius, slots.data(), capacity) == expected.size());
                CHECK(slots.back() == 12345);
                slots.pop_back();
                CHECK(std::is_sorted(slots.begin(), slots.end()));
                std::vector<Neighbour> found;
                for (const uint32_t slot : slots)
                    found.push_back({squared_distance(point_at(grown.tree, slot), center), grown.tree.id[slot]});
                std::sort(found.begin(), found.end());
                CHECK(found == expected);
                if (expected.size() > 1) {
                    std::vector<uint32_t> one(2, 12345);
                    CHECK(in_radius(grown.tree, center, radius, one.data(), 1) == expected.size());
                    CHECK(one[0] == slots[0]);
                    CHECK(one[1] == 12345);
                }
            }
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: sums over near leaves equal sums over all leaves, bit for bit") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        const PointTree &tree = grown.tree;
        for (const Vec3 &center : centers_for(set.points)) {
            const Real radius(2);
            Real near_sum(0), whole_sum(0);
            const auto add_leaf = [&](uint32_t leaf, Real &sum) {
                for (uint32_t slot = leaf * leaf_points; slot < min((leaf + 1) * leaf_points, tree.count); ++slot) {
                    const Real d = squared_distance(point_at(tree, slot), center);
                    if (d < radius * radius) sum += Real(1) / (d + Real(1));
                }
            };
            for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) { add_leaf(leaf, near_sum); });
            for (uint32_t leaf = 0; leaf < tree.leaf_count; ++leaf) add_leaf(leaf, whole_sum);
            CHECK(near_sum == whole_sum);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: no leaf near a point is missed, and few are called in vain") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        const PointTree &tree = grown.tree;
        for (const Vec3 &center : centers_for(set.points))
            for (const Real radius : {Real(0), Real(1), Real(20), Real(30000)}) {
                const auto leaves = leaves_near(tree, center, radius);
                CHECK(std::is_sorted(leaves.begin(), leaves.end()));
                CHECK(std::adjacent_find(leaves.begin(), leaves.end()) == leaves.end());
                if (!leaves.empty()) CHECK(leaves.back() < tree.leaf_count);
                for (uint32_t slot = 0; slot < tree.count; ++slot)
                    if (squared_distance(point_at(tree, slot), center) <= radius * radius)
                        CHECK(std::binary_search(leaves.begin(), leaves.end(), slot / leaf_points));
            }
    }
    const Grown grown(random_points(1000, 9));
    CHECK(leaves_near(grown.tree, Vec3(Real(500), Real(0), Real(0)), Real(400)).empty());
}

TEST_CASE(WISP_ARITH_NAME ": point tree: no leaf near a segment is missed, and few are called in vain") {
    for (const PointSet &set : point_sets()) {
        CAPTURE(set.name);
        const Grown grown(set.points);
        const PointTree &tree = grown.tree;
        for (const Segment &segment : segments_for(set.points))
            for (const Real radius : {Real(0), Real(0.5), Real(20)}) {
                const auto leaves = leaves_on(tree, segment, radius);
                CHECK(std::is_sorted(leaves.begin(), leaves.end()));
                CHECK(std::adjacent_find(leaves.begin(), leaves.end()) == leaves.end());
                if (!leaves.empty()) CHECK(leaves.back() < tree.leaf_count);
                for (uint32_t slot = 0; slot < tree.count; ++slot)
                    if (distance_from(segment, point_at(tree, slot)) <= value_of(radius))
                        CHECK(std::binary_search(leaves.begin(), leaves.end(), slot / leaf_points));
            }
    }
    // Beside the points, and before and behind them on a line through them.
    const Grown grown(random_points(1000, 9));
    const Vec3 along(Real(1), Real(0), Real(0));
    CHECK(leaves_on(grown.tree, {Vec3(Real(-100), Real(40), Real(0)), along, Real(0), Real(200)}, Real(7)).empty());
    CHECK(leaves_on(grown.tree, {Vec3(Real(-100), Real(0), Real(0)), along, Real(0), Real(60)}, Real(7)).empty());
    CHECK(leaves_on(grown.tree, {Vec3(Real(-100), Real(0), Real(0)), along, Real(140), Real(200)}, Real(7)).empty());
    const Vec3 diagonal = normalize(Vec3(Real(1), Real(1), Real(0)));
    CHECK(leaves_on(grown.tree, {Vec3(Real(-100), Real(-30), Real(0)), diagonal, Real(0), Real(300)}, Real(4)).empty());
    const auto crossed =
        leaves_on(grown.tree, {Vec3(Real(-100), Real(1), Real(0)), along, Real(0), Real(200)}, Real(1));
    CHECK(crossed.size() >= 4);
    CHECK(crossed.size() <= 20); // of 63
}

TEST_CASE(WISP_ARITH_NAME ": point tree: of points with unlike radii, none that reaches a place is missed") {
    for (const PointSet &set : point_sets()) {
        if (set.points.empty()) continue;
        CAPTURE(set.name);
        Mt19937 random(17, 1, 2, 3);
        std::vector<Real> radii;
        Real largest(0), smallest(1000);
        while (radii.size() < set.points.size()) { // from 2^-10 to 16
            Real radius = Real(16) * (Real(0.5) + Real(0.5) * uniform(random));
            for (uint32_t halvings = random() % 14; halvings > 0; --halvings) radius = radius * Real(0.5);
            radii.push_back(radius);
            largest = max(largest, radius), smallest = min(smallest, radius);
        }
        const uint32_t count = static_cast<uint32_t>(set.points.size());
        std::vector<unsigned char> memory(static_cast<size_t>(point_tree_bytes(count)));
        Arena arena(memory.data(), memory.size());
        const PointTree tree = build_point_tree(set.points.data(), count, arena, {}, radii.data());
        REQUIRE(tree.ready);
        CHECK(tree.has_radii == (smallest * Real(most_unlike) < largest));
        if (!tree.has_radii) continue;
        std::set<uint32_t> ids(tree.id, tree.id + count);
        CHECK(ids.size() == count);
        const auto check = [&](const std::vector<uint32_t> &leaves, auto &&distance, double more) {
            CHECK(std::is_sorted(leaves.begin(), leaves.end()));
            for (uint32_t slot = 0; slot < count; ++slot)
                if (distance(point_at(tree, slot)) <= value_of(radii[tree.id[slot]]) + more)
                    CHECK(std::binary_search(leaves.begin(), leaves.end(), slot / leaf_points));
        };
        for (const Vec3 &center : centers_for(set.points))
            for (const Real more : {Real(0), Real(3), Real(30000)}) {
                std::vector<uint32_t> leaves;
                for_each_leaf_reaching(tree, center, more, largest, [&](uint32_t leaf) { leaves.push_back(leaf); });
                check(
                    leaves, [&](const Vec3 &p) { return std::sqrt(value_of(squared_distance(p, center))); },
                    value_of(more));
            }
        for (const Segment &s : segments_for(set.points)) {
            std::vector<uint32_t> leaves;
            for_each_leaf_reaching_segment(tree, s.origin, s.direction, s.t0, s.t1, largest,
                                           [&](uint32_t leaf) { leaves.push_back(leaf); });
            check(
                leaves, [&](const Vec3 &p) { return distance_from(s, p); }, 0);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": point tree: one large point does not make a search visit every small one") {
    Points points = random_points(4000, 21);
    std::vector<Real> radii(points.size(), Real(0.25));
    for (size_t i = 0; i < points.size(); i += 100) radii[i] = Real(64);
    const uint32_t count = static_cast<uint32_t>(points.size());
    std::vector<unsigned char> memory(static_cast<size_t>(point_tree_bytes(count)));
    Arena arena(memory.data(), memory.size());
    const PointTree tree = build_point_tree(points.data(), count, arena, {}, radii.data());
    REQUIRE(tree.has_radii);
    uint32_t visited = 0;
    for_each_leaf_reaching(tree, Vec3(Real(0)), Real(0), Real(64), [&](uint32_t) { ++visited; });
    CHECK(visited >= 3);  // 40 large points
    CHECK(visited <= 12); // of 250 leaves
    visited = 0;
    for_each_leaf_reaching_segment(tree, Vec3(Real(-40), Real(1), Real(2)), Vec3(Real(1), Real(0), Real(0)), Real(0),
                                   Real(80), Real(64), [&](uint32_t) { ++visited; });
    CHECK(visited >= 3);
    CHECK(visited <= 40);
    // Radii that are less unlike change nothing.
    for (Real &radius : radii) radius = min(radius, Real(1));
    arena.rewind(0);
    const PointTree alike = build_point_tree(points.data(), count, arena, {}, radii.data());
    CHECK_FALSE(alike.has_radii);
    const std::vector<uint32_t> with_radii(alike.id, alike.id + count);
    arena.rewind(0);
    const PointTree plain = build_point_tree(points.data(), count, arena);
    CHECK(std::equal(with_radii.begin(), with_radii.end(), plain.id));
}

TEST_CASE(WISP_ARITH_NAME ": point tree: an arena that is too small is refused and left as it was") {
    for (const uint32_t count : {1u, 100u, 3000u}) {
        const Points points = random_points(count, 77);
        std::vector<unsigned char> memory(static_cast<size_t>(point_tree_bytes(count)));
        uint32_t refused = 0, built = 0;
        for (size_t size = 0; size <= memory.size(); size += memory.size() / 16) {
            Arena arena(memory.data(), size);
            const PointTree tree = build_point_tree(points.data(), count, arena);
            CHECK(arena.peak() <= size);
            ++(tree.ready ? built : refused);
            if (!tree.ready) {
                CHECK(arena.mark() == 0);
                CHECK(tree.count == 0);
            }
        }
        CHECK(refused > 0);
        Arena whole(memory.data(), memory.size());
        CHECK(build_point_tree(points.data(), count, whole).ready);
        CHECK(whole.mark() < whole.peak()); // the scratch is given back
    }
    unsigned char little[64];
    Arena arena(little, sizeof little);
    NearestScratch scratch;
    CHECK_FALSE(make_nearest_scratch(500, arena, scratch));
    CHECK(arena.mark() == 0);
    std::vector<unsigned char> enough(static_cast<size_t>(nearest_scratch_bytes(500)));
    Arena large(enough.data(), enough.size());
    CHECK(make_nearest_scratch(500, large, scratch));
}

} // namespace wisp::WISP_ARITH
