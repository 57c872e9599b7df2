// Unbiased volumetric path tracing (S1).
#include "core/render/path_tracer.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

// A cell costs a search among the elements: more cells than these do not pay (README).
inline uint64_t most_majorants_of(uint64_t elements) {
    return min(max(elements * 64, uint64_t{1} << 19), uint64_t{1} << 22);
}
// Collisions of a path: where there are more it ends, and is counted as capped.
constexpr uint32_t longest_path = 1u << 20;
// Tentative collisions of a flight, after which the observer may be asked; units of work.
constexpr uint32_t asked_after = 1 << 10, units_of_collision = 16, units_of_light = 256, units_of_majorant = 128;

Real uniform(Pcg32 &generator) { return unit_half_open<Real>(generator()); }
Real exponential(Pcg32 &generator) { return -log(unit_open<Real>(generator())); }

// What a light sends towards the ray's origin from the smoke at distance t, per unit of length, and the smoke's sigma_t
// there.
struct Source {
    Color radiance;
    Real sigma;
};
Source scattered_once(const PathTracer &tracer, uint32_t number, const Ray &ray, Real t) {
    const Light &light = tracer.lights[number];
    const Medium &medium = *tracer.medium;
    const Vec3 x = ray.origin + ray.direction * t;
    const Illumination arriving = illuminate(light, x, x, x);
    Source source = {Color(Real(0)), Real(0)};
    for (uint32_t i = 0; i < medium.count; ++i) {
        const SmokeVolume &smoke = medium.smokes[i];
        const Real sigma = extinction(smoke.field, x);
        source.sigma += sigma;
        source.radiance += smoke.albedo * (sigma * smoke.phase(arriving.direction, -ray.direction));
    }
    source.radiance = source.radiance * arriving.irradiance;
    tracer.statistics->smoke.density_evaluations += medium.count;
    tracer.watch.go_on(units_of_light);
    if (!(largest(source.radiance) > Real(0))) return source;
    if (tracer.shadows && is_shadowed(tracer.shadows, number, x, arriving)) {
        source.radiance = Color(Real(0));
        return source;
    }
    if (!tracer.shadows) ++tracer.statistics->rays.shadow;
    source.radiance = source.radiance * exp(-optical_depth(medium, {x, -arriving.direction}, arriving.distance));
    return source;
}

// Distances along the ray up to `end` drawn in proportion to 1 / r^2 from a light.
struct EquiAngular {
    EquiAngular(const Light &light, const Ray &ray, Real end_) : end(end_) {
        const Vec3 to_light = light.position - ray.origin;
        middle = dot(to_light, ray.direction);
        distance = max(length(cross(to_light, ray.direction)), Real(0x1p-10));
        low = angle(-middle);
        spread = angle(end - middle) - low;
    }
    Real density(Real t) const {
        const Real u = t - middle;
        return distance / (spread * (distance * distance + u * u));
    }
    Real sample(Real xi) const {
        Real sine, cosine;
        sincos_turns((low + xi * spread) * inv_two_pi<Real>, sine, cosine);
        return min(max(Real(0), middle + bounded_quotient(distance * sine, cosine)), end);
    }
    Real angle(Real t) const { return t < Real(0) ? -angle_between(-t, distance) : angle_between(t, distance); }

    Real end, middle, distance, low, spread;
};

// Next-event estimation of such a light has an infinite variance: it does not sample in proportion to 1 / r^2.
bool stands_in_smoke(const PathTracer &tracer, const Light &light) {
    return has_falloff(light.kind) && is_strictly_inside(tracer.medium->bounds, light.position);
}

