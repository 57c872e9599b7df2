// Lightcuts: building the trees of lights, and bounding the light of a node.
#include "core/lights/lightcuts.h"
#include "core/numbers/random.h"
#include <algorithm>
#include <type_traits>

namespace wisp::WISP_ARITH {

namespace {

constexpr Real min_distance = Real(0x1p-8); // to a box: below it no direction is certain, and there is no bound
constexpr int max_irradiance_exponent = 16; // above it there is no bound either
// Bounds hold for the values as computed. They are enlarged relative to the lengths of vectors and to the bound itself,
// and by units of the last place for numbers near the end of the range.
constexpr Real vector_slack = Real(0x1p-20), bound_slack = Real(0x1p-12);
constexpr Real last_place = Real(std::is_same<Real, Fixed>::value ? 0x1p-32 : 0x1p-120);

// The position of a light in the box of its node. A parallel light counts as one unit away.
Vec3 place_of(const Light &light) { return light.kind == LightKind::parallel ? -light.direction : light.position; }

LightNode node_of(const Light &light, uint32_t index) {
    const Vec3 place = place_of(light);
    const bool spot = light.kind == LightKind::spot;
    const Vec3 direction = spot ? light.direction : Vec3(Real(0));
    const Real one_minus_cosine = spot ? light.one_minus_cosine : Real(2);
    return {{place, place}, {direction, direction}, one_minus_cosine, light.color, 1, index, 0};
}

Box joined(const Box &a, const Box &b) { return {min(a.low, b.low), max(a.high, b.high)}; }

// The representative is that of one child, chosen in proportion to its brightness by a hash of the first child's index.
LightNode joined(const LightNode &a, const LightNode &b, uint32_t children) {
    const Real xi = unit_half_open<Real>(draw(photon_event(0, children), 0));
    const bool first = xi * largest(a.color + b.color) < largest(a.color);
    return {joined(a.box, b.box),
            joined(a.directions, b.directions),
            max(a.max_one_minus_cosine, b.max_one_minus_cosine),
            a.color + b.color,
            a.count + b.count,
            first ? a.light : b.light,
            children};
}

// The cost of a cluster is its brightness times the squared size of its boxes, of positions and of directions.
struct Cluster {
    Box box, directions;
    Real weight;
};

constexpr uint32_t units_of_light = 8; // of work, along an axis

// Splits lights into clusters. Its numbers are relative to those of all lights, so that squares stay in range.
struct Splitter {
    const Light *lights;
    uint32_t *order; // of the lights
    Real *cost;      // cost[i]: of the lights from i to the end
    Real unit, brightness;

