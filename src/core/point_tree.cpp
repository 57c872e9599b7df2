// Building the point tree and searching the k nearest (S5).
#include "wisp/point_tree.h"
#include <algorithm>

namespace wisp {
namespace detail {

// Where the slots are that hold no point: beyond every radius, and in Fixed no square of a distance overflows.
inline float far_from_all(float) { return 0x1p60f; }
inline double far_from_all(double) { return 0x1p60; }
inline Fixed far_from_all(Fixed) { return Fixed(28672); }

inline float below(float x) { return x; }
inline float above(float x) { return x; }
inline float above(double x) {
    const float f = static_cast<float>(x);
    return f < x ? from_bits<float>(to_bits(f) + (f < 0 ? -1 : 1)) : f;
}
inline float below(double x) { return -above(-x); }
inline int32_t below(Fixed x) { return static_cast<int32_t>(x.raw() >> 20); }
inline int32_t above(Fixed x) { return -static_cast<int32_t>(-x.raw() >> 20); }

inline float beyond(float) { return 0x1p62f; }
inline int32_t beyond(int32_t) { return 1 << 29; }

} // namespace detail
} // namespace wisp

namespace wisp::WISP_ARITH {

using namespace detail;

namespace {

struct Record {
    Real coordinate[3];
    uint32_t id;
};

constexpr uint32_t leaves_below(uint32_t height) { return uint32_t{1} << (3 * height); } // of a child of such a block
constexpr uint32_t blocks_of(uint32_t leaves, uint32_t height) {
    return static_cast<uint32_t>((uint64_t{leaves} + leaves_below(height) * uint64_t{lanes} - 1) >> (3 * height + 3));
}
uint32_t height_of(uint32_t leaves) {
    uint32_t height = leaves == 0 ? 0 : 1;
    while (height > 0 && blocks_of(leaves, height - 1) > 1) ++height;
    return height;
}

struct Builder {
    Record *records;
    Real *x, *y, *z;
    uint32_t *id;
    BoxBlock *leaf_boxes;

    void build(uint32_t first, uint32_t end, uint32_t height) {
        const uint32_t child = leaves_below(height) * leaf_points;
        const uint32_t children = (end - first + child - 1) / child;
        if (children == 1) {
            if (height == 0)
                make_leaf(first, end);
            else
                build(first, end, height - 1);
            return;
        }
        Real low[3], high[3];
        for (int a = 0; a < 3; ++a) low[a] = high[a] = records[first].coordinate[a];
        for (uint32_t i = first; i < end; ++i)
            for (int a = 0; a < 3; ++a) {
                low[a] = min(low[a], records[i].coordinate[a]);
                high[a] = max(high[a], records[i].coordinate[a]);
            }
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
        const uint32_t cut = first + (children + 1) / 2 * child;
        std::nth_element(records + first, records + cut, records + end, [axis](const Record &a, const Record &b) {
            return a.coordinate[axis] < b.coordinate[axis] || (a.coordinate[axis] == b.coordinate[axis] && a.id < b.id);
        });
        build(first, cut, height);
        build(cut, end, height);
    }

