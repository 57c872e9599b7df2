// A balanced kd-tree over points (S5): leaves near a point, leaves near a segment, and the k nearest points.
//
// Points are stored in the order of the tree ("slots") as a structure of arrays, `leaf_points` to a leaf. All leaves
// but the last are full. A block holds the boxes of sixteen children, so that testing them is a loop over lanes; it
// stands for four levels of median cuts. There are no links: the tree is its numbering, a heap with sixteen children to
// a node.
//
//   leaf l               holds the slots l * leaf_points ... (l + 1) * leaf_points - 1
//   block b of height 0  holds the boxes of the leaves 16 b ... 16 b + 15
//   block b of height h  holds the boxes of the blocks 16 b ... 16 b + 15 of height h - 1
//   the root             is block 0 of height `height` - 1; block b of height h is blocks[first_block[h] + b]
//
// so box `lane` of block b of height h bounds the leaves (16 b + lane) 16^h ... (16 b + lane + 1) 16^h - 1, as far as
// there are leaves. The c children of a block are divided into the first (c + 1) / 2 and the rest, recursively, until
// each is alone. A division cuts the widest extent of the points by the total order (coordinate, id). The slots of a
// leaf are ordered by id. Hence the layout is a pure function of the points.
//
// Boxes only cull, so a bound takes 4 bytes in every arithmetic, rounded outwards. All tests are conservative: a leaf
// may be visited without need, but none is missed. Leaves are visited in ascending order, so that sums over them have
// one order.
//
// Ranges: in Fixed the squared distance between any two points or queries must be below 2^31, which holds for
// coordinates within +-13,000; radii must be below 2^15. The floating arithmetics take coordinates up to 2^40.
#pragma once
#include "core/geometry/ray.h"
#include "wisp/arena.h"

