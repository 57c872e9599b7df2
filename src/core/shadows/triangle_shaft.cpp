// Shafts of cells against triangles, by separating planes.
#include "core/shadows/triangle_shaft.h"
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_kdtree.h"

namespace wisp::WISP_ARITH {

namespace {

using namespace detail;

// Margins as derived in the header: in float and double, e being half a last place of 1; in Fixed.
constexpr double e = sizeof(Real) == 4 ? 0x1p-24 : 0x1p-53;
inline double margin_of(double edge, double corner, double to_light, double largest) {
    return max(e * (5 * edge + 3 * corner), e * 8 * to_light) + 0x1p-48 * largest;
}
inline int64_t margin_of(int64_t, int64_t, int64_t, int64_t) { return 10; }
inline double hit_margin(double reach) { return 15 * e * reach; }
inline int64_t hit_margin(int64_t) { return 0; } // margin_of includes it

Position position_of(const Vec3 &v) {
    return Position(to_proof_scalar(v.x), to_proof_scalar(v.y), to_proof_scalar(v.z));
}

Position scaled_256(const Position &v, int k) {
    return Position(detail::scaled_256(v.x, k), detail::scaled_256(v.y, k), detail::scaled_256(v.z, k));
}

struct Range {
    ProofScalar low, high;

    void add(ProofScalar x) {
        low = min(low, x);
        high = max(high, x);
    }
};

Range range_of(const TriangleShaft &shaft, const Position &axis) {
    const ProofScalar first = along(axis, shaft.light[0]);
    Range range = {first, first};
    for (const Position &p : shaft.begin) range.add(along(axis, p));
    if (shaft.parallel)
        for (const Position &p : shaft.light) range.add(along(axis, p));
    return range;
}

Range range_of(const Position (&triangle)[3], const Position &axis) {
    const ProofScalar first = along(axis, triangle[0]);
    Range range = {first, first};
    range.add(along(axis, triangle[1]));
    range.add(along(axis, triangle[2]));
    return range;
}

// Whether a plane across the axis separates two convex sets that are widened by the margin.
bool are_apart(const Range &a, const Range &b, const Position &axis, ProofScalar margin) {
    return max(a.low - b.high, b.low - a.high) > margin * sum_of(axis);
}

// Whether the triangle blocks no ray of the shaft: some plane separates them. It tries the axes of the separating axis
// theorem, those of faces and of pairs of edges, likely ones first.
bool misses(const TriangleShaft &shaft, const Position (&triangle)[3]) {
    ProofScalar largest = ProofScalar(0);
    for (const Position &p : triangle) largest = max(largest, largest_of(p));
    const ProofScalar margin = shaft.margin + hit_margin(largest + shaft.width);
    for (int i = 0; i < 3; ++i)
        if (min(triangle[0][i], min(triangle[1][i], triangle[2][i])) > shaft.high[i] ||
            max(triangle[0][i], max(triangle[1][i], triangle[2][i])) < shaft.low[i])
            return true;
    for (const TriangleShaft::Face &face : shaft.faces)
        if (range_of(triangle, face.outward).low - face.support > margin * sum_of(face.outward)) return true;
    const Position edges[3] = {triangle[1] - triangle[0], triangle[2] - triangle[1], triangle[0] - triangle[2]};
    const auto separates = [&](const Position &axis) {
        return are_apart(range_of(shaft, axis), range_of(triangle, axis), axis, margin);
    };
    if (separates(across(edges[0], edges[1]))) return true;
    for (const Position &edge : edges)
        for (int i = 0; i < 3; ++i) {
            if (separates(across(edge, shaft.begin[i == 2 ? 0 : i + 1] - shaft.begin[i]))) return true;
            if ((i == 0 || !shaft.parallel) && separates(across(edge, shaft.light[i] - shaft.begin[i]))) return true;
        }
    return false;
}

} // namespace

TriangleShaft make_triangle_shaft(const TriangleTree &tree, const Vec3 (&receiver)[3], const CellPlace &cell,
                                  const Light &light, Real ray_epsilon) {
    TriangleShaft shaft = {};
    const Position a = position_of(receiver[0]), b = position_of(receiver[1]) - a, c = position_of(receiver[2]) - a;
    shaft.origin = a + scaled_256(b, cell.u) + scaled_256(c, cell.v);
    shaft.corner[1] = scaled_256(b, cell.size);
    shaft.corner[2] = scaled_256(c, cell.size);
    shaft.parallel = light.kind == LightKind::parallel;
    ProofScalar largest = to_proof_scalar(tree.largest) + ProofScalar(1), to_light = ProofScalar(0);
    if (shaft.parallel) {
        const Vec3 towards = -light.direction;
        const Position step(far_along(towards.x, largest), far_along(towards.y, largest),
                            far_along(towards.z, largest));
        for (int i = 0; i < 3; ++i) shaft.light[i] = shaft.corner[i] + step;
    } else {
        const Position at = position_of(light.position);
        largest = max(largest, largest_of(at));
        for (Position &p : shaft.light) p = at - shaft.origin;
    }
    shaft.provable = in_range(largest);
    if (!shaft.provable) return shaft;
    ProofScalar longest = ProofScalar(0);
    for (int i = 0; i < 3; ++i) {
        longest = max(longest, length_bound(shaft.light[i] - shaft.corner[i]));
        if (!shaft.parallel) to_light = max(to_light, largest_of(shaft.light[i] - shaft.corner[i]));
        shaft.width = max(shaft.width, largest_of(shaft.corner[i]));
    }
    const ProofScalar begin = min(lower_bound(to_proof_scalar(ray_epsilon)), longest);
    ProofScalar corner = ProofScalar(0);
    for (const Vec3 &v : receiver) corner = max(corner, largest_of(position_of(v)));
    shaft.margin = margin_of(max(largest_of(b), largest_of(c)), corner, to_light, 8 * largest);
    shaft.begin_max = upper_bound(to_proof_scalar(ray_epsilon));
    for (int i = 0; i < 3; ++i) {
        const Position all = shaft.light[i] - shaft.corner[i];
        shaft.begin[i] = shaft.corner[i];
        if (begin > ProofScalar(0))
            shaft.begin[i] +=
                Position(ratio(all.x, begin, longest), ratio(all.y, begin, longest), ratio(all.z, begin, longest));
    }
    const ProofScalar any_margin = shaft.margin + hit_margin(2 * largest);
    const auto face_of = [&](Position axis, const Position &on, const Position &inside) {
        if (along(axis, inside - on) > ProofScalar(0)) axis = -axis;
        const ProofScalar support = range_of(shaft, axis).high;
        return TriangleShaft::Face{axis, support, support + any_margin * sum_of(axis)};
    };
    const Position(&at)[3] = shaft.begin;
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1, k = j == 2 ? 0 : j + 1;
        shaft.faces[i] = face_of(across(at[j] - at[i], shaft.light[i] - at[i]), at[i], at[k]);
    }
    shaft.faces[3] = face_of(across(at[1] - at[0], at[2] - at[0]), at[0], shaft.light[0]);
    for (int i = 0; i < 3; ++i) {
        Position axis(ProofScalar(0));
        axis[i] = ProofScalar(1);
        const Range range = range_of(shaft, axis);
        shaft.low[i] = range.low - any_margin;
        shaft.high[i] = range.high + any_margin;
    }
    return shaft;
}

