#include "host/prepare/core_units.h"
#include "core/numbers/elementary.h"
#include "core/smoke/grid_samples.h"
#include <cmath>
#include <iterator>
#include <tuple>

namespace wisp {

void sort_canonically(Particle *begin, Particle *end) {
    std::sort(begin, end, [](const Particle &a, const Particle &b) {
        return std::make_tuple(a.position.x, a.position.y, a.position.z, a.h, a.area) <
               std::make_tuple(b.position.x, b.position.y, b.position.z, b.h, b.area);
    });
}

double step_length(const GridDescription &grid) {
    if (!grid.density) return std::min({grid.half.x, grid.half.y, grid.half.z}) * 0.1;
    return 2 * std::min({grid.half.x / grid.nx, grid.half.y / grid.ny, grid.half.z / grid.nz});
}

Double3 aligned_half(const GridDescription &grid) {
    const Double3 *a = grid.axis, &h = grid.half;
    return {std::fabs(a[0].x) * h.x + std::fabs(a[1].x) * h.y + std::fabs(a[2].x) * h.z,
            std::fabs(a[0].y) * h.x + std::fabs(a[1].y) * h.y + std::fabs(a[2].y) * h.z,
            std::fabs(a[0].z) * h.x + std::fabs(a[1].z) * h.y + std::fabs(a[2].z) * h.z};
}

SmokeExtent extent_of(const Particle *particles, size_t count, const SmokeDescription &smoke) {
    SmokeExtent extent;
    for (size_t i = 0; i < count; ++i) extent.add(particles[i].position, particles[i].h);
    if (!smoke.is_grid()) return extent;
    const Double3 half = aligned_half(smoke.grid);
    for (const Double3 &corner : {smoke.grid.center - half, smoke.grid.center + half})
        extent.add(corner, step_length(smoke.grid));
    return extent;
}

void normalize(SmokeDescription &source, Particle *particles, size_t count, float *densities, const Unit &unit) {
    const double scale = unit.scale;
    for (Particle *p = particles; p < particles + count; ++p) {
        p->position = (p->position - unit.center) * scale;
        p->h *= scale;
        p->area *= scale * scale;
        source.smallest_h = source.largest_h == 0 ? p->h : std::min(source.smallest_h, p->h);
        source.largest_h = std::max(source.largest_h, p->h);
        source.total_area += p->area;
    }
    source.particles = particles;
    source.count = static_cast<uint32_t>(count);
    if (!source.is_grid()) return;
    GridDescription &grid = source.grid;
    grid.center = (grid.center - unit.center) * scale;
    grid.half = grid.half * scale;
    grid.extinction /= scale;
    const uint64_t samples = densities ? stored_samples(grid) : 0;
    float densest = 0;
    for (uint64_t i = 0; i < samples; ++i) densest = std::max(densest, densities[i]);
    if (densest > 0) {
        const int e = exponent_of(static_cast<double>(densest));
        for (uint64_t i = 0; i < samples; ++i) densities[i] = std::ldexp(densities[i], -e);
        grid.extinction = std::ldexp(grid.extinction, e);
    }
    source.smallest_h = source.largest_h = step_length(grid);
    double sum = grid.density ? 0 : 1;
    for (uint64_t i = 0; i < samples; ++i) sum += static_cast<double>(densities[i]);
    // The integral of a sample's trilinear tent is the volume of a cell.
    source.total_area = grid.extinction * sum *
                        (8 * grid.half.x * grid.half.y * grid.half.z / static_cast<double>(samples_of_box(grid)));
}

Unit unit_of_smoke(const SmokeExtent &all) {
    return {(all.low + all.high) * 0.5, std::ldexp(1.0, -exponent_of(all.smallest_h))};
}

Unit unit_of_surfaces(const Double3 &center, double reach, double farthest) {
    constexpr int size_exponent = 10, least_exponent = 4, reach_exponent = 12;
    if (!(reach > 0)) return {center, 1};
    const int size = exponent_of(reach), far = exponent_of(std::max(farthest, reach));
    return {center,
            std::ldexp(1.0, std::max(std::min(size_exponent, reach_exponent - far + size), least_exponent) - size)};
}

double scale_of(const SmokeExtent &all, const Unit &own, bool beside_surfaces, double surfaces) {
    // As far as surfaces make room for a unit in which thin smoke keeps its digits in fixed point.
    constexpr double room_size = 0x1p4;
    double scale = own.scale;
    for (const double reach = reach_of(all, own.center); reach * scale > coordinate_limit;) scale *= 0.5;
    if (!beside_surfaces) return scale;
    const auto keeps_all = [&](double of) { return keeps_surfaces(surfaces, of) && all.smallest_h * of >= least_h; };
    while (all.smallest_h * scale >= 2 && surfaces * 0.5 * scale >= room_size) scale *= 0.5;
    while (all.largest_h * scale > most_h && keeps_all(0.5 * scale)) scale *= 0.5;
    return scale;
}

Camera make_camera(const Double3 &from, const Double3 &at, const Double3 &upward, double angle, int width, int height,
                   const Unit &space) {
    double sine, cosine;
    sincos_turns(angle / 720, sine, cosine);
    const double pixel = 2 * sine / cosine / std::max(height - 1, 1);
    const Double3 forward = unit(at - from), right = unit(cross(forward, upward)), up = cross(right, forward);
    Camera camera;
    camera.origin = (from - space.center) * space.scale;
    camera.right = right * pixel;
    camera.down = up * -pixel;
    camera.corner = forward - camera.right * (0.5 * width) - camera.down * (0.5 * height);
    return camera;
}

LightSource make_light(LightKind kind, const Double3 &position, const Double3 &direction, double degrees,
                       const Double3 &color, const Unit &space) {
    LightSource light = {kind, (position - space.center) * space.scale, {0, 0, 1}, 2, color};
    if (kind == LightKind::spot || kind == LightKind::parallel) light.direction = unit(direction);
    if (kind == LightKind::spot) {
        double sine, cosine; // 1 - cos x = 2 sin^2(x / 2), x half of the cone's angle
        sincos_turns(degrees / 1440, sine, cosine);
        light.one_minus_cosine = 2 * sine * sine;
    }
    if (kind == LightKind::point || kind == LightKind::spot) light.color = color * (space.scale * space.scale);
    return light;
}

double radius_of(const SmokeExtent &smoke, bool beside_surfaces, double surfaces, const Unit &unit) {
    if (!smoke.any()) return beside_surfaces ? surfaces : 0;
    if (!beside_surfaces) return (0.5 * length(smoke.high - smoke.low) + 2 * smoke.largest_h) * unit.scale;
    return std::max(
        {surfaces, length(smoke.low - unit.center) * unit.scale, length(smoke.high - unit.center) * unit.scale});
}

namespace {

// The largest irradiance of the light in the ball of `radius` around the origin. Distances below half the radius count
// as that.
double brightness(const LightSource &light, double radius) {
    const double color = largest(light.color);
    if (light.kind == LightKind::parallel || light.kind == LightKind::constant) return color;
    const double distance = std::max(length(light.position) - radius, std::max(radius, 1.0) * 0.5);
    return color / (distance * distance);
}

} // namespace

double dim_radiances(Scene &scene, LightSource *lights, SmokeDescription *smokes, const Double3 *ambient,
                     double radius) {
    double brightest = std::max(largest(scene.background), 0.0);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) brightest = std::max(brightest, largest(smokes[i].emission));
    if (ambient) brightest = std::max(brightest, largest(*ambient));
    for (uint32_t i = 0; i < scene.light_count; ++i) brightest = std::max(brightest, brightness(lights[i], radius));
    scene.radiance_exponent = brightest > 0 ? exponent_of(brightest) + 1 : 0;
    const double dim = std::ldexp(1.0, -scene.radiance_exponent);
    scene.background = scene.background * dim;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) smokes[i].emission = smokes[i].emission * dim;
    for (uint32_t i = 0; i < scene.light_count; ++i) lights[i].color = lights[i].color * dim;
    return dim;
}

