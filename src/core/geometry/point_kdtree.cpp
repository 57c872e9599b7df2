// Building the point tree and searching it for the k nearest (S5).
//
// * The build moves points as records of four values between two buffers. Quickselect copies them between the buffers
//   without branches; few records are divided by counting ranks. The choice of pivots changes the time but not
//   the result, because (coordinate, id) is a total order.
// * `nearest` guesses a radius from the density of the points and gathers all points within it. In the rare case that
//   these are too few, it repeats with a larger radius. The k-th distance among the candidates is found by counting
//   those below a bound, which is one vector loop, and moving the bound by interpolation.
#include "core/geometry/point_kdtree.h"
#include <algorithm>

namespace wisp {
namespace detail {

// ---- conversions ----

// The coordinate of empty slots: farther than any radius; in Fixed the square of a distance to it still fits.
constexpr float coordinate_of_empty(float) { return 0x1p60f; }
constexpr double coordinate_of_empty(double) { return 0x1p60; }
constexpr Fixed coordinate_of_empty(Fixed) { return Fixed(28672); }

// Bounds of a box, rounded outwards.
constexpr float upper_bound_of(float x) { return x; }
constexpr float lower_bound_of(float x) { return x; }
inline float upper_bound_of(double x) {
    const float f = static_cast<float>(x);
    return f < x ? from_bits<float>(to_bits(f) + (f < 0 ? -1 : 1)) : f;
}
inline float lower_bound_of(double x) { return -upper_bound_of(-x); }
constexpr int32_t lower_bound_of(Fixed x) { return static_cast<int32_t>(x.raw() >> bound_shift); }
constexpr int32_t upper_bound_of(Fixed x) { return -static_cast<int32_t>(-x.raw() >> bound_shift); }

// low and -high of the box of a child that does not exist.
constexpr float no_bound(float) { return 0x1p62f; }
constexpr int32_t no_bound(int32_t) { return 1 << 29; }

// Lengths and square roots of squared lengths, converted from bounds to scalars.
constexpr float length_of_bound(float x, float) { return x; }
constexpr double length_of_bound(float x, double) { return x; }
constexpr Fixed length_of_bound(int32_t x, Fixed) { return Fixed::from_raw(int64_t{x} * (1 << bound_shift)); }
inline float root_of_bound(float x, float) { return sqrt(x); }
inline double root_of_bound(float x, double) { return sqrt(static_cast<double>(x)); }
inline Fixed root_of_bound(int64_t x, Fixed) { return sqrt(Fixed::from_raw(x * (1 << (2 * bound_shift - 32)))); }

// A coordinate as the build moves and compares it: the number itself, or the integer of a Fixed.
constexpr float to_key(float x) { return x; }
constexpr double to_key(double x) { return x; }
constexpr int64_t to_key(Fixed x) { return x.raw(); }
constexpr float from_key(float key, float) { return key; }
constexpr double from_key(double key, double) { return key; }
constexpr Fixed from_key(int64_t key, Fixed) { return Fixed::from_raw(key); }

// Scalars >= 0 as integers of the same order, and back.
inline uint32_t to_ordinal(float x) { return to_bits(x); }
inline uint64_t to_ordinal(double x) { return to_bits(x); }
constexpr uint64_t to_ordinal(Fixed x) { return static_cast<uint64_t>(x.raw()); }
inline float from_ordinal(uint32_t n, float) { return from_bits<float>(n); }
inline double from_ordinal(uint64_t n, double) { return from_bits<double>(n); }
constexpr Fixed from_ordinal(uint64_t n, Fixed) { return Fixed::from_raw(static_cast<int64_t>(n)); }

} // namespace detail

namespace WISP_ARITH {

using namespace detail;

using Ordinal = decltype(to_ordinal(Real()));
using Key = decltype(to_key(Real()));

namespace {

// ---- the numbering ----

// The number of leaves below a child of a block of height h, and below the block.
constexpr uint64_t leaves_of_child(uint32_t h) { return uint64_t{1} << (log_children * h); }
constexpr uint64_t leaves_of_block(uint32_t h) { return leaves_of_child(h + 1); }

uint32_t blocks_at(uint32_t leaves, uint32_t h) {
    return static_cast<uint32_t>((leaves + leaves_of_block(h) - 1) / leaves_of_block(h));
}

uint32_t height_for(uint32_t leaves) {
    uint32_t height = leaves > 0 ? 1 : 0;
    while (height > 0 && blocks_at(leaves, height - 1) > 1) ++height;
    return height;
}

// ---- building ----

// A point during the build. It has four values, so that it is moved and compared as one vector. The last value carries
// the bits of the id.
struct Record {
    Key value[4];

