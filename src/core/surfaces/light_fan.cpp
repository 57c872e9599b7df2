#include "core/surfaces/light_fan.h"
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_kdtree.h"

namespace wisp::WISP_ARITH {

namespace {

// A box or a triangle that meets the fan is found in spite of roundings. Coordinates, limits and products round by less
// than 2^-20 of the numbers that they are computed of.
constexpr Real slack = Real(0x1p-18);

// With a point of the ray on its border.
HalfSpace side_through(const LightFan &fan, const Vec3 &normal, Real distance) {
    return {normal, dot(normal, fan.origin + fan.along * distance)};
}

// The side of the line from a point of the ray to the light; sign 1: the stretch ends there, -1: it begins there.
HalfSpace outermost(const LightFan &fan, Real distance, Real sign, FanPoint &outwards) {
    const Real x = fan.is_parallel ? fan.light_x : fan.light_x - distance, y = fan.light_y;
    const Real inverse = sign / sqrt(x * x + y * y);
    outwards = {y * inverse, -x * inverse};
    return side_through(fan, fan.along * outwards.x + fan.up * outwards.y, distance);
}

void set_stretch(LightFan &fan, Real begin, Real end) {
    fan.begin = begin;
    fan.end = end;
    fan.side[3] = outermost(fan, begin, Real(-1), fan.before);
    fan.side[4] = outermost(fan, end, Real(1), fan.behind);
}

// Narrows the fan to the steps that are not all hidden. Returns whether another fan is left.
bool narrow(LightFan &fan, const StepShadows &steps) {
    uint32_t first = 0, last = steps.count;
    while (first < last && steps.hidden[first] == ~0u) ++first;
    while (first < last && steps.hidden[last - 1] == ~0u) --last;
    if (first == last) {
        fan.begin = fan.end;
        return false;
    }
    const Real begin = steps.begin[first], end = steps.begin[last - 1] + steps.length[last - 1];
    if (!(begin > fan.begin || end < fan.end)) return false;
    set_stretch(fan, begin, end);
    return true;
}

bool is_hidden(const LightFan &fan) { return !(fan.begin < fan.end); }

Real sum_of(const Vec3 &v) { return v.x + v.y + v.z; }

// The least dot product of the normal with a point of the box.
Real least_along(const Vec3 &normal, const Box &box) {
    Vec3 corner;
    for (int a = 0; a < 3; ++a) corner[a] = normal[a] < Real(0) ? box.high[a] : box.low[a];
    return dot(normal, corner);
}

// The fan in the space of a tree: that of an instance (nullptr: the world's). `largest` bounds coordinates there.
struct FanSides {
    HalfSpace side[fan_sides];
    Real plane; // the dot product of side[0]'s normal with points of the fan's plane

    FanSides(const LightFan &fan, const PlacedInstance *instance, Real largest) {
        for (uint32_t s = 0; s < fan_sides; ++s) {
            const Vec3 &normal = fan.side[s].normal;
            Real limit = fan.side[s].limit, size = abs(limit);
            side[s].normal = normal;
            if (instance) { // dot(normal, axes x + origin) <= limit
                for (int a = 0; a < 3; ++a) side[s].normal[a] = dot(normal, instance->axis[a]);
                const Real moved = dot(normal, instance->origin);
                limit -= moved;
                size += abs(moved);
            }
            if (s == 0) plane = limit;
            side[s].limit = limit + slack * (size + sum_of(absolute(side[s].normal)) * largest);
        }
    }
    bool meet(const Box &box) const {
        for (const HalfSpace &s : side)
            if (least_along(s.normal, box) > s.limit) return false;
        return true;
    }
};

inline float box_parameter(Real x, float) { return float_of(x); }
inline int64_t box_parameter(Real x, int64_t) { return static_cast<int64_t>(position_of(x)); }

// The same in the numbers of boxes.
struct BoxSides {
    BoxParameter normal[fan_sides][3], limit[fan_sides];
    uint32_t low[fan_sides][3]; // 0: the least product is that of the low plane

