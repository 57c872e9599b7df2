// Rasters of instances, and lists of the static triangles before them.
#include "core/shadows/box_shaft.h"
#include "core/shadows/instance_shadows.h"
#include <algorithm>
#include <utility>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t max_raster_lights = 32;        // lights with rasters
constexpr uint32_t max_instance_lights = 1 << 16; // entries, of whole lights
constexpr uint32_t finest_side = 32, sides = 6;
constexpr uint32_t max_steps = 24; // of an instance in a light's rasters, on average; 6 suffice for sides of one step
constexpr uint8_t rays_before_shaft = 16;
constexpr Real box_margin = Real(1.0 / 32), step_margin = Real(1.0 / 16); // as derived in the header
constexpr Real min_width = Real(1.0 / 256);                               // of a raster

uint32_t raster_lights_of(const Scene &scene) {
    return scene.instance_count ? std::min(scene.light_count, max_raster_lights) : 0;
}
uint32_t instance_lights_of(const Scene &scene) {
    return scene.instance_count ? std::min(scene.light_count, max_instance_lights / scene.instance_count) : 0;
}

struct Axes {
    int a, b, c;
};
Axes axes_from(uint32_t first) {
    const int a = static_cast<int>(first);
    const int b = a == 2 ? 0 : a + 1;
    return {a, b, b == 2 ? 0 : b + 1};
}

struct Rectangle {
    Real low[2], high[2];

    void add(const Rectangle &r) {
        for (int i = 0; i < 2; ++i) {
            low[i] = min(low[i], r.low[i]);
            high[i] = max(high[i], r.high[i]);
        }
    }
};

Real quotient(Real x, Real a) { return x >= a ? Real(1) : x <= -a ? Real(-1) : x / a; } // clamped; a >= 0

// The rectangle of a box on a side of the light's cube; false: the box is not seen there.
bool rectangle_on_side(const Light &light, uint32_t side, const Box &box, Rectangle &rectangle) {
    const Axes axes = axes_from(side / 2);
    Vec3 low = box.low - light.position - Vec3(box_margin), high = box.high - light.position + Vec3(box_margin);
    if (side % 2 == 1) std::swap(low, high), low = -low, high = -high;
    const int across[2] = {axes.b, axes.c};
    Real near = low[axes.a];
    const Real far = high[axes.a];
    for (const int i : across) near = max(near, max(low[i], -high[i])); // |p.b|, |p.c| <= p.a
    near = max(near, Real(0));
    if (far < near || far == Real(0)) return false;
    for (int i = 0; i < 2; ++i) {
        const Real from = low[across[i]], to = high[across[i]];
        rectangle.low[i] = quotient(from, from < Real(0) ? near : far);
        rectangle.high[i] = quotient(to, to > Real(0) ? near : far);
    }
    return true;
}

// The coordinates of p in the plane across a parallel light's largest coordinate.
void place_in_plane(const Vec3 &direction, const Axes &axes, const Vec3 &p, Real (&place)[2]) {
    place[0] = p[axes.b] - p[axes.a] * (direction[axes.b] / direction[axes.a]);
    place[1] = p[axes.c] - p[axes.a] * (direction[axes.c] / direction[axes.a]);
}
Rectangle rectangle_in_plane(const Light &light, const Box &box) {
    const Axes axes = axes_from(largest_axis(light.direction));
    const Box wider = {box.low - Vec3(box_margin), box.high + Vec3(box_margin)};
    Rectangle all = {};
    for (uint32_t i = 0; i < 8; ++i) {
        Rectangle here;
        place_in_plane(light.direction, axes, corner_of(wider, i), here.low);
        std::copy(here.low, here.low + 2, here.high);
        if (i == 0) all = here;
        all.add(here);
    }
    return all;
}

bool rectangle_of(const Light &light, uint32_t side, const Box &box, Rectangle &rectangle) {
    if (light.kind != LightKind::parallel) return rectangle_on_side(light, side, box, rectangle);
    if (side == 0) rectangle = rectangle_in_plane(light, box);
    return side == 0;
}

// A range of steps, first to last, of the raster's two coordinates.
struct Steps {
    int32_t first[2], last[2];

    uint32_t count() const { return static_cast<uint32_t>((last[0] - first[0] + 1) * (last[1] - first[1] + 1)); }
};
Steps steps_of(const LightRaster &raster, const Rectangle &rectangle) {
    const int32_t end = static_cast<int32_t>(raster.side) - 1;
    Steps steps;
    for (int i = 0; i < 2; ++i) {
        const Real from = (rectangle.low[i] - raster.low[i]) * raster.steps[i],
                   to = (rectangle.high[i] - raster.low[i]) * raster.steps[i];
        steps.first[i] = min(max(floor_to_int(from - step_margin), 0), end);
        steps.last[i] = min(max(floor_to_int(to + step_margin), 0), end);
    }
    return steps;
}