namespace wisp {

constexpr uint32_t leaf_points = 16;
constexpr uint32_t log_children = 4, children = 1 << log_children; // boxes of a block
constexpr uint32_t max_heights = 7;                                // 16^7 leaves hold more than 2^31 points
static_assert(leaf_points % lanes == 0 && children % lanes == 0, "leaves and blocks are whole numbers of vectors");

constexpr uint32_t no_point = 0xffffffff; // id of an empty slot

// The number of slots in a tree of `count` points: `count` rounded up to whole leaves.
constexpr uint32_t point_tree_slots(uint32_t count) { return (count + leaf_points - 1) / leaf_points * leaf_points; }

// A bound of a box, and the type of a product of two bounds. Bounds are floats for float and double. For Fixed they are
// integers in units of 2^-12.
namespace f32 {
using Bound = float;
using BoundProduct = float;
} // namespace f32
namespace f64 {
using Bound = float;
using BoundProduct = float;
} // namespace f64
namespace fixed {
using Bound = int32_t;
using BoundProduct = int64_t;
} // namespace fixed

namespace WISP_ARITH {

// The boxes of a block's children, and the largest radius of the points in each. The box of a child that does not exist
// has low > high, so that no test passes.
struct BoxBlock {
    Bound low_x[children], low_y[children], low_z[children], high_x[children], high_y[children], high_z[children];
    Bound radius[children]; // 0 where points have none
};

struct PointTree {
    bool ready;                 // false: the arena was too small
    bool has_radii;             // of points, which are unlike: boxes are tested with those of their own points
    uint32_t count, leaf_count; // points; leaves
    const Real *x, *y, *z;      // by slot; an empty slot holds a position far outside any scene
    const uint32_t *id;         // by slot: the point's index in the caller's order, or no_point
    Box bounds;                 // of all points
    uint32_t height;            // the number of heights of blocks: 0 without points
    uint32_t first_block[max_heights];
    const BoxBlock *blocks;
};

// Builds the tree of `count` <= 2^31 - 1 points. Its arrays are made from the arena; scratch memory is given back
// before the function returns. If the arena is too small, the tree has no points and ready == false, and the arena is
// unchanged.
//
// `radii`, one a point, or nullptr: where those of a node are more than most_unlike to 1, it is cut by (radius, id), so
// that a search need not visit every small point that has a large one for a neighbour. Radii that are all less unlike
// are not kept.
constexpr int32_t most_unlike = 4;
PointTree build_point_tree(const Vec3 *points, uint32_t count, Arena &arena, Watch watch = {},
                           const Real *radii = nullptr);

// An upper bound of the bytes that build_point_tree takes from the arena, scratch included.
uint64_t point_tree_bytes(uint32_t count);

// ---- visitors ----

// Calls visit(leaf), in ascending order, for each leaf that may hold a point p with |p - center| <= radius, where
// 0 <= radius.
template <class Visit>
WISP_INLINE void for_each_leaf_near(const PointTree &tree, const Vec3 &center, Real radius, Visit &&visit);

// The same for each leaf that may hold a point p with |p - center| <= radius + the radius of p; no point has more than
// `largest`. The tree has radii.
template <class Visit>
WISP_INLINE void for_each_leaf_reaching(const PointTree &tree, const Vec3 &center, Real radius, Real largest,
                                        Visit &&visit);

// The same for points within `radius` of the segment from origin + t0 direction to origin + t1 direction. `direction`
// is a unit vector; 0 <= radius, in Fixed < 2^15. An end far outside the scene costs no more.
template <class Visit>
WISP_INLINE void for_each_leaf_on_segment(const PointTree &tree, const Vec3 &origin, const Vec3 &direction, Real t0,
                                          Real t1, Real radius, Visit &&visit);

// The same for points that are within their own radii of the segment.
template <class Visit>
WISP_INLINE void for_each_leaf_reaching_segment(const PointTree &tree, const Vec3 &origin, const Vec3 &direction,
                                                Real t0, Real t1, Real largest, Visit &&visit);

// ---- k nearest ----

struct Nearest {
    uint32_t count;      // points found
    uint32_t farthest;   // the index of the one that comes last by (squared distance, id)
    Real radius_squared; // its squared distance; 0 if no point was found
};

// Scratch memory of `nearest` for k <= max_k, made once.
struct NearestScratch {
    uint32_t capacity;
    Real *distance_squared;
    uint32_t *slot;
};
bool make_nearest_scratch(uint32_t max_k, Arena &arena, NearestScratch &scratch); // false: the arena is too small
uint64_t nearest_scratch_bytes(uint32_t max_k);

// The k nearest points: the first k by (squared distance, id) of the points whose squared distance is less than
// max_radius^2, or all of those if there are fewer. The squared distance is sum_of_products(dx, dx, dy, dy, dz, dz).
// `slots` and `distances_squared` have room for k entries. They are filled in ascending order of slots, so that the
// result is a pure function of the points. k <= the max_k of the scratch; 0 <= max_radius, in Fixed < 2^15.
Nearest nearest(const PointTree &tree, const Vec3 &center, uint32_t k, Real max_radius, NearestScratch &scratch,
                uint32_t *slots, Real *distances_squared);

// Writes the first `capacity` slots, in ascending order, of the points whose squared distance is less than radius^2.
// Returns the number of all such points.
uint32_t in_radius(const PointTree &tree, const Vec3 &center, Real radius, uint32_t *slots, uint32_t capacity);

} // namespace WISP_ARITH

// ---- implementation of the visitors ----

namespace detail {

constexpr int bound_shift = 20; // bits between the units of Fixed and of its bounds

// A length as a Bound; `slack` covers its rounding. The bounds of Fixed, in units of 2^-12, are clamped to +-2^16, far
// outside any scene, so that sums, differences and products fit.
constexpr float to_bound(float x) { return x; }
constexpr float to_bound(double x) { return static_cast<float>(x); }
constexpr int32_t to_bound(Fixed x) {
    return static_cast<int32_t>(min(max(x.raw() >> bound_shift, -(int64_t{1} << 28)), int64_t{1} << 28));
}
// A component of a direction, and the number 1 in the units of directions: 2^-30 in Fixed.
constexpr float to_direction(float x) { return x; }
constexpr float to_direction(double x) { return static_cast<float>(x); }
constexpr int32_t to_direction(Fixed x) { return static_cast<int32_t>(x.raw() >> 2); }
constexpr float direction_one(float) { return 1; }
constexpr int64_t direction_one(int32_t) { return int64_t{1} << 30; }

// A bound on the rounding of a length that the tests below compute from coordinates whose magnitudes add up to `sum`.
// Floats: each test rounds fewer than 30 times, each time by at most 2^-24 * 2 sum. Integers: only conversions round,
// lengths by one unit each, and directions by a relative 2^-31 of a length below 2^31.
constexpr float slack(float sum) { return sum * 0x1p-18f + 0x1p-60f; }
constexpr int32_t slack(int32_t) { return 8; }

// Radii are clamped to this: larger than any scene, and too small to reach the boxes of children that do not exist.
constexpr float largest_radius(float) { return 0x1p60f; }
constexpr int32_t largest_radius(int32_t) { return 1 << 27; }

// For each byte, the positions of its set bits, lowest first: lists the lanes of a mask without branches.
struct SetBits {
    uint32_t position[256][lanes];
    uint8_t count[256];
};
constexpr SetBits find_set_bits() {
    SetBits bits = {};
    for (uint32_t byte = 0; byte < 256; ++byte)
        for (uint32_t l = 0, count = 0; l < lanes; ++l)
            if (byte >> l & 1) bits.position[byte][count++] = l, bits.count[byte] = static_cast<uint8_t>(count);
    return bits;
}
inline constexpr SetBits set_bits = find_set_bits();

template <class T> constexpr T magnitude(T x) { return x < 0 ? -x : x; }

} // namespace detail

namespace WISP_ARITH {

// Tests boxes against a ball, for loops over lanes.
struct BallTest {
    Bound x, y, z;
    BoundProduct radius_squared;