// Next-event estimation: an estimate of what the lights send towards the ray's origin after one scattering on the ray's
// distances 0 to `end`. Its sample is the ray's own `collision`; for lights in the smoke a second one is drawn, and
// each is weighted as by the balance heuristic.
Color single_scattering(const PathTracer &tracer, const Ray &ray, Real end, const MediumCollision &collision,
                        Pcg32 &generator) {
    Color sum(Real(0));
    for (uint32_t l = 0; l < tracer.light_count; ++l) {
        const Light &light = tracer.lights[l];
        if (!stands_in_smoke(tracer, light)) {
            if (!collision.found) continue;
            const Source source = scattered_once(tracer, l, ray, collision.distance);
            if (source.sigma > Real(0)) sum += source.radiance / source.sigma;
            continue;
        }
        const EquiAngular angular(light, ray, end);
        const auto weighted = [&](Real t) {
            const Source source = scattered_once(tracer, l, ray, t);
            if (!(largest(source.radiance) > Real(0))) return Color(Real(0));
            const Real transmittance = exp(-optical_depth(*tracer.medium, ray, t));
            return source.radiance * (transmittance / (source.sigma * transmittance + angular.density(t)));
        };
        if (collision.found) sum += weighted(collision.distance);
        sum += weighted(angular.sample(uniform(generator)));
    }
    return sum;
}

// Moves the ray to its collision, and draws its new direction.
void scatter(const SmokeVolume &smoke, Real distance, Ray &ray, Pcg32 &generator) {
    ray.origin += ray.direction * distance;
    const Phase::Cosine angle = smoke.phase.sample(unit_open<Real>(generator()));
    ray.direction = deflect(ray.direction, angle, uniform(generator));
}

} // namespace

// Each bound holds in a slightly larger box than its cell, because rounding may move a point of a flight out of the
// cell.
Majorants make_majorants(const Medium &medium, Real edge, Arena &arena, Watch watch) {
    Majorants majorants = {};
    const Vec3 size = medium.bounds.high - medium.bounds.low;
    const auto cells = [&] {
        return Cell{floor_to_int(size.x / edge) + 1, floor_to_int(size.y / edge) + 1, floor_to_int(size.z / edge) + 1};
    };
    uint64_t elements = 0;
    for (uint32_t i = 0; i < medium.count; ++i) elements += elements_of(*medium.smokes[i].source);
    while (number_of(cells()) > most_majorants_of(elements)) edge = edge * Real(1.25);
    const Cell count = cells();
    majorants.lattice = make_lattice(medium.bounds.low, Vec3(edge), count);
    Real *sigma = arena.make<Real>(number_of(count));
    if (!sigma) return majorants;

    const Vec3 margin = Vec3(edge * Real(0x1p-7));
    Real *next = sigma;
    watch.expect(number_of(count) * units_of_majorant);
    for (int32_t z = 0; z < count.z; ++z)
        for (int32_t y = 0; y < count.y; ++y)
            for (int32_t x = 0; x < count.x; ++x) {
                if (x % 64 == 0 && !watch.done(min(count.x - x, 64) * units_of_majorant)) return majorants;
                const Vec3 low = majorants.lattice.low + Vec3(Real(x), Real(y), Real(z)) * edge;
                Real bound = Real(0);
                for (uint32_t i = 0; i < medium.count; ++i)
                    bound += majorant(medium.smokes[i].field, {low - margin, low + Vec3(edge) + margin});
                *next++ = bound * Real(1 + 0x1p-10);
            }
    majorants.sigma = sigma;
    return majorants;
}

MediumCollision track(const PathTracer &tracer, const Ray &ray, Real end, Pcg32 &generator) {
    const Medium &medium = *tracer.medium;
    const Lattice &lattice = tracer.majorants.lattice;
    MediumCollision collision = {false, end, 0, 0};
    Real rest = exponential(generator); // the majorants' optical depth from here to the next tentative collision
    uint32_t tentative = 0;
    for_each_cell(lattice, ray, Real(0), end, [&](const Cell &cell, Real from, Real to) {
        const Real bound = tracer.majorants.sigma[index_of(lattice.count, cell)];
        for (Real t = from;;) {
            const Real depth = bound * (to - t);
            if (!(rest < depth)) {
                rest -= depth;
                return true;
            }
            if (++tentative % asked_after == 0 && !tracer.watch.go_on(asked_after * units_of_collision)) return false;
            if (tentative == max_tentative) {
                ++tracer.statistics->photons.capped;
                return false;
            }
            t += rest / bound;
            const Vec3 x = ray.origin + ray.direction * t;
            // The collision is real if this is below sigma_t. It is then one with the smoke in whose part of sigma_t it
            // lies.
            Real sigma = uniform(generator) * bound;
            for (uint32_t i = 0; i < medium.count; ++i) {
                ++tracer.statistics->smoke.density_evaluations;
                sigma -= extinction(medium.smokes[i].field, x);
                if (!(sigma < Real(0))) continue;
                collision = {true, t, i, 0};
                return false;
            }
            rest = exponential(generator);
        }
    });
    return collision;
}