    Real coordinate(int axis) const { return from_key(value[axis], Real()); }
    uint32_t id() const { return static_cast<uint32_t>(to_ordinal(from_key(value[3], Real()))); }
};

struct Bounds {
    Key low[4], high[4]; // the last values mean nothing

    Vec3 low_corner() const { return corner(low); }
    Vec3 high_corner() const { return corner(high); }

  private:
    static Vec3 corner(const Key (&key)[4]) {
        return Vec3(from_key(key[0], Real()), from_key(key[1], Real()), from_key(key[2], Real()));
    }
};

WISP_MULTIVERSIONED void find_bounds(const Record *records, uint32_t count, Bounds &bounds) {
    Key low[4], high[4];
    for (int a = 0; a < 4; ++a) low[a] = high[a] = records[0].value[a];
    for (size_t i = 0; i < count; ++i) WISP_NO_UNROLL for (int a = 0; a < 4; ++a) {
            const Key v = records[i].value[a];
            low[a] = v < low[a] ? v : low[a];
            high[a] = high[a] < v ? v : high[a];
        }
    for (int a = 0; a < 4; ++a) bounds.low[a] = low[a], bounds.high[a] = high[a];
}

int widest_axis(const Bounds &b) {
    int widest = 0;
    for (int a = 1; a < 3; ++a)
        if (b.high[widest] - b.low[widest] < b.high[a] - b.low[a]) widest = a;
    return widest;
}

// By (coordinate, id).
struct Before {
    int axis;
    bool operator()(const Record &a, const Record &b) const {
        return a.value[axis] < b.value[axis] || (a.value[axis] == b.value[axis] && a.id() < b.id());
    }
};

// Copies the records whose coordinate is below the pivot to the front of `to`, and the others to its back. Returns the
// number below.
uint32_t split(const Record *from, Record *to, uint32_t count, int axis, Key pivot) {
    size_t front = 0, back = count; // the records between them are free
    for (size_t i = 0; i < count; ++i) {
        const bool below = from[i].value[axis] < pivot;
        to[front] = from[i];
        to[--back] = from[i];
        front += below;
        back += below;
    }
    return static_cast<uint32_t>(front);
}

constexpr uint32_t few = 64; // up to this count, records are divided by their ranks

// Sets rank[i] to the number of keys below key[i]. The arrays are a whole number of vectors long.
WISP_MULTIVERSIONED void find_ranks(const Key *key, uint32_t count, Ordinal *rank) {
    for (size_t first = 0; first < count; first += lanes) {
        Ordinal sum[lanes] = {};
        for (size_t j = 0; j < count; ++j) {
            const Key other = key[j];
            WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) sum[l] += other < key[first + l] ? 1 : 0;
        }
        WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) rank[first + l] = sum[l];
    }
}

// An estimate, from a sample, of the coordinate with rank `wanted`. If that rank is near an end, the pivot is chosen
// farther from the end than `wanted`, so that the smaller side is what remains to be divided.
Key sampled_pivot(const Record *records, uint32_t count, uint32_t wanted, int axis) {
    Key sample[few];
    Ordinal rank[few];
    const uint32_t samples = count < 1024 ? 16 : few, step = count / samples, margin = samples / 32;
    uint32_t target = static_cast<uint32_t>(uint64_t{wanted} * samples / count); // the rank within the sample
    if (target < samples / 4) target += margin;
    if (target >= samples - samples / 4) target -= margin;
    for (uint32_t i = 0; i < samples; ++i) sample[i] = records[i * step + step / 2].value[axis];
    find_ranks(sample, samples, rank);
    uint32_t best = 0; // the largest rank <= target
    for (uint32_t i = 1; i < samples; ++i)
        if (rank[i] <= target && (rank[i] > rank[best] || rank[best] > target)) best = i;
    return sample[best];
}

void cut_few(const Record *from, Record *to, uint32_t count, uint32_t wanted, int axis) {
    Key key[few + lanes] = {};
    Ordinal rank[few + lanes], sum = 0;
    uint32_t front = 0, back = count;
    for (uint32_t i = 0; i < count; ++i) key[i] = from[i].value[axis];
    find_ranks(key, count, rank);
    for (uint32_t i = 0; i < count; ++i) {
        to[front] = to[back - 1] = from[i];
        sum += rank[i];
        front += rank[i] < wanted ? 1 : 0;
        back -= rank[i] < wanted ? 0 : 1;
    }
    if (2 * sum == Ordinal{count} * (count - 1)) return;
    // Some coordinates are equal.
    std::copy(from, from + count, to);
    std::nth_element(to, to + wanted, to + count, Before{axis});
}

// Copies the records to `to` so that the first `wanted` by (coordinate, id) come first; `from` is overwritten.
// 0 < wanted < count. This is quickselect. The first step copies without branches. In later steps the cut is near an
// end, so few records are swapped. After max_steps std::nth_element takes over, which bounds the time for any input.
void cut(Record *from, Record *to, uint32_t count, uint32_t wanted, int axis, Watch watch) {
    constexpr uint32_t max_steps = 64;
    for (uint32_t step = 0; count > few; ++step) {
        const bool copied = step > 0;
        if (!watch.go_on(count / 8)) return;
        if (step == max_steps) return std::nth_element(to, to + wanted, to + count, Before{axis});
        const Key pivot = sampled_pivot(copied ? to : from, count, wanted, axis);
        const auto below = [=](const Record &r) { return r.value[axis] < pivot; };
        const auto up_to = [=](const Record &r) { return r.value[axis] <= pivot; };
        uint32_t front = copied ? static_cast<uint32_t>(std::partition(to, to + count, below) - to)
                                : split(from, to, count, axis, pivot);
        if (front == 0) {
            front = static_cast<uint32_t>(std::partition(to, to + count, up_to) - to);
            if (wanted < front) { // the cut falls among equal coordinates
                std::nth_element(to, to + wanted, to + front, Before{axis});
                return;
            }
        }
        if (wanted == front) return;
        if (wanted < front) {
            count = front;
        } else {
            from += front, to += front;
            wanted -= front, count -= front;
        }
        if (count <= few) std::copy(to, to + count, from);
    }
    cut_few(from, to, count, wanted, axis);
}

// Sets rank[i] to the number of a leaf's ids that are smaller than id[i].
WISP_MULTIVERSIONED void find_id_ranks(const uint32_t *id, uint32_t *rank) {
    for (size_t first = 0; first < leaf_points; first += lanes) {
        uint32_t smaller[lanes] = {};
        for (size_t j = 0; j < leaf_points; ++j) {
            const uint32_t other = id[j];
            WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) smaller[l] += other < id[first + l] ? 1 : 0;
        }
        WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) rank[first + l] = smaller[l];
    }
}

