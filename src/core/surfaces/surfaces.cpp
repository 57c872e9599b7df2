// The trees of a scene's surfaces, and rays through all of them.
#include "core/surfaces/coplanar.h"
#include "core/surfaces/surfaces.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

// The margin of an instance's box in the world. Coordinates are below 2^13. Each operation that computes the box, or a
// point of a ray, rounds by less than 2^-22 of that.
constexpr Real margin = Real(0x1p-4);

Box box_of(const Triangle *triangles, uint32_t count) {
    Box box = {vec_of(triangles[0].corner[0]), vec_of(triangles[0].corner[0])};
    for (uint32_t i = 0; i < count; ++i)
        for (const Double3 &corner : triangles[i].corner) {
            box.low = min(box.low, vec_of(corner));
            box.high = max(box.high, vec_of(corner));
        }
    return box;
}

Vec3 applied(const Vec3 axis[3], const Vec3 &v) {
    return Vec3(sum_of_products(axis[0].x, v.x, axis[1].x, v.y, axis[2].x, v.z),
                sum_of_products(axis[0].y, v.x, axis[1].y, v.y, axis[2].y, v.z),
                sum_of_products(axis[0].z, v.x, axis[1].z, v.y, axis[2].z, v.z));
}

Box world_box(const PlacedInstance &instance) {
    const Vec3 half = (instance.bounds.high - instance.bounds.low) * Real(0.5);
    const Vec3 axis[3] = {absolute(instance.axis[0]), absolute(instance.axis[1]), absolute(instance.axis[2])};
    const Vec3 middle = instance.origin + applied(instance.axis, instance.bounds.low + half);
    const Vec3 reach = applied(axis, half) + Vec3(margin);
    return {middle - reach, middle + reach};
}

Real middle_of(const Box &box, int axis) { return box.low[axis] + box.high[axis]; } // doubled

