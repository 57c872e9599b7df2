// The kd-tree over triangles: building by the surface area heuristic, and rays through it.
#include "core/geometry/point_kdtree.h" // WISP_NO_UNROLL, WISP_INLINE
#include "core/numbers/double_bits.h"
#include "core/surfaces/triangle_kdtree.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

// ---- building: integers in steps of a lattice ----

constexpr int lattice_bits = 23;  // coordinates are below 2^23 steps
constexpr int fine_bits = 7;      // triangles are clipped to cells in units of 2^-7 steps
constexpr int64_t fine_slack = 8; // of those units, more than a corner's rounding (one) and six cuts (one each)

// Costs of the heuristic: to traverse a node, to test a group of triangles.
constexpr uint64_t node_cost = 1, group_cost = 2;
constexpr uint32_t few = 64;   // of so few triangles, planes at all bounds are tried
constexpr uint32_t bins = 256; // of more, planes at the bounds around the best border of so many bins

constexpr uint32_t leaf_axis = 3;

struct LatticeBox {
    int32_t low[3], high[3];
};

// A triangle in a node. The box holds the part of the triangle that lies in the node's cell.
struct Item {
    uint32_t triangle;
    LatticeBox box;
};

// The capacities of the lists. A node that would not fit is not split.
struct Capacities {
    uint64_t groups, nodes, items;
};
constexpr Capacities capacities_for(uint64_t count) { return {count + 8, 4 * count + 8, 3 * count + 8}; }

constexpr uint32_t groups_for(uint32_t triangles) { return (triangles + group_triangles - 1) / group_triangles; }

// A plane across an axis that splits a node: how many triangles go to the child below and above; triangles that lie in
// the plane go below if flat_below, otherwise above.
struct Split {
    uint64_t cost = UINT64_MAX;
    uint32_t axis = 0;
    int32_t plane = 0;
    bool flat_below = false;
    uint32_t below = 0, above = 0;
};

// SAH costs of planes across an axis of a cell. Areas are shifted so that area times count fits 64 bits.
class CutCosts {
  public:
    CutCosts(const LatticeBox &cell, uint32_t axis) : axis_(axis), low_(cell.low[axis]), high_(cell.high[axis]) {
        const auto extent = [&](uint32_t a) { return static_cast<uint64_t>(int64_t{cell.high[a]} - cell.low[a]); };
        const uint64_t p = extent((axis + 1) % 3), q = extent((axis + 2) % 3);
        ends_ = p * q, around_ = p + q;
        const uint64_t all = ends_ + around_ * extent(axis);
        while (all >> shift_ >= uint64_t{1} << 30) ++shift_;
        all_ = (all >> shift_) + 1;
    }
    uint64_t of_leaf(uint32_t count) const { return all_ * group_cost * groups_for(count); }

    void consider(int32_t plane, uint32_t below, uint32_t above, uint32_t flat, Split &best) const {
        if (plane <= low_ || plane >= high_) return;
        const uint64_t area_below = area(plane - int64_t{low_}), area_above = area(high_ - int64_t{plane});
        for (const bool flat_below : {true, false}) {
            const uint32_t in_below = below + (flat_below ? flat : 0), in_above = above + (flat_below ? 0 : flat);
            uint64_t tests = group_cost * (area_below * groups_for(in_below) + area_above * groups_for(in_above));
            if (in_below == 0 || in_above == 0) tests -= tests / 8; // empty space ends rays early
            const uint64_t cost = all_ * node_cost + tests;
            if (cost < best.cost) best = {cost, axis_, plane, flat_below, in_below, in_above};
            if (flat == 0) return;
        }
    }

  private:
    uint64_t area(int64_t width) const { return (ends_ + around_ * static_cast<uint64_t>(width)) >> shift_; }
    uint32_t axis_;
    int32_t low_, high_;
    int shift_ = 0;
    uint64_t ends_, around_, all_;
};

// A point of a triangle in fine units.
struct FinePoint {
    int64_t x[3];
};

// Clips a convex polygon of `count` corners to sign (x[axis] - at) <= 0; each clip adds a corner at most.
uint32_t cut_off(const FinePoint *from, uint32_t count, uint32_t axis, int64_t at, int64_t sign, FinePoint *to) {
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const FinePoint &p = from[i], &q = from[i + 1 < count ? i + 1 : 0];
        const int64_t p_over = sign * (p.x[axis] - at), q_over = sign * (q.x[axis] - at);
        if (p_over <= 0) to[left++] = p;
        if ((p_over < 0 && q_over > 0) || (p_over > 0 && q_over < 0)) {
            FinePoint &r = to[left++];
            for (uint32_t a = 0; a < 3; ++a)
                r.x[a] = p.x[a] + (q.x[a] - p.x[a]) * (at - p.x[axis]) / (q.x[axis] - p.x[axis]);
            r.x[axis] = at;
        }
    }
    return left;
}