constexpr uint32_t units_per_point = 2; // of work

// By (radius, id).
struct SmallerBefore {
    const Real *radii;
    bool operator()(const Record &a, const Record &b) const {
        const Real of_a = radii[a.id()], of_b = radii[b.id()];
        return of_a < of_b || (of_a == of_b && a.id() < b.id());
    }
};

struct RadiusRange {
    Real least, most;

    bool unlike() const { return Real(most_unlike) * least < most; }
};
RadiusRange radius_range(const Record *records, uint32_t count, const Real *radii) {
    RadiusRange range = {radii[records[0].id()], Real(0)};
    for (uint32_t i = 0; i < count; ++i) {
        range.least = min(range.least, radii[records[i].id()]);
        range.most = max(range.most, radii[records[i].id()]);
    }
    return range;
}

class Builder {
  public:
    Builder(Real *x, Real *y, Real *z, uint32_t *id, BoxBlock *leaf_boxes, const Real *radii, Watch watch)
        : x_(x), y_(y), z_(z), id_(id), leaf_boxes_(leaf_boxes), radii_(radii), watch_(watch) {}

    // Makes the leaves of the slots first ... first + count - 1 from the records, divided into children of a block of
    // height h. What it calls is not inlined, so that the recursion takes little of the stack.
    void build(Record *records, Record *spare, uint32_t first, uint32_t count, uint32_t h) {
        uint64_t child = leaves_of_child(h) * leaf_points;
        while (h > 0 && count <= child) child = leaves_of_child(--h) * leaf_points;
        if (count <= child) {
            make_leaf(records, first, count);
            watch_.done(count * uint64_t{units_per_point});
            return;
        }
        const uint32_t child_count = static_cast<uint32_t>((count + child - 1) / child);
        const uint32_t wanted = static_cast<uint32_t>((child_count + 1) / 2 * child);
        divide(records, spare, count, wanted);
        if (watch_.stopped()) return;
        build(spare, records, first, wanted, h);
        build(spare + wanted, records + wanted, first + wanted, count - wanted, h);
    }