    Cluster cluster_of(uint32_t light) const {
        const LightNode node = node_of(lights[light], light);
        return {node.box, node.directions, largest(node.color) / brightness};
    }
    static void add(Cluster &sum, const Cluster &other) {
        sum = {joined(sum.box, other.box), joined(sum.directions, other.directions), sum.weight + other.weight};
    }
    Real cost_of(const Cluster &cluster) const {
        const Vec3 edges = (cluster.box.high - cluster.box.low) / unit,
                   turn = cluster.directions.high - cluster.directions.low;
        return cluster.weight * (dot(edges, edges) + dot(turn, turn));
    }
    Real coordinate(uint32_t light, int axis) const {
        const Vec3 v = axis < 3 ? place_of(lights[light]) : lights[light].direction;
        return axis % 3 == 0 ? v.x : axis % 3 == 1 ? v.y : v.z;
    }
    void sort(uint32_t begin, uint32_t end, int axis) const {
        std::sort(order + begin, order + end, [this, axis](uint32_t a, uint32_t b) {
            const Real x = coordinate(a, axis), y = coordinate(b, axis);
            return x < y || (x == y && a < b);
        });
    }
    void measure(uint32_t begin, uint32_t end) {
        unit = brightness = Real(1);
        Cluster all = cluster_of(order[begin]);
        for (uint32_t i = begin + 1; i < end; ++i) add(all, cluster_of(order[i]));
        const Real edge = largest(all.box.high - all.box.low);
        if (edge > Real(0)) unit = edge;
        if (all.weight > Real(0)) brightness = all.weight;
    }
    // Sorts the lights into two clusters of the least total cost, along one axis, and returns where the second begins.
    // Neither has less than 1/16 of the lights, so that trees are not deep.
    uint32_t split(uint32_t begin, uint32_t end, Watch watch) const {
        const uint32_t min_count = std::max((end - begin) / 16, uint32_t{1});
        const int axes = lights[order[begin]].kind == LightKind::spot ? 6 : 3;
        uint32_t middle = begin + min_count;
        int best_axis = 0;
        Real best = no_bound;
        for (int axis = 0; axis < axes && watch.go_on((end - begin) * units_of_light); ++axis) {
            sort(begin, end, axis);
            Cluster rest = cluster_of(order[end - 1]), first = cluster_of(order[begin]);
            cost[end - 1] = cost_of(rest);
            for (uint32_t i = end - 1; --i > begin;) {
                add(rest, cluster_of(order[i]));
                cost[i] = cost_of(rest);
            }
            for (uint32_t i = begin + 1; i <= end - min_count; ++i) {
                const Real sum = cost_of(first) + cost[i];
                if (i >= begin + min_count && sum < best) {
                    best = sum;
                    best_axis = axis;
                    middle = i;
                }
                add(first, cluster_of(order[i]));
            }
        }
        sort(begin, end, best_axis);
        return middle;
    }
};

// The lights `first` to `end` - 1 of the sorted order.
struct Range {
    uint32_t first, end;
};

// A box relative to a point, with its nearest distance and the sphere around it, both allowing for rounding.
struct SeenBox {
    Vec3 low, high, middle;
    Real radius, nearest, slack;
};
SeenBox seen_from(const Vec3 &point, const Box &box) {
    SeenBox seen;
    seen.low = box.low - point;
    seen.high = box.high - point;
    const Vec3 half = (seen.high - seen.low) * Real(0.5);
    seen.middle = seen.low + half;
    seen.nearest = length(max(Vec3(Real(0)), max(seen.low, -seen.high)));
    seen.radius = length(half);
    seen.slack = (length(seen.middle) + seen.radius) * vector_slack;
    seen.radius += seen.slack;
    return seen;
}

// An upper bound of the cosine between the unit vector a = `axis` and the vector v to any point of the box. Let z = a
// v, and let r be the distance of v from the axis: the cosine is z / |v| = z / sqrt(z^2 + r^2). The largest z is that
// of a corner, Z; if Z <= 0, no cosine is above 0. The smallest r is at least R, that of the centre minus the radius.
// For z > 0 the cosine grows with z and falls with r, so it is at most Z / sqrt(Z^2 + R^2), and at most Z / min |v|.
Real max_cosine(const SeenBox &box, const Vec3 &axis) {
    const Vec3 farther = max(axis * box.low, axis * box.high);
    const Real along = farther.x + farther.y + farther.z + box.slack;
    if (!(along > Real(0))) return Real(0);
    const Real across = max(Real(0), length(box.middle - axis * dot(axis, box.middle)) - box.radius);
    return min(Real(1), along / max(box.nearest, sqrt(along * along + across * across)));
}

// Whether no spot of the node reaches the point. The largest product of a vector to the point with an axis is bounded
// coordinate by coordinate. Divided by the least distance (by the largest, if the product is below 0), it is an upper
// bound of the cosine, which must lie outside the widest cone.
bool is_outside(const SeenBox &box, const LightNode &node) {
    const Box &d = node.directions;
    const Vec3 farther = max(max(-box.low * d.low, -box.low * d.high), max(-box.high * d.low, -box.high * d.high));
    const Real along = farther.x + farther.y + farther.z + box.slack;
    const Real distance = along > Real(0) ? box.nearest : length(box.middle) + box.radius;
    return along / distance + bound_slack < Real(1) - node.max_one_minus_cosine;
}

} // namespace

uint64_t light_cut_bytes(const Scene &scene) {
    const uint64_t count = scene.light_count;
    return Arena::bytes<LightNode>(2 * count) + Arena::bytes<CutNode>(count) + Arena::bytes<Range>(2 * count) +
           Arena::bytes<uint32_t>(count) + Arena::bytes<Real>(count);
}

bool make_light_cuts(const Light *lights, uint32_t count, Arena &arena, LightCuts &cuts, Watch watch) {
    LightNode *nodes = arena.make<LightNode>(2 * size_t{count});
    cuts = {lights, nodes, 0, 0, {}, arena.make<CutNode>(count), Real(0.02), 1000}; // the values of the paper
    const size_t mark = arena.mark();
    Range *range = arena.make<Range>(2 * size_t{count});
    Splitter splitter = {lights, arena.make<uint32_t>(count), arena.make<Real>(count), Real(1), Real(1)};
    if (!nodes || !cuts.heap || !range || !splitter.order || !splitter.cost) return false;
    uint32_t sorted = 0, made = 0; // numbers of lights sorted, and of nodes made
    watch.expect(uint64_t{count} * units_of_light);
    for (const LightKind kind : {LightKind::point, LightKind::spot, LightKind::parallel, LightKind::constant}) {
        const uint32_t begin = sorted, root = made;
        for (uint32_t i = 0; i < count; ++i)
            if (lights[i].kind == kind) splitter.order[sorted++] = i;
        if (sorted == begin) continue;
        cuts.roots[cuts.root_count++] = root;
        splitter.measure(begin, sorted);
        range[made++] = {begin, sorted};
        for (uint32_t n = root; n < made; ++n) {
            nodes[n].children = 0;
            const uint32_t lights_below = range[n].end - range[n].first;
            if (!(lights_below == 1 ? watch.done(units_of_light) : watch.go_on(lights_below * units_of_light)))
                return false;
            if (lights_below == 1) continue;
            const uint32_t middle = splitter.split(range[n].first, range[n].end, watch);
            nodes[n].children = made;
            range[made++] = {range[n].first, middle};
            range[made++] = {middle, range[n].end};
        }
        for (uint32_t n = made; n-- > root;) {
            const uint32_t children = nodes[n].children, light = splitter.order[range[n].first];
            nodes[n] =
                children ? joined(nodes[children], nodes[children + 1], children) : node_of(lights[light], light);
        }
    }
    cuts.node_count = made;
    arena.rewind(mark);
    return true;
}

Real max_light(const LightCuts &cuts, const LightNode &node, const LitPoint &point) {
    const LightKind kind = cuts.lights[node.light].kind;
    const SeenBox box = seen_from(kind == LightKind::parallel ? Vec3(Real(0)) : point.position, node.box);
    if (box.nearest < min_distance) return no_bound;
    const bool falls_off = kind == LightKind::point || kind == LightKind::spot;
    if (falls_off && scale_pow2(largest(node.color), -max_irradiance_exponent) > box.nearest * box.nearest)
        return no_bound;
    if (kind == LightKind::spot && is_outside(box, node)) return Real(0);
    const Real cosine = max_cosine(box, point.normal);
    if (!(cosine > Real(0)) || !(max_cosine(box, point.plane) > Real(0))) return Real(0);
    // Bound each factor by itself: 1/r^2 by the nearest distance, the cosines of the normal and the highlight by their
    // upper bounds, and visibility by 1.
    const Real rounding = Real(static_cast<int32_t>(node.count)) * last_place;
    Color irradiance = node.color;
    if (falls_off) irradiance = irradiance / box.nearest / box.nearest + Color(rounding * Real(256));
    const Real lambert = kind == LightKind::constant ? cosine : cosine * inv_pi<Real>;
    const Real off = max_cosine(box, point.mirrored);
    const bool shines = off > Real(0) || point.shininess == Real(0);
    const Real highlight = shines ? power(min(Real(1), off + vector_slack), point.shininess) : Real(0);
    const Color factor = point.diffuse * lambert + point.specular * highlight;
    if (!(largest(factor) > Real(0))) return Real(0);
    const Real bound = largest(irradiance * (factor + Color(last_place * Real(16))));
    return bound + bound * bound_slack + rounding;
}

namespace {

bool is_first(const CutNode &a, const CutNode &b) {
    return a.bound > b.bound || (a.bound == b.bound && a.node < b.node);
}

} // namespace

void push(CutNode *heap, uint32_t &size, const CutNode &node) {
    uint32_t i = size++;
    for (; i > 0 && is_first(node, heap[(i - 1) / 2]); i = (i - 1) / 2) heap[i] = heap[(i - 1) / 2];
    heap[i] = node;
}

CutNode pop(CutNode *heap, uint32_t &size) {
    const CutNode first = heap[0], last = heap[--size];
    uint32_t i = 0;
    for (uint32_t child = 1; child < size; child = 2 * i + 1) {
        if (child + 1 < size && is_first(heap[child + 1], heap[child])) ++child;
        if (!is_first(heap[child], last)) break;
        heap[i] = heap[child];
        i = child;
    }
    heap[i] = last;
    return first;
}

} // namespace wisp::WISP_ARITH