// Narrows the box to the part of the triangle in it; false: no part is.
bool narrow(const FinePoint (&corner)[3], LatticeBox &box) {
    FinePoint polygons[2][10]; // three corners and one for each of six cuts
    std::copy(corner, corner + 3, polygons[0]);
    uint32_t count = 3, now = 0;
    const auto cut = [&](uint32_t axis, int64_t at, int64_t sign) {
        bool over = false;
        for (uint32_t i = 0; i < count; ++i) over = over || sign * (polygons[now][i].x[axis] - at) > 0;
        if (!over) return;
        count = cut_off(polygons[now], count, axis, at, sign, polygons[1 - now]);
        now = 1 - now;
    };
    for (uint32_t a = 0; a < 3; ++a) {
        cut(a, (int64_t{box.low[a]} << fine_bits) - fine_slack, -1);
        cut(a, (int64_t{box.high[a]} << fine_bits) + fine_slack, 1);
    }
    if (count == 0) return false;
    for (uint32_t a = 0; a < 3; ++a) {
        int64_t low = polygons[now][0].x[a], high = low;
        for (uint32_t i = 1; i < count; ++i) {
            low = min(low, polygons[now][i].x[a]);
            high = max(high, polygons[now][i].x[a]);
        }
        box.low[a] = max(box.low[a], static_cast<int32_t>((low - fine_slack) >> fine_bits));
        box.high[a] = min(box.high[a], static_cast<int32_t>(-((-high - fine_slack) >> fine_bits)));
        if (box.low[a] > box.high[a]) return false;
    }
    return true;
}

uint32_t plane_value(int32_t plane, int exponent) {
    if constexpr (std::is_same_v<Real, Fixed>)
        return static_cast<uint32_t>(plane);
    else
        return detail::to_bits(scale_pow2(static_cast<float>(plane), exponent));
}

Vec3 corner_of(const Triangle &triangle, uint32_t i) { return vec_of(triangle.corner[i]); }

constexpr uint32_t units_per_triangle = 64; // of work

class TriangleTreeBuilder {
  public:
    TriangleTreeBuilder(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch)
        : triangles_(triangles), materials_(materials), capacities_(capacities_for(count)), watch_(watch) {
        const size_t start = arena.mark();
        groups_ = arena.make<TriangleGroup>(static_cast<size_t>(capacities_.groups));
        nodes_ = arena.make<TriangleNode>(static_cast<size_t>(capacities_.nodes));
        items_ = arena.make<Item>(static_cast<size_t>(capacities_.items));
        events_ = arena.make<uint32_t>(size_t{2} * count);
        if (!groups_ || !nodes_ || !items_ || !events_) {
            arena.rewind(start);
            return;
        }
        watch_.expect(uint64_t{count} * units_per_triangle);
        find_items(count);
        grow();
        if (watch_.stopped()) {
            arena.rewind(start);
            return;
        }
        // Memory that was not needed is returned: nodes move down to follow the last group.
        arena.rewind(start);
        tree_.groups = arena.make<TriangleGroup>(tree_.group_count);
        TriangleNode *nodes = arena.make<TriangleNode>(tree_.node_count);
        std::copy(nodes_, nodes_ + tree_.node_count, nodes);
        tree_.nodes = nodes;
        tree_.ready = true;
    }
    const TriangleTree &tree() const { return tree_; }

  private:
    struct Task {
        uint32_t node, depth;
        uint64_t first; // of its items
        uint32_t count;
        uint64_t room; // for groups in its leaves
        LatticeBox cell;
    };

