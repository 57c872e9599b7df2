// Lights and their photons.
#include "core/lights/light.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr Real closest = Real(0x1p-10); // a light is never nearer than this to a stretch of a ray
constexpr Real infinitely_far = Real(0x1p20);

// intensity times the mean of 1 / r^2 over the straight stretch from a to b, both relative to the light: that mean is
// angle / (distance of the line * length) = angle / |a x b|. The intensity is divided first: in fixed point 1 / r^2 of
// a distant light has no digits left.
Color mean_irradiance(const Color &intensity, const Vec3 &a, const Vec3 &b) {
    const Real near = max(length(a), closest), far = max(length(b), closest);
    const Real floor = length(b - a) * closest, area = max(length(cross(a, b)), floor), cosine = dot(a, b);
    // angle / sine for small angles: its series, where the quotient would lose its digits.
    if (area < Real(1.0 / 16) * cosine || floor == Real(0)) {
        const Real sine = area / near / far, s2 = sine * sine;
        return intensity / near / far * (Real(1) + s2 * (Real(1.0 / 6) + s2 * Real(3.0 / 40)));
    }
    return intensity / area * angle_between(area, cosine);
}

// Whether a unit vector lies in the cone about another.
bool in_cone(const Vec3 &direction, const Vec3 &axis, Real one_minus_cosine) {
    const Vec3 chord = direction - axis;
    return dot(chord, chord) <= Real(2) * one_minus_cosine;
}

// A direction inside the cone of `one_minus_cosine` about the axis, uniform in solid angle.
Vec3 direction_in_cone(const Vec3 &axis, Real one_minus_cosine, Event event) {
    const Real u = unit_open<Real>(draw(event, dimension_direction_1)) * one_minus_cosine; // 1 - cosine
    const Real sine = sqrt(max(Real(0), u * (Real(2) - u)));
    return deflect(axis, {Real(1) - u, min(sine, Real(1))}, unit_half_open<Real>(draw(event, dimension_direction_2)));
}

} // namespace

Light make_light(const LightSource &source) {
    return {source.kind, vec_of(source.position), vec_of(source.direction), to_real<Real>(source.one_minus_cosine),
            vec_of(source.color)};
}

Light *make_lights(const Scene &scene, Arena &arena) {
    Light *lights = arena.make<Light>(scene.light_count);
    for (uint32_t i = 0; lights && i < scene.light_count; ++i) lights[i] = make_light(scene.lights[i]);
    return lights;
}

Illumination illuminate(const Light &light, const Vec3 &x, const Vec3 &a, const Vec3 &b) {
    if (light.kind == LightKind::parallel) return {light.direction, infinitely_far, light.color};
    const Vec3 from_light = x - light.position;
    const Real distance = length(from_light);
    // At the light itself any direction will do; the floor keeps the irradiance finite.
    const Vec3 direction = distance > Real(0) ? from_light / distance : Vec3(Real(0), Real(0), Real(1));
    if (light.kind == LightKind::constant) return {direction, distance, light.color};
    if (light.kind == LightKind::spot && !in_cone(direction, light.direction, light.one_minus_cosine))
        return {direction, distance, Color(Real(0))};
    return {direction, distance, mean_irradiance(light.color, a - light.position, b - light.position)};
}

Emitter make_emitter(const Light &light, const Sphere &smoke) {
    Emitter emitter = {};
    emitter.light = &light;
    const Real brightest = largest(light.color);
    if (!(brightest > Real(0)) || !(smoke.radius > Real(0))) return emitter;
    emitter.photon_color = light.color / brightest;
    if (light.kind == LightKind::parallel) { // a disc across the light that shades the sphere
        emitter.power = light.color * (pi<Real> * smoke.radius * smoke.radius);
        return emitter;
    }
    // The cone that holds the sphere, or the spot's own where that is narrower; the whole sphere of directions from
    // inside the smoke.
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
    if (light.kind == LightKind::constant) { // E d^2 at the first collision, so at most this
        const Real farthest = distance + smoke.radius;
        emitter.reach_squared = farthest * farthest;
        emitter.power = emitter.power * emitter.reach_squared;
    }
    return emitter;
}

Photon emit(const Emitter &emitter, const Sphere &smoke, Event event) {
    const Light &light = *emitter.light;
    if (light.kind == LightKind::parallel) {
        const Real radius = smoke.radius * sqrt(unit_open<Real>(draw(event, dimension_position_1)));
        const Vec3 across =
            deflect(light.direction, {Real(0), Real(1)}, unit_half_open<Real>(draw(event, dimension_position_2)));
        const Vec3 start = smoke.center + across * radius - light.direction * smoke.radius;
        return {{start, light.direction}, emitter.photon_color, true};
    }
    const Vec3 direction = direction_in_cone(emitter.axis, emitter.one_minus_cosine, event);
    const bool leaves = light.kind != LightKind::spot || in_cone(direction, light.direction, light.one_minus_cosine);
    return {{light.position, direction}, emitter.photon_color, leaves};
}

} // namespace wisp::WISP_ARITH
