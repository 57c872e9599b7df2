// Building the kd-tree over triangles by the surface area heuristic.
#include "core/surfaces/triangle_items.h"
#include "core/surfaces/triangle_kdtree.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr int fine_bits = 7;      // triangles are clipped to cells in units of 2^-7 steps
constexpr int64_t fine_slack = 8; // of those units, more than a corner's rounding (one) and six cuts (one each)

// Costs of the heuristic: to traverse a node, to test a group of triangles.
constexpr uint64_t node_cost = 1, group_cost = 2;
constexpr uint32_t few = 64;   // of so few triangles, planes at all bounds are tried
constexpr uint32_t bins = 256; // of more, planes at the bounds around the best border of so many bins

// The capacities of the lists. A node that would not fit is not split.
struct Capacities {
    uint64_t groups, nodes, items;
};
constexpr Capacities capacities_for(uint64_t count) { return {count + 8, 4 * count + 8, 3 * count + 8}; }

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
        cut(a, int64_t{box.low[a]} * (int64_t{1} << fine_bits) - fine_slack, -1);
        cut(a, int64_t{box.high[a]} * (int64_t{1} << fine_bits) + fine_slack, 1);
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

constexpr uint32_t units_per_triangle = 64; // of work

class KdtreeBuilder {
  public:
    KdtreeBuilder(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch)
        : triangles_(triangles), materials_(materials), capacities_(capacities_for(count)), watch_(watch) {
        const size_t start = arena.mark();
        groups_ = arena.make<TriangleGroup>(static_cast<size_t>(capacities_.groups));
        nodes_ = arena.make<TriangleNode>(static_cast<size_t>(capacities_.nodes));
        items_ = arena.make<TriangleItem>(static_cast<size_t>(capacities_.items));
        events_ = arena.make<uint32_t>(size_t{2} * count);
        if (!groups_ || !nodes_ || !items_ || !events_) {
            arena.rewind(start);
            return;
        }
        watch_.expect(uint64_t{count} * units_per_triangle);
        tree_.kind = TreeKind::kd;
        find_items(triangles_, count, items_, tree_, watch_);
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

    bool narrow(TriangleItem &item) const {
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
        const TriangleItem *items = items_ + task.first;
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
        for (uint32_t first = 0; first < task.count; first += group_triangles)
            fill_group(triangles_, materials_, items_ + task.first + first, min(task.count - first, group_triangles),
                       groups_[tree_.group_count++]);
    }

    // Leaves the items of the upper child where those of the node were, followed by those of the lower child.
    void divide(const Split &split, const Task &task, Task &below, Task &above) {
        const uint32_t axis = split.axis;
        below = {tree_.node_count, task.depth + 1, 0, 0, 0, task.cell};
        above = {tree_.node_count + 1, task.depth + 1, task.first, 0, 0, task.cell};
        below.cell.high[axis] = above.cell.low[axis] = split.plane;
        tree_.node_count += 2;
        nodes_[task.node] = {plane_value(split.plane, tree_.step_exponent), below.node << 2 | axis};
        TriangleItem *const upper = items_ + task.first, *const lower = upper + task.count;
        for (uint32_t i = 0; i < task.count; ++i) {
            const TriangleItem item = upper[i];
            const int32_t low = item.box.low[axis], high = item.box.high[axis];
            const bool flat = low == split.plane && high == split.plane;
            const bool in_below = low < split.plane || (flat && split.flat_below);
            const bool in_above = high > split.plane || (flat && !split.flat_below);
            TriangleItem part = item;
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
        Task task = {0, 0, 0, tree_.triangle_count, capacities_.groups, around(tree_.bounds, tree_.step_exponent)};
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
    TriangleItem *items_;
    uint32_t *events_;
    TriangleTree tree_ = {};
    Watch watch_;
};

} // namespace

uint64_t kdtree_bytes(uint32_t count) {
    const Capacities capacities = capacities_for(count);
    return Arena::bytes<TriangleGroup>(capacities.groups) + Arena::bytes<TriangleNode>(capacities.nodes) +
           Arena::bytes<TriangleItem>(capacities.items) + Arena::bytes<uint32_t>(uint64_t{2} * count);
}

TriangleTree make_kdtree(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena,
                         Watch watch) {
    return KdtreeBuilder(triangles, count, materials, arena, watch).tree();
}

} // namespace wisp::WISP_ARITH