void normalize(Triangle &triangle, const Unit &space) {
    for (Double3 &corner : triangle.corner) corner = (corner - space.center) * space.scale;
}

void set_normals(Triangle &triangle, const Double3 (&normals)[3]) {
    const bool all =
        std::all_of(std::begin(normals), std::end(normals), [](const Double3 &n) { return largest_component(n) > 0; });
    for (size_t i = 0; i < 3; ++i) triangle.normal[i] = all ? unit(normals[i]) : Double3{0, 0, 0};
}

Unit space_of(const Instance &instance, const Extent &own, const Unit &world) {
    double size = 0; // of the instance's unit of length, in the world
    for (const Double3 &axis : instance.axis) size = std::max(size, length(axis));
    Unit space = {own.middle(), size > 0 ? world.scale * std::ldexp(1.0, exponent_of(size)) : world.scale};
    // An instance that is flattened may be far larger in its own space than in the world.
    const double reach = largest_component(own.high - space.center);
    if (reach * space.scale > coordinate_limit)
        space.scale = std::ldexp(1.0, exponent_of(coordinate_limit) - 1 - exponent_of(reach));
    return space;
}

bool has_inverse(const Double3 (&axis)[3]) {
    const double scale = length(axis[0]) * length(axis[1]) * length(axis[2]);
    return std::fabs(dot(axis[0], cross(axis[1], axis[2]))) > 1e-12 * scale;
}

