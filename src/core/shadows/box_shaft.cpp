// Shafts of boxes, and the search of the static tree for what lies in them.
#include "core/shadows/box_shaft.h"
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_kdtree.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr int lattice_bits = 26, finer = 3; // coordinates of the tree are below 2^23 of its steps

using Triple = LatticePoint;

Triple minus(const Triple &a, const Triple &b) { return {{a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]}}; }
Triple cross_product(const Triple &a, const Triple &b) {
    return {{a.x[1] * b.x[2] - a.x[2] * b.x[1], a.x[2] * b.x[0] - a.x[0] * b.x[2], a.x[0] * b.x[1] - a.x[1] * b.x[0]}};
}
detail::Wide wide_dot(const Triple &a, const Triple &b) {
    return detail::product<detail::Wide>(a.x[0], b.x[0]) + detail::product<detail::Wide>(a.x[1], b.x[1]) +
           detail::product<detail::Wide>(a.x[2], b.x[2]);
}
// The sign of w where its magnitude is above the slack, otherwise 0; the slack is not negative.
int sign_beyond(detail::Wide w, detail::Wide slack) {
    const bool negative = detail::high_word(w) < 0;
    const detail::Wide rest = (negative ? detail::negated(w) : w) + detail::negated(slack);
    if (detail::high_word(rest) < 0 || detail::is_zero(rest)) return 0;
    return negative ? -1 : 1;
}
LatticeBounds widened(LatticeBounds box, int64_t by) {
    for (int a = 0; a < 3; ++a) {
        box.low.x[a] -= by;
        box.high.x[a] += by;
    }
    return box;
}

// In the tree's own steps.
int64_t plane_of(uint32_t value, const TriangleTree &tree) {
    if constexpr (std::is_same_v<Real, Fixed>) return static_cast<int32_t>(value);
    return floor_to_int(scale_pow2(detail::from_bits<float>(value), -tree.step_exponent));
}

void lattice_triangle(const Scene &scene, uint32_t triangle, int exponent, LatticePoint (&corner)[3]) {
    for (int c = 0; c < 3; ++c) corner[c] = lattice_point(vec_of(scene.triangles[triangle].corner[c]), exponent);
}

} // namespace

int static_exponent(const TriangleTree &tree) { return tree.step_exponent - finer; }

int exponent_for(const TriangleTree &tree, Real farthest) {
    int exponent = static_exponent(tree);
    while (!(farthest < scale_pow2(Real(1), min(exponent + lattice_bits, 30)))) ++exponent;
    return exponent;
}

int light_exponent(const TriangleTree &tree, const Light &light) {
    if (light.kind == LightKind::parallel) return static_exponent(tree);
    return exponent_for(tree, largest(absolute(light.position)));
}

ShaftLattice make_shaft_lattice(const Surfaces &surfaces, int exponent) {
    const auto steps = [exponent](Real length) { return int64_t{floor_to_int(scale_pow2(length, -exponent))} + 1; };
    const int64_t error = std::is_same_v<Real, float>    ? 1 << 8
                          : std::is_same_v<Real, double> ? 1
                                                         : steps(Real(0x1p-14));
    const int64_t blur = std::is_same_v<Real, float> ? 1 << 6 : error + 1;
    return {exponent, error + 3, blur, steps(surfaces.ray_epsilon)};
}

bool update_light(ShaftLight &light, const Shadows &shadows, uint32_t number, bool first) {
    if (!first && same_shadows(light.light, shadows.lights[number])) return false;
    light.light = shadows.lights[number];
    light.lattice = make_shaft_lattice(*shadows.surfaces, light_exponent(shadows.surfaces->static_tree, light.light));
    return true;
}

bool is_on_lattice(const TriangleTree &tree, const Vec3 &p) {
    const Real farthest = tree.largest * Real(2); // the lattice reaches as far as this
    return abs(p.x) <= farthest && abs(p.y) <= farthest && abs(p.z) <= farthest;
}

