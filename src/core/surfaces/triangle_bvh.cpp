// Building the tree of boxes over triangles by the surface area heuristic.
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_items.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t bins = 16;
constexpr int32_t outside = 1 << (lattice_bits + 1); // no coordinate
constexpr uint32_t units_per_triangle = 16;          // of work

// The capacities of the lists. Where groups would not suffice, ranges are divided into full ones.
struct Capacities {
    uint64_t groups, nodes, items;
};
constexpr Capacities capacities_for(uint64_t count) { return {count / 4 + 8, count / 4 + 8, count}; }

constexpr LatticeBox empty_box() { return {{outside, outside, outside}, {-outside, -outside, -outside}}; }
void include(LatticeBox &box, const LatticeBox &other) {
    for (int a = 0; a < 3; ++a) {
        box.low[a] = min(box.low[a], other.low[a]);
        box.high[a] = max(box.high[a], other.high[a]);
    }
}
// Half the surface: below 2^50.
uint64_t area_of(const LatticeBox &box) {
    uint64_t edge[3];
    for (int a = 0; a < 3; ++a) edge[a] = static_cast<uint64_t>(int64_t{box.high[a]} - box.low[a]);
    return edge[0] * edge[1] + edge[1] * edge[2] + edge[2] * edge[0];
}
// What a range of triangles costs if a ray crosses its box: groups that are tested, and a little for what they hold.
uint64_t tests_of(uint32_t count) { return uint64_t{groups_for(count)} * group_triangles + count; }

int32_t middle_of(const LatticeBox &box, uint32_t axis) { return box.low[axis] + box.high[axis]; } // twice

class BvhBuilder {
  public:
    BvhBuilder(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch)
        : triangles_(triangles), materials_(materials), watch_(watch) {
        const Capacities capacities = capacities_for(count);
        const size_t start = arena.mark();
        groups_ = arena.make<TriangleGroup>(static_cast<size_t>(capacities.groups));
        nodes_ = arena.make<BoxNode>(static_cast<size_t>(capacities.nodes));
        items_ = arena.make<TriangleItem>(static_cast<size_t>(capacities.items));
        if (!groups_ || !nodes_ || !items_) {
            arena.rewind(start);
            return;
        }
        tree_.kind = TreeKind::bvh;
        watch_.expect(uint64_t{count} * units_per_triangle);
        find_items(triangles_, count, items_, tree_, watch_);
        grow(static_cast<uint32_t>(capacities.groups));
        arena.rewind(start);
        if (watch_.stopped()) return;
        // Memory that was not needed is returned: nodes move down to follow the last group.
        tree_.groups = arena.make<TriangleGroup>(tree_.group_count);
        BoxNode *nodes = arena.make<BoxNode>(tree_.node_count);
        std::copy(nodes_, nodes_ + tree_.node_count, nodes);
        tree_.boxes = nodes;
        tree_.ready = true;
    }
    const TriangleTree &tree() const { return tree_; }

  private:
    struct Range { // of items
        uint32_t first, count;
        uint32_t room; // for groups
        LatticeBox box;
    };
    struct Split {
        uint64_t cost = UINT64_MAX;
        uint32_t axis = 0, bin = 0; // the first bin of the second part
        uint32_t count = 0;         // of the first part
    };
    // Bins of the middles of items along an axis.
    struct Bins {
        int32_t low = outside * 2;
        uint64_t scale = 0;

        uint32_t of(int32_t middle) const {
            return static_cast<uint32_t>((static_cast<uint64_t>(int64_t{middle} - low) * scale) >> 32);
        }
    };

    Split find_split(const Range &range, Bins (&bins_of)[3]) const {
        int32_t high[3] = {-2 * outside, -2 * outside, -2 * outside};
        const TriangleItem *const items = items_ + range.first;
        for (uint32_t i = 0; i < range.count; ++i)
            for (uint32_t a = 0; a < 3; ++a) {
                const int32_t middle = middle_of(items[i].box, a);
                bins_of[a].low = min(bins_of[a].low, middle);
                high[a] = max(high[a], middle);
            }
        for (uint32_t a = 0; a < 3; ++a)
            bins_of[a].scale = (uint64_t{bins} << 32) / static_cast<uint64_t>(int64_t{high[a]} - bins_of[a].low + 1);
        int shift = 0; // of areas, so that costs fit 64 bits
        while (area_of(range.box) >> shift >> 31 != 0) ++shift;
        Split best;
        for (uint32_t a = 0; a < 3; ++a) {
            if (bins_of[a].low == high[a]) continue;
            LatticeBox box[bins];
            uint32_t count[bins] = {};
            std::fill(box, box + bins, empty_box());
            for (uint32_t i = 0; i < range.count; ++i) {
                const uint32_t bin = bins_of[a].of(middle_of(items[i].box, a));
                include(box[bin], items[i].box);
                ++count[bin];
            }
            uint64_t cost_above[bins];
            LatticeBox all = empty_box();
            uint32_t number = 0;
            for (uint32_t bin = bins - 1; bin > 0; --bin) {
                include(all, box[bin]);
                number += count[bin];
                cost_above[bin] = number == 0 ? 0 : (area_of(all) >> shift) * tests_of(number);
            }
            all = empty_box();
            number = 0;
            for (uint32_t bin = 1; bin < bins; ++bin) {
                include(all, box[bin - 1]);
                number += count[bin - 1];
                if (number == 0 || number == range.count) continue;
                const uint64_t cost = (area_of(all) >> shift) * tests_of(number) + cost_above[bin];
                if (cost < best.cost) best = {cost, a, bin, number};
            }
        }
        return best;
    }