    void find_items(uint32_t count) {
        Real &largest = tree_.largest;
        largest = Real(0);
        for (uint32_t i = 0; i < count && (i % 1024 != 0 || watch_.go_on(1024)); ++i) {
            const Vec3 a = corner_of(triangles_[i], 0), b = corner_of(triangles_[i], 1),
                       c = corner_of(triangles_[i], 2);
            if (!has_area(a, b, c)) continue;
            const Vec3 low = min(a, min(b, c)), high = max(a, max(b, c));
            Box &bounds = tree_.bounds;
            bounds = tree_.triangle_count == 0 ? Box{low, high} : Box{min(bounds.low, low), max(bounds.high, high)};
            items_[tree_.triangle_count++].triangle = i;
            for (int axis = 0; axis < 3; ++axis) largest = max(largest, max(abs(low[axis]), abs(high[axis])));
        }
        constexpr int finest = std::is_same_v<Real, Fixed> ? -32 : -100;
        tree_.step_exponent = finest;
        while (!(scale_pow2(largest, -lattice_bits - tree_.step_exponent) < Real(1))) ++tree_.step_exponent;
        for (uint32_t i = 0; i < tree_.triangle_count; ++i) {
            const Triangle &triangle = triangles_[items_[i].triangle];
            const Vec3 a = corner_of(triangle, 0), b = corner_of(triangle, 1), c = corner_of(triangle, 2);
            items_[i].box = around({min(a, min(b, c)), max(a, max(b, c))});
        }
    }

    LatticeBox around(const Box &box) const {
        LatticeBox result;
        for (int axis = 0; axis < 3; ++axis) {
            result.low[axis] = floor_to_int(scale_pow2(box.low[axis], -tree_.step_exponent));
            result.high[axis] = -floor_to_int(-scale_pow2(box.high[axis], -tree_.step_exponent));
        }
        return result;
    }

    bool narrow(Item &item) const {
        FinePoint corner[3];
        for (uint32_t i = 0; i < 3; ++i) {
            const Vec3 p = corner_of(triangles_[item.triangle], i);
            for (int axis = 0; axis < 3; ++axis)
                corner[i].x[axis] = floor_to_int(scale_pow2(p[axis], fine_bits - tree_.step_exponent));
        }
        return wisp::WISP_ARITH::narrow(corner, item.box);
    }

    // ---- the best plane ----

    // Tries planes at the bounds of items, from `from` to `to`. `below` items begin before `from`, `above` items end at
    // `from` or later.
    void sweep(const Task &task, uint32_t axis, int32_t from, int32_t to, uint32_t below, uint32_t above, Split &best) {
        enum : uint32_t { end, flat, begin }; // in this order at one plane
        const Item *items = items_ + task.first;
        uint32_t count = 0;
        const auto add = [&](int32_t at, uint32_t kind) {
            if (at >= from && at <= to) events_[count++] = static_cast<uint32_t>(at - from) << 2 | kind;
        };
        for (uint32_t i = 0; i < task.count; ++i) {
            const int32_t low = items[i].box.low[axis], high = items[i].box.high[axis];
            if (low == high) {
                add(low, flat);
            } else {
                add(low, begin);
                add(high, end);
            }
        }
        std::sort(events_, events_ + count);
        const CutCosts costs(task.cell, axis);
        for (uint32_t i = 0; i < count;) {
            const uint32_t place = events_[i] >> 2;
            uint32_t kinds[3] = {};
            for (; i < count && events_[i] >> 2 == place; ++i) ++kinds[events_[i] & 3];
            above -= kinds[end] + kinds[flat];
            costs.consider(from + static_cast<int32_t>(place), below, above, kinds[flat], best);
            below += kinds[begin] + kinds[flat];
        }
    }

    // Finds the best border of bins, then the best plane between the borders before and after it.
    void sweep_bins(const Task &task, uint32_t axis, Split &best) {
        const int32_t low = task.cell.low[axis], high = task.cell.high[axis];
        int shift = 0;
        while (int64_t{high} - low >= int64_t{bins} << shift) ++shift;
        uint32_t begins[bins] = {}, ends[bins] = {};
        for (uint32_t i = 0; i < task.count; ++i) {
            const LatticeBox &box = items_[task.first + i].box;
            ++begins[(box.low[axis] - low) >> shift];
            ++ends[(box.high[axis] - low) >> shift];
        }
        const CutCosts costs(task.cell, axis);
        Split border;
        uint32_t below = 0, above = task.count, below_before = 0, above_before = task.count, last = bins - 1;
        while (last > 0 && low + (int64_t{last} << shift) >= high) --last;
        uint32_t best_bin = 0, best_below = 0, best_above = 0;
        for (uint32_t bin = 0; bin <= last; ++bin) {
            const uint64_t cost = border.cost;
            costs.consider(low + static_cast<int32_t>(bin << shift), below, above, 0, border);
            if (border.cost < cost) best_bin = bin, best_below = below_before, best_above = above_before;
            below_before = below, above_before = above;
            below += begins[bin], above -= ends[bin];
        }
        if (best_bin == 0) return;
        const int32_t at = low + static_cast<int32_t>(best_bin << shift), width = int32_t{1} << shift;
        sweep(task, axis, at - width, min(high, at + width), best_below, best_above, best);
    }