    BoxSides(const FanSides &fan, int step_exponent) {
        for (uint32_t s = 0; s < fan_sides; ++s) {
            limit[s] = box_parameter(fan.side[s].limit, BoxParameter());
            for (int a = 0; a < 3; ++a) {
                const Real along = fan.side[s].normal[a];
                normal[s][a] = box_parameter(along, BoxParameter());
                if constexpr (boxes_in_float) normal[s][a] = per_plane(normal[s][a], step_exponent, BoxPlane());
                low[s][a] = along < Real(0) ? 1 : 0;
            }
        }
    }
};

// A mask of the children whose boxes the fan meets.
WISP_INLINE uint32_t children_in(const BoxSides &fan, const BoxNode &node, int shift) {
    BoxParameter most[lanes], zero[lanes] = {};
    for (uint32_t s = 0; s < fan_sides; ++s) {
        const BoxPlane *const x = node.plane[fan.low[s][0]][0], *const y = node.plane[fan.low[s][1]][1],
                              *const z = node.plane[fan.low[s][2]][2];
        WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) {
            const BoxParameter beyond = at_box_plane(x[l], shift, fan.normal[s][0]) +
                                        at_box_plane(y[l], shift, fan.normal[s][1]) +
                                        at_box_plane(z[l], shift, fan.normal[s][2]) - fan.limit[s];
            most[l] = s == 0 ? beyond : max(most[l], beyond);
        }
    }
    return lanes_not_less(zero, most);
}

// Where the line from the light through the point meets the ray.
Real projected(const LightFan &fan, const FanPoint &p) {
    const Real part = p.y / fan.light_y; // of the way to the light
    if (fan.is_parallel) return p.x - part * fan.light_x;
    return p.x + bounded_quotient((p.x - fan.light_x) * part, Real(1) - part);
}

// Hides the parts of steps between two distances on the ray.
void hide(StepShadows &steps, Real from, Real to) {
    const auto mask_below = [](uint32_t part) { return part < shadow_parts ? (1u << part) - 1 : ~0u; };
    for (uint32_t i = 0; i < steps.count; ++i) {
        const Real begin = steps.begin[i], length = steps.length[i], end = begin + length;
        if (!(to > begin) || !(from < end)) continue;
        // The number of parts whose middles lie before.
        const auto parts_before = [begin, length](Real t) {
            return static_cast<uint32_t>(floor_to_int((t - begin) / length * Real(shadow_parts) + Real(0.5)));
        };
        const uint32_t first = from > begin ? mask_below(parts_before(from)) : 0;
        steps.hidden[i] |= (to < end ? mask_below(parts_before(to)) : ~0u) & ~first;
    }
}

// Whether the light lies in the triangle's plane, as a lamp on a ceiling does: rounding alone would decide to which
// side such a triangle throws a shadow.
bool is_in_plane(const LightFan &fan, const Vec3 (&corner)[3]) {
    const Vec3 normal = glm::cross(direction_between(corner[0], corner[1]), direction_between(corner[0], corner[2]));
    return abs(dot(normal, fan.light - corner[0])) <= length(normal) * fan.epsilon;
}

// Hides what the triangle of these corners, seen from the fan's origin, hides. `across`: where they are, on either side
// of the fan's plane.
void hide_behind(const LightFan &fan, const Vec3 (&corner)[3], const Real (&across)[3], StepShadows &steps) {
    // Of the corner that is alone on its side, both edges are cut: from their corner at 0 or above, so that two
    // triangles cut an edge alike.
    const bool below[3] = {across[0] < Real(0), across[1] < Real(0), across[2] < Real(0)};
    const uint32_t alone = below[1] == below[2] ? 0 : below[0] == below[2] ? 1 : 2;
    const auto cut_towards = [&](uint32_t other) {
        const uint32_t from = below[alone] ? other : alone, to = below[alone] ? alone : other;
        const Real part = across[from] / (across[from] - across[to]);
        const Vec3 p = corner[from] + (corner[to] - corner[from]) * part;
        return FanPoint{dot(fan.along, p), dot(fan.up, p)};
    };
    FanPoint cut[2] = {cut_towards(alone == 0 ? 1 : 0), cut_towards(alone == 2 ? 1 : 2)};
    if (cut[0].y > cut[1].y) std::swap(cut[0], cut[1]);
    const FanPoint low = cut[0], high = cut[1];
    if (high.y < Real(0) || low.y > fan.farthest) return;
    const auto beyond = [](const FanPoint &p, Real distance, const FanPoint &outwards) {
        return (p.x - distance) * outwards.x + p.y * outwards.y > Real(0);
    };
    if ((beyond(low, fan.begin, fan.before) && beyond(high, fan.begin, fan.before)) ||
        (beyond(low, fan.end, fan.behind) && beyond(high, fan.end, fan.behind)))
        return;
    if (!fan.is_parallel && high.y > Real(0.5) * fan.light_y && is_in_plane(fan, corner)) return;
    const auto at = [&](Real y) { return FanPoint{mix(low.x, high.x, (y - low.y) / (high.y - low.y)), y}; };
    if (low.y < Real(0)) cut[0] = at(Real(0));
    if (high.y > fan.farthest) cut[1] = at(fan.farthest);
    const Real a = projected(fan, cut[0]), b = projected(fan, cut[1]);
    hide(steps, min(a, b), max(a, b));
}

// Hides what the first `count` triangles of a group hide.
WISP_INLINE void hide_behind(const LightFan &fan, const FanSides &sides, const PlacedInstance *instance,
                             const TriangleGroup &group, uint32_t count, StepShadows &steps) {
    Real across[3][lanes];
    const Vec3 &normal = sides.side[0].normal;
    for (uint32_t c = 0; c < 3; ++c) {
        const auto &at = group.corner[c];
        WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) across[c][l] =
            sum_of_products(normal.x, at[0][l], normal.y, at[1][l], normal.z, at[2][l]) - sides.plane;
    }
    const Real zero[lanes] = {};
    uint32_t any = 0, all = ~0u; // of the corners, not below the plane
    for (uint32_t c = 0; c < 3; ++c) {
        const uint32_t above = lanes_not_less(across[c], zero);
        any |= above;
        all &= above;
    }
    for (uint32_t mask = any & ~all & ((1u << count) - 1); mask != 0; mask &= mask - 1) {
        const uint32_t l = static_cast<uint32_t>(__builtin_ctz(mask));
        if ((group.triangle[l] & transmissive_bit) != 0) continue;
        Vec3 corner[3];
        for (uint32_t c = 0; c < 3; ++c)
            corner[c] = in_world(instance, Vec3(group.corner[c][0][l], group.corner[c][1][l], group.corner[c][2][l])) -
                        fan.origin;
        hide_behind(fan, corner, {across[0][l], across[1][l], across[2][l]}, steps);
    }
}

