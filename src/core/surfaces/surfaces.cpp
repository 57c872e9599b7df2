// The trees of a scene's surfaces, and rays through all of them.
#include "core/surfaces/surfaces.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t deepest = 40; // groups are halved: far more than 2^32 bodies need

// By how much boxes of bodies are wider than what they hold: coordinates are below 2^13 and every step towards them, or
// along a ray, rounds them by less than 2^-22 of that.
constexpr Real margin = Real(0x1p-4);

Box box_of(const Triangle *triangles, uint32_t count) {
    Box box = {vec_of(triangles[0].corner[0]), vec_of(triangles[0].corner[0])};
    for (uint32_t i = 0; i < count; ++i)
        for (const Double3 &corner : triangles[i].corner) {
            box.low = lowest(box.low, vec_of(corner));
            box.high = highest(box.high, vec_of(corner));
        }
    return box;
}

Vec3 absolute(const Vec3 &v) { return Vec3(abs(v.x), abs(v.y), abs(v.z)); }
Vec3 applied(const Vec3 axis[3], const Vec3 &v) {
    return Vec3(sum_of_products(axis[0].x, v.x, axis[1].x, v.y, axis[2].x, v.z),
                sum_of_products(axis[0].y, v.x, axis[1].y, v.y, axis[2].y, v.z),
                sum_of_products(axis[0].z, v.x, axis[1].z, v.y, axis[2].z, v.z));
}

Box world_box(const PlacedBody &body) {
    const Vec3 half = (body.bounds.high - body.bounds.low) * Real(0.5);
    const Vec3 axis[3] = {absolute(body.axis[0]), absolute(body.axis[1]), absolute(body.axis[2])};
    const Vec3 middle = body.origin + applied(body.axis, body.bounds.low + half);
    const Vec3 reach = applied(axis, half) + Vec3(margin);
    return {middle - reach, middle + reach};
}

Real middle_of(const Box &box, int axis) { return box.low[axis] + box.high[axis]; } // twice it

// The groups of bodies order[0 .. count - 1], at groups[first] and behind it; returns how many there are.
uint32_t make_groups(const Surfaces &surfaces, const Box *boxes, uint32_t *order, uint32_t count, uint32_t first) {
    BodyGroup &group = surfaces.groups[first];
    group = {boxes[order[0]], 0, order[0]};
    if (count == 1) return 1;
    Vec3 low = boxes[order[0]].low + boxes[order[0]].high, high = low;
    for (uint32_t i = 1; i < count; ++i) {
        const Box &box = boxes[order[i]];
        group.box = {lowest(group.box.low, box.low), highest(group.box.high, box.high)};
        low = lowest(low, box.low + box.high);
        high = highest(high, box.low + box.high);
    }
    const Vec3 width = high - low;
    const int axis = width.x >= width.y && width.x >= width.z ? 0 : width.y >= width.z ? 1 : 2;
    std::sort(order, order + count, [boxes, axis](uint32_t a, uint32_t b) {
        const Real x = middle_of(boxes[a], axis), y = middle_of(boxes[b], axis);
        return x < y || (x == y && a < b);
    });
    const uint32_t made = make_groups(surfaces, boxes, order, count / 2, first + 1);
    group.second = first + 1 + made;
    return 1 + made + make_groups(surfaces, boxes, order + count / 2, count - count / 2, group.second);
}