LatticePoint lattice_point(const Vec3 &p, int exponent) {
    return {{floor_to_int(scale_pow2(p.x, -exponent)), floor_to_int(scale_pow2(p.y, -exponent)),
             floor_to_int(scale_pow2(p.z, -exponent))}};
}

BoxShaft::BoxShaft(const ShaftLattice &lattice, const LatticeBounds &box, const Light &light)
    : lattice_(lattice), from_(widened(box, lattice.margin)), to_(from_) {
    if (light.kind == LightKind::parallel) {
        // 2^(lattice_bits + 2) steps lead beyond all static triangles.
        const LatticePoint shift = lattice_point(light.direction, -lattice_bits - 2);
        to_ = {minus(from_.low, shift), minus(from_.high, shift)};
    } else {
        const LatticePoint at = lattice_point(light.position, lattice.exponent);
        to_ = widened({at, at}, lattice.margin);
    }
    for (int a = 0; a < 3; ++a) {
        around_.low.x[a] = std::min(from_.low.x[a], to_.low.x[a]);
        around_.high.x[a] = std::max(from_.high.x[a], to_.high.x[a]);
    }
    // Projected along an axis, the shaft is the hull of two rectangles, those of the box and of the light. The line
    // through the same corner of both (low or high in each coordinate) is a side of the hull if this corner is, in each
    // rectangle, the farthest one along the line's normal.
    for (int a = 0; a < 3; ++a) {
        const int b = a == 2 ? 0 : a + 1;
        for (int name = 0; name < 4; ++name) {
            const bool high_a = name & 1, high_b = name & 2;
            const int64_t at_a = (high_a ? from_.high : from_.low).x[a], at_b = (high_b ? from_.high : from_.low).x[b];
            const int64_t d_a = (high_a ? to_.high : to_.low).x[a] - at_a,
                          d_b = (high_b ? to_.high : to_.low).x[b] - at_b;
            for (const int sign : {1, -1}) {
                const int64_t n_a = sign * d_b, n_b = -sign * d_a;
                if ((n_a == 0 && n_b == 0) || (high_a ? n_a < 0 : n_a > 0) || (high_b ? n_b < 0 : n_b > 0)) continue;
                side_[side_count_++] = {{a, b}, {n_a, n_b}, {at_a, at_b}};
                break;
            }
        }
    }
}

bool BoxShaft::may_intersect(const LatticeBounds &box) const {
    for (int a = 0; a < 3; ++a)
        if (box.high.x[a] < around_.low.x[a] || box.low.x[a] > around_.high.x[a]) return false;
    for (int i = 0; i < side_count_; ++i) {
        const Side &side = side_[i];
        int64_t least = 0;
        for (int k = 0; k < 2; ++k) {
            const int a = side.axis[k];
            least += side.normal[k] * ((side.normal[k] > 0 ? box.low : box.high).x[a] - side.at[k]);
        }
        if (least > 0) return false;
    }
    return true;
}

bool BoxShaft::may_intersect(const LatticePoint (&t)[3]) const {
    LatticeBounds box = {t[0], t[0]};
    for (int a = 0; a < 3; ++a) {
        box.low.x[a] = std::min(t[0].x[a], std::min(t[1].x[a], t[2].x[a]));
        box.high.x[a] = std::max(t[0].x[a], std::max(t[1].x[a], t[2].x[a]));
        if (box.high.x[a] < around_.low.x[a] || box.low.x[a] > around_.high.x[a]) return false;
    }
    for (int i = 0; i < side_count_; ++i) {
        const Side &side = side_[i];
        bool outside = true;
        for (const LatticePoint &p : t)
            outside = outside && side.normal[0] * (p.x[side.axis[0]] - side.at[0]) +
                                         side.normal[1] * (p.x[side.axis[1]] - side.at[1]) >
                                     0;
        if (outside) return false;
    }
    const Triple normal = cross_product(minus(t[1], t[0]), minus(t[2], t[0]));
    const detail::Wide none = detail::join<detail::Wide>(0, 0);
    const int first = sign_beyond(wide_dot(normal, minus(from_.low, t[0])), none);
    bool apart = first != 0;
    for (int i = 0; i < 8 && apart; ++i)
        for (const LatticeBounds *end : {&from_, &to_})
            apart = apart && sign_beyond(wide_dot(normal, minus(corner_of(*end, i), t[0])), none) == first;
    return !apart;
}