namespace {

// A box in the shaft's box. Whether all of it is outside one of the shaft's faces.
bool is_outside(const TriangleShaft &shaft, const Position &low, const Position &high) {
    for (const TriangleShaft::Face &face : shaft.faces) {
        const Position &out = face.outward;
        const Position nearest(out.x > 0 ? low.x : high.x, out.y > 0 ? low.y : high.y, out.z > 0 ? low.z : high.z);
        if (along(out, nearest) > face.limit) return true;
    }
    return false;
}

// The search of is_shaft_lit(): for triangles that do not miss the shaft.
class ShaftSearch {
  public:
    ShaftSearch(const TriangleTree &tree, const TriangleShaft &shaft, uint32_t ignore_triangle, TreeCounts &counts)
        : tree_(tree), shaft_(shaft), ignore_triangle_(ignore_triangle), counts_(counts) {}

    // False: a triangle may block a ray.
    bool finds_none_in_kdtree() {
        struct Part { // what is left of a node's cell in the shaft's box
            uint32_t node;
            Position low, high;
        } stack[max_tree_depth + 1];
        Part first = {0, shaft_.low, shaft_.high};
        if (!clip(position_of(tree_.bounds.low), position_of(tree_.bounds.high), first.low, first.high)) return true;
        stack[0] = first;
        for (uint32_t count = 1; count > 0;) {
            const Part part = stack[--count];
            ++counts_.node_visits;
            if (is_outside(shaft_, part.low, part.high)) continue;
            const TriangleNode &node = tree_.nodes[part.node];
            if (node.axis() == leaf_axis) {
                if (!all_miss(node.first(), node.value)) return false;
                continue;
            }
            const int axis = static_cast<int>(node.axis());
            const ProofScalar plane = plane_at(node.value, tree_.step_exponent, ProofScalar()) - shaft_.origin[axis];
            if (part.high[axis] >= plane) {
                Part &above = stack[count++] = part;
                above.node = node.first() + 1;
                above.low[axis] = max(part.low[axis], plane);
            }
            if (part.low[axis] <= plane) {
                Part &below = stack[count++] = part;
                below.node = node.first();
                below.high[axis] = min(part.high[axis], plane);
            }
        }
        return true;
    }
    bool finds_none_in_bvh() {
        uint32_t stack[bvh_stack];
        stack[0] = tree_.root;
        for (uint32_t count = 1; count > 0;) {
            const uint32_t child = stack[--count];
            ++counts_.node_visits;
            if (is_leaf(child)) {
                if (!all_miss(group_of(child), triangles_in(child))) return false;
                continue;
            }
            const BoxNode &node = tree_.boxes[child];
            for (uint32_t lane = 0; lane < lanes; ++lane) {
                Position low = shaft_.low, high = shaft_.high, box[2];
                for (int side = 0; side < 2; ++side)
                    for (int axis = 0; axis < 3; ++axis)
                        box[side][axis] = plane_at(node.plane[side][axis][lane], tree_.step_exponent, ProofScalar());
                if (clip(box[0], box[1], low, high) && !is_outside(shaft_, low, high))
                    stack[count++] = node.child[lane];
            }
        }
        return true;
    }