template <class Position> Real coordinate_of(Position position) {
    if constexpr (std::is_same_v<Real, Fixed>)
        return Fixed::from_raw(position);
    else
        return position;
}

void search_kdtree(const TriangleTree &tree, LightFan &fan, const PlacedInstance *instance, StepShadows &steps,
                   TreeCounts &counts) {
    FanSides sides(fan, instance, tree.largest);
    struct Entry {
        uint32_t node;
        Box cell;
    } stack[max_tree_depth + 1];
    stack[0] = {0, tree.bounds};
    for (uint32_t stack_size = 1; stack_size > 0 && !is_hidden(fan);) {
        const Entry now = stack[--stack_size];
        ++counts.node_visits;
        if (!sides.meet(now.cell)) continue;
        const TriangleNode &node = tree.nodes[now.node];
        if (node.axis() == leaf_axis) {
            counts.triangle_tests += node.value;
            for (uint32_t first = 0; first < node.value; first += group_triangles)
                hide_behind(fan, sides, instance, tree.groups[node.first() + first / group_triangles],
                            min(node.value - first, group_triangles), steps);
            if (narrow(fan, steps)) sides = FanSides(fan, instance, tree.largest);
            continue;
        }
        const Real plane = coordinate_of(plane_of(node.value, plane_shift(tree), Parameter()));
        const int axis = static_cast<int>(node.axis());
        for (const uint32_t above : {1u, 0u}) {
            Entry &next = stack[stack_size++];
            next = {node.first() + above, now.cell};
            (above ? next.cell.low : next.cell.high)[axis] = plane;
        }
    }
}