// visit(body) for each body whose box the ray passes before end(), the nearer half of each group first.
template <class End, class Visit>
void for_each_body(const Surfaces &surfaces, const Ray &ray, uint64_t &visits, End &&end, Visit &&visit) {
    if (surfaces.group_count == 0) return;
    struct Entry {
        uint32_t group;
        Real begin;
    } stack[deepest];
    const auto entry = [&](uint32_t group, Entry &found) {
        Real from = Real(0), to = path_end;
        ++visits;
        if (!clip(surfaces.groups[group].box, ray, from, to)) return false;
        found = {group, from};
        return true;
    };
    uint32_t height = 0;
    if (entry(0, stack[0])) height = 1;
    while (height > 0) {
        const Entry top = stack[--height];
        if (!(top.begin < end())) continue;
        const BodyGroup &group = surfaces.groups[top.group];
        if (group.second == 0) {
            if (!visit(surfaces.bodies[group.body])) return;
            continue;
        }
        Entry first, second;
        const bool has_first = entry(top.group + 1, first), has_second = entry(group.second, second);
        const bool swapped = has_first && has_second && first.begin < second.begin;
        if (has_first && !swapped) stack[height++] = first;
        if (has_second) stack[height++] = second;
        if (has_first && swapped) stack[height++] = first;
    }
}

TriangleRay ray_in(const PlacedBody &body, const Ray &ray) {
    return TriangleRay(applied(body.inverse, ray.origin - body.origin), applied(body.inverse, ray.direction));
}

uint32_t within(uint32_t triangle, uint32_t first, uint32_t count) {
    return triangle - first < count ? triangle - first : no_triangle;
}

} // namespace

uint64_t surface_bytes(const Scene &scene) {
    uint64_t bytes = triangle_tree_bytes(scene.still_count) + Arena::bytes<PlacedBody>(scene.body_count);
    for (uint32_t i = 0; i < scene.body_count; ++i) bytes += triangle_tree_bytes(scene.bodies[i].count);
    return bytes;
}

uint64_t placement_bytes(const Scene &scene) {
    return triangle_tree_bytes(scene.morph_count) + Arena::bytes<BodyGroup>(2 * uint64_t{scene.body_count}) +
           Arena::bytes<Box>(scene.body_count) + Arena::bytes<uint32_t>(scene.body_count);
}

Surfaces make_surfaces(const Scene &scene, Arena &arena) {
    Surfaces surfaces = {};
    surfaces.body_count = scene.body_count;
    surfaces.still_count = scene.still_count;
    surfaces.morph_first = scene.still_count + scene.body_triangle_count;
    surfaces.morph_count = scene.morph_count;
    surfaces.skin = to_real<Real>(scene.skin);
    surfaces.still = make_triangle_tree(scene.triangles, scene.still_count, scene.materials, arena);
    surfaces.bodies = arena.make<PlacedBody>(scene.body_count);
    surfaces.ready = surfaces.still.ready && surfaces.bodies;
    for (uint32_t i = 0; surfaces.ready && i < scene.body_count; ++i) {
        const Body &source = scene.bodies[i];
        PlacedBody &body = surfaces.bodies[i];
        body = {};
        body.first = source.first;
        body.count = source.count;
        body.bounds = box_of(scene.triangles + source.first, source.count);
        body.tree = make_triangle_tree(scene.triangles + source.first, source.count, scene.materials, arena);
        surfaces.ready = body.tree.ready;
    }
    return surfaces;
}

void place_surfaces(const Scene &scene, Arena &arena, Surfaces &surfaces) {
    surfaces.morphs =
        make_triangle_tree(scene.triangles + surfaces.morph_first, scene.morph_count, scene.materials, arena);
    surfaces.groups = arena.make<BodyGroup>(2 * size_t{scene.body_count});
    surfaces.group_count = 0;
    surfaces.boxes = arena.make<Box>(scene.body_count);
    uint32_t *order = arena.make<uint32_t>(scene.body_count), visible = 0;
    surfaces.ready = surfaces.morphs.ready && surfaces.groups && surfaces.boxes && order;
    if (!surfaces.ready) return;
    for (uint32_t i = 0; i < scene.body_count; ++i) {
        const Body &source = scene.bodies[i];
        if (!source.visible) continue;
        PlacedBody &body = surfaces.bodies[i];
        body.origin = vec_of(source.origin);
        for (int k = 0; k < 3; ++k) {
            body.axis[k] = vec_of(source.axis[k]);
            body.inverse[k] = vec_of(source.inverse[k]);
        }
        surfaces.boxes[i] = world_box(body);
        order[visible++] = i;
    }
    if (visible > 0) surfaces.group_count = make_groups(surfaces, surfaces.boxes, order, visible, 0);
}