    Split find_split(const Task &task) {
        Split best;
        for (uint32_t axis = 0; axis < 3 && watch_.go_on(2 * task.count); ++axis)
            if (task.count <= few)
                sweep(task, axis, task.cell.low[axis], task.cell.high[axis], 0, task.count, best);
            else
                sweep_bins(task, axis, best);
        return best;
    }

    // ---- the tree ----

    void make_leaf(const Task &task) {
        watch_.done(uint64_t{task.count} * units_per_triangle);
        nodes_[task.node] = {task.count, tree_.group_count << 2 | leaf_axis};
        for (uint32_t first = 0; first < task.count; first += group_triangles) {
            TriangleGroup &group = groups_[tree_.group_count++];
            for (uint32_t lane = 0; lane < group_triangles; ++lane) {
                const bool empty = first + lane >= task.count;
                const Triangle *triangle = empty ? nullptr : triangles_ + items_[task.first + first + lane].triangle;
                group.triangle[lane] = empty ? no_triangle : items_[task.first + first + lane].triangle;
                if (!empty && total_order_key(materials_[triangle->material].transmission) > 0)
                    group.triangle[lane] |= transmissive_bit;
                for (uint32_t c = 0; c < 3; ++c) {
                    const Vec3 p = empty ? Vec3(Real(0)) : corner_of(*triangle, c);
                    for (int axis = 0; axis < 3; ++axis) group.corner[c][axis][lane] = p[axis];
                }
            }
        }
    }

    // Leaves the items of the upper child where those of the node were, followed by those of the lower child.
    void divide(const Split &split, const Task &task, Task &below, Task &above) {
        const uint32_t axis = split.axis;
        below = {tree_.node_count, task.depth + 1, 0, 0, 0, task.cell};
        above = {tree_.node_count + 1, task.depth + 1, task.first, 0, 0, task.cell};
        below.cell.high[axis] = above.cell.low[axis] = split.plane;
        tree_.node_count += 2;
        nodes_[task.node] = {plane_value(split.plane, tree_.step_exponent), below.node << 2 | axis};
        Item *const upper = items_ + task.first, *const lower = upper + task.count;
        for (uint32_t i = 0; i < task.count; ++i) {
            const Item item = upper[i];
            const int32_t low = item.box.low[axis], high = item.box.high[axis];
            const bool flat = low == split.plane && high == split.plane;
            const bool in_below = low < split.plane || (flat && split.flat_below);
            const bool in_above = high > split.plane || (flat && !split.flat_below);
            Item part = item;
            part.box.high[axis] = min(high, split.plane);
            if (in_below && (!in_above || narrow(part))) lower[below.count++] = part;
            part = item;
            part.box.low[axis] = max(low, split.plane);
            if (in_above && (!in_below || narrow(part))) upper[above.count++] = part;
        }
        below.first = task.first + above.count;
        std::copy(lower, lower + below.count, items_ + below.first);
        // Spare room is divided in proportion to the numbers of triangles.
        const uint64_t needed_below = groups_for(below.count),
                       spare = task.room - needed_below - groups_for(above.count);
        below.room = needed_below + spare * below.count / max(uint64_t{1}, uint64_t{below.count} + above.count);
        above.room = task.room - below.room;
    }

    void grow() {
        Task stack[max_tree_depth]; // upper children, at most one of each depth
        uint32_t stack_size = 0;
        nodes_[1] = {0, leaf_axis}; // unused: pairs of children begin at even places
        tree_.node_count = 2;
        Task task = {0, 0, 0, tree_.triangle_count, capacities_.groups, around(tree_.bounds)};
        for (;;) {
            Split split;
            if (task.count > 0 && task.depth < max_tree_depth) split = find_split(task);
            const bool worth = split.cost < CutCosts(task.cell, split.axis).of_leaf(task.count);
            if (worth && tree_.node_count + 2 <= capacities_.nodes &&
                task.first + task.count + split.below <= capacities_.items &&
                groups_for(split.below) + groups_for(split.above) <= task.room) {
                Task below, above;
                divide(split, task, below, above);
                stack[stack_size++] = above;
                task = below;
                continue;
            }
            make_leaf(task);
            if (stack_size == 0) return;
            const uint64_t left = task.room - groups_for(task.count);
            task = stack[--stack_size];
            task.room += left;
        }
    }