void normalize(Instance &instance, const Unit &space, const Unit &world) {
    instance.origin = (transformed_point(instance, space.center) - world.center) * world.scale;
    for (Double3 &axis : instance.axis) axis = axis * (world.scale / space.scale);
    const Double3 *a = instance.axis, yz = cross(a[1], a[2]), zx = cross(a[2], a[0]), xy = cross(a[0], a[1]);
    const double volume = dot(a[0], yz);
    instance.mirrored = volume < 0;
    // The rows of the inverse are x, y and z; Instance has its columns.
    const Double3 x = yz * (1 / volume), y = zx * (1 / volume), z = xy * (1 / volume);
    instance.inverse[0] = {x.x, y.x, z.x};
    instance.inverse[1] = {x.y, y.y, z.y};
    instance.inverse[2] = {x.z, y.z, z.z};
}

Material make_material(const Material &of_scene, const Double3 &ambient, double dim) {
    Material material = of_scene;
    const Double3 &a = of_scene.ambient;
    material.ambient = Double3{a.x * ambient.x, a.y * ambient.y, a.z * ambient.z} * dim;
    if (!(material.index > 0)) material.index = 1;
    return material;
}

namespace {

// Of what is no smoke. Corners are within coordinate_limit already.
const char *fault_of_surfaces(const Scene &scene, bool fixed, LightChoice lights) {
    const double farthest = fixed ? 0x1p13 : 0x1p18;
    if (!(largest_component(scene.camera.origin) <= farthest))
        return fixed ? "the camera is too far from the surfaces for fixed point; f32 has room for 32 times as far"
                     : "the camera is too far from the surfaces";
    if (fixed && length(scene.camera.corner) > 0x1p15) return "the view is too wide for fixed point";
    double sum = 0;
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const LightSource &light = scene.lights[i];
        if (light.kind != LightKind::parallel && !(largest_component(light.position) <= farthest))
            return fixed ? "a light is too far from the surfaces for fixed point; f32 has room for 32 times as far"
                         : "a light is too far from the surfaces; a parallel light has no distance";
        if (fixed && largest(light.color) > 0x1p30) return "a light is too strong for fixed point";
        sum += largest(light.color);
    }
    if (fixed && lights == LightChoice::cuts && sum > 0x1p30)
        return "the lights together are too strong for cuts in fixed point";
    if (scene.radiance_exponent > 120) return "it is too bright for a picture of 32-bit numbers";
    if (!fixed) return nullptr;
    for (uint32_t i = 0; i < scene.instance_count; ++i) {
        const Instance &instance = scene.instances[i];
        double largest_stretch = 0;
        for (int k = 0; instance.visible && k < 3; ++k)
            largest_stretch = std::max(
                {largest_stretch, largest_component(instance.axis[k]), largest_component(instance.inverse[k])});
        if (largest_stretch > 0x1p11) return "something is stretched more than 2048 times, too much for fixed point";
    }
    for (uint32_t i = 0; i < scene.material_count; ++i) {
        const Material &m = scene.materials[i];
        if (std::max({largest(m.ambient), largest(m.diffuse), largest(m.specular)}) > 4)
            return "a material is brighter than 4, too much for fixed point";
    }
    return nullptr;
}