    BallTest(const Vec3 &center, Real radius)
        : x(detail::to_bound(center.x)), y(detail::to_bound(center.y)), z(detail::to_bound(center.z)) {
        using namespace detail;
        const Bound r = min(to_bound(radius), largest_radius(x));
        const BoundProduct reach = r + slack(magnitude(x) + magnitude(y) + magnitude(z) + r);
        radius_squared = reach * reach;
    }

    // The squared distance of the centre from a box.
    BoundProduct gap_squared(const BoxBlock &b, uint32_t l) const {
        const BoundProduct gap_x = x - min(max(x, b.low_x[l]), b.high_x[l]);
        const BoundProduct gap_y = y - min(max(y, b.low_y[l]), b.high_y[l]);
        const BoundProduct gap_z = z - min(max(z, b.low_z[l]), b.high_z[l]);
        return gap_x * gap_x + gap_y * gap_y + gap_z * gap_z;
    }
    uint32_t operator()(const BoxBlock &b, uint32_t l) const { return gap_squared(b, l) <= radius_squared ? 1 : 0; }
};

// The same with the radii of the boxes' points.
struct ReachingBallTest {
    BallTest ball;
    BoundProduct more; // what is added to a radius

    ReachingBallTest(const Vec3 &center, Real radius, Real largest) : ball(center, Real(0)) {
        using namespace detail;
        const Bound r = min(to_bound(radius), largest_radius(ball.x)), most = min(to_bound(largest), largest_radius(r));
        more = r + slack(magnitude(ball.x) + magnitude(ball.y) + magnitude(ball.z) + r + most);
    }
    uint32_t operator()(const BoxBlock &b, uint32_t l) const {
        const BoundProduct reach = b.radius[l] + more;
        return ball.gap_squared(b, l) <= reach * reach ? 1 : 0;
    }
};

// Tests boxes against a segment with a radius, by separating axes (Gottschalk et al. 1996): box and segment are
// disjoint if their projections on some axis are farther apart than the radius. The axes are x, y, z, and their cross
// products with the direction d. All lengths are doubled: a box gives low + high and high - low, twice its middle and
// half-extent.
struct SegmentTest {
    Bound middle_x, middle_y, middle_z;        // of the segment
    Bound reach_x, reach_y, reach_z;           // its half-extent plus the radius
    Bound x, y, z, abs_x, abs_y, abs_z;        // d
    BoundProduct radius_x, radius_y, radius_z; // the radius projected on d x (1, 0, 0), d x (0, 1, 0), d x (0, 0, 1)