    const Triangle *triangles_;
    const Material *materials_;
    Capacities capacities_;
    TriangleGroup *groups_;
    TriangleNode *nodes_;
    Item *items_;
    uint32_t *events_;
    TriangleTree tree_ = {};
    Watch watch_;
};

} // namespace

uint64_t triangle_tree_bytes(uint32_t count) {
    const Capacities capacities = capacities_for(count);
    return Arena::bytes<TriangleGroup>(capacities.groups) + Arena::bytes<TriangleNode>(capacities.nodes) +
           Arena::bytes<Item>(capacities.items) + Arena::bytes<uint32_t>(uint64_t{2} * count);
}

TriangleTree make_triangle_tree(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena,
                                Watch watch) {
    if (count > max_triangles) return {};
    return TriangleTreeBuilder(triangles, count, materials, arena, watch).tree();
}

// ---- rays ----

namespace {

inline float position_of(float x) { return x; }
inline double position_of(double x) { return x; }
inline int64_t position_of(Fixed x) { return x.raw(); }

inline float plane_of(uint32_t value, int, float) { return detail::from_bits<float>(value); }
inline double plane_of(uint32_t value, int, double) { return detail::from_bits<float>(value); }
inline int64_t plane_of(uint32_t value, int shift, int64_t) {
    return static_cast<int64_t>(static_cast<uint64_t>(int64_t{static_cast<int32_t>(value)}) << shift);
}

inline float times(float a, float b) { return a * b; }
inline double times(double a, double b) { return a * b; }
inline int64_t times(int64_t a, int64_t b) { // b in units of 2^-32
    const detail::Wide w = detail::product<detail::Wide>(a, b);
    return static_cast<int64_t>((static_cast<uint64_t>(detail::high_word(w)) << 32) | (detail::low_word(w) >> 32));
}

// The ray's parameter at a distance, rounded to either side.
template <class T> struct Span { T low, high; };
inline Span<float> span_of(float distance, float) { return {distance, distance}; }
inline Span<double> span_of(double distance, double) { return {distance, distance}; }
inline Span<int64_t> span_of(Fixed distance, Fixed dominant) {
    constexpr int64_t far = int64_t{1} << 61;
    const int64_t high = detail::high_word(detail::product<detail::Wide>(distance.raw(), abs(dominant).raw()));
    if (high >= far >> 32) return {far, far};
    if (high < -far >> 32) return {-far, -far};
    const int64_t low = times(distance.raw(), abs(dominant).raw());
    return {low, low + 1};
}

// `inverse`: how far the parameter grows per unit of length along an axis. `margin`: the margin of plane crossings, as
// a parameter. `component` and `dominant` are the direction's component along the axis and its largest one. `reach` is
// at least the magnitude of any corner's coordinate plus that of the origin's.
template <class T> struct Slope { T inverse, margin; };
template <class T> Slope<T> slope_of(T component, T dominant, T reach) {
    constexpr T e = sizeof(T) == 4 ? T(0x1p-24) : T(0x1p-53);
    const T least = abs(dominant) * e, size = max(abs(component), least);
    const T inverse = T(1) / (component < 0 ? -size : size);
    // In units of e reach: 14 for the hit (triangle.h), 1 for raising the component, 1 for the inverse, 4 for the
    // products and sums in to_low and to_high, less than a half for the margin itself. The sum is below 24.
    return {inverse, T(24) * e * reach * abs(inverse)};
}
inline Slope<int64_t> slope_of(Fixed component, Fixed dominant, Fixed reach) {
    using namespace detail;
    const int64_t size = component.raw() < 0 ? -component.raw() : component.raw();
    const int64_t most = dominant.raw() < 0 ? -dominant.raw() : dominant.raw();
    // Lengths of up to `far` are multiplied by inverses of up to 2^room.
    int64_t margin = 8 + (most >> 32) + (reach.raw() >> 32);
    const int64_t far = reach.raw() + 2 * margin;
    const int room = min(30, leading_zeros(static_cast<uint64_t>(far)) - 3);
    int64_t inverse = int64_t{1} << (32 + room);
    if (most >> room < size)
        inverse = static_cast<int64_t>(
            divide(join<Wide>(static_cast<uint64_t>(most) >> 32, static_cast<uint64_t>(most) << 32),
                   static_cast<uint64_t>(size))
                .quotient);
    else
        margin += (reach.raw() >> room) + 1;
    return {component.raw() < 0 ? -inverse : inverse, times(margin, inverse) + 1};
}

// An upper bound of a corner's coordinate less the origin's, in magnitude.
Real reach_of(const TriangleTree &tree, const TriangleRay &ray) {
    return tree.largest + max(abs(ray.origin.x), max(abs(ray.origin.y), abs(ray.origin.z)));
}

// The ray as it is tested against planes.
struct PlaneRay {
    // A plane is crossed at a parameter from plane * inverse - to_low to plane * inverse - to_high.
    Parameter inverse[3], to_low[3], to_high[3];
    uint32_t backward[3]; // 1: the direction's component is negative
    int shift;            // Fixed: from steps of planes to units of 2^-32