// Of one smoke. Adds its power to `power`, and extends `radius` to it.
const char *fault_of_smoke(const SmokeDescription &smoke, bool beside_surfaces, Arithmetic arithmetic,
                           double gather_radius, double &radius, double &power) {
    const bool fixed = arithmetic == Arithmetic::fixed;
    for (const Particle *p = smoke.particles; p < smoke.particles + smoke.count; ++p) {
        radius = std::max(radius, length(p->position) + 2 * p->h);
        if (!(p->area <= (fixed ? 0x1p20 : 1e30) * p->h * p->h))
            return "a particle's optical depth is too large for this arithmetic";
    }
    const GridDescription &grid = smoke.grid;
    if (smoke.is_grid()) {
        radius = std::max(radius, length(grid.center) + length(grid.half));
        double densest = grid.density ? 0 : 1;
        for (uint64_t i = 0; grid.density && i < stored_samples(grid); ++i)
            densest = std::max(densest, static_cast<double>(grid.density[i]));
        if (!(grid.extinction * densest <= (fixed ? 0x1p15 : 1e30)))
            return "the smoke's extinction is too large for this arithmetic";
    }
    // 1 - |g| must keep some digits, and p = (1 + |g|) / (4 pi (1 - |g|)^2) must be in range.
    const double least = fixed ? 0x1p-16 : arithmetic == Arithmetic::f32 ? 0x1p-20 : 0x1p-40;
    if (!(1 - std::fabs(smoke.asymmetry) >= least))
        return "the phase is nearer to 1 or -1 than this arithmetic can tell";
    power += 4 * 3.15 * largest(smoke.emission) * smoke.total_area;
    if (fixed && !smoke.is_grid() && smoke.total_area > 0x1p26)
        return "the smoke's cross-section is too large for fixed point";
    if (fixed && beside_surfaces && !smoke.empty() && smoke.smallest_h < least_h)
        return "a smoothing length is too fine for fixed point beside the surfaces";
    if (fixed && beside_surfaces && smoke.largest_h > most_h)
        return "a smoothing length is too coarse for fixed point beside the surfaces";
    if (fixed && smoke.largest_h * gather_radius > 0x1p14) return "the gather radius is too large for fixed point";
    return nullptr;
}

// Of a scene with smoke, which has this radius and power.
const char *fault_around_smoke(const Scene &scene, bool fixed, double radius, double power) {
    if (length(scene.camera.origin) > 0x1p18) return "the camera is more than 262144 smoothing lengths from the smoke";
    if (fixed && length(scene.camera.corner) > 0x1p15) // the longest ray before it is normalised
        return "the view is too wide for fixed point";
    double smallest_h = 0, largest_h = 0;
    for (const SmokeDescription *smoke = scene.smokes; smoke < scene.smokes + scene.smoke_count; ++smoke) {
        if (smoke->empty()) continue;
        smallest_h = smallest_h == 0 ? smoke->smallest_h : std::min(smallest_h, smoke->smallest_h);
        largest_h = std::max(largest_h, smoke->largest_h);
    }
    if (fixed && largest_h > 4096 * smallest_h)
        return "smoothing lengths differ by more than 4096, too much for fixed point";
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const LightSource &light = scene.lights[i];
        const double color = largest(light.color), d = length(light.position) + radius;
        const bool has_position = light.kind != LightKind::parallel;
        if (has_position && d > (fixed ? 0x1p14 : 0x1p18))
            return fixed ? "a light is more than 16384 smoothing lengths from the smoke, too far for this arithmetic"
                         : "a light is more than 262144 smoothing lengths from the smoke, too far for this arithmetic";
        power += color * 4 * 3.15 *
                 (light.kind == LightKind::parallel   ? radius * radius
                  : light.kind == LightKind::constant ? d * d
                                                      : 1);
        if (fixed && color > 0x1p30) return "a light is too strong for fixed point";
    }
    if (fixed && power > 0x1p30) return "the lights' power is too large for fixed point";
    return nullptr;
}

} // namespace

RangeFault find_range_fault(const Scene &scene, Arithmetic arithmetic, double gather_radius, LightChoice lights) {
    const bool fixed = arithmetic == Arithmetic::fixed;
    if (scene.triangle_count() > 0)
        if (const char *what = fault_of_surfaces(scene, fixed, lights)) return {what};
    double radius = 0, power = 0;
    bool any = false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        any = any || !scene.smokes[i].empty();
        if (const char *what =
                fault_of_smoke(scene.smokes[i], scene.triangle_count() > 0, arithmetic, gather_radius, radius, power))
            return {what, i};
    }
    if (!any) return {};
    return {fault_around_smoke(scene, fixed, radius, power)};
}

} // namespace wisp
