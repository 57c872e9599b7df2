// Where photons start, and with which power (S2).
#include "core/photons/emitter.h"

namespace wisp::WISP_ARITH {

namespace {

// A direction in a cone about the axis, uniform in solid angle.
Vec3 direction_in_cone(const Vec3 &axis, Real one_minus_cosine, Event event) {
    const Real u = unit_open<Real>(draw(event, dimension_direction_1)) * one_minus_cosine; // 1 - cosine
    const Real sine = sqrt(max(Real(0), u * (Real(2) - u)));
    return deflect(axis, {Real(1) - u, min(sine, Real(1))}, unit_half_open<Real>(draw(event, dimension_direction_2)));
}

// Chooses an emitter in proportion to its largest channel. All photons then carry the same largest channel.
const Emitter &choose(const Emitters &emitters, Event event) {
    Real rest = unit_half_open<Real>(draw(event, dimension_light)) * emitters.power;
    uint32_t i = 0;
    for (; i + 1 < emitters.count; ++i) {
        const Real power = largest(emitters.list[i].power);
        if (rest < power) break;
        rest -= power;
    }
    return emitters.list[i];
}

// Smokes far from each other are targets of their own: in the sphere around all of them photons would meet none. Each
// is a search for every photon, so they are few.
constexpr uint32_t most_targets = 8;

struct Targets {
    Sphere list[most_targets];
    uint32_t count;
};

// Around the supports of one smoke.
Sphere sphere_around(const SmokeVolume &smoke) {
    const Box &bounds = smoke.field.bounds();
    Sphere sphere = {(bounds.low + bounds.high) * Real(0.5), length(bounds.high - bounds.low) * Real(0.5)};
    if (smoke.source->is_grid()) return sphere;
    Real squared = Real(0);
    find_reach(*smoke.source, sphere.center, {}, squared);
    sphere.radius = min(sphere.radius, sqrt(squared) + Real(2) * to_real<Real>(smoke.source->largest_h));
    return sphere;
}

Sphere sphere_around(const Sphere &a, const Sphere &b) {
    const Vec3 way = b.center - a.center;
    const Real distance = length(way);
    if (distance + b.radius <= a.radius) return a;
    if (distance + a.radius <= b.radius) return b;
    const Real radius = (distance + a.radius + b.radius) * Real(0.5);
    return {a.center + way * ((radius - a.radius) / distance), radius};
}

Real area_of(const Sphere &sphere) { return sphere.radius * sphere.radius; }

// Spheres that hold all smoke, apart where that makes their areas smaller by half.
Targets find_targets(const Medium &medium) {
    const Targets one = {{medium.sphere}, 1};
    if (medium.count < 2 || medium.count > most_targets) return one;
    Targets targets = {{}, 0};
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (medium.smokes[i].source->empty()) continue;
        Sphere sphere = sphere_around(medium.smokes[i]);
        for (uint32_t k = 0; k < targets.count;) { // those that are better one
            const Sphere both = sphere_around(targets.list[k], sphere);
            if (area_of(both) > area_of(targets.list[k]) + area_of(sphere)) {
                ++k;
                continue;
            }
            sphere = both;
            targets.list[k] = targets.list[--targets.count];
            k = 0;
        }
        targets.list[targets.count++] = sphere;
    }
    Real area = Real(0);
    for (uint32_t k = 0; k < targets.count; ++k) area += area_of(targets.list[k]);
    return area * Real(2) < area_of(medium.sphere) ? targets : one;
}

// Whether all photons of a light start in the cone to one target, as where it stands in that.
bool sends_all(const Emitter &emitter) {
    const Light &light = *emitter.light;
    return light.kind != LightKind::parallel &&
           !(emitter.one_minus_cosine < (light.kind == LightKind::spot ? light.one_minus_cosine : Real(2)));
}

// Whether an emitter of the same light could have sent the photon, too.
bool sends(const Emitter &emitter, const Ray &ray) {
    if (emitter.light->kind != LightKind::parallel)
        return in_cone(ray.direction, emitter.axis, emitter.one_minus_cosine);
    const Vec3 away = cross(ray.direction, emitter.target.center - ray.origin);
    return dot(away, away) < area_of(emitter.target);
}

} // namespace

Emitter make_emitter(const Light &light, const Sphere &smoke, const Sphere &all) {
    Emitter emitter = {};
    emitter.light = &light;
    emitter.target = smoke;
    const Real brightest = largest(light.color);
    if (!(brightest > Real(0)) || !(smoke.radius > Real(0))) return emitter;
    emitter.photon_color = light.color / brightest;
    if (light.kind == LightKind::parallel) { // photons start on a disc that covers the sphere
        emitter.power = light.color * (pi<Real> * smoke.radius * smoke.radius);
        return emitter;
    }
    // Photons start in a cone of directions: all directions if the light lies in the sphere, else the cone that holds
    // the sphere; the cone of a spot if that is narrower.
    const Vec3 to_smoke = smoke.center - light.position;
    const Real distance = length(to_smoke);
    emitter.one_minus_cosine = Real(2);
    emitter.axis = Vec3(Real(0), Real(0), Real(1));
    if (distance > smoke.radius) {
        const Real sine = smoke.radius / distance, s2 = sine * sine;
        emitter.one_minus_cosine = s2 / (Real(1) + sqrt(max(Real(0), Real(1) - s2)));
        emitter.axis = to_smoke / distance;
    }
    if (light.kind == LightKind::spot && light.one_minus_cosine < emitter.one_minus_cosine) {
        emitter.one_minus_cosine = light.one_minus_cosine;
        emitter.axis = light.direction;
    }
    const Real solid_angle = two_pi<Real> * emitter.one_minus_cosine;
    emitter.power = light.color * solid_angle;
    if (light.kind == LightKind::constant) { // a photon carries E d^2 of its first collision: here of the largest d
        const Real farthest = length(all.center - light.position) + all.radius;
        emitter.reach_squared = farthest * farthest;
        emitter.power = emitter.power * emitter.reach_squared;
    }
    return emitter;
}