WISP_MULTIVERSIONED void search_bvh(const TriangleTree &tree, LightFan &fan, const PlacedInstance *instance,
                                    StepShadows &steps, TreeCounts &counts) {
    FanSides sides(fan, instance, tree.largest);
    BoxSides boxes(sides, tree.step_exponent);
    const int shift = plane_shift(tree);
    uint32_t stack[bvh_stack], stack_size = 0;
    stack[stack_size++] = tree.root;
    while (stack_size > 0 && !is_hidden(fan)) {
        const uint32_t child = stack[--stack_size];
        ++counts.node_visits;
        if (is_leaf(child)) {
            const uint32_t count = triangles_in(child);
            counts.triangle_tests += count;
            hide_behind(fan, sides, instance, tree.groups[group_of(child)], count, steps);
            if (!narrow(fan, steps)) continue;
            sides = FanSides(fan, instance, tree.largest);
            boxes = BoxSides(sides, tree.step_exponent);
            continue;
        }
        const BoxNode &node = tree.boxes[child];
        for (uint32_t mask = children_in(boxes, node, shift); mask != 0; mask &= mask - 1)
            stack[stack_size++] = node.child[__builtin_ctz(mask)];
    }
}

void add_shadows(const TriangleTree &tree, LightFan &fan, const PlacedInstance *instance, StepShadows &steps,
                 TreeCounts &counts) {
    if (tree.triangle_count == 0) return;
    if (has(parts::kd_trees) && tree.kind == TreeKind::kd)
        search_kdtree(tree, fan, instance, steps, counts);
    else
        search_bvh(tree, fan, instance, steps, counts);
}

} // namespace

bool make_light_fan(const Ray &ray, Real begin, Real end, bool is_parallel, const Vec3 &light, Real epsilon,
                    LightFan &fan) {
    fan.origin = ray.origin;
    fan.along = ray.direction;
    fan.is_parallel = is_parallel;
    fan.epsilon = epsilon;
    fan.light = is_parallel ? light : light - ray.origin;
    fan.light_x = dot(fan.light, fan.along);
    const Vec3 up = fan.light - fan.along * fan.light_x;
    fan.light_y = length(up);
    if (!(fan.light_y > (abs(fan.light_x) + fan.light_y) * Real(0x1p-10))) return false;
    fan.up = up / fan.light_y;
    fan.across = glm::cross(fan.along, fan.up);
    fan.farthest = is_parallel ? infinite_distance : fan.light_y - max(epsilon, fan.light_y * Real(0x1p-19));
    fan.side[0] = side_through(fan, fan.across, Real(0));
    fan.side[1] = side_through(fan, -fan.across, Real(0));
    fan.side[2] = side_through(fan, -fan.up, Real(0));
    set_stretch(fan, begin, end);
    return true;
}

void add_shadows(const Surfaces &surfaces, LightFan &fan, StepShadows &steps, TreeCounts &counts) {
    add_shadows(surfaces.static_tree, fan, nullptr, steps, counts);
    add_shadows(surfaces.deforming_tree, fan, nullptr, steps, counts);
    if (surfaces.group_count == 0) return;
    const FanSides world(fan, nullptr, surfaces.largest);
    uint32_t stack[max_group_depth], stack_size = 0;
    stack[stack_size++] = 0;
    while (stack_size > 0 && !is_hidden(fan)) {
        const uint32_t at = stack[--stack_size];
        const InstanceNode &group = surfaces.groups[at];
        ++counts.node_visits;
        if (!world.meet(group.box)) continue;
        if (group.second == 0) {
            const PlacedInstance &instance = surfaces.instances[group.instance];
            add_shadows(instance.tree, fan, &instance, steps, counts);
        } else {
            stack[stack_size++] = group.second;
            stack[stack_size++] = at + 1;
        }
    }
}

} // namespace wisp::WISP_ARITH
