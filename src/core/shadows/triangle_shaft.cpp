// Shafts of shadow rays against triangles.
#include "core/shadows/triangle_shaft.h"

namespace wisp::WISP_ARITH {

namespace {

using namespace detail;

// Margins of the floating arithmetics, e being half a last place of 1; and of Fixed.
constexpr double e = sizeof(Real) == 4 ? 0x1p-24 : 0x1p-53;
inline double margin_of(double edge, double corner, double way, double largest) {
    return max(e * (5 * edge + 3 * corner), e * 8 * way) + 0x1p-48 * largest;
}
inline int64_t margin_of(int64_t, int64_t, int64_t, int64_t) { return 10; }
inline double hit_margin(double reach) { return 15 * e * reach; }
inline int64_t hit_margin(int64_t) { return 0; } // margin_of has it

Position position_of(const Vec3 &v) { return Position(to_proof_scalar(v.x), to_proof_scalar(v.y), to_proof_scalar(v.z)); }

Position share(const Position &v, int part) {
    return Position(detail::share(v.x, part), detail::share(v.y, part), detail::share(v.z, part));
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

// Whether two convex bodies, widened by the margin, are on two sides of a plane across the axis.
bool are_apart(const Range &a, const Range &b, const Position &axis, ProofScalar margin) {
    return max(a.low - b.high, b.low - a.high) > margin * sum_of(axis);
}

// Of all axes that may tell convex bodies apart, those of their faces and edges, the likely ones first.
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
    const auto tells = [&](const Position &axis) {
        return are_apart(range_of(shaft, axis), range_of(triangle, axis), axis, margin);
    };
    if (tells(across(edges[0], edges[1]))) return true;
    for (const Position &edge : edges)
        for (int i = 0; i < 3; ++i) {
            if (tells(across(edge, shaft.begin[i == 2 ? 0 : i + 1] - shaft.begin[i]))) return true;
            if ((i == 0 || !shaft.parallel) && tells(across(edge, shaft.light[i] - shaft.begin[i]))) return true;
        }
    return false;
}

} // namespace

TriangleShaft make_triangle_shaft(const TriangleTree &tree, const Vec3 (&receiver)[3], const CellPlace &cell,
                              const Light &light, Real ray_epsilon) {
    TriangleShaft shaft = {};
    const Position a = position_of(receiver[0]), b = position_of(receiver[1]) - a, c = position_of(receiver[2]) - a;
    shaft.origin = a + share(b, cell.u) + share(c, cell.v);
    shaft.corner[1] = share(b, cell.size);
    shaft.corner[2] = share(c, cell.size);
    shaft.parallel = light.kind == LightKind::parallel;
    ProofScalar largest = to_proof_scalar(tree.largest) + ProofScalar(1), way = ProofScalar(0);
    if (shaft.parallel) {
        const Vec3 to_light = -light.direction;
        const Position step(far_along(to_light.x, largest), far_along(to_light.y, largest),
                            far_along(to_light.z, largest));
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
        if (!shaft.parallel) way = max(way, largest_of(shaft.light[i] - shaft.corner[i]));
        shaft.width = max(shaft.width, largest_of(shaft.corner[i]));
    }
    const ProofScalar begin = min(at_least(to_proof_scalar(ray_epsilon)), longest);
    ProofScalar corner = ProofScalar(0);
    for (const Vec3 &v : receiver) corner = max(corner, largest_of(position_of(v)));
    shaft.margin = margin_of(max(largest_of(b), largest_of(c)), corner, way, 8 * largest);
    shaft.begin_most = at_most(to_proof_scalar(ray_epsilon));
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

bool is_shaft_free(const TriangleTree &tree, const TriangleShaft &shaft, uint32_t skip, TreeCounts &counts) {
    if (!shaft.provable) return false;
    if (tree.triangle_count == 0) return true;
    struct Part { // of a node's cell, in the shaft's box
        uint32_t node;
        Position low, high;
    } waiting[max_tree_depth + 1];
    const Position low = position_of(tree.bounds.low) - shaft.origin,
                   high = position_of(tree.bounds.high) - shaft.origin;
    Part first = {0, shaft.low, shaft.high};
    for (int i = 0; i < 3; ++i) {
        first.low[i] = max(first.low[i], low[i]);
        first.high[i] = min(first.high[i], high[i]);
        if (first.low[i] > first.high[i]) return true;
    }
    waiting[0] = first;
    uint32_t last = no_triangle;
    for (uint32_t count = 1; count > 0;) {
        const Part part = waiting[--count];
        ++counts.node_visits;
        bool outside = false;
        for (const TriangleShaft::Face &face : shaft.faces) {
            const Position &out = face.outward;
            const Position nearest(out.x > 0 ? part.low.x : part.high.x, out.y > 0 ? part.low.y : part.high.y,
                                   out.z > 0 ? part.low.z : part.high.z);
            outside = outside || along(out, nearest) > face.limit;
        }
        if (outside) continue;
        const TriangleNode &node = tree.nodes[part.node];
        if (node.axis() < 3) {
            const int axis = static_cast<int>(node.axis());
            const ProofScalar plane = plane_at(node.value, tree.step_exponent, ProofScalar()) - shaft.origin[axis];
            if (part.high[axis] >= plane) {
                Part &above = waiting[count++] = part;
                above.node = node.first() + 1;
                above.low[axis] = max(part.low[axis], plane);
            }
            if (part.low[axis] <= plane) {
                Part &below = waiting[count++] = part;
                below.node = node.first();
                below.high[axis] = min(part.high[axis], plane);
            }
            continue;
        }
        for (uint32_t i = 0; i < node.value; ++i) {
            const TriangleGroup &group = tree.groups[node.first() + i / group_triangles];
            const uint32_t lane = i % group_triangles, triangle = group.triangle[lane];
            if (triangle == last || triangle == skip || (triangle & lets_light_through) != 0) continue;
            last = triangle; // again in the next leaf, as often as not
            ++counts.triangle_tests;
            Position corners[3];
            for (int c = 0; c < 3; ++c)
                corners[c] = Position(to_proof_scalar(group.corner[c][0][lane]), to_proof_scalar(group.corner[c][1][lane]),
                                      to_proof_scalar(group.corner[c][2][lane])) -
                             shaft.origin;
            if (!misses(shaft, corners)) return false;
        }
    }
    return true;
}

// All lines from the cell to the light pass the three edges on one side, which is linear in where they begin, and its
// error convex: so it is enough that those of the corners do. Sheared corners are off by less than the margin, and each
// line by as much at either end; a line on one side of all edges of what `meet` sees is what it calls a hit. The
// distance of that is between the skin and the end, as the triangle is so far from the cell, and from the light, in
// some direction: x' + t d' is within the margin of it, x' of the cell, and what has been gone at the whole distance of
// the light. So t d' is at least a gap less two margins, which are below 4 in the terms of length_bound, along that
// direction; d' is no longer than at_most has it.
bool is_shaft_blocked(const TriangleShaft &shaft, const Vec3 (&occluder)[3]) {
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
            const int now =
                sure_side(triangle[i] - from, triangle[i == 2 ? 0 : i + 1] - from, shaft.light[k] - from, margin);
            if (now == 0 || now == -side) return false;
            side = now;
        }
    const auto between = [&](Position axis) {
        if (along(axis, shaft.light[0] - shaft.corner[0]) < ProofScalar(0)) axis = -axis;
        const Range there = range_of(triangle, axis), cell = range_of(shaft.corner, axis),
                    lights = range_of(shaft.light, axis);
        const ProofScalar gap = (shaft.begin_most + 4 * margin) * length_bound(axis);
        return there.low - cell.high > gap && lights.low - there.high > gap;
    };
    return between(across(triangle[1] - triangle[0], triangle[2] - triangle[0])) ||
           between(across(shaft.corner[1], shaft.corner[2])) || between(axis_along(shaft.light[0]));
}

} // namespace wisp::WISP_ARITH