    PlaneRay(const TriangleTree &tree, const TriangleRay &ray) : shift(tree.step_exponent + 32) {
        const Real origin[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
        const Real direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
        const Real reach = reach_of(tree, ray);
        for (uint32_t a = 0; a < 3; ++a) {
            const Slope<Parameter> slope = slope_of(direction[a], direction[ray.z], reach);
            const Parameter to_origin = times(position_of(origin[a]), slope.inverse);
            inverse[a] = slope.inverse;
            to_low[a] = to_origin + slope.margin;
            to_high[a] = to_origin - slope.margin;
            backward[a] = direction[a] < Real(0) ? 1 : 0;
        }
    }
};

// A filter finds the triangles of a group that may be hit: all that are hit, and few others. In f32 and f64 it computes
// the test's own sheared corners; the sign of a difference of rounded products is that of the exact difference, or 0.
template <class T> struct ExactFiltering {
    using Number = T;
    using Product = T;

    explicit ExactFiltering(T) {}
    static Number number_of(T shear) { return shear; }
    static Number difference(T a, T b) { return a - b; }
    static Number sheared(Number x, Number z, Number shear) { return x - shear * z; }
    static Product room(Number) { return Product(0); }
};

// For Fixed, by doubles in units of 2^-32. Differences from the test's own numbers:
//   - A corner less the origin is exact, and at most M = 2^47.
//   - A sheared corner differs by less than 2^-51 M + 2^-14: 2^-53 M by the shear, as much by its product, twice as
//     much by the difference, and 2^-14 because the test rounds down. `slack` is twice that.
//   - The cross product of corners p and q differs by less than slack / 2 (|p_x| + |p_y| + |q_x| + |q_y| + slack), and
//     by as much again through three roundings of 2^-53 of products below 2 M (|q_x| + |q_y|). `room` is twice their
//     sum.
struct DoubleFiltering {
    using Number = double;
    using Product = double;
    static constexpr double slack = 0x1p-3 + 0x1p-13;

    explicit DoubleFiltering(Fixed) {}
    static Number number_of(int64_t shear) { return static_cast<double>(shear) * 0x1p-62; }
    static Number difference(Fixed a, Fixed b) { // 2^52 + 2^51 + the integer, less 2^52 + 2^51
        const uint64_t integer = static_cast<uint64_t>(a.raw()) - static_cast<uint64_t>(b.raw());
        return detail::from_bits<double>(integer + 0x4338000000000000) - 0x1.8p52;
    }
    static Number sheared(Number x, Number z, Number shear) { return x - shear * z; }
    static Product room(Number sum) { return 2 * slack * (sum + slack); }
};

// For Fixed, by words of 32 bits, in units such that a corner less the origin is at most 2^27. Differences from the
// test's own numbers:
//   - A sheared corner differs by less than 3.2: 1 each by rounding down the coordinate, the coordinate along the ray
//     and their product, 2^-3 by the shear in units of 2^-30.
//   - The cross product of corners p and q differs by less than 3.2 (|p_x| + |p_y| + |q_x| + |q_y|) + 2 * 3.2^2. `room`
//     is more than that.
struct IntegerFiltering {
    using Number = int32_t;
    using Product = int64_t;
    int shift;

    explicit IntegerFiltering(Fixed reach)
        : shift(max(0, 37 - detail::leading_zeros(static_cast<uint64_t>(reach.raw()) | 1))) {}
    static Number number_of(int64_t shear) { return static_cast<Number>(shear >> 32); }
    Number difference(Fixed a, Fixed b) const { return static_cast<Number>((a.raw() - b.raw()) >> shift); }
    static Number sheared(Number x, Number z, Number shear) {
        return x - static_cast<Number>((Product{shear} * z) >> 30);
    }
    static Product room(Number sum) { return 4 * (Product{sum} + 8); }
};

using Filtering = std::conditional_t<!std::is_same_v<Real, Fixed>, ExactFiltering<Real>,
                                     std::conditional_t<hardware_double, DoubleFiltering, IntegerFiltering>>;

struct Filter : Filtering {
    uint32_t axis[3];
    Real from[3];
    Number shear_x, shear_y;

