// Building the point tree and searching the k nearest (S5).
#include "wisp/point_tree.h"
#include <algorithm>
#ifndef SHARE
#define SHARE 2
#endif
#ifndef WISP_F
#define WISP_F 1.4
#endif

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

inline uint32_t to_order(float x) { return to_bits(x); }
inline uint64_t to_order(double x) { return to_bits(x); }
inline uint64_t to_order(Fixed x) { return static_cast<uint64_t>(x.raw()); }
inline float order_value(uint32_t bits, float) { return from_bits<float>(bits); }
inline double order_value(uint64_t bits, double) { return from_bits<double>(bits); }
inline Fixed order_value(uint64_t bits, Fixed) { return Fixed::from_raw(static_cast<int64_t>(bits)); }
inline float from_bound(float x, float) { return x; }
inline double from_bound(float x, double) { return x; }
inline Fixed from_bound(int32_t x, Fixed) { return Fixed::from_raw(int64_t{x} * (1 << 20)); }
inline float root_of_gap(float x, float) { return sqrt(x); }
inline double root_of_gap(float x, double) { return sqrt(x); }
inline Fixed root_of_gap(int64_t x, Fixed) { return sqrt(Fixed::from_raw(x * (1 << 8))); }

} // namespace detail
} // namespace wisp

namespace wisp::WISP_ARITH {

using namespace detail;

namespace {

struct Record {
    Real coordinate[3];
    uint32_t id;
};

constexpr uint32_t log_children = children == 8 ? 3 : children == 16 ? 4 : 5;
constexpr uint64_t leaves_below(uint32_t height) { return uint64_t{1} << (log_children * height); } // of a child of such a block
constexpr uint32_t blocks_of(uint32_t leaves, uint32_t height) {
    return static_cast<uint32_t>((uint64_t{leaves} + leaves_below(height + 1) - 1) >> (log_children * (height + 1)));
}
uint32_t height_of(uint32_t leaves) {
    uint32_t height = leaves == 0 ? 0 : 1;
    while (height > 0 && blocks_of(leaves, height - 1) > most_roots) ++height;
    return height;
}

struct Builder {
    Record *records;
    Real *x, *y, *z;
    uint32_t *id;
    BoxBlock *leaf_boxes;

    void build(uint32_t first, uint32_t end, uint32_t height) {
        const uint32_t child = static_cast<uint32_t>(leaves_below(height) * leaf_points);
        const uint32_t parts = (end - first + child - 1) / child;
        if (parts == 1) {
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
        const uint32_t cut = first + (parts + 1) / 2 * child;
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
        BoxBlock &block = leaf_boxes[leaf / children];
        const uint32_t lane = leaf % children;
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
        builder.build(0, count, tree.height);
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
        const uint32_t members = h == 0 ? leaves : blocks_of(leaves, h - 1);
        BoxBlock *here = block + tree.first_block[h];
        for (uint32_t child = 0; child < blocks_of(leaves, h) * children; ++child) {
            BoxBlock &parent = here[child / children];
            const uint32_t lane = child % children;
            if (child >= members) {
                fill_empty(parent, lane);
            } else if (h > 0) {
                const BoxBlock &b = block[tree.first_block[h - 1] + child];
                parent.low_x[lane] = *std::min_element(b.low_x, b.low_x + children);
                parent.low_y[lane] = *std::min_element(b.low_y, b.low_y + children);
                parent.low_z[lane] = *std::min_element(b.low_z, b.low_z + children);
                parent.high_x[lane] = *std::max_element(b.high_x, b.high_x + children);
                parent.high_y[lane] = *std::max_element(b.high_y, b.high_y + children);
                parent.high_z[lane] = *std::max_element(b.high_z, b.high_z + children);
            }
        }
    }
    arena.rewind(kept);
    tree.x = x, tree.y = y, tree.z = z, tree.id = id, tree.blocks = block;
    tree.count = count, tree.leaf_count = leaves;
    tree.ready = true;
    tree.roots = tree.height ? blocks_of(leaves, tree.height - 1) : 0;
    return tree;
}

namespace {

// Squared distances of all slots of a leaf.
void leaf_distances(const PointTree &tree, uint32_t leaf, const Vec3 &center, Real *distance_squared) {
    const Real *x = tree.x + size_t{leaf} * leaf_points, *y = tree.y + size_t{leaf} * leaf_points;
    const Real *z = tree.z + size_t{leaf} * leaf_points;
    WISP_LANES for (uint32_t l = 0; l < leaf_points; ++l) {
        const Real dx = x[l] - center.x, dy = y[l] - center.y, dz = z[l] - center.z;
        distance_squared[l] = sum_of_products(dx, dx, dy, dy, dz, dz);
    }
}

// Slots in ascending order with their squared distances, of which those below `limit` count.
struct Candidates {
    Real *distance;
    uint32_t *slot;
    uint32_t count;
    Real limit;
};

uint32_t count_up_to(const Candidates &c, Real bound) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < c.count; ++i) count += c.distance[i] <= bound ? 1 : 0;
    return count;
}

uint32_t count_below(const Candidates &c, Real bound) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < c.count; ++i) count += c.distance[i] < bound ? 1 : 0;
    return count;
}