  private:
    // Copies the records to `spare`, the first `wanted` by the widest axis, or by unlike radii, first; `records` is
    // overwritten.
    __attribute__((noinline)) void divide(Record *records, Record *spare, uint32_t count, uint32_t wanted) {
        if (radii_ && radius_range(records, count, radii_).unlike()) {
            if (!watch_.go_on(count)) return;
            std::copy(records, records + count, spare);
            std::nth_element(spare, spare + wanted, spare + count, SmallerBefore{radii_});
        } else {
            Bounds bounds;
            find_bounds(records, count, bounds);
            cut(records, spare, count, wanted, widest_axis(bounds), watch_);
        }
    }
    __attribute__((noinline)) void make_leaf(const Record *records, uint32_t first, uint32_t count) {
        Bounds bounds;
        find_bounds(records, count, bounds);
        const uint32_t leaf = first / leaf_points, lane = leaf % children;
        BoxBlock &block = leaf_boxes_[leaf / children];
        const Vec3 low = bounds.low_corner(), high = bounds.high_corner();
        block.low_x[lane] = lower_bound_of(low.x);
        block.low_y[lane] = lower_bound_of(low.y);
        block.low_z[lane] = lower_bound_of(low.z);
        block.high_x[lane] = upper_bound_of(high.x);
        block.high_y[lane] = upper_bound_of(high.y);
        block.high_z[lane] = upper_bound_of(high.z);
        block.radius[lane] = radii_ ? upper_bound_of(radius_range(records, count, radii_).most) : Bound(0);

        uint32_t id[leaf_points], rank[leaf_points];
        for (uint32_t i = 0; i < leaf_points; ++i) id[i] = i < count ? records[i].id() : no_point;
        find_id_ranks(id, rank);
        for (uint32_t i = 0; i < count; ++i) {
            const uint32_t slot = first + rank[i];
            x_[slot] = records[i].coordinate(0);
            y_[slot] = records[i].coordinate(1);
            z_[slot] = records[i].coordinate(2);
            id_[slot] = id[i];
        }
    }

    Real *x_, *y_, *z_;
    uint32_t *id_;
    BoxBlock *leaf_boxes_;
    const Real *radii_; // by id, or nullptr
    Watch watch_;
};

void set_no_box(BoxBlock &block, uint32_t lane) {
    block.low_x[lane] = block.low_y[lane] = block.low_z[lane] = no_bound(Bound());
    block.high_x[lane] = block.high_y[lane] = block.high_z[lane] = -no_bound(Bound());
    block.radius[lane] = Bound(0);
}