Color sample_radiance(const PathTracer &tracer, Ray ray, Real end, Color radiance, Pcg32 &generator) {
    const Medium &medium = *tracer.medium;
    if (medium.empty()) return radiance;
    const Surfaces *surfaces = tracer.shadows ? tracer.shadows->surfaces : nullptr;
    Color throughput(Real(1));
    for (uint32_t number = 0; number < longest_path; ++number) {
        if (!tracer.watch.go_on(units_of_collision)) return radiance;
        if (number > 0) end = distance_to_surface(surfaces, ray, Real(0));
        Real begin = Real(0);
        if (!clip(medium.bounds, ray, begin, end)) return radiance;
        ray.origin += ray.direction * begin;
        end -= begin;
        const MediumCollision collision = track(tracer, ray, end, generator);
        radiance += throughput * single_scattering(tracer, ray, end, collision, generator);
        if (!collision.found) return radiance;
        const SmokeVolume &smoke = medium.smokes[collision.smoke];
        radiance += throughput * (Color(Real(1)) - smoke.albedo) * smoke.emission;

        throughput = throughput * smoke.albedo;
        if (!(largest(throughput) > Real(0))) return radiance;
        if (largest(throughput) < Real(0.25)) {
            if (uniform(generator) < Real(0.5)) return radiance;
            throughput = throughput * Real(2);
        }
        scatter(smoke, collision.distance, ray, generator);
    }
    ++tracer.statistics->photons.capped;
    return radiance;
}

Color sample_multiple_scattering(const PathTracer &tracer, Ray ray, Real end, Pcg32 &generator) {
    const Color none(Real(0));
    Real begin = Real(0);
    if (!clip(tracer.medium->bounds, ray, begin, end)) return none;
    ray.origin += ray.direction * begin;
    const MediumCollision collision = track(tracer, ray, end - begin, generator);
    if (!collision.found) return none;
    const SmokeVolume &smoke = tracer.medium->smokes[collision.smoke];
    const Surfaces *surfaces = tracer.shadows ? tracer.shadows->surfaces : nullptr;
    scatter(smoke, collision.distance, ray, generator);
    return smoke.albedo * sample_radiance(tracer, ray, distance_to_surface(surfaces, ray, Real(0)), none, generator);
}

uint64_t majorant_bytes(const Scene &scene) {
    uint64_t elements = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) elements += elements_of(scene.smokes[i]);
    return Arena::bytes<Real>(most_majorants_of(elements));
}

bool make_path_tracer(const Scene &scene, const Medium &medium, const Light *lights, Shadows *shadows, Arena &arena,
                      Statistics &statistics, PathTracer &tracer, Watch watch) {
    tracer = {&medium, lights, scene.light_count, {}, &statistics, shadows, watch};
    if (medium.empty()) return true;
    tracer.majorants = make_majorants(medium, smallest_smoothing_length(scene), arena, watch);
    return tracer.majorants.sigma != nullptr;
}

Pcg32 pass_generator(const Settings &settings, uint32_t pass, int32_t x, int32_t y) {
    const uint64_t place =
        static_cast<uint64_t>(pass) << 32 | static_cast<uint64_t>(y) << 16 | static_cast<uint64_t>(x);
    const Event seed = photon_event(settings.seed, place);
    return Pcg32(uint64_t{seed.high} << 32 | seed.low);
}

} // namespace wisp::WISP_ARITH
