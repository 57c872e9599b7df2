// Building the tree of boxes over triangles by the surface area heuristic.
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_items.h"
#include <algorithm>
#include <utility>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t bins = 16;
// Ranges of triangles are divided in two by cost down to that depth, from then on by halves of their groups.
constexpr uint32_t max_depth_by_cost = 48, max_depth = max_depth_by_cost + 27;
static_assert(max_triangles / group_triangles <= 1u << 26);
static_assert(max_depth < bvh_stack, "a tree of nodes of two has room on any search's stack");
constexpr int32_t outside = 1 << (lattice_bits + 1); // no coordinate
constexpr uint32_t units_per_triangle = 16;          // of work

// The capacities of the lists. Where groups would not suffice, ranges are divided into full ones.
struct Capacities {
    uint64_t groups, nodes, items, parts;
};
constexpr Capacities capacities_for(uint64_t count) {
    return {count / 4 + 8, count / 4 + 8, count, 2 * (count / 4 + 8)};
}

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

// A range of items that was divided in two, or a leaf. The first half is the next part.
struct Part {
    LatticeBox box;
    uint32_t first, count; // of items
    uint32_t second;       // the second half
    // [n - 1]: of n roots at most that stand for the part, so many are for the first half. 0: one root less is as good.
    // Of one root, the children of the node that it is.
    uint8_t first_half[lanes];
};
constexpr bool is_leaf(const Part &part) { return part.count <= group_triangles; }