Photon emit(const Emitter &emitter, const Sphere &all, Event event) {
    const Light &light = *emitter.light;
    if (light.kind == LightKind::parallel) {
        const Sphere &target = emitter.target;
        const Real radius = target.radius * sqrt(unit_open<Real>(draw(event, dimension_position_1)));
        const Vec3 across =
            deflect(light.direction, {Real(0), Real(1)}, unit_half_open<Real>(draw(event, dimension_position_2)));
        const Real back = all.radius - dot(all.center - target.center, light.direction);
        const Vec3 start = target.center + across * radius - light.direction * back;
        return {{start, light.direction}, emitter.photon_color, true};
    }
    const Vec3 direction = direction_in_cone(emitter.axis, emitter.one_minus_cosine, event);
    const bool emitted = light.kind != LightKind::spot || in_cone(direction, light.direction, light.one_minus_cosine);
    return {{light.position, direction}, emitter.photon_color, emitted};
}

Photon emit_from_smoke(const SmokeVolume &smoke, const Color &photon_color, Event event) {
    // Choose a particle or sample by its fraction of the density's integral, then a point of its kernel or tent.
    const uint32_t target = draw(event, dimension_position_1);
    uint32_t low = 0, high = elements_of(*smoke.source);
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        (smoke.area_fraction_before[middle] <= target ? low : high) = middle;
    }
    const Phase uniform = Phase(Real(0));
    const Vec3 up(Real(0), Real(0), Real(1));
    const Vec3 direction = deflect(up, uniform.sample(unit_open<Real>(draw(event, dimension_direction_1))),
                                   unit_half_open<Real>(draw(event, dimension_direction_2)));
    if (smoke.source->is_grid()) {
        const Vec3 xi(unit_open<Real>(draw(event, dimension_position_2)),
                      unit_open<Real>(draw(event, dimension_radius)), unit_open<Real>(draw(event, dimension_azimuth)));
        return {{point_of_sample(smoke.field.grid, low, xi), direction}, photon_color, true};
    }
    const Particle &particle = smoke.source->particles[low];
    const Real xi = unit_open<Real>(draw(event, dimension_radius));
    const Real radius = with_kernel(smoke.source->kernel, [&](const auto &kernel) { // the h of poly6 is 2 H
        return (Real(2) / kernel.support) * kernel.radius_of_fraction(xi) * to_real<Real>(particle.h);
    });
    const Vec3 outward = deflect(up, uniform.sample(unit_open<Real>(draw(event, dimension_position_2))),
                                 unit_half_open<Real>(draw(event, dimension_azimuth)));
    return {{vec_of(particle.position) + outward * radius, direction}, photon_color, true};
}

Emitters find_emitters(const Medium &medium, const Light *lights, uint32_t light_count, Arena &arena) {
    const Targets targets = find_targets(medium);
    Emitters emitters = {arena.make<Emitter>(light_count * targets.count + medium.count), 0, Real(0)};
    if (!emitters.list) return emitters;
    const auto add = [&](const Emitter &emitter) {
        if (!(largest(emitter.power) > Real(0))) return;
        emitters.list[emitters.count++] = emitter;
        emitters.power += largest(emitter.power);
    };
    for (uint32_t i = 0; i < light_count; ++i) {
        const uint32_t first = emitters.count;
        const Real before = emitters.power;
        for (uint32_t k = 0; k < targets.count; ++k) {
            Emitter emitter = make_emitter(lights[i], targets.list[k], medium.sphere);
            if (sends_all(emitter)) { // and the light to the other targets, too
                emitters.count = first;
                emitters.power = before;
                add(emitter);
                break;
            }
            emitter.earlier = emitters.count - first;
            add(emitter);
        }
    }
    for (uint32_t i = 0; i < medium.count; ++i) {
        const Color power = medium.smokes[i].emitted_power;
        if (!(largest(power) > Real(0))) continue;
        Emitter emitter = {};
        emitter.smoke = i;
        emitter.power = power;
        emitter.photon_color = power / largest(power);
        add(emitter);
    }
    return emitters;
}

Emission emit_photon(const Medium &medium, const Emitters &emitters, uint64_t key) {
    const Event event = photon_event(key, 0);
    const Emitter &emitter = choose(emitters, event);
    if (!emitter.light) return {emit_from_smoke(medium.smokes[emitter.smoke], emitter.photon_color, event), &emitter};
    Photon photon = emit(emitter, medium.sphere, event);
    for (uint32_t k = 1; k <= emitter.earlier; ++k)
        photon.emitted &= !sends((&emitter)[-static_cast<int32_t>(k)], photon.ray);
    return {photon, &emitter};
}

uint64_t emitter_bytes(const Scene &scene) {
    return Arena::bytes<Emitter>(uint64_t{scene.light_count} * min(max(scene.smoke_count, 1u), most_targets) +
                                 scene.smoke_count);
}

} // namespace wisp::WISP_ARITH