    Filter(const TriangleTree &tree, const TriangleRay &ray)
        : Filtering(reach_of(tree, ray)), axis{ray.x, ray.y, ray.z}, shear_x(number_of(ray.shear_x)),
          shear_y(number_of(ray.shear_y)) {
        for (int i = 0; i < 3; ++i) from[i] = ray.origin[static_cast<int>(axis[i])];
    }

    // A mask of the first `count` triangles that may be hit.
    WISP_INLINE uint32_t candidates(const TriangleGroup &group, uint32_t count) const {
        Number x[3][group_triangles], y[3][group_triangles];
        for (uint32_t c = 0; c < 3; ++c) {
            const Real *const from_x = group.corner[c][axis[0]], *const from_y = group.corner[c][axis[1]],
                              *const from_z = group.corner[c][axis[2]];
            WISP_NO_UNROLL for (uint32_t l = 0; l < group_triangles; ++l) {
                const Number z = difference(from_z[l], from[2]);
                x[c][l] = sheared(difference(from_x[l], from[0]), z, shear_x);
                y[c][l] = sheared(difference(from_y[l], from[1]), z, shear_y);
            }
        }
        const auto cross = [&](uint32_t p, uint32_t q, uint32_t l) {
            return Product{x[p][l]} * y[q][l] - Product{y[p][l]} * x[q][l];
        };
        const auto size = [](auto v) {
            if constexpr (std::is_integral_v<decltype(v)>)
                return v < 0 ? -v : v;
            else
                return abs(v);
        };
        uint32_t mask = 0;
        WISP_NO_UNROLL for (uint32_t l = 0; l < group_triangles; ++l) {
            const Product a = cross(2, 1, l), b = cross(0, 2, l), c = cross(1, 0, l);
            const Product space =
                room(size(x[0][l]) + size(x[1][l]) + size(x[2][l]) + size(y[0][l]) + size(y[1][l]) + size(y[2][l]));
            mask |= min(a, min(b, c)) < -space && max(a, max(b, c)) > space ? 0u : 1u << l;
        }
        return mask & ((1u << count) - 1);
    }
};

// Calls visit(triangle, hit) for triangles that the ray's line hits, in leaves that the ray passes between parameters
// `begin` and `end`. visit may lower `end`, and returns whether the search is over.
template <class Visit>
WISP_INLINE void search(const TriangleTree &tree, const TriangleRay &ray, Parameter begin, Parameter &end,
                        uint32_t ignore_triangle, TreeCounts &counts, Visit &&visit) {
    if (tree.triangle_count == 0) return;
    const PlaneRay planes(tree, ray);
    const Filter filter(tree, ray);
    Parameter from = begin, to = end;
    for (int a = 0; a < 3; ++a) {
        const Parameter low = times(position_of(tree.bounds.low[a]), planes.inverse[a]),
                        high = times(position_of(tree.bounds.high[a]), planes.inverse[a]);
        from = max(from, min(low, high) - planes.to_low[a]);
        to = min(to, max(low, high) - planes.to_high[a]);
    }
    if (to < from) return;
    struct StackEntry {
        uint32_t node;
        Parameter from, to;
    };
    StackEntry stack[max_tree_depth];
    uint32_t stack_size = 0;
    uint64_t visits = 0, tests = 0;
    uint32_t last = no_triangle;
    const TriangleNode *node = tree.nodes;
    for (bool done = false; !done;) {
        ++visits;
        while (node->axis() != leaf_axis) {
            const uint32_t axis = node->axis();
            const Parameter crossing = times(plane_of(node->value, planes.shift, Parameter()), planes.inverse[axis]);
            const Parameter far_from = crossing - planes.to_low[axis], near_to = crossing - planes.to_high[axis];
            const uint32_t near = node->first() + planes.backward[axis], far = near ^ 1;
            ++visits;
            if (far_from > to) {
                node = tree.nodes + near;
            } else if (near_to < from) {
                node = tree.nodes + far;
            } else {
                stack[stack_size++] = {far, max(from, far_from), to};
                to = min(to, near_to);
                node = tree.nodes + near;
            }
        }
        for (uint32_t count = node->value, at = node->first(); count > 0 && !done; ++at) {
            const TriangleGroup &group = tree.groups[at];
            const uint32_t tested = min(count, group_triangles);
            tests += tested;
            count -= tested;
            for (uint32_t mask = filter.candidates(group, tested); mask != 0 && !done; mask &= mask - 1) {
                const uint32_t lane = static_cast<uint32_t>(__builtin_ctz(mask));
                const uint32_t triangle = group.triangle[lane];
                if (triangle == last || (triangle & ~transmissive_bit) == ignore_triangle) continue;
                last = triangle; // often it is in the next leaf, too
                const auto sheared = [&](uint32_t c) {
                    const auto along = [&](uint32_t i) {
                        return group.corner[c][filter.axis[i]][lane] - filter.from[i];
                    };
                    return shear(ray, along(0), along(1), along(2));
                };
                TriangleHit hit;
                if (intersect(ray, sheared(0), sheared(1), sheared(2), hit)) done = visit(triangle, hit);
            }
        }
        for (;;) {
            if (stack_size == 0) {
                done = true;
                break;
            }
            const StackEntry &next = stack[--stack_size];
            if (next.from > end) continue;
            node = tree.nodes + next.node;
            from = next.from;
            to = min(next.to, end);
            break;
        }
    }
    counts.node_visits += visits;
    counts.triangle_tests += tests;
}

} // namespace

template <bool opaque_only>
WISP_INLINE bool find_nearest(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                              uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts, Real beyond) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    Parameter search_end = span_of(end, dominant).high;
    hit = {end, no_triangle, Real(0), Real(0), no_triangle};
    search(tree, ray, span_of(begin, dominant).low, search_end, ignore_triangle, counts,
           [&](uint32_t marked, const TriangleHit &found) {
               if (opaque_only && (marked & transmissive_bit) != 0) return false;
               const uint32_t triangle = marked & ~transmissive_bit;
               if (!(found.distance > begin) || !(found.distance < end)) return false;
               if (hit.distance < found.distance || (found.distance == hit.distance && hit.triangle < triangle)) {
                   if (found.distance - hit.distance <= beyond) hit.lowest = min(hit.lowest, triangle);
                   return false;
               }
               const bool is_close = hit.distance - found.distance <= beyond;
               hit = {found.distance, triangle, found.u, found.v, is_close ? min(hit.lowest, triangle) : triangle};
               search_end = span_of(found.distance + beyond, dominant).high;
               return false;
           });
    return hit.triangle != no_triangle;
}