// Calls visit(group, rectangle) for the instances that are seen on the side.
template <class Visit>
void for_each_rectangle(const Surfaces &surfaces, const Light &light, uint32_t side, Visit &&visit) {
    Rectangle rectangle;
    for (uint32_t g = surfaces.group_count; g-- > 0;)
        if (surfaces.groups[g].second == 0 && rectangle_of(light, side, surfaces.groups[g].box, rectangle))
            visit(g, rectangle);
}

// The light's rasters, as fine as `room` for their instances allows. Returns how much of it they use.
uint32_t make_rasters(const Surfaces &surfaces, const Light &light, LightRaster *rasters, uint32_t *groups,
                      uint32_t begin, uint32_t room) {
    Rectangle all[sides] = {};
    for (uint32_t s = 0; s < sides; ++s) {
        rasters[s].side = 0;
        for_each_rectangle(surfaces, light, s, [&](uint32_t, const Rectangle &r) {
            if (rasters[s].side == 0) all[s] = r;
            rasters[s].side = finest_side;
            all[s].add(r);
        });
    }
    for (uint32_t finest = finest_side;; finest /= 2) {
        uint32_t used = 0;
        for (uint32_t s = 0; s < sides; ++s) {
            LightRaster &raster = rasters[s];
            if (raster.side == 0) continue;
            raster.side = finest;
            for (int i = 0; i < 2; ++i) {
                raster.low[i] = all[s].low[i];
                raster.steps[i] = Real(static_cast<int32_t>(finest)) / max(all[s].high[i] - all[s].low[i], min_width);
            }
            for_each_rectangle(surfaces, light, s,
                               [&](uint32_t, const Rectangle &r) { used += steps_of(raster, r).count(); });
        }
        if (used <= room) break;
    }
    uint32_t end = begin;
    for (uint32_t s = 0; s < sides; ++s) { // counted, added up to where each ends, and filled backwards
        LightRaster &raster = rasters[s];
        const uint32_t steps = raster.side * raster.side;
        const auto for_each_step = [&](auto &&visit) {
            for_each_rectangle(surfaces, light, s, [&](uint32_t group, const Rectangle &r) {
                const Steps at = steps_of(raster, r);
                for (int32_t y = at.first[1]; y <= at.last[1]; ++y)
                    for (int32_t x = at.first[0]; x <= at.last[0]; ++x)
                        visit(raster.starts[static_cast<uint32_t>(y) * raster.side + static_cast<uint32_t>(x)], group);
            });
        };
        std::fill(raster.starts, raster.starts + steps + 1, 0u);
        for_each_step([](uint32_t &count, uint32_t) { ++count; });
        for (uint32_t i = 0; i < steps; ++i) raster.starts[i] = end += raster.starts[i];
        raster.starts[steps] = end;
        for_each_step([groups](uint32_t &start, uint32_t group) { groups[--start] = group; });
    }
    return end - begin;
}

// The start of a query's step in its raster; nullptr: no instance is seen there.
const uint32_t *find_step(const InstanceShadows &instances, const Light &light, const ShadowQuery &query) {
    const Vec3 &d = query.ray.direction; // the light sees the point along -d
    const bool parallel = light.kind == LightKind::parallel;
    const Axes axes = axes_from(largest_axis(parallel ? light.direction : d));
    const uint32_t side = parallel ? 0 : 2 * static_cast<uint32_t>(axes.a) + (d[axes.a] > Real(0) ? 1 : 0);
    const LightRaster &raster = instances.rasters[query.light * sides + side];
    if (raster.side == 0) return nullptr;
    Real place[2] = {d[axes.b] / d[axes.a], d[axes.c] / d[axes.a]};
    if (parallel) place_in_plane(light.direction, axes, query.ray.origin, place);
    int32_t step[2];
    const int32_t end = static_cast<int32_t>(raster.side);
    for (int i = 0; i < 2; ++i) {
        const Real at = (place[i] - raster.low[i]) * raster.steps[i];
        if (at < -step_margin || at > Real(end) + step_margin) return nullptr;
        step[i] = min(max(floor_to_int(at), 0), end - 1);
    }
    return raster.starts + static_cast<uint32_t>(step[1] * end + step[0]);
}