void set_union(BoxBlock &parent, uint32_t lane, const BoxBlock &block) {
    parent.low_x[lane] = *std::min_element(block.low_x, block.low_x + children);
    parent.low_y[lane] = *std::min_element(block.low_y, block.low_y + children);
    parent.low_z[lane] = *std::min_element(block.low_z, block.low_z + children);
    parent.high_x[lane] = *std::max_element(block.high_x, block.high_x + children);
    parent.high_y[lane] = *std::max_element(block.high_y, block.high_y + children);
    parent.high_z[lane] = *std::max_element(block.high_z, block.high_z + children);
    parent.radius[lane] = *std::max_element(block.radius, block.radius + children);
}

// Computes the boxes of blocks from those of their children. The boxes of leaves exist already.
void box_blocks(const PointTree &tree, BoxBlock *blocks) {
    uint32_t members = tree.leaf_count;
    for (uint32_t h = 0; h < tree.height; ++h) {
        BoxBlock *here = blocks + tree.first_block[h];
        if (h > 0)
            for (uint32_t i = 0; i < members; ++i)
                set_union(here[i / children], i % children, blocks[tree.first_block[h - 1] + i]);
        for (uint32_t i = members; i % children != 0; ++i) set_no_box(here[i / children], i % children);
        members = blocks_at(tree.leaf_count, h);
    }
}

} // namespace

uint64_t point_tree_bytes(uint32_t count) {
    const uint64_t slots = (uint64_t{count} + leaf_points - 1) / leaf_points * leaf_points;
    const uint32_t leaves = static_cast<uint32_t>(slots / leaf_points);
    uint64_t blocks = 0;
    for (uint32_t h = 0; h < height_for(leaves); ++h) blocks += blocks_at(leaves, h);
    return 3 * Arena::bytes<Real>(slots) + Arena::bytes<uint32_t>(slots) + Arena::bytes<BoxBlock>(blocks) +
           2 * Arena::bytes<Record>(count);
}

PointTree build_point_tree(const Vec3 *points, uint32_t count, Arena &arena, Watch watch, const Real *radii) {
    const size_t start = arena.mark();
    PointTree tree = {};
    watch.expect(count * uint64_t{units_per_point});
    const uint32_t slots = point_tree_slots(count);
    tree.count = count;
    tree.leaf_count = slots / leaf_points;
    tree.height = height_for(tree.leaf_count);
    uint32_t block_count = 0;
    for (uint32_t h = tree.height; h-- > 0; block_count += blocks_at(tree.leaf_count, h))
        tree.first_block[h] = block_count;

    Real *x = arena.make<Real>(slots), *y = arena.make<Real>(slots), *z = arena.make<Real>(slots);
    uint32_t *id = arena.make<uint32_t>(slots);
    BoxBlock *blocks = arena.make<BoxBlock>(block_count);
    const size_t kept = arena.mark();
    Record *records = arena.make<Record>(count), *spare = arena.make<Record>(count);
    if (!x || !y || !z || !id || !blocks || !records || !spare) {
        arena.rewind(start);
        return {};
    }
    for (uint32_t i = 0; i < count; ++i) {
        const Vec3 &p = points[i];
        records[i] = {{to_key(p.x), to_key(p.y), to_key(p.z), to_key(from_ordinal(Ordinal{i}, Real()))}};
    }
    if (count > 0) {
        Bounds b;
        find_bounds(records, count, b);
        tree.bounds = {b.low_corner(), b.high_corner()};
        tree.has_radii = radii && radius_range(records, count, radii).unlike();
        if (!tree.has_radii) radii = nullptr;
        Builder(x, y, z, id, blocks + tree.first_block[0], radii, watch).build(records, spare, 0, count, tree.height);
        if (watch.stopped()) return {};
        box_blocks(tree, blocks);
    }
    for (uint32_t slot = count; slot < slots; ++slot) {
        x[slot] = coordinate_of_empty(Real());
        y[slot] = z[slot] = Real(0);
        id[slot] = no_point;
    }
    arena.rewind(kept);
    tree.x = x, tree.y = y, tree.z = z, tree.id = id, tree.blocks = blocks;
    tree.ready = true;
    return tree;
}