class BvhBuilder {
  public:
    BvhBuilder(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch)
        : triangles_(triangles), materials_(materials), watch_(watch) {
        const Capacities capacities = capacities_for(count);
        const size_t start = arena.mark();
        groups_ = arena.make<TriangleGroup>(static_cast<size_t>(capacities.groups));
        nodes_ = arena.make<BoxNode>(static_cast<size_t>(capacities.nodes));
        items_ = arena.make<TriangleItem>(static_cast<size_t>(capacities.items));
        parts_ = arena.make<Part>(static_cast<size_t>(capacities.parts));
        waiting_ = arena.make<Waiting>(1);
        if (!groups_ || !nodes_ || !items_ || !parts_ || !waiting_) {
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
    static constexpr uint64_t waiting_bytes() { return Arena::bytes<Waiting>(1); }

  private:
    struct Range { // of items
        uint32_t first, count;
        uint32_t room; // for groups
        LatticeBox box;
    };
    struct Half { // a second half that is to be divided
        Range range;
        uint32_t depth;
        uint32_t whole; // the part whose second half it is
    };
    // [n - 1]: the areas of all nodes below a part, if n roots at most stand for it.
    struct Costs {
        uint64_t of[lanes];
    };
    struct Link {               // to a node that is to be made
        uint32_t part, waiting; // children of the nodes above, on the search's stack
        uint32_t *link;
    };
    // What waits while the tree is built, one thing after another: 10 kB, too much for the stack of a small board.
    struct Waiting {
        Half halves[max_depth + 1];
        Costs costs[max_depth + 1];
        Link links[bvh_stack];
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

    uint32_t make_leaf(const Part &part) {
        watch_.done(uint64_t{part.count} * units_per_triangle);
        fill_group(triangles_, materials_, items_ + part.first, part.count, groups_[tree_.group_count]);
        return leaf_bit | tree_.group_count++ << 3 | (part.count - 1);
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

    // Divides all items in two, and the parts again, until all are leaves.
    void divide_all(uint32_t room) {
        uint32_t stack_size = 0;
        waiting_->halves[stack_size++] = {
            {0, tree_.triangle_count, room, around(tree_.bounds, tree_.step_exponent)}, 0, 0};
        while (stack_size > 0) {
            Half task = waiting_->halves[--stack_size];
            parts_[task.whole].second = part_count_;
            for (;; ++task.depth) {
                const uint32_t whole = part_count_++;
                parts_[whole] = {task.range.box, task.range.first, task.range.count, 0, {}};
                if (is_leaf(parts_[whole])) break;
                Range first, second;
                divide(task.range, task.depth < max_depth_by_cost, first, second);
                waiting_->halves[stack_size++] = {second, task.depth + 1, whole};
                task.range = first;
            }
            deepest_ = max(deepest_, task.depth);
        }
    }

    // Chooses which parts become nodes: such that the sum of their areas is the least (README.md, "Building the tree of
    // boxes"; Ylitie, Karras, Laine 2017).
    void choose_nodes() {
        uint32_t stack_size = 0;
        int shift = 0;
        while (area_of(parts_[0].box) >> shift >> 32 != 0) ++shift;
        for (uint32_t i = part_count_; i-- > 0;) {
            Part &part = parts_[i];
            if (is_leaf(part)) {
                waiting_->costs[stack_size++] = {};
                continue;
            }
            const Costs &first = waiting_->costs[stack_size - 1], &second = waiting_->costs[stack_size - 2];
            Costs all;
            for (uint32_t roots = 2; roots <= lanes; ++roots) {
                uint64_t &best = all.of[roots - 1] = UINT64_MAX;
                for (uint32_t k = 1; k < roots; ++k) {
                    const uint64_t cost = first.of[k - 1] + second.of[roots - k - 1];
                    if (cost >= best) continue;
                    best = cost;
                    part.first_half[roots - 1] = static_cast<uint8_t>(k);
                }
            }
            all.of[0] = all.of[lanes - 1] + (area_of(part.box) >> shift) + 1;
            part.first_half[0] = part.first_half[lanes - 1];
            for (uint32_t roots = 2; roots <= lanes; ++roots)
                if (all.of[roots - 1] >= all.of[roots - 2]) {
                    all.of[roots - 1] = all.of[roots - 2];
                    part.first_half[roots - 1] = 0;
                }
            waiting_->costs[--stack_size - 1] = all;
        }
    }

    struct Children {
        uint32_t part[lanes];
        uint32_t count = 0;
    };
    Children children_of(uint32_t node) const {
        struct Task {
            uint32_t part, roots;
        };
        Children children;
        Task stack[lanes];
        uint32_t stack_size = 0;
        const auto halve = [&](uint32_t part, uint32_t for_first, uint32_t roots) {
            stack[stack_size++] = {parts_[part].second, roots - for_first};
            stack[stack_size++] = {part + 1, for_first};
        };
        halve(node, parts_[node].first_half[0], lanes);
        while (stack_size > 0) {
            const auto [index, roots] = stack[--stack_size];
            const Part &part = parts_[index];
            uint32_t used = roots;
            while (used > 1 && part.first_half[used - 1] == 0) --used;
            if (is_leaf(part) || used == 1)
                children.part[children.count++] = index;
            else
                halve(index, part.first_half[used - 1], used);
        }
        return children;
    }

    void make_nodes() {
        uint32_t stack_size = 0;
        waiting_->links[stack_size++] = {0, 0, &tree_.root};
        while (stack_size > 0) {
            const Link task = waiting_->links[--stack_size];
            // Nodes of two have room on any search's stack.
            const bool deep = task.waiting + lanes + deepest_ > bvh_stack;
            Children children = deep ? Children{{task.part + 1, parts_[task.part].second}, 2} : children_of(task.part);
            // Small boxes first: a ray that crosses one hits something in it more often.
            std::sort(children.part, children.part + children.count,
                      [this](uint32_t p, uint32_t q) { return area_of(parts_[p].box) < area_of(parts_[q].box); });
            *task.link = tree_.node_count;
            BoxNode &node = nodes_[tree_.node_count++];
            for (uint32_t lane = 0; lane < lanes; ++lane) {
                const bool empty = lane >= children.count;
                const Part *const part = empty ? nullptr : parts_ + children.part[lane];
                set_box(node, lane, empty ? empty_box() : part->box);
                node.child[lane] = !empty && is_leaf(*part) ? make_leaf(*part) : leaf_bit;
            }
            for (uint32_t lane = children.count; lane-- > 0;)
                if (!is_leaf(parts_[children.part[lane]]))
                    waiting_->links[stack_size++] = {children.part[lane], task.waiting + children.count - 1,
                                                     &node.child[lane]};
        }
    }

    void grow(uint32_t room) {
        if (tree_.triangle_count == 0) return;
        divide_all(room);
        if (part_count_ == 1) {
            tree_.root = make_leaf(parts_[0]);
            return;
        }
        choose_nodes();
        make_nodes();
    }

    const Triangle *triangles_;
    const Material *materials_;
    TriangleGroup *groups_;
    BoxNode *nodes_;
    TriangleItem *items_;
    Part *parts_;
    Waiting *waiting_;
    uint32_t part_count_ = 0, deepest_ = 0; // the depth of the deepest leaf
    TriangleTree tree_ = {};
    Watch watch_;
};

} // namespace

uint64_t bvh_bytes(uint32_t count) {
    const Capacities capacities = capacities_for(count);
    return Arena::bytes<TriangleGroup>(capacities.groups) + Arena::bytes<BoxNode>(capacities.nodes) +
           Arena::bytes<TriangleItem>(capacities.items) + Arena::bytes<Part>(capacities.parts) +
           BvhBuilder::waiting_bytes();
}

TriangleTree make_bvh(const Triangle *triangles, uint32_t count, const Material *materials, Arena &arena, Watch watch) {
    return BvhBuilder(triangles, count, materials, arena, watch).tree();
}

} // namespace wisp::WISP_ARITH