    SegmentTest(const PointTree &tree, const Vec3 &origin, const Vec3 &direction, Real t0, Real t1, Real radius) {
        using namespace detail;
        // The segment is clipped to a ball around all points: a shorter segment has less cancellation.
        const Vec3 extent = tree.bounds.high - tree.bounds.low;
        const Vec3 to_middle = tree.bounds.low + extent * Real(0.5) - origin;
        const Real far = abs(to_middle.x) + abs(to_middle.y) + abs(to_middle.z), along = dot(to_middle, direction);
        const Real around = Real(0.5) * (extent.x + extent.y + extent.z) + radius + far * Real(0x1p-18) + Real(0x1p-24);
        const Real from = max(t0, along - around), to = max(from, min(t1, along + around));
        const Vec3 middle = origin + direction * from + direction * (Real(0.5) * (to - from));
        const Vec3 half = direction * (Real(0.5) * (to - from));

        x = to_direction(direction.x), y = to_direction(direction.y), z = to_direction(direction.z);
        abs_x = magnitude(x), abs_y = magnitude(y), abs_z = magnitude(z);
        middle_x = 2 * to_bound(middle.x), middle_y = 2 * to_bound(middle.y), middle_z = 2 * to_bound(middle.z);
        const Bound r = 2 * min(to_bound(radius), largest_radius(x));
        const Bound magnitudes = magnitude(middle_x) + magnitude(middle_y) + magnitude(middle_z);
        const Bound rounding = slack(min(magnitudes, largest_radius(x)) + to_bound(around) + to_bound(far));
        reach_x = 2 * to_bound(abs(half.x)) + r + rounding;
        reach_y = 2 * to_bound(abs(half.y)) + r + rounding;
        reach_z = 2 * to_bound(abs(half.z)) + r + rounding;
        const BoundProduct one = direction_one(x), margin = one * rounding;
        const Vec3 d = direction;
        radius_x = BoundProduct(r) * to_direction(sqrt(d.y * d.y + d.z * d.z)) + margin;
        radius_y = BoundProduct(r) * to_direction(sqrt(d.z * d.z + d.x * d.x)) + margin;
        radius_z = BoundProduct(r) * to_direction(sqrt(d.x * d.x + d.y * d.y)) + margin;
    }

    uint32_t operator()(const BoxBlock &b, uint32_t l) const {
        using detail::magnitude;
        const BoundProduct size_x = b.high_x[l] - b.low_x[l], size_y = b.high_y[l] - b.low_y[l];
        const BoundProduct size_z = b.high_z[l] - b.low_z[l];
        const BoundProduct to_x = b.low_x[l] + b.high_x[l] - middle_x, to_y = b.low_y[l] + b.high_y[l] - middle_y;
        const BoundProduct to_z = b.low_z[l] + b.high_z[l] - middle_z;
        const auto within = [](BoundProduct apart, BoundProduct limit) { return magnitude(apart) <= limit ? 1u : 0u; };
        return within(to_x, size_x + reach_x) & within(to_y, size_y + reach_y) & within(to_z, size_z + reach_z) &
               within(y * to_z - z * to_y, size_y * abs_z + size_z * abs_y + radius_x) &
               within(z * to_x - x * to_z, size_z * abs_x + size_x * abs_z + radius_y) &
               within(x * to_y - y * to_x, size_x * abs_y + size_y * abs_x + radius_z);
    }
};

// The same with the radii of the boxes' points, of which none is more than `largest`.
struct ReachingSegmentTest {
    SegmentTest segment; // with the largest radius
    Bound doubled_largest;
    BoundProduct across_x, across_y, across_z; // the lengths of d x (1, 0, 0), d x (0, 1, 0), d x (0, 0, 1)