// ---- searching ----

namespace {

// Squared distances of all slots of a leaf.
WISP_INLINE void leaf_distances(const PointTree &tree, uint32_t leaf, const Vec3 &center, Real *distance_squared) {
    const size_t first = size_t{leaf} * leaf_points;
    const Real *x = tree.x + first, *y = tree.y + first, *z = tree.z + first;
    WISP_NO_UNROLL for (uint32_t l = 0; l < leaf_points; ++l) {
        const Real dx = x[l] - center.x, dy = y[l] - center.y, dz = z[l] - center.z;
        distance_squared[l] = sum_of_products(dx, dx, dy, dy, dz, dz);
    }
}

// Slots in ascending order with their squared distances. Only those with distance < limit are candidates.
struct Candidates {
    Real *distance;
    uint32_t *slot;
    uint32_t count;
    Real limit;
};

// The candidates with distance < bound, and those with distance == bound and id < ids_below.
struct Cut {
    Real bound;
    uint32_t ids_below;
};

WISP_MULTIVERSIONED uint32_t count_below(const Real *distance, uint32_t count, Real bound) {
    uint32_t below = 0;
    for (size_t i = 0; i < count; ++i) below += distance[i] < bound ? 1 : 0;
    return below;
}

WISP_MULTIVERSIONED uint32_t count_up_to(const Real *distance, uint32_t count, Real bound) {
    uint32_t below = 0;
    for (size_t i = 0; i < count; ++i) below += distance[i] <= bound ? 1 : 0;
    return below;
}

uint32_t count_tied(const Candidates &c, Real bound, const uint32_t *id, uint32_t ids_below) {
    uint32_t tied = 0;
    for (uint32_t i = 0; i < c.count; ++i) tied += c.distance[i] == bound && id[c.slot[i]] < ids_below ? 1 : 0;
    return tied;
}

// The smallest n in [low, high] with enough(n). enough must be monotonic, and true for high.
template <class Integer, class Enough> Integer least(Integer low, Integer high, Enough enough) {
    while (low < high) {
        const Integer middle = low + (high - low) / 2;
        if (enough(middle))
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// The cut after the first k candidates by (distance, id); 0 < k <= inside, the number of candidates.
Cut cut_after(const Candidates &c, uint32_t k, uint32_t inside, const uint32_t *id) {
    if (inside == k) return {c.limit, 0};
    // Search for a bound that exactly k distances do not exceed. The first guess assumes even density. Later guesses
    // interpolate between a bound that is too low and one that is too high.
    const auto ratio = [](uint32_t a, uint32_t b) {
        return Real(static_cast<int32_t>(a)) / Real(static_cast<int32_t>(b));
    };
    Real low = Real(0), high = c.limit;
    uint32_t up_to_low = 0, up_to_high = inside;
    const Real excess = ratio(inside - k, inside);
    Real guess = high - high * (excess * (Real(2.0 / 3) + excess * Real(1.0 / 9))); // about high (k / inside)^(2/3)
    for (int step = 0; step < 12; ++step) {
        const uint32_t up_to_guess = count_up_to(c.distance, c.count, guess);
        if (up_to_guess == k) return {guess, no_point};
        (up_to_guess < k ? low : high) = guess;
        (up_to_guess < k ? up_to_low : up_to_high) = up_to_guess;
        if (up_to_high - up_to_low < 2) break;
        guess = low + (high - low) * ratio(2 * (k - up_to_low) + 1, 2 * (up_to_high - up_to_low) + 2);
    }
    // Some distances are equal, or almost: find the k-th by bisection, then divide the equal ones by id.
    const auto ordinal = least(to_ordinal(low), to_ordinal(high),
                               [&](auto n) { return count_up_to(c.distance, c.count, from_ordinal(n, Real())) >= k; });
    const Real bound = from_ordinal(ordinal, Real());
    const uint32_t wanted = k - count_below(c.distance, c.count, bound);
    return {bound, least(uint32_t{0}, no_point, [&](uint32_t n) { return count_tied(c, bound, id, n) >= wanted; })};
}

// Copies the first k candidates, those within the cut. The output arrays may be the candidates' own.
void take(const Candidates &c, uint32_t k, Cut cut, const uint32_t *id, Real *distance, uint32_t *slot) {
    uint32_t taken = 0;
    if (cut.ids_below == 0 || cut.ids_below == no_point) {
        const Real bound = cut.ids_below == 0 ? cut.bound : from_ordinal(to_ordinal(cut.bound) + 1, Real());
        for (uint32_t i = 0; taken < k; ++i) {
            const Real d = c.distance[i];
            distance[taken] = d;
            slot[taken] = c.slot[i];
            taken += d < bound ? 1 : 0;
        }
        return;
    }
    for (uint32_t i = 0; taken < k; ++i) {
        const Real d = c.distance[i];
        const uint32_t s = c.slot[i];
        distance[taken] = d;
        slot[taken] = s;
        taken += d < cut.bound || (d == cut.bound && id[s] < cut.ids_below) ? 1 : 0;
    }
}

// Moves the first k candidates, or all if there are fewer, to the given arrays, which may be the candidates' own.
// Returns their number. The limit becomes the next number above the distance of the last one.
__attribute__((noinline)) uint32_t keep_first(Candidates &c, uint32_t k, const uint32_t *id, Real *distance,
                                              uint32_t *slot) {
    const uint32_t inside = count_below(c.distance, c.count, c.limit), kept = min(k, inside);
    const Cut cut = cut_after(c, kept, inside, id);
    take(c, kept, cut, id, distance, slot);
    if (kept < inside) c.limit = from_ordinal(to_ordinal(cut.bound) + 1, Real());
    return kept;
}

// Gathers the slots of all leaves within the radius. If they exceed `capacity`, at least the first k candidates are
// kept.
WISP_MULTIVERSIONED void gather(const PointTree &tree, const Vec3 &center, uint32_t k, Real radius, uint32_t capacity,
                                Candidates &c) {
    c.limit = radius * radius;
    uint32_t count = 0;
    for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) {
        if (count + leaf_points > capacity) {
            c.count = count;
            count = keep_first(c, k, tree.id, c.distance, c.slot);
        }
        leaf_distances(tree, leaf, center, c.distance + count);
        uint32_t *slot = c.slot + count;
        WISP_NO_UNROLL for (uint32_t l = 0; l < leaf_points; ++l) slot[l] = leaf * leaf_points + l;
        count += leaf_points;
    });
    while (count > 0 && c.slot[count - 1] >= tree.count) --count; // empty slots
    c.count = count;
}

// A radius that is likely to hold slightly more than k points, from the density of a node near the centre that has
// about k points.
Real guess_radius(const PointTree &tree, const Vec3 &center, uint32_t k) {
    const BallTest ball(center, Real(0));
    const BoxBlock *block = tree.blocks;
    uint32_t index = 0, lane = 0;
    uint64_t points = 0;
    BoundProduct gap = 0;
    for (uint32_t h = tree.height; h-- > 0;) {
        if (points > 0 && leaves_of_child(h) * leaf_points * 2 < k) break;
        points = leaves_of_child(h) * leaf_points;
        block = tree.blocks + tree.first_block[h] + index;
        BoundProduct gaps[children];
        WISP_NO_UNROLL for (uint32_t l = 0; l < children; ++l) gaps[l] = ball.gap_squared(*block, l);
        lane = 0;
        for (uint32_t l = 1; l < children; ++l) lane = gaps[l] < gaps[lane] ? l : lane;
        gap = gaps[lane];
        index = index * children + lane;
    }
    const Real x = length_of_bound(block->high_x[lane] - block->low_x[lane], Real());
    const Real y = length_of_bound(block->high_y[lane] - block->low_y[lane], Real());
    const Real z = length_of_bound(block->high_z[lane] - block->low_z[lane], Real());
    const Real widest = max(max(x, y), z);
    if (!(widest > Real(0))) return Real(0);
    const Real volume = max((x / widest) * (y / widest) * (z / widest), Real(1.0 / 64)); // in units of widest^3
    const Real fraction = Real(static_cast<int32_t>(k)) / Real(static_cast<int32_t>(points));
    // 0.2387 = 3 / (4 pi)
    return widest * cbrt(volume * fraction * Real(0.2387)) + root_of_bound(gap, Real());
}

constexpr uint64_t candidates_for(uint64_t k) { return 4 * k + 32 * leaf_points; }

} // namespace