  private:
    // Narrows a box, relative to the shaft's origin, to another that is not; false: nothing is left.
    bool clip(const Position &box_low, const Position &box_high, Position &low, Position &high) const {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = max(low[axis], box_low[axis] - shaft_.origin[axis]);
            high[axis] = min(high[axis], box_high[axis] - shaft_.origin[axis]);
            if (low[axis] > high[axis]) return false;
        }
        return true;
    }
    // Of `count` triangles in groups from `first` on.
    bool all_miss(uint32_t first, uint32_t count) {
        for (uint32_t i = 0; i < count; ++i) {
            const TriangleGroup &group = tree_.groups[first + i / group_triangles];
            const uint32_t lane = i % group_triangles, triangle = group.triangle[lane];
            if (triangle == last_ || triangle == ignore_triangle_ || (triangle & transmissive_bit) != 0) continue;
            last_ = triangle; // in a kd-tree it is often in the next leaf, too
            ++counts_.triangle_tests;
            Position corners[3];
            for (int c = 0; c < 3; ++c)
                corners[c] =
                    Position(to_proof_scalar(group.corner[c][0][lane]), to_proof_scalar(group.corner[c][1][lane]),
                             to_proof_scalar(group.corner[c][2][lane])) -
                    shaft_.origin;
            if (!misses(shaft_, corners)) return false;
        }
        return true;
    }

    const TriangleTree &tree_;
    const TriangleShaft &shaft_;
    const uint32_t ignore_triangle_;
    TreeCounts &counts_;
    uint32_t last_ = no_triangle;
};

} // namespace

bool is_shaft_lit(const TriangleTree &tree, const TriangleShaft &shaft, uint32_t ignore_triangle, TreeCounts &counts) {
    if (!shaft.provable) return false;
    if (tree.triangle_count == 0) return true;
    ShaftSearch search(tree, shaft, ignore_triangle, counts);
    return tree.kind == TreeKind::bvh ? search.finds_none_in_bvh() : search.finds_none_in_kdtree();
}

// Two things are proved for every ray of the shaft.
//
// 1. Its line passes the three edges on the same side, which is what intersect() calls a hit. The side is linear in the
//    point where the line begins, and the error of the side is convex. So it suffices to check the lines from the
//    cell's corners. Each end of a line, and each sheared corner, is off by less than the margin, which sure_side()
//    covers.
//
// 2. The hit lies between ray_epsilon and the ray's end. Along some axis the triangle is apart from the cell and from
//    the light by more than `gap`. The hit x' + t d' is within the margin of the triangle, x' within the margin of the
//    cell, and the ray's end within the margin of the light. So along the axis t d' has at least the length of the
//    distance less two margins, which are at most 4 margin length_bound(axis) together. upper_bound() bounds the length
//    of d'.
bool is_shaft_shadowed(const TriangleShaft &shaft, const Vec3 (&occluder)[3]) {
    if (!shaft.provable) return false;
    Position triangle[3];
    ProofScalar largest = ProofScalar(0);
    for (int i = 0; i < 3; ++i) {
        triangle[i] = position_of(occluder[i]) - shaft.origin;
        largest = max(largest, largest_of(triangle[i]));
    }
    const ProofScalar margin = shaft.margin + hit_margin(largest + shaft.width);
    int side = 0;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            const Position &from = shaft.corner[k];
            const int side_here =
                sure_side(triangle[i] - from, triangle[i == 2 ? 0 : i + 1] - from, shaft.light[k] - from, margin);
            if (side_here == 0 || side_here == -side) return false;
            side = side_here;
        }
    const auto is_between = [&](Position axis) {
        if (along(axis, shaft.light[0] - shaft.corner[0]) < ProofScalar(0)) axis = -axis;
        const Range blocker = range_of(triangle, axis), cell = range_of(shaft.corner, axis),
                    lights = range_of(shaft.light, axis);
        const ProofScalar gap = (shaft.begin_max + 4 * margin) * length_bound(axis);
        return blocker.low - cell.high > gap && lights.low - blocker.high > gap;
    };
    return is_between(across(triangle[1] - triangle[0], triangle[2] - triangle[0])) ||
           is_between(across(shaft.corner[1], shaft.corner[2])) || is_between(axis_along(shaft.light[0]));
}

} // namespace wisp::WISP_ARITH