// Lists the static triangles between the query's instance and light, if they are few.
void list_blockers(InstanceLight &instance, const Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    const Light &light = shadows.lights[query.light];
    const Box &box = surfaces.boxes[query.instance];
    Real farthest = Real(0);
    for (int a = 0; a < 3; ++a) farthest = max(farthest, max(abs(box.low[a]), abs(box.high[a])));
    const ShaftLattice lattice = make_shaft_lattice(
        surfaces, std::max(light_exponent(surfaces.static_tree, light), exponent_for(surfaces.static_tree, farthest)));
    LatticeBounds bounds = {lattice_point(box.low, lattice.exponent), lattice_point(box.high, lattice.exponent)};
    for (int64_t &x : bounds.high.x) ++x;
    uint32_t count;
    if (find_blockers(shadows, lattice, BoxShaft(lattice, bounds, light), max_listed, instance.blocker, count))
        instance.blocker_count = static_cast<uint8_t>(count);
}

} // namespace

uint64_t instance_shadow_bytes(const Scene &scene) {
    const uint64_t lights = raster_lights_of(scene), rasters = lights * sides;
    return Arena::bytes<LightRaster>(rasters) + Arena::bytes<uint32_t>(rasters * (finest_side * finest_side + 1)) +
           Arena::bytes<uint32_t>(lights * scene.instance_count * max_steps) +
           Arena::bytes<InstanceLight>(uint64_t{instance_lights_of(scene)} * scene.instance_count);
}

InstanceShadows make_instance_shadows(const Shadows &shadows, Arena &arena) {
    const Scene &scene = *shadows.scene;
    InstanceShadows instances = {};
    instances.raster_lights = raster_lights_of(scene);
    instances.light_count = instance_lights_of(scene);
    const size_t rasters = size_t{instances.raster_lights} * sides,
                 entries = size_t{instances.light_count} * scene.instance_count;
    constexpr uint32_t starts_of_raster = finest_side * finest_side + 1;
    const uint32_t room = scene.instance_count * max_steps;
    instances.rasters = arena.make<LightRaster>(rasters);
    uint32_t *starts = arena.make<uint32_t>(rasters * starts_of_raster);
    instances.groups = arena.make<uint32_t>(size_t{instances.raster_lights} * room);
    instances.lights = arena.make<InstanceLight>(entries);
    instances.ready = instances.rasters && starts && instances.groups && instances.lights;
    if (!instances.ready) return instances;
    for (size_t i = 0; i < rasters; ++i) instances.rasters[i].starts = starts + i * starts_of_raster;
    uint32_t used = 0;
    for (uint32_t l = 0; l < instances.raster_lights && shadows.watch.go_on(scene.instance_count); ++l)
        used += make_rasters(*shadows.surfaces, shadows.lights[l], instances.rasters + size_t{l} * sides,
                             instances.groups, used, room);
    for (size_t i = 0; i < entries; ++i) {
        instances.lights[i].blocker_count = InstanceLight::not_listed;
        instances.lights[i].rays = 0;
    }
    return instances;
}

InstanceLight *find_instance_light(InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query) {
    const uint32_t instance_count = shadows.surfaces->instance_count;
    if (query.light >= instances.light_count || query.instance >= instance_count) return nullptr;
    InstanceLight &instance = instances.lights[size_t{query.light} * instance_count + query.instance];
    if (instance.rays < rays_before_shaft && ++instance.rays == rays_before_shaft)
        list_blockers(instance, shadows, query);
    return &instance;
}

bool is_blocked_by_listed(const InstanceLight &instance, const Shadows &shadows, const ShadowQuery &query) {
    const TriangleRay ray(query.ray.origin, query.ray.direction);
    for (uint32_t i = 0; i < instance.blocker_count; ++i) {
        ++shadows.statistics->shadow.extra_tests;
        if (intersects(*shadows.scene, instance.blocker[i], ray, query.begin, query.end)) return true;
    }
    return false;
}

bool is_blocked_by_moving(const InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query,
                          bool &tested) {
    const Surfaces &surfaces = *shadows.surfaces;
    TreeCounts &counts = shadows.statistics->shadow.traced;
    tested = surfaces.deforming_count > 0;
    if (query.light >= instances.raster_lights) {
        tested = tested || surfaces.group_count > 0;
        return is_blocked_by_moving(shadows, query);
    }
    if (is_blocked_by_deforming(surfaces, query.ray, query.begin, query.end, query.triangle, counts)) return true;
    const uint32_t *step = find_step(instances, shadows.lights[query.light], query);
    if (!step) return false;
    tested = tested || step[0] < step[1];
    for (uint32_t i = step[0]; i < step[1]; ++i) {
        const InstanceNode &group = surfaces.groups[instances.groups[i]];
        Real begin = Real(0), end = query.end;
        ++counts.node_visits;
        if (clip(group.box, query.ray, begin, end) &&
            is_blocked_by_instance(surfaces.instances[group.instance], query.ray, query.begin, query.end,
                                   query.triangle, counts))
            return true;
    }
    return false;
}

} // namespace wisp::WISP_ARITH