    ReachingSegmentTest(const PointTree &tree, const Vec3 &origin, const Vec3 &d, Real t0, Real t1, Real largest)
        : segment(tree, origin, d, t0, t1, largest) {
        using namespace detail;
        doubled_largest = 2 * min(to_bound(largest), largest_radius(segment.x));
        across_x = to_direction(sqrt(d.y * d.y + d.z * d.z));
        across_y = to_direction(sqrt(d.z * d.z + d.x * d.x));
        across_z = to_direction(sqrt(d.x * d.x + d.y * d.y));
    }

    uint32_t operator()(const BoxBlock &b, uint32_t l) const {
        const Bound less = doubled_largest - 2 * b.radius[l];
        SegmentTest own = segment;
        own.reach_x -= less, own.reach_y -= less, own.reach_z -= less;
        own.radius_x -= less * across_x, own.radius_y -= less * across_y, own.radius_z -= less * across_z;
        return own(b, l);
    }
};

// Descends the tree height by height, a batch of blocks at a time. All children of the batch that pass the test are
// listed before any of them is opened, so that there are few branches to predict. Lists are in ascending order, and a
// batch is finished down to its leaves before the next one starts.
template <class Test, class Visit>
WISP_INLINE void for_each_leaf(const PointTree &tree, const Test &test, Visit &&visit) {
    constexpr uint32_t batch = 4;
    struct List {
        uint32_t next, count;
        uint32_t member[batch * children + lanes]; // whole vectors are written
    };
    if (tree.count == 0) return;
    List lists[max_heights + 1]; // [0]: leaves; [h + 1]: blocks of height h
    List *const top = lists + tree.height, *list = top;
    const uint32_t *first_block = tree.first_block + tree.height - 1; // of the height of `list`
    top->next = top->member[0] = 0;
    top->count = 1;
    for (;;) {
        if (list->next == list->count) { // this batch is done
            if (list == top) return;
            ++list, ++first_block;
            continue;
        }
        List *const below = list - 1;
        const BoxBlock *blocks = tree.blocks + *first_block;
        const uint32_t end = min(list->next + batch, list->count);
        uint32_t count = 0;
        for (uint32_t i = list->next; i < end; ++i) {
            const uint32_t block = list->member[i];
            for (uint32_t group = 0; group < children; group += lanes) {
                uint32_t mask = 0;
                WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) mask |=
                    test(blocks[block], group + l) ? 1u << l : 0u;
                uint32_t *member = below->member + count;
                const uint32_t *lane = detail::set_bits.position[mask];
                WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) member[l] = block * children + group + lane[l];
                count += detail::set_bits.count[mask];
            }
        }
        list->next = end;
        if (below == lists) {
            for (uint32_t i = 0; i < count; ++i) visit(below->member[i]);
        } else {
            below->next = 0;
            below->count = count;
            --list, --first_block;
        }
    }
}

template <class Visit>
WISP_INLINE void for_each_leaf_near(const PointTree &tree, const Vec3 &center, Real radius, Visit &&visit) {
    for_each_leaf(tree, BallTest(center, radius), visit);
}

template <class Visit>
WISP_INLINE void for_each_leaf_reaching(const PointTree &tree, const Vec3 &center, Real radius, Real largest,
                                        Visit &&visit) {
    for_each_leaf(tree, ReachingBallTest(center, radius, largest), visit);
}

template <class Visit>
WISP_INLINE void for_each_leaf_on_segment(const PointTree &tree, const Vec3 &origin, const Vec3 &direction, Real t0,
                                          Real t1, Real radius, Visit &&visit) {
    for_each_leaf(tree, SegmentTest(tree, origin, direction, t0, t1, radius), visit);
}

template <class Visit>
WISP_INLINE void for_each_leaf_reaching_segment(const PointTree &tree, const Vec3 &origin, const Vec3 &direction,
                                                Real t0, Real t1, Real largest, Visit &&visit) {
    for_each_leaf(tree, ReachingSegmentTest(tree, origin, direction, t0, t1, largest), visit);
}

} // namespace WISP_ARITH
} // namespace wisp