// The first k by (distance, id) are those with a distance < bound, and those at the bound whose id is <= last_id.
struct Cut {
    Real bound;
    uint32_t last_id;
};

// Which of the candidates at the bound belong to the first k: `wanted` of them.
uint32_t cut_ties(const Candidates &c, Real bound, uint32_t wanted, const uint32_t *id) {
    uint32_t low = 0, high = no_point;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        uint32_t count = 0;
        for (uint32_t i = 0; i < c.count; ++i) count += c.distance[i] == bound && id[c.slot[i]] <= middle ? 1 : 0;
        if (count >= wanted)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// 0 < k <= inside = count_below(c, c.limit).
Cut cut_after(const Candidates &c, uint32_t k, uint32_t inside, const uint32_t *id) {
    if (inside == k) return {c.limit, 0};
    // Bracket: count_up_to(low) < k, unless low is 0; count_up_to(high) > k.
    Real low = Real(0), high = c.limit;
    uint32_t below_low = 0, below_high = inside;
    const Real part = Real(static_cast<int32_t>(inside - k)) / Real(static_cast<int32_t>(inside));
    Real guess = high - high * part * (Real(2.0 / 3) + part * Real(1.0 / 9)); // (k / inside)^(2/3)
    for (int step = 0; step < 10; ++step) {
        const uint32_t count = count_up_to(c, guess);
        if (count == k) return {guess, no_point};
        (count < k ? low : high) = guess;
        (count < k ? below_low : below_high) = count;
        if (below_high <= below_low) break;
        guess = low + (high - low) * (Real(static_cast<int32_t>(2 * (k - below_low) + 1)) /
                                      Real(static_cast<int32_t>(2 * (below_high - below_low) + 1)));
    }
    auto least = to_order(low), most = to_order(high);
    while (least < most) {
        const auto middle = least + (most - least) / 2;
        if (count_up_to(c, order_value(middle, Real())) >= k)
            most = middle;
        else
            least = middle + 1;
    }
    const Real bound = order_value(least, Real());
    return {bound, cut_ties(c, bound, k - count_below(c, bound), id)};
}

// Moves the k candidates before the cut to the front of the arrays.
void take(const Candidates &c, uint32_t k, Cut cut, const uint32_t *id, Real *distance, uint32_t *slot) {
    uint32_t kept = 0;
    if (cut.last_id == 0 || cut.last_id == no_point) {
        for (uint32_t i = 0; kept < k; ++i) {
            const Real d = c.distance[i];
            distance[kept] = d;
            slot[kept] = c.slot[i];
            kept += cut.last_id == 0 ? d < cut.bound : d <= cut.bound;
        }
        return;
    }
    for (uint32_t i = 0; kept < k; ++i) {
        const Real d = c.distance[i];
        const uint32_t s = c.slot[i];
        distance[kept] = d;
        slot[kept] = s;
        kept += d < cut.bound || (d == cut.bound && id[s] <= cut.last_id) ? 1 : 0;
    }
}

// Gathers all points within the radius; should there be too many, only those that may be among the first k.
void gather(const PointTree &tree, const Vec3 &center, uint32_t k, Real radius, uint32_t capacity, Candidates &c) {
    c.count = 0;
    c.limit = radius * radius;
    for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) {
        if (c.count + leaf_points > capacity) {
            const Cut cut = cut_after(c, k, count_below(c, c.limit), tree.id);
            take(c, k, cut, tree.id, c.distance, c.slot);
            c.count = k;
            c.limit = order_value(to_order(cut.bound) + 1, Real());
        }
        leaf_distances(tree, leaf, center, c.distance + c.count);
        WISP_LANES for (uint32_t l = 0; l < leaf_points; ++l) c.slot[c.count + l] = leaf * leaf_points + l;
        c.count += leaf_points;
    });
    while (c.count > 0 && c.slot[c.count - 1] >= tree.count) --c.count;
}