// The side on which a ray passes an edge is the sign of a volume: that of the tetrahedron of two points of the ray and
// the edge's ends.
//   - If one of the four points moves by `blur` in each coordinate, the volume changes by at most 6 D^2 blur, where D
//     is the largest difference of coordinates. So a volume beyond 32 D^2 blur keeps its sign when all four points
//     move.
//   - The volume is linear in each point. So the corners of a box decide for every point of the box.
//   - The boxes are widened by ray_epsilon and twice the margin, because a hit counts only between the ends of the ray.
bool BoxShaft::is_shadowed_by(const LatticePoint (&t)[3]) const {
    const int64_t more = lattice_.ray_epsilon + lattice_.margin;
    const LatticeBounds from = widened(from_, more), to = widened(to_, more);
    int64_t widest = 2 * lattice_.blur;
    for (int a = 0; a < 3; ++a) {
        const int64_t low =
            std::min(std::min(from.low.x[a], to.low.x[a]), std::min(t[0].x[a], std::min(t[1].x[a], t[2].x[a])));
        const int64_t high =
            std::max(std::max(from.high.x[a], to.high.x[a]), std::max(t[0].x[a], std::max(t[1].x[a], t[2].x[a])));
        widest = std::max(widest, high - low);
    }
    const detail::Wide slack = detail::product<detail::Wide>(widest * widest, 32 * lattice_.blur);
    const Triple normal = cross_product(minus(t[1], t[0]), minus(t[2], t[0]));
    const int before = sign_beyond(wide_dot(normal, minus(from.low, t[0])), slack);
    if (before == 0) return false;
    for (int i = 0; i < 8; ++i)
        if (sign_beyond(wide_dot(normal, minus(corner_of(from, i), t[0])), slack) != before ||
            sign_beyond(wide_dot(normal, minus(corner_of(to, i), t[0])), slack) != -before)
            return false;
    int inside = 0;
    for (int i = 0; i < 8; ++i)
        for (int e = 0; e < 3; ++e) {
            const LatticePoint a = corner_of(from, i);
            const Triple plane = cross_product(minus(t[e], a), minus(t[e == 2 ? 0 : e + 1], a));
            for (int j = 0; j < 8; ++j) {
                const int side = sign_beyond(wide_dot(plane, minus(corner_of(to, j), a)), slack);
                if (inside == 0) inside = side;
                if (side == 0 || side != inside) return false;
            }
        }
    return true;
}

namespace {

// The search of find_blockers().
class BlockerSearch {
  public:
    BlockerSearch(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t max_count,
                  uint32_t *blocker)
        : shadows_(shadows), tree_(shadows.surfaces->static_tree), counts_(shadows.statistics->shadow.proofs),
          lattice_(lattice), shaft_(shaft), max_count_(max_count), blocker_(blocker),
          shift_(tree_.step_exponent - lattice.exponent) {}