WISP_MULTIVERSIONED bool nearest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                     uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts, Real beyond) {
    return find_nearest<false>(tree, ray, begin, end, ignore_triangle, hit, counts, beyond);
}

WISP_MULTIVERSIONED bool nearest_opaque_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                            uint32_t ignore_triangle, SurfaceHit &hit, TreeCounts &counts) {
    return find_nearest<true>(tree, ray, begin, end, ignore_triangle, hit, counts, Real(0));
}

WISP_MULTIVERSIONED bool lowest_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                    uint32_t ignore_triangle, uint32_t first, SurfaceHit &hit, TreeCounts &counts) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    Parameter search_end = span_of(end, dominant).high;
    hit = {end, no_triangle, Real(0), Real(0), no_triangle};
    search(tree, ray, span_of(begin, dominant).low, search_end, ignore_triangle, counts,
           [&](uint32_t marked, const TriangleHit &found) {
               const uint32_t triangle = marked & ~transmissive_bit;
               if (triangle < first || !(triangle < hit.triangle)) return false;
               if (found.distance < begin || !(found.distance < end)) return false;
               hit = {found.distance, triangle, found.u, found.v, triangle};
               return false;
           });
    return hit.triangle != no_triangle;
}

WISP_MULTIVERSIONED bool any_hit(const TriangleTree &tree, const TriangleRay &ray, Real begin, Real end,
                                 uint32_t ignore_triangle, uint32_t &occluder, TreeCounts &counts) {
    const Real dominant = ray.direction[static_cast<int>(ray.z)];
    Parameter search_end = span_of(end, dominant).high;
    occluder = no_triangle;
    search(tree, ray, span_of(begin, dominant).low, search_end, ignore_triangle, counts,
           [&](uint32_t triangle, const TriangleHit &found) {
               if (!(found.distance > begin) || !(found.distance < end)) return false;
               if ((triangle & transmissive_bit) != 0) return false;
               occluder = triangle;
               return true;
           });
    return occluder != no_triangle;
}

} // namespace wisp::WISP_ARITH