// Makes the nodes of instances order[0 .. count - 1], at groups[first] and after it; returns their number.
uint32_t make_groups(const Surfaces &surfaces, const Box *boxes, uint32_t *order, uint32_t count, uint32_t first) {
    InstanceNode &group = surfaces.groups[first];
    group = {boxes[order[0]], 0, order[0]};
    if (count == 1) return 1;
    Vec3 low = boxes[order[0]].low + boxes[order[0]].high, high = low;
    for (uint32_t i = 1; i < count; ++i) {
        const Box &box = boxes[order[i]];
        group.box = {min(group.box.low, box.low), max(group.box.high, box.high)};
        low = min(low, box.low + box.high);
        high = max(high, box.low + box.high);
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

// Calls visit(instance) for each instance whose box the ray enters before the distance end(). The nearer child of a
// node comes first. Ends when visit returns false.
template <class End, class Visit>
void for_each_instance(const Surfaces &surfaces, const Ray &ray, uint64_t &visits, End &&end, Visit &&visit) {
    if (surfaces.group_count == 0) return;
    struct Entry {
        uint32_t group;
        Real begin;
    } stack[max_group_depth];
    const auto entry = [&](uint32_t group, Entry &found) {
        Real from = Real(0), to = infinite_distance;
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
        const InstanceNode &group = surfaces.groups[top.group];
        if (group.second == 0) {
            if (!visit(surfaces.instances[group.instance])) return;
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

TriangleRay ray_in(const PlacedInstance &instance, const Ray &ray) {
    return TriangleRay(applied(instance.inverse, ray.origin - instance.origin),
                       applied(instance.inverse, ray.direction));
}

uint32_t within(uint32_t triangle, uint32_t first, uint32_t count) {
    return triangle - first < count ? triangle - first : no_triangle;
}

} // namespace

uint64_t surface_bytes(const Scene &scene, TreeKind kind) {
    uint64_t bytes = triangle_tree_bytes(kind, scene.static_count) + Arena::bytes<PlacedInstance>(scene.instance_count);
    for (uint32_t i = 0; i < scene.instance_count; ++i) bytes += triangle_tree_bytes(kind, scene.instances[i].count);
    return bytes;
}

uint64_t placement_bytes(const Scene &scene, TreeKind kind) {
    return triangle_tree_bytes(kind, scene.deforming_count) +
           Arena::bytes<InstanceNode>(2 * uint64_t{scene.instance_count}) + Arena::bytes<Box>(scene.instance_count) +
           Arena::bytes<uint32_t>(scene.instance_count);
}

Surfaces make_surfaces(const Scene &scene, TreeKind kind, Arena &arena, Watch watch) {
    Surfaces surfaces = {};
    surfaces.kind = kind;
    surfaces.instance_count = scene.instance_count;
    surfaces.static_count = scene.static_count;
    surfaces.deforming_first = scene.static_count + scene.instance_triangle_count;
    surfaces.deforming_count = scene.deforming_count;
    surfaces.ray_epsilon = to_real<Real>(scene.ray_epsilon);
    surfaces.static_tree = make_triangle_tree(kind, scene.triangles, scene.static_count, scene.materials, arena, watch);
    surfaces.instances = arena.make<PlacedInstance>(scene.instance_count);
    surfaces.ready = surfaces.static_tree.ready && surfaces.instances;
    for (uint32_t i = 0; surfaces.ready && i < scene.instance_count; ++i) {
        const Instance &source = scene.instances[i];
        PlacedInstance &instance = surfaces.instances[i];
        instance = {};
        instance.first = source.first;
        instance.count = source.count;
        instance.bounds = box_of(scene.triangles + source.first, source.count);
        instance.tree =
            make_triangle_tree(kind, scene.triangles + source.first, source.count, scene.materials, arena, watch);
        surfaces.ready = instance.tree.ready;
    }
    return surfaces;
}

void place_surfaces(const Scene &scene, Arena &arena, Surfaces &surfaces, Watch watch) {
    surfaces.deforming_tree = make_triangle_tree(surfaces.kind, scene.triangles + surfaces.deforming_first,
                                                 scene.deforming_count, scene.materials, arena, watch);
    surfaces.groups = arena.make<InstanceNode>(2 * size_t{scene.instance_count});
    surfaces.group_count = 0;
    surfaces.boxes = arena.make<Box>(scene.instance_count);
    uint32_t *order = arena.make<uint32_t>(scene.instance_count), visible = 0;
    surfaces.ready = surfaces.deforming_tree.ready && surfaces.groups && surfaces.boxes && order;
    if (!surfaces.ready) return;
    for (uint32_t i = 0; i < scene.instance_count; ++i) {
        const Instance &source = scene.instances[i];
        if (!source.visible) continue;
        PlacedInstance &instance = surfaces.instances[i];
        instance.origin = vec_of(source.origin);
        for (int k = 0; k < 3; ++k) {
            instance.axis[k] = vec_of(source.axis[k]);
            instance.inverse[k] = vec_of(source.inverse[k]);
        }
        surfaces.boxes[i] = world_box(instance);
        order[visible++] = i;
    }
    if (visible > 0) surfaces.group_count = make_groups(surfaces, surfaces.boxes, order, visible, 0);
    surfaces.triangles = scene.triangles;
    surfaces.placed = scene.instances;
    surfaces.largest = max(surfaces.static_tree.largest, surfaces.deforming_tree.largest);
    if (visible > 0) {
        const Box &all = surfaces.groups[0].box;
        surfaces.largest = max(surfaces.largest, largest(max(absolute(all.low), absolute(all.high))));
    }
}

namespace {

// Calls visit(tree, the ray in its space, its first triangle, how many, its instance or how many there are) for each
// tree that the ray may enter before the distance end().
template <class End, class Visit>
void for_each_tree(const Surfaces &surfaces, const Ray &ray, TreeCounts &counts, End &&end, Visit &&visit) {
    const TriangleRay world(ray.origin, ray.direction);
    visit(surfaces.static_tree, world, uint32_t{0}, surfaces.static_count, surfaces.instance_count);
    visit(surfaces.deforming_tree, world, surfaces.deforming_first, surfaces.deforming_count, surfaces.instance_count);
    for_each_instance(surfaces, ray, counts.node_visits, end, [&](const PlacedInstance &instance) {
        visit(instance.tree, ray_in(instance, ray), instance.first, instance.count,
              static_cast<uint32_t>(&instance - surfaces.instances));
        return true;
    });
}

// The nearest hit of all trees, each found by search(tree, ray, begin, end, ignore_triangle, hit, counts). `lowest`: no
// hit up to `beyond`, which is above 0, farther has a lower triangle, if the search says so of its tree.
template <class Search>
Hit find_nearest(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle, Real beyond,
                 uint32_t &lowest, TreeCounts &counts, Search &&search) {
    Hit hit = {false, end, Real(0), Real(0), no_triangle, surfaces.instance_count};
    lowest = no_triangle;
    const auto reach = [&] { return min(end, hit.distance + beyond); };
    for_each_tree(
        surfaces, ray, counts, reach,
        [&](const TriangleTree &tree, const TriangleRay &local, uint32_t first, uint32_t count, uint32_t instance) {
            SurfaceHit found;
            if (!search(tree, local, begin, reach(), within(ignore_triangle, first, count), found, counts)) return;
            const uint32_t triangle = first + found.triangle;
            const bool is_far = hit.distance - found.distance > beyond;
            lowest = is_far ? first + found.lowest : min(lowest, first + found.lowest);
            if (found.distance < hit.distance || (found.distance == hit.distance && triangle < hit.triangle))
                hit = {true, found.distance, found.u, found.v, triangle, instance};
        });
    return hit;
}

// A triangle in the world, as the scene has it.
WorldTriangle world_triangle(const Surfaces &surfaces, uint32_t triangle, uint32_t instance) {
    WorldTriangle corners;
    for (int i = 0; i < 3; ++i) {
        PlaneVec &p = corners.corner[i];
        p = plane_vec_of(surfaces.triangles[triangle].corner[i]);
        if (instance == surfaces.instance_count) continue;
        const Instance &placed = surfaces.placed[instance];
        p = plane_vec_of(placed.axis[0]) * p.x + plane_vec_of(placed.axis[1]) * p.y +
            plane_vec_of(placed.axis[2]) * p.z + plane_vec_of(placed.origin);
    }
    return corners;
}

// Of the hits that are at most `beyond` farther, in the plane of the nearest one, that of the lowest triangle.
Hit lowest_of_plane(const Surfaces &surfaces, const Ray &ray, Real end, uint32_t ignore_triangle, Real beyond,
                    const Hit &nearest, TreeCounts &counts) {
    const WorldTriangle plane = world_triangle(surfaces, nearest.triangle, nearest.instance);
    const PlaneReal rounding = corner_rounding(surfaces.largest);
    const Real to = min(end, nearest.distance + beyond);
    for (uint32_t from = 0;;) {
        Hit hit = nearest;
        for_each_tree(
            surfaces, ray, counts, [to] { return to; },
            [&](const TriangleTree &tree, const TriangleRay &local, uint32_t first, uint32_t count, uint32_t instance) {
                SurfaceHit found;
                if (first >= hit.triangle || first + count <= from) return;
                if (lowest_hit(tree, local, nearest.distance, to, within(ignore_triangle, first, count),
                               from > first ? from - first : 0, found, counts) &&
                    first + found.triangle < hit.triangle)
                    hit = {true, found.distance, found.u, found.v, first + found.triangle, instance};
            });
        if (hit.triangle == nearest.triangle ||
            are_coplanar(plane, world_triangle(surfaces, hit.triangle, hit.instance), rounding))
            return hit;
        from = hit.triangle + 1;
    }
}

} // namespace

Real coplanar_reach(const Surfaces &surfaces, const Ray &ray) {
    const Real reach = surfaces.largest + largest(absolute(ray.origin));
    if constexpr (std::is_same_v<Real, Fixed>) {
        return (surfaces.group_count > 0 ? Real(1) + reach : Real(1)) * Real(0x1p-20);
    } else {
        constexpr Real e = sizeof(Real) == 4 ? Real(0x1p-24) : Real(0x1p-53);
        return reach * (e * Real(0x1p14));
    }
}

Hit nearest_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                TreeCounts &counts) {
    const Real beyond = coplanar_reach(surfaces, ray);
    uint32_t lowest;
    const Hit hit = find_nearest(surfaces, ray, begin, end, ignore_triangle, beyond, lowest, counts,
                                 [beyond](auto &&...all) { return nearest_hit(all..., beyond); });
    return lowest < hit.triangle ? lowest_of_plane(surfaces, ray, end, ignore_triangle, beyond, hit, counts) : hit;
}

Hit nearest_opaque_hit(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, TreeCounts &counts) {
    uint32_t unused;
    return find_nearest(surfaces, ray, begin, end, no_triangle, coplanar_reach(surfaces, ray), unused, counts,
                        [](auto &&...all) { return nearest_opaque_hit(all...); });
}

bool is_blocked_by_static(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                          uint32_t &occluder, TreeCounts &counts) {
    return any_hit(surfaces.static_tree, TriangleRay(ray.origin, ray.direction), begin, end,
                   within(ignore_triangle, 0, surfaces.static_count), occluder, counts);
}

bool is_blocked_by_deforming(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                             TreeCounts &counts) {
    uint32_t occluder;
    return surfaces.deforming_count > 0 &&
           any_hit(surfaces.deforming_tree, TriangleRay(ray.origin, ray.direction), begin, end,
                   within(ignore_triangle, surfaces.deforming_first, surfaces.deforming_count), occluder, counts);
}

bool is_blocked_by_instance(const PlacedInstance &instance, const Ray &ray, Real begin, Real end,
                            uint32_t ignore_triangle, TreeCounts &counts) {
    uint32_t occluder;
    return any_hit(instance.tree, ray_in(instance, ray), begin, end,
                   within(ignore_triangle, instance.first, instance.count), occluder, counts);
}

bool is_blocked_by_moving(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                          TreeCounts &counts) {
    bool blocked = is_blocked_by_deforming(surfaces, ray, begin, end, ignore_triangle, counts);
    if (blocked) return true;
    for_each_instance(
        surfaces, ray, counts.node_visits, [end] { return end; },
        [&](const PlacedInstance &instance) {
            blocked = is_blocked_by_instance(instance, ray, begin, end, ignore_triangle, counts);
            return !blocked;
        });
    return blocked;
}

bool is_blocked(const Surfaces &surfaces, const Ray &ray, Real begin, Real end, uint32_t ignore_triangle,
                TreeCounts &counts) {
    uint32_t occluder;
    return is_blocked_by_static(surfaces, ray, begin, end, ignore_triangle, occluder, counts) ||
           is_blocked_by_moving(surfaces, ray, begin, end, ignore_triangle, counts);
}

} // namespace wisp::WISP_ARITH