namespace {

// By a tree's search(tree, ray, begin, end, skip, hit, counts).
template <class Search>
Hit find_nearest(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &counts,
                 Search &&search) {
    Hit hit = {false, end, Real(0), Real(0), no_triangle, surfaces.body_count};
    const auto look = [&](const TriangleTree &tree, const TriangleRay &local, uint32_t first, uint32_t count,
                          uint32_t body) {
        SurfaceHit found;
        // A little beyond the hit so far, for one at the same distance.
        const Real reach = min(end, hit.distance + (hit.distance * Real(0x1p-20) + Real(0x1p-32)));
        if (!search(tree, local, begin, reach, within(skip, first, count), found, counts)) return;
        if (found.distance < hit.distance || (found.distance == hit.distance && first + found.triangle < hit.triangle))
            hit = {true, found.distance, found.u, found.v, first + found.triangle, body};
    };
    const TriangleRay world(ray.origin, ray.direction);
    look(surfaces.still, world, 0, surfaces.still_count, surfaces.body_count);
    look(surfaces.morphs, world, surfaces.morph_first, surfaces.morph_count, surfaces.body_count);
    for_each_body(
        surfaces, ray, counts.node_visits, [&hit] { return hit.distance; },
        [&](const PlacedBody &body) {
            look(body.tree, ray_in(body, ray), body.first, body.count, static_cast<uint32_t>(&body - surfaces.bodies));
            return true;
        });
    return hit;
}

} // namespace

Hit nearest_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &counts) {
    return find_nearest(surfaces, ray, begin, end, skip, counts, [](auto &&...all) { return nearest_hit(all...); });
}

Hit nearest_opaque_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, TreeCounts &counts) {
    return find_nearest(surfaces, ray, begin, end, no_triangle, counts,
                        [](auto &&...all) { return nearest_opaque_hit(all...); });
}

bool is_blocked_by_still(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip,
                         uint32_t &occluder, TreeCounts &counts) {
    return any_hit(surfaces.still, TriangleRay(ray.origin, ray.direction), begin, end,
                   within(skip, 0, surfaces.still_count), occluder, counts);
}

bool is_blocked_by_morphs(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip,
                          TreeCounts &counts) {
    uint32_t occluder;
    return surfaces.morph_count > 0 &&
           any_hit(surfaces.morphs, TriangleRay(ray.origin, ray.direction), begin, end,
                   within(skip, surfaces.morph_first, surfaces.morph_count), occluder, counts);
}

bool is_blocked_by_body(const PlacedBody &body, const Ray &ray, Real begin, Real end, uint32_t skip,
                        TreeCounts &counts) {
    uint32_t occluder;
    return any_hit(body.tree, ray_in(body, ray), begin, end, within(skip, body.first, body.count), occluder, counts);
}

bool is_blocked_by_moving(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip,
                          TreeCounts &counts) {
    bool blocked = is_blocked_by_morphs(surfaces, ray, begin, end, skip, counts);
    if (blocked) return true;
    for_each_body(
        surfaces, ray, counts.node_visits, [end] { return end; },
        [&](const PlacedBody &body) {
            blocked = is_blocked_by_body(body, ray, begin, end, skip, counts);
            return !blocked;
        });
    return blocked;
}

bool is_blocked(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t skip, TreeCounts &counts) {
    uint32_t occluder;
    return is_blocked_by_still(surfaces, ray, begin, end, skip, occluder, counts) ||
           is_blocked_by_moving(surfaces, ray, begin, end, skip, counts);
}

} // namespace wisp::WISP_ARITH