    // False: there are more than max_count.
    bool search_kdtree() {
        struct Entry {
            uint32_t node;
            LatticeBounds cell; // in the tree's steps
        } stack[max_tree_depth + 1];
        const LatticePoint low = lattice_point(tree_.bounds.low, tree_.step_exponent),
                           high = lattice_point(tree_.bounds.high, tree_.step_exponent);
        stack[0] = {0, {low, {{high.x[0] + 1, high.x[1] + 1, high.x[2] + 1}}}};
        for (uint32_t stack_size = 1; stack_size > 0;) {
            const Entry now = stack[--stack_size];
            ++counts_.node_visits;
            if (!shadows_.watch.go_on(1)) return false;
            if (!may_intersect(now.cell)) continue;
            const TriangleNode &node = tree_.nodes[now.node];
            if (node.axis() == leaf_axis) {
                if (!add(node.first(), node.value)) return false;
                continue;
            }
            const int64_t plane = plane_of(node.value, tree_);
            const int axis = static_cast<int>(node.axis());
            for (const bool above : {true, false}) {
                Entry &next = stack[stack_size++];
                next = {node.first() + (above ? 1 : 0), now.cell};
                (above ? next.cell.low : next.cell.high).x[axis] = plane;
            }
        }
        return true;
    }
    bool search_bvh() {
        uint32_t stack[bvh_stack];
        stack[0] = tree_.root;
        for (uint32_t stack_size = 1; stack_size > 0;) {
            const uint32_t child = stack[--stack_size];
            ++counts_.node_visits;
            if (!shadows_.watch.go_on(1)) return false;
            if (is_leaf(child)) {
                if (!add(group_of(child), triangles_in(child))) return false;
                continue;
            }
            const BoxNode &node = tree_.boxes[child];
            for (uint32_t lane = 0; lane < lanes; ++lane) {
                LatticeBounds box;
                for (int a = 0; a < 3; ++a) {
                    box.low.x[a] = steps_of(node.plane[0][a][lane], tree_.step_exponent);
                    box.high.x[a] = steps_of(node.plane[1][a][lane], tree_.step_exponent);
                }
                if (box.low.x[0] <= box.high.x[0] && may_intersect(box)) stack[stack_size++] = node.child[lane];
            }
        }
        return true;
    }
    uint32_t count() const { return count_; }

  private:
    // Converts the tree's steps to the lattice's, which are longer or shorter by a power of two.
    int64_t down(int64_t x) const { return shift_ >= 0 ? x * (int64_t{1} << shift_) : x >> -shift_; }
    bool may_intersect(const LatticeBounds &in_tree) const {
        LatticeBounds box;
        for (int a = 0; a < 3; ++a) {
            box.low.x[a] = down(in_tree.low.x[a]);
            box.high.x[a] = -down(-in_tree.high.x[a]);
        }
        return shaft_.may_intersect(box);
    }
    // Of `number` triangles in groups from `first` on.
    bool add(uint32_t first, uint32_t number) {
        for (uint32_t i = 0; i < number; ++i) {
            const uint32_t triangle = tree_.groups[first + i / group_triangles].triangle[i % group_triangles];
            if ((triangle & transmissive_bit) != 0) continue;
            if (std::find(blocker_, blocker_ + count_, triangle) != blocker_ + count_) continue;
            LatticePoint corner[3];
            ++counts_.triangle_tests;
            lattice_triangle(*shadows_.scene, triangle, lattice_.exponent, corner);
            if (!shaft_.may_intersect(corner)) continue;
            if (count_ == max_count_) return false;
            blocker_[count_++] = triangle;
        }
        return true;
    }

    const Shadows &shadows_;
    const TriangleTree &tree_;
    TreeCounts &counts_;
    const ShaftLattice &lattice_;
    const BoxShaft &shaft_;
    const uint32_t max_count_;
    uint32_t *const blocker_;
    const int shift_;
    uint32_t count_ = 0;
};

} // namespace

bool find_blockers(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t max_count,
                   uint32_t *blocker, uint32_t &count) {
    const TriangleTree &tree = shadows.surfaces->static_tree;
    BlockerSearch search(shadows, lattice, shaft, max_count, blocker);
    const bool all =
        tree.triangle_count == 0 || (tree.kind == TreeKind::bvh ? search.search_bvh() : search.search_kdtree());
    count = search.count();
    return all;
}

bool is_shaft_shadowed(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t triangle) {
    ++shadows.statistics->shadow.proofs.triangle_tests;
    LatticePoint corner[3];
    lattice_triangle(*shadows.scene, triangle, lattice.exponent, corner);
    return shaft.is_shadowed_by(corner);
}

} // namespace wisp::WISP_ARITH