uint64_t nearest_scratch_bytes(uint32_t max_k) {
    return Arena::bytes<Real>(candidates_for(max_k)) + Arena::bytes<uint32_t>(candidates_for(max_k));
}

bool make_nearest_scratch(uint32_t max_k, Arena &arena, NearestScratch &scratch) {
    const size_t start = arena.mark();
    scratch.capacity = static_cast<uint32_t>(candidates_for(max_k));
    scratch.distance_squared = arena.make<Real>(scratch.capacity);
    scratch.slot = arena.make<uint32_t>(scratch.capacity);
    if (scratch.distance_squared && scratch.slot) return true;
    arena.rewind(start);
    return false;
}

Nearest nearest(const PointTree &tree, const Vec3 &center, uint32_t k, Real max_radius, NearestScratch &scratch,
                uint32_t *slots, Real *distances_squared) {
    if (k == 0 || tree.count == 0) return {};
    Candidates c = {scratch.distance_squared, scratch.slot, 0, Real(0)};
    Real radius = k < tree.count ? min(guess_radius(tree, center, k), max_radius) : max_radius;
    for (uint32_t tries = 0;; ++tries) {
        gather(tree, center, k, radius, scratch.capacity, c);
        const uint32_t inside = count_below(c.distance, c.count, c.limit);
        if (inside >= k || !(radius < max_radius)) break;
        // Grow as even density suggests; after two tries, at least double.
        const Real missing = Real(static_cast<int32_t>(k)) / Real(static_cast<int32_t>(inside + 1));
        const Real growth = max(cbrt(missing * Real(1.5)), Real(tries < 2 ? 1 : 2));
        radius = radius > Real(0) ? min(max_radius, radius * min(growth, Real(4))) : max_radius;
    }
    Nearest found = {};
    found.count = keep_first(c, k, tree.id, distances_squared, slots);
    for (uint32_t i = 1; i < found.count; ++i) {
        const Real d = distances_squared[i], farthest = distances_squared[found.farthest];
        if (farthest < d || (d == farthest && tree.id[slots[found.farthest]] < tree.id[slots[i]])) found.farthest = i;
    }
    if (found.count > 0) found.radius_squared = distances_squared[found.farthest];
    return found;
}

WISP_MULTIVERSIONED uint32_t in_radius(const PointTree &tree, const Vec3 &center, Real radius, uint32_t *slots,
                                       uint32_t capacity) {
    const Real limit = radius * radius;
    uint32_t count = 0;
    for_each_leaf_near(tree, center, radius, [&](uint32_t leaf) {
        Real distance[leaf_points];
        leaf_distances(tree, leaf, center, distance);
        const uint32_t first = leaf * leaf_points, filled = min(tree.count - first, leaf_points);
        if (capacity > 0)
            for (uint32_t l = 0, next = count; l < filled && next < capacity; ++l)
                if (distance[l] < limit) slots[next++] = first + l;
        WISP_NO_UNROLL for (uint32_t l = 0; l < leaf_points; ++l) count += distance[l] < limit && l < filled ? 1 : 0;
    });
    return count;
}

} // namespace WISP_ARITH
} // namespace wisp