    void make_leaf(uint32_t first, uint32_t end) {
        std::sort(records + first, records + end, [](const Record &a, const Record &b) { return a.id < b.id; });
        Vec3 low(records[first].coordinate[0], records[first].coordinate[1], records[first].coordinate[2]);
        Vec3 high = low;
        for (uint32_t i = first; i < end; ++i) {
            const Record &r = records[i];
            const Vec3 p(r.coordinate[0], r.coordinate[1], r.coordinate[2]);
            x[i] = p.x, y[i] = p.y, z[i] = p.z, id[i] = r.id;
            low = lowest(low, p);
            high = highest(high, p);
        }
        const uint32_t leaf = first / leaf_points;
        BoxBlock &block = leaf_boxes[leaf / lanes];
        const uint32_t lane = leaf % lanes;
        block.low_x[lane] = below(low.x), block.low_y[lane] = below(low.y), block.low_z[lane] = below(low.z);
        block.high_x[lane] = above(high.x), block.high_y[lane] = above(high.y), block.high_z[lane] = above(high.z);
    }
};

void fill_empty(BoxBlock &block, uint32_t lane) {
    block.low_x[lane] = block.low_y[lane] = block.low_z[lane] = beyond(Bound());
    block.high_x[lane] = block.high_y[lane] = block.high_z[lane] = -beyond(Bound());
}

} // namespace

uint64_t point_tree_bytes(uint32_t count) {
    const uint64_t slots = (uint64_t{count} + leaf_points - 1) / leaf_points * leaf_points;
    uint64_t blocks = 0;
    const uint32_t leaves = static_cast<uint32_t>(slots / leaf_points);
    for (uint32_t h = 0; h < height_of(leaves); ++h) blocks += blocks_of(leaves, h);
    return 3 * Arena::bytes<Real>(slots) + Arena::bytes<uint32_t>(slots) + Arena::bytes<BoxBlock>(blocks) +
           Arena::bytes<Record>(count);
}

PointTree build_point_tree(const Vec3 *points, uint32_t count, Arena &arena) {
    const size_t start = arena.mark();
    PointTree tree = {};
    const uint32_t slots = point_tree_slots(count), leaves = slots / leaf_points;
    uint32_t blocks = 0;
    tree.height = height_of(leaves);
    for (uint32_t h = tree.height; h-- > 0;) {
        tree.first_block[h] = blocks;
        blocks += blocks_of(leaves, h);
    }
    Real *x = arena.make<Real>(slots), *y = arena.make<Real>(slots), *z = arena.make<Real>(slots);
    uint32_t *id = arena.make<uint32_t>(slots);
    BoxBlock *block = arena.make<BoxBlock>(blocks);
    const size_t kept = arena.mark();
    Record *records = arena.make<Record>(count);
    if (!x || !y || !z || !id || !block || !records) {
        arena.rewind(start);
        return {};
    }
    for (uint32_t i = 0; i < count; ++i) records[i] = {{points[i].x, points[i].y, points[i].z}, i};
    if (count > 0) {
        Builder builder = {records, x, y, z, id, block + tree.first_block[0]};
        builder.build(0, count, tree.height - 1);
        tree.bounds.low = tree.bounds.high = points[0];
        for (uint32_t i = 0; i < count; ++i) {
            tree.bounds.low = lowest(tree.bounds.low, points[i]);
            tree.bounds.high = highest(tree.bounds.high, points[i]);
        }
    }
    for (uint32_t i = count; i < slots; ++i) {
        x[i] = y[i] = z[i] = Real(0);
        x[i] = far_from_all(Real());
        id[i] = no_point;
    }
    for (uint32_t h = 0; h < tree.height; ++h) {
        const uint32_t children = h == 0 ? leaves : blocks_of(leaves, h - 1);
        BoxBlock *here = block + tree.first_block[h];
        for (uint32_t child = 0; child < blocks_of(leaves, h) * lanes; ++child) {
            BoxBlock &parent = here[child / lanes];
            const uint32_t lane = child % lanes;
            if (child >= children) {
                fill_empty(parent, lane);
            } else if (h > 0) {
                const BoxBlock &b = block[tree.first_block[h - 1] + child];
                parent.low_x[lane] = *std::min_element(b.low_x, b.low_x + lanes);
                parent.low_y[lane] = *std::min_element(b.low_y, b.low_y + lanes);
                parent.low_z[lane] = *std::min_element(b.low_z, b.low_z + lanes);
                parent.high_x[lane] = *std::max_element(b.high_x, b.high_x + lanes);
                parent.high_y[lane] = *std::max_element(b.high_y, b.high_y + lanes);
                parent.high_z[lane] = *std::max_element(b.high_z, b.high_z + lanes);
            }
        }
    }
    arena.rewind(kept);
    tree.x = x, tree.y = y, tree.z = z, tree.id = id, tree.blocks = block;
    tree.count = count, tree.leaf_count = leaves;
    tree.ready = true;
    return tree;
}

namespace {

Real squared_distance(const PointTree &tree, uint32_t slot, const Vec3 &center) {
    const Real dx = tree.x[slot] - center.x, dy = tree.y[slot] - center.y, dz = tree.z[slot] - center.z;
    return sum_of_products(dx, dx, dy, dy, dz, dz);
}

} // namespace

uint64_t nearest_scratch_bytes(uint32_t most) {
    const uint64_t capacity = 2 * uint64_t{most} + 2 * leaf_points;
    return Arena::bytes<Real>(capacity) + Arena::bytes<uint32_t>(capacity);
}

bool make_nearest_scratch(uint32_t most, Arena &arena, NearestScratch &scratch) {
    const size_t start = arena.mark();
    scratch.capacity = 2 * most + 2 * leaf_points;
    scratch.distance_squared = arena.make<Real>(scratch.capacity);
    scratch.slot = arena.make<uint32_t>(scratch.capacity);
    if (scratch.distance_squared && scratch.slot) return true;
    arena.rewind(start);
    return false;
}

Nearest nearest(const PointTree &tree, const Vec3 &center, uint32_t k, Real max_radius, NearestScratch &scratch,
                uint32_t *slots, Real *distances_squared) {
    uint32_t count = 0;
    Real *distance = scratch.distance_squared;
    uint32_t *slot = scratch.slot;
    Nearest found = {};
    if (k == 0) return found;
    const auto before = [&](Real da, uint32_t a, Real db, uint32_t b) {
        return da < db || (da == db && tree.id[a] < tree.id[b]);
    };
    // The k smallest so far, by insertion.
    const Real limit = max_radius * max_radius;
    for_each_leaf_near(tree, center, max_radius, [&](uint32_t leaf) {
        const uint32_t end = min((leaf + 1) * leaf_points, tree.count);
        for (uint32_t i = leaf * leaf_points; i < end; ++i) {
            const Real d = squared_distance(tree, i, center);
            if (!(d < limit) || (count == k && !before(d, i, distance[k - 1], slot[k - 1]))) continue;
            uint32_t at = count < k ? count++ : k - 1;
            for (; at > 0 && before(d, i, distance[at - 1], slot[at - 1]); --at) {
                distance[at] = distance[at - 1];
                slot[at] = slot[at - 1];
            }
            distance[at] = d;
            slot[at] = i;
        }
    });
    if (count == 0) return found;
    const uint32_t last = slot[count - 1];
    std::sort(slot, slot + count);
    for (uint32_t i = 0; i < count; ++i) {
        slots[i] = slot[i];
        distances_squared[i] = squared_distance(tree, slot[i], center);
        if (slot[i] == last) found.farthest = i;
    }
    found.count = count;
    found.radius_squared = distances_squared[found.farthest];
    return found;
}

uint32_t in_radius(const PointTree &tree, const Vec3 &center, Real radius, uint32_t *slots, uint32_t capacity) {
    const Real limit = radius * radius;
    uint32_t count = 0;
    for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) {
        const uint32_t end = min((leaf + 1) * leaf_points, tree.count);
        for (uint32_t i = leaf * leaf_points; i < end; ++i) {
            if (!(squared_distance(tree, i, center) < limit)) continue;
            if (count < capacity) slots[count] = i;
            ++count;
        }
    });
    return count;
}

} // namespace wisp::WISP_ARITH