// A radius that may well hold some more than k points, by the density of the node at the center that has about k.
Real guess_radius(const PointTree &tree, const Vec3 &center, uint32_t k) {
    const BallTest ball(center, Real(0));
    uint32_t block = 0, child = 0;
    const BoxBlock *boxes = nullptr;
    uint64_t points = 0;
    BoundProduct gap = 0;
    for (uint32_t h = tree.height; h-- > 0;) {
        const uint64_t size = leaf_points * leaves_below(h);
        if (boxes && size * SHARE < k) break;
        points = size;
        const BoxBlock *first = tree.blocks + tree.first_block[h];
        uint32_t best = 0; bool any = false;
        for (uint32_t b = boxes ? block : 0; b < (boxes ? block + 1 : tree.roots); ++b) {
            BoundProduct gaps[children];
            WISP_LANES for (uint32_t l = 0; l < children; ++l) gaps[l] = ball.gap_squared(first[b], l);
            for (uint32_t l = 0; l < children; ++l)
                if (!any || gaps[l] < gap) any = true, gap = gaps[l], best = b * children + l;
        }
        boxes = &first[best / children];
        child = best % children;
        block = best;
    }
    const Real x = from_bound(boxes->high_x[child] - boxes->low_x[child], Real());
    const Real y = from_bound(boxes->high_y[child] - boxes->low_y[child], Real());
    const Real z = from_bound(boxes->high_z[child] - boxes->low_z[child], Real());
    const Real widest = max(max(x, y), z);
    if (!(widest > Real(0))) return Real(0);
    const Real volume = max((x / widest) * (y / widest) * (z / widest), Real(1.0 / 64));
    const Real share = Real(static_cast<int32_t>(k)) / Real(static_cast<int32_t>(points));
    return widest * cbrt(volume * share * Real(0.2387 * WISP_F)) + root_of_gap(gap, Real());
}

} // namespace

uint64_t nearest_scratch_bytes(uint32_t most) {
    const uint64_t capacity = 4 * uint64_t{most} + 64 * leaf_points;
    return Arena::bytes<Real>(capacity) + Arena::bytes<uint32_t>(capacity);
}

bool make_nearest_scratch(uint32_t most, Arena &arena, NearestScratch &scratch) {
    const size_t start = arena.mark();
    scratch.capacity = 4 * most + 64 * leaf_points;
    scratch.distance_squared = arena.make<Real>(scratch.capacity);
    scratch.slot = arena.make<uint32_t>(scratch.capacity);
    if (scratch.distance_squared && scratch.slot) return true;
    arena.rewind(start);
    return false;
}

uint64_t stat_tries, stat_queries, stat_raw, stat_inside;

WISP_WIDE Nearest nearest(const PointTree &tree, const Vec3 &center, uint32_t k, Real max_radius,
                          NearestScratch &scratch, uint32_t *slots, Real *distances_squared) {
    Nearest found = {};
    if (k == 0 || tree.count == 0) return found;
    Candidates c = {scratch.distance_squared, scratch.slot, 0, Real(0)};
    Real radius = max_radius;
    if (k < tree.count) radius = min(guess_radius(tree, center, k), max_radius);
    uint32_t inside;
    ++stat_queries;
    for (;;) {
        ++stat_tries;
        gather(tree, center, k, radius, scratch.capacity, c);
        inside = count_below(c, c.limit);
        if (inside >= k || !(radius < max_radius)) break;
        const Real missing = Real(static_cast<int32_t>(k)) / Real(static_cast<int32_t>(inside + 1));
        radius = radius > Real(0) ? min(max_radius, radius * min(Real(4), cbrt(missing * Real(1.5)))) : max_radius;
    }
    stat_raw += c.count;
    stat_inside += inside;
    found.count = min(k, inside);
    if (found.count == 0) return found;
    take(c, found.count, cut_after(c, found.count, inside, tree.id), tree.id, distances_squared, slots);
    for (uint32_t i = 0; i < found.count; ++i) found.radius_squared = max(found.radius_squared, distances_squared[i]);
    uint32_t last_id = 0;
    for (uint32_t i = 0; i < found.count; ++i)
        if (distances_squared[i] == found.radius_squared && tree.id[slots[i]] >= last_id) {
            found.farthest = i;
            last_id = tree.id[slots[i]];
        }
    return found;
}

WISP_WIDE uint32_t in_radius(const PointTree &tree, const Vec3 &center, Real radius, uint32_t *slots,
                             uint32_t capacity) {
    const Real limit = radius * radius;
    uint32_t count = 0;
    for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) {
        Real distance[leaf_points];
        leaf_distances(tree, leaf, center, distance);
        uint32_t inside = 0;
        WISP_LANES for (uint32_t l = 0; l < leaf_points; ++l)
            inside += (distance[l] < limit) & (leaf * leaf_points + l < tree.count) ? 1u : 0u;
        for (uint32_t l = 0; l < leaf_points && count < capacity; ++l)
            if (distance[l] < limit && leaf * leaf_points + l < tree.count) slots[count++] = leaf * leaf_points + l;
        if (count >= capacity) count += inside;
    });
    return count;
}

} // namespace wisp::WISP_ARITH
