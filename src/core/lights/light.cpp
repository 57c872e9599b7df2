// The irradiance of lights, and its mean over a segment of a ray (README, Equi-angular mean).
#include "core/lights/light.h"
#include "core/geometry/ray.h"
#include "core/lights/least_distance.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr Real min_distance = Real(least_light_distance);
constexpr Real parallel_distance = Real(0x1p20); // from any point to a parallel light

// The intensity times the mean of 1/r^2 over the segment from a to b; both points are relative to the light. The mean
// is angle / (distance of the line * length) = angle / |a x b|, where the angle is that between a and b. The code
// divides the intensity first: in fixed point, 1/r^2 of a distant light has no digits left.
Color mean_irradiance(const Color &intensity, const Vec3 &a, const Vec3 &b) {
    const Real near = max(length(a), min_distance), far = max(length(b), min_distance);
    const Real floor = length(b - a) * min_distance, area = max(length(cross(a, b)), floor), cosine = dot(a, b);
    // For small angles, angle / sine by its series: the quotient would lose its digits.
    if (area < Real(1.0 / 16) * cosine || floor == Real(0)) {
        const Real sine = area / near / far, s2 = sine * sine;
        return intensity / near / far * (Real(1) + s2 * (Real(1.0 / 6) + s2 * Real(3.0 / 40)));
    }
    return intensity / area * angle_between(area, cosine);
}

// Where the segment from a to b, both relative to a spot, lies in its cone: from a fraction `from` to a fraction `to`
// of its length. False: nowhere. The half angle is below a quarter turn. In the cone the part p.n along the axis n is
// above 0, and sin^2 (p.n)^2 - cos^2 |p - n (p.n)|^2 is not below 0: a quadratic function along the segment.
bool clip_to_cone(const Light &spot, const Vec3 &a, const Vec3 &b, Real &from, Real &to) {
    const Real far = max(max(length(a), length(b)), min_distance), cosine = Real(1) - spot.one_minus_cosine;
    const Real cos2 = cosine * cosine, sin2 = spot.one_minus_cosine * (Real(2) - spot.one_minus_cosine);
    const Vec3 &n = spot.direction, begin = a / far, way = (b - a) / far;
    const Real u = dot(begin, n), v = dot(way, n);
    const Vec3 p = begin - n * u, q = way - n * v;
    const Real second = sin2 * v * v - cos2 * dot(q, q), half_first = sin2 * u * v - cos2 * dot(p, q),
               zeroth = sin2 * u * u - cos2 * dot(p, p);
    from = Real(0);
    to = Real(1);
    const bool a_inside = u > Real(0) && zeroth >= Real(0);
    const bool b_inside = u + v > Real(0) && second + Real(2) * half_first + zeroth >= Real(0);
    if (a_inside && b_inside) return true;
    const Real discriminant = half_first * half_first - second * zeroth;
    if (!(discriminant > Real(0))) return false;
    const Real root = sqrt(discriminant);
    const Real sum = -(half_first + (half_first < Real(0) ? -root : root)); // no cancellation
    const Real one = bounded_quotient(sum, second), other = bounded_quotient(zeroth, sum);
    const Real low = min(one, other), high = max(one, other);
    const auto is_between = [](Real t) { return t > Real(0) && t < Real(1); };
    if (a_inside) {
        to = is_between(low) ? low : high;
    } else if (b_inside) {
        from = is_between(high) ? high : low;
    } else {
        if (!(second < Real(0)) || !is_between(low) || !is_between(high) || !(u + v * low > Real(0))) return false;
        from = low;
        to = high;
    }
    return from < to;
}

// Whether the segment from a to b, both relative to a light, may leave its cone. Wider cones count as a whole.
bool has_cone(const Light &light, const Vec3 &a, const Vec3 &b) {
    return light.kind == LightKind::spot && dot(b - a, b - a) > Real(0) && light.one_minus_cosine < Real(1);
}