    uint32_t widest_axis(const Range &range) const {
        uint32_t widest = 0;
        for (uint32_t a = 1; a < 3; ++a)
            if (range.box.high[a] - range.box.low[a] > range.box.high[widest] - range.box.low[widest]) widest = a;
        return widest;
    }

    // Divides a range of more than a group.
    void divide(const Range &range, bool by_cost, Range &first, Range &second) {
        watch_.go_on(range.count / 4 + 1);
        TriangleItem *const items = items_ + range.first;
        Bins bins_of[3];
        Split split;
        if (by_cost) split = find_split(range, bins_of);
        if (split.cost == UINT64_MAX || groups_for(split.count) + groups_for(range.count - split.count) > range.room) {
            const uint32_t axis = widest_axis(range);
            split.count = groups_for(range.count) / 2 * group_triangles;
            std::sort(items, items + range.count, [axis](const TriangleItem &p, const TriangleItem &q) {
                const int32_t p_middle = middle_of(p.box, axis), q_middle = middle_of(q.box, axis);
                return p_middle != q_middle ? p_middle < q_middle : p.triangle < q.triangle;
            });
        } else {
            const Bins &along = bins_of[split.axis];
            const auto is_first = [&](const TriangleItem &item) {
                return along.of(middle_of(item.box, split.axis)) < split.bin;
            };
            for (uint32_t i = 0, j = range.count;;) {
                while (i < j && is_first(items[i])) ++i;
                while (i < j && !is_first(items[j - 1])) --j;
                if (i == j) break;
                std::swap(items[i++], items[--j]);
            }
        }
        first = {range.first, split.count, 0, empty_box()};
        second = {range.first + split.count, range.count - split.count, 0, empty_box()};
        for (uint32_t i = 0; i < first.count; ++i) include(first.box, items[i].box);
        for (uint32_t i = first.count; i < range.count; ++i) include(second.box, items[i].box);
        const uint32_t needed = groups_for(first.count), spare = range.room - needed - groups_for(second.count);
        first.room = needed + static_cast<uint32_t>(uint64_t{spare} * first.count / range.count);
        second.room = range.room - first.room;
    }

    uint32_t make_leaf(const Range &range) {
        watch_.done(uint64_t{range.count} * units_per_triangle);
        fill_group(triangles_, materials_, items_ + range.first, range.count, groups_[tree_.group_count]);
        return leaf_bit | tree_.group_count++ << 3 | (range.count - 1);
    }

    void set_box(BoxNode &node, uint32_t lane, const LatticeBox &box) {
        const auto value = [this](int32_t plane) {
            if constexpr (std::is_same_v<Real, Fixed>)
                return plane;
            else
                return scale_pow2(static_cast<float>(plane), tree_.step_exponent);
        };
        for (int a = 0; a < 3; ++a) {
            node.plane[0][a][lane] = value(box.low[a]);
            node.plane[1][a][lane] = value(box.high[a]);
        }
    }

    void grow(uint32_t room) {
        if (tree_.triangle_count == 0) return;
        Range all = {0, tree_.triangle_count, room, around(tree_.bounds, tree_.step_exponent)};
        if (all.count <= group_triangles) {
            tree_.root = make_leaf(all);
            return;
        }
        struct Task {
            Range range;
            uint32_t depth;
            uint32_t *link;
        };
        Task stack[bvh_stack];
        uint32_t stack_size = 0;
        stack[stack_size++] = {all, 0, &tree_.root};
        while (stack_size > 0) {
            const Task task = stack[--stack_size];
            Range child[lanes] = {task.range};
            uint32_t children = 1;
            while (children < lanes) {
                uint32_t largest = lanes;
                for (uint32_t i = 0; i < children; ++i) {
                    if (child[i].count <= group_triangles) continue;
                    if (largest == lanes || area_of(child[largest].box) < area_of(child[i].box)) largest = i;
                }
                if (largest == lanes) break;
                Range first, second;
                divide(child[largest], task.depth < max_depth_by_cost, first, second);
                child[largest] = first;
                child[children++] = second;
            }
            *task.link = tree_.node_count;
            BoxNode &node = nodes_[tree_.node_count++];
            for (uint32_t lane = 0; lane < lanes; ++lane) {
                set_box(node, lane, lane < children ? child[lane].box : empty_box());
                node.child[lane] = leaf_bit;
                if (lane < children && child[lane].count <= group_triangles) node.child[lane] = make_leaf(child[lane]);
            }
            for (uint32_t lane = children; lane-- > 0;)
                if (child[lane].count > group_triangles)
                    stack[stack_size++] = {child[lane], task.depth + 1, &node.child[lane]};
        }
    }

    const Triangle *triangles_;
    const Material *materials_;
    TriangleGroup *groups_;
    BoxNode *nodes_;
    TriangleItem *items_;
    TriangleTree tree_ = {};
    Watch watch_;
};

} // namespace

uint64_t bvh_bytes(uint32_t count) {
    const Capacities capacities = capacities_for(count);
    return Arena::bytes<TriangleGroup>(capacities.groups) + Arena::bytes<BoxNode>(capacities.nodes) +
           Arena::bytes<TriangleItem>(capacities.items);
}

TriangleTree make_bvh(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch) {
    return BvhBuilder(triangles, count, materials, arena, watch).tree();
}

} // namespace wisp::WISP_ARITH