// Cuts off what a light does not shine on. Returns which part of the length is left.
Real cut_to_light(const Light &light, Vec3 &a, Vec3 &b) {
    Real from, to;
    if (!clip_to_light(light, a, b, from, to)) return Real(0);
    if (to - from < Real(1)) {
        const Vec3 way = b - a;
        b = a + way * to;
        a += way * from;
    }
    return to - from;
}

// Whether two unit vectors are nearer to each other than `parts` of the half-width of the phase function's peak, which
// is about 1 - |g| (N-E1).
bool turns_little(const Phase &phase, const Vec3 &from, const Vec3 &to, Real parts) {
    const Real widest = (Real(1) - abs(phase.asymmetry())) * parts;
    return dot(to - from, to - from) <= widest * widest;
}

// `halvings` more of the angle are allowed. Points are relative to the light. By Simpson's rule in each part: light
// with falloff is spread evenly over the angle, light without over the length.
Real mean_phase_between(const Light &light, const Phase &phase, const Vec3 &a, const Vec3 &b, const Vec3 &out,
                        int32_t halvings) {
    const Real far_a = max(length(a), min_distance), far_b = max(length(b), min_distance);
    // The bisector of the angle at the light meets the segment where its parts are as a : b.
    const bool constant = light.kind == LightKind::constant;
    const Real of_b = far_a / (far_a + far_b);
    const Vec3 bisected = a + (b - a) * of_b, from = a / far_a, to = b / far_b;
    if (halvings == 0 || turns_little(phase, from, to, Real(1))) {
        const Vec3 middle = constant ? (a + b) * Real(0.5) : bisected;
        const Real distance = length(middle);
        const Vec3 between = distance > Real(0) ? middle / distance : from;
        return Real(1.0 / 6) * (phase(from, out) + Real(4) * phase(between, out) + phase(to, out));
    }
    const Real first = mean_phase_between(light, phase, a, bisected, out, halvings - 1);
    const Real second = mean_phase_between(light, phase, bisected, b, out, halvings - 1);
    return first + (second - first) * (constant ? Real(1) - of_b : Real(0.5));
}

} // namespace

bool clip_to_light(const Light &light, const Vec3 &a, const Vec3 &b, Real &from, Real &to) {
    if (has_cone(light, a, b)) return clip_to_cone(light, a, b, from, to);
    from = Real(0);
    to = Real(1);
    return true;
}

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
    if (light.kind == LightKind::parallel) return {light.direction, parallel_distance, light.color};
    const Vec3 from_light = x - light.position;
    const Real distance = length(from_light);
    // At the light itself, any direction is right. min_distance keeps the irradiance finite.
    const Vec3 direction = distance > Real(0) ? from_light / distance : Vec3(Real(0), Real(0), Real(1));
    if (light.kind == LightKind::constant) return {direction, distance, light.color};
    Vec3 begin = a - light.position, end = b - light.position;
    if (light.kind != LightKind::spot) return {direction, distance, mean_irradiance(light.color, begin, end)};
    const Real part = has_cone(light, begin, end)                                   ? cut_to_light(light, begin, end)
                      : in_cone(direction, light.direction, light.one_minus_cosine) ? Real(1)
                                                                                    : Real(0);
    if (!(part > Real(0))) return {direction, distance, Color(Real(0))};
    return {direction, distance, mean_irradiance(light.color, begin, end) * part};
}

Real mean_phase(const Light &light, const Phase &phase, const Vec3 &in, const Vec3 &a, const Vec3 &b, const Vec3 &out) {
    constexpr int32_t halvings = 8; // of an angle of at most half a turn
    if (phase.isotropic()) return inv_four_pi<Real>;
    if (light.kind == LightKind::parallel) return phase(in, out);
    Vec3 from = a - light.position, to = b - light.position;
    const Real part = cut_to_light(light, from, to);
    if (!(part > Real(0))) return phase(in, out); // of no light
    const Real near = max(length(from), min_distance), far = max(length(to), min_distance);
    if (part == Real(1) && turns_little(phase, from / near, to / far, Real(1.0 / 8))) return phase(in, out);
    return mean_phase_between(light, phase, from, to, out, halvings);
}

} // namespace wisp::WISP_ARITH
