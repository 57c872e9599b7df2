// Unbiased volumetric path tracing (S1).
#include "core/render/path_tracer.h"
#include "core/lights/equi_angular.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

// A cell costs a search among the elements: more cells than these do not pay (README).
inline uint64_t most_majorants_of(uint64_t elements) {
    return min(max(elements * 64, uint64_t{1} << 19), uint64_t{1} << 22);
}
Cell majorants_in(const Vec3 &size, Real edge) {
    return {floor_to_int(size.x / edge) + 1, floor_to_int(size.y / edge) + 1, floor_to_int(size.z / edge) + 1};
}
constexpr Cell cube_of(int32_t edge) { return {edge, edge, edge}; }
// The least edge from `edge` on of so many cells or fewer.
Real edge_for(const Vec3 &size, Real edge, uint64_t most) {
    while (number_of(majorants_in(size, edge)) > most) edge = edge * Real(1.25);
    return edge;
}
// Of all majorants, those of cells that may be divided: this part of them at most. Dividing pays where cells become
// that much smaller.
constexpr uint64_t cells_to_divide = 16;
constexpr int32_t most_parts = 1 << 7;
constexpr Real paying_division = Real(1.5);

// Edge of a cell of majorants: six samples of density grids, a smoothing length of particles, whose bounds loosen
// sooner in larger cells (README).
Real majorant_edge(const Scene &scene) {
    const Real edge = smallest_smoothing_length(scene);
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].is_grid() && !scene.smokes[i].empty()) return edge;
    return edge * Real(6);
}
// Tentative collisions on a ray whose cells all have smoke, however thin it is; what is left of the light when one
// flight decides for all of it; the throughput from which on paths go on for certain. Measured (README).
constexpr Real least_tentative = Real(4), one_flight = Real(0x1p-4), certain_survival = Real(0.375);
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
    ++tracer.statistics->rays.shadow;
    if (has(parts::surfaces) && tracer.surfaces &&
        is_blocked_in_space(*tracer.surfaces, x, arriving, tracer.statistics->shadow.traced)) {
        source.radiance = Color(Real(0));
        return source;
    }
    source.radiance = source.radiance * exp(-optical_depth(medium, {x, -arriving.direction}, arriving.distance));
    return source;
}

// At a path's collisions such a light would have an infinite variance: they do not come in proportion to 1 / r^2.
bool stands_in_smoke(const PathTracer &tracer, const Light &light) {
    return stands_near(light, tracer.medium->bounds, Real(0));
}

// Whether few of a ray's collisions find most of a light's, of which that part of the ray is lit: those in the cone of
// a spot, or next to a light.
bool shines_unevenly(const PathTracer &tracer, const Light &light, Real lit) {
    const Vec3 size = tracer.medium->bounds.high - tracer.medium->bounds.low;
    return lit < Real(0.5) || stands_near(light, tracer.medium->bounds, max(max(size.x, size.y), size.z) * Real(0.25));
}

// Next-event estimation: an estimate of what a light sends towards the ray's origin after one scattering on the ray's
// distances 0 to `end`, at the ray's `collision`. For a light in the smoke the place is drawn as the light falls off;
// for one that shines unevenly both estimates are weighted by the balance heuristic.
Color single_scattering(const PathTracer &tracer, uint32_t number, const Ray &ray, Real end,
                        const WeightedCollision &collision, Pcg32 &generator) {
    const Light &light = tracer.lights[number];
    const Vec3 from_light = ray.origin - light.position;
    Real from, to;
    if (!clip_to_light(light, from_light, from_light + ray.direction * end, from, to)) return Color(Real(0));
    const bool inside = stands_in_smoke(tracer, light);
    if (!inside && !shines_unevenly(tracer, light, to - from)) {
        if (!(collision.weight > Real(0))) return Color(Real(0));
        const Source source = scattered_once(tracer, number, ray, collision.distance);
        return source.sigma > Real(0) ? source.radiance * (collision.weight / source.sigma) : Color(Real(0));
    }
    Real least = Real(1), greatest = Real(-1);
    for (uint32_t i = 0; i < tracer.medium->count; ++i) {
        least = min(least, tracer.medium->smokes[i].phase.asymmetry());
        greatest = max(greatest, tracer.medium->smokes[i].phase.asymmetry());
    }
    const EquiAngular places(light.position, ray, from * end, to * end, least, greatest);
    const auto estimate = [&](Real t) {
        const Source source = scattered_once(tracer, number, ray, t);
        if (!(largest(source.radiance) > Real(0))) return Color(Real(0));
        const Real arriving = exp(-optical_depth(*tracer.medium, ray, t)),
                   colliding = inside ? Real(0) : source.sigma * arriving;
        return source.radiance * (arriving / (places.density(t) + colliding));
    };
    const Color drawn = estimate(places.sample(generator));
    const Real t = collision.distance;
    if (inside || !(collision.weight > Real(0)) || t < from * end || t > to * end) return drawn;
    return drawn + estimate(t) * collision.weight;
}

// Moves the ray to where it enters the medium's bounds. False: it does not before `end`.
bool enter(const Medium &medium, Ray &ray, Real &end) {
    Real begin = Real(0);
    if (!clip(medium.bounds, ray, begin, end)) return false;
    ray.origin += ray.direction * begin;
    end -= begin;
    return true;
}

// Where a path is scattered. Its next single scattering is estimated twice for some lights: along the path's own new
// direction, and along one that is drawn from a lobe about the light, in which its light is likely to be scattered
// back. The lobe is the phase function, as the light is scattered by it. About a light in the smoke it is Poisson's
// kernel over the sine of the angle, as a ray that passes the light at the distance h scatters light in proportion to
// 1 / h. Each estimate is weighted as by the balance heuristic.
class Turn {
  public:
    Turn(const PathTracer &tracer, const SmokeVolume &smoke, const Vec3 &x, const Vec3 &before)
        : tracer_(tracer), phase_(smoke.phase), lobe_(max(smoke.phase.asymmetry(), Real(0))), x_(x), before_(before) {
        for (uint32_t l = 0; l < tracer.light_count; ++l) lobes_ += has_lobe(l) ? 1 : 0;
    }

    Ray follow_phase(Pcg32 &generator) const {
        const Phase::Cosine angle = phase_.sample(unit_open<Real>(generator()));
        return {x_, deflect(before_, angle, uniform(generator))};
    }

    // Draws one of the lights that have a lobe, and a direction about it. False: none has.
    bool follow_lobe(Pcg32 &generator, uint32_t &light, Ray &ray) const {
        if (lobes_ == 0) return false;
        uint32_t before = static_cast<uint32_t>(uint64_t{generator()} * lobes_ >> 32);
        for (light = 0; !has_lobe(light) || before-- > 0;) ++light;
        const Phase::Cosine angle = stands_in_smoke(tracer_, tracer_.lights[light])
                                        ? lobe_.inverse(uniform(generator) * half_pi<Real>).doubled()
                                        : phase_.sample(unit_open<Real>(generator()));
        ray = {x_, deflect(towards(light), angle, uniform(generator))};
        return true;
    }

    // The weight of a light's single scattering along a direction that was drawn in either way, over the phase
    // function there.
    Real share(uint32_t light, const Vec3 &direction) const {
        if (!has_lobe(light)) return Real(1);
        const Vec3 to_light = towards(light);
        const Real density = phase_(before_, direction);
        const Real lobe = stands_in_smoke(tracer_, tracer_.lights[light])
                              ? lobe_({length(direction - to_light), length(direction + to_light)}) *
                                    (per_turn / max(length(cross(to_light, direction)), Real(0x1p-14)))
                              : phase_(to_light, direction);
        return density / (density + lobe / Real(static_cast<int32_t>(lobes_)));
    }

  private:
    static constexpr Real per_turn = Real(0.0506605918212); // 1 / (2 pi^2)

    // Of a distant light and an even phase function, the lobe would be as that is.
    bool has_lobe(uint32_t light) const {
        return !phase_.isotropic() || stands_in_smoke(tracer_, tracer_.lights[light]);
    }
    Vec3 towards(uint32_t light) const { return -illuminate(tracer_.lights[light], x_, x_, x_).direction; }

    const PathTracer &tracer_;
    const Phase &phase_;
    const PoissonKernel lobe_;
    const Vec3 x_, before_;
    uint32_t lobes_ = 0;
};

// Whether a path goes on; its throughput grows where others end.
bool survives(Color &throughput, Pcg32 &generator) {
    const Real most = largest(throughput);
    if (!(most > Real(0))) return false;
    if (!(most < certain_survival)) return true;
    if (!(uniform(generator) < most / certain_survival)) return false;
    throughput = throughput * (certain_survival / most);
    return true;
}

Color emitted(const PathTracer &tracer, const WeightedCollision &collision) {
    if (!(collision.weight > Real(0))) return Color(Real(0));
    const SmokeVolume &smoke = tracer.medium->smokes[collision.smoke];
    return (Color(Real(1)) - smoke.albedo) * smoke.emission * collision.weight;
}

// Returns `radiance` plus one sample of light that is scattered at the ray's `collision` and has been emitted or
// scattered before.
Color scattered_again(const PathTracer &tracer, Ray ray, WeightedCollision collision, Color radiance,
                      Pcg32 &generator) {
    const Medium &medium = *tracer.medium;
    Color throughput(Real(1));
    for (uint32_t number = 1; number < longest_path; ++number) {
        if (!(collision.weight > Real(0)) || !tracer.watch.go_on(units_of_collision)) return radiance;
        const SmokeVolume &smoke = medium.smokes[collision.smoke];
        throughput = throughput * smoke.albedo * collision.weight;
        if (!survives(throughput, generator)) return radiance;

        const Turn turn(tracer, smoke, ray.origin + ray.direction * collision.distance, ray.direction);
        uint32_t light;
        if (turn.follow_lobe(generator, light, ray)) {
            Real end = distance_to_surface(tracer.surfaces, ray, Real(0));
            const Real share = turn.share(light, ray.direction);
            if (enter(medium, ray, end)) {
                collision = sample_collision(tracer, ray, end, generator);
                radiance += throughput * single_scattering(tracer, light, ray, end, collision, generator) * share;
            }
        }
        ray = turn.follow_phase(generator);
        Real end = distance_to_surface(tracer.surfaces, ray, Real(0));
        if (!enter(medium, ray, end)) return radiance;
        collision = sample_collision(tracer, ray, end, generator);
        radiance += throughput * emitted(tracer, collision);
        for (uint32_t l = 0; l < tracer.light_count; ++l)
            radiance += throughput * single_scattering(tracer, l, ray, end, collision, generator) *
                        turn.share(l, ray.direction);
    }
    ++tracer.statistics->photons.capped;
    return radiance;
}

} // namespace

namespace {

// Finds the bounds of all cells of a lattice. Each holds in a slightly larger box than its cell, because rounding may
// move a point of a flight out of the cell. False: the work is stopped.
bool find_bounds(const Medium &medium, const Lattice &lattice, Real margin, Watch watch, Real *sigma) {
    const Cell &count = lattice.count;
    for (int32_t z = 0; z < count.z; ++z)
        for (int32_t y = 0; y < count.y; ++y)
            for (int32_t x = 0; x < count.x; ++x) {
                if (x % 64 == 0 && !watch.done(min(count.x - x, 64) * units_of_majorant)) return false;
                const Vec3 low = lattice.low + Vec3(Real(x), Real(y), Real(z)) * lattice.edge;
                *sigma++ =
                    majorant(medium, {low - Vec3(margin), low + lattice.edge + Vec3(margin)}) * Real(1 + 0x1p-10);
            }
    return true;
}

// Makes cells of this edge. False: the arena was too small, or the work is stopped.
bool make_cells(const Medium &medium, Real edge, Arena &arena, Watch watch, Majorants &majorants) {
    const Cell count = majorants_in(medium.bounds.high - medium.bounds.low, edge);
    majorants.lattice = make_lattice(medium.bounds.low, Vec3(edge), count);
    Real *sigma = arena.make<Real>(number_of(count));
    if (!sigma) return false;
    watch.expect(number_of(count) * units_of_majorant);
    if (!find_bounds(medium, majorants.lattice, edge * Real(0x1p-7), watch, sigma)) return false;
    majorants.sigma = sigma;
    return true;
}

Lattice parts_of(const Majorants &majorants, const Cell &cell) {
    const Vec3 &edge = majorants.lattice.edge;
    return make_lattice(majorants.lattice.low + Vec3(Real(cell.x), Real(cell.y), Real(cell.z)) * edge,
                        edge / Real(majorants.parts), cube_of(majorants.parts));
}

// The parts along each edge of cells that hold smoke: so many that the smallest are `edge` long, but at most `most` in
// all.
int32_t parts_that_fit(const Majorants &majorants, Real edge, uint64_t most) {
    const Lattice &lattice = majorants.lattice;
    uint64_t occupied = 0;
    for (uint64_t i = 0; i < number_of(lattice.count); ++i) occupied += majorants.sigma[i] > Real(0) ? 1 : 0;
    const int32_t wanted = floor_to_int(min(lattice.edge.x / edge, Real(most_parts - 1))) + 1;
    int32_t parts = 1;
    while (parts < wanted && occupied * number_of(cube_of(parts + 1)) <= most) ++parts;
    return parts;
}

// Divides the cells that hold smoke. False: the arena was too small, or the work is stopped.
bool divide_cells(const Medium &medium, int32_t parts, Arena &arena, Watch watch, Majorants &majorants) {
    const Lattice &lattice = majorants.lattice;
    const uint64_t cells = number_of(lattice.count), of_each = number_of(cube_of(parts));
    uint32_t *first = arena.make<uint32_t>(cells);
    if (!first) return false;
    uint64_t count = 0;
    for (uint64_t i = 0; i < cells; ++i) {
        first[i] = static_cast<uint32_t>(count);
        if (majorants.sigma[i] > Real(0)) count += of_each;
    }
    Real *sigma = arena.make<Real>(count);
    if (!sigma) return false;
    majorants.parts = parts;
    majorants.first_part = first;
    majorants.sigma_of_part = sigma;
    // Rounding goes with the extent of the lattice.
    const Real margin = lattice.edge.x * max(Real(0x1p-7) / Real(parts), Real(0x1p-12));
    watch.expect(count * units_of_majorant);
    for (int32_t z = 0; z < lattice.count.z; ++z)
        for (int32_t y = 0; y < lattice.count.y; ++y)
            for (int32_t x = 0; x < lattice.count.x; ++x) {
                const int64_t i = index_of(lattice.count, {x, y, z});
                if (majorants.sigma[i] > Real(0) &&
                    !find_bounds(medium, parts_of(majorants, {x, y, z}), margin, watch, sigma + first[i]))
                    return false;
            }
    return true;
}

} // namespace

Majorants make_majorants(const Medium &medium, Real edge, Arena &arena, Watch watch) {
    const Vec3 size = medium.bounds.high - medium.bounds.low;
    uint64_t elements = 0;
    for (uint32_t i = 0; i < medium.count; ++i) elements += elements_of(*medium.smokes[i].source);
    const uint64_t most = most_majorants_of(elements);
    const Real even = edge_for(size, edge, most);
    Majorants majorants = {};
    if (edge < even) {
        const size_t mark = arena.mark();
        if (!make_cells(medium, edge_for(size, even, most / cells_to_divide), arena, watch, majorants)) return {};
        const int32_t parts = parts_that_fit(majorants, edge, most - most / cells_to_divide * 2);
        if (majorants.lattice.edge.x * paying_division < even * Real(parts))
            return divide_cells(medium, parts, arena, watch, majorants) ? majorants : Majorants{};
        arena.rewind(mark);
    }
    return make_cells(medium, even, arena, watch, majorants) ? majorants : Majorants{};
}

WeightedCollision sample_collision(const PathTracer &tracer, const Ray &ray, Real end, Pcg32 &generator) {
    const Medium &medium = *tracer.medium;
    const Majorants &majorants = tracer.majorants;
    const Lattice &lattice = majorants.lattice;
    WeightedCollision collision = {Real(0), end, 0};
    const Real more = least_tentative / max(end, Real(0x1p-20));
    Real rest = exponential(generator); // tentative collisions to expect from here to the next one
    Real left = Real(1);                // of a unit of light: what has not collided yet
    uint32_t tentative = 0;
    // Whether the light flies on where sigma_t is at most `majorant`.
    const auto fly = [&](Real majorant, Real from, Real to) {
        if (!(majorant > Real(0))) return true;
        const Real rate = majorant + more;
        for (Real t = from;;) {
            const Real expected = rate * (to - t);
            if (!(rest < expected)) {
                rest -= expected;
                return true;
            }
            if (++tentative % asked_after == 0 && !tracer.watch.go_on(asked_after * units_of_collision)) return false;
            if (tentative == max_tentative) {
                ++tracer.statistics->photons.capped;
                return false;
            }
            t += rest / rate;
            const Vec3 x = ray.origin + ray.direction * t;
            // A little light flies on or collides as one: a path through deep smoke then has the weight 1, not a
            // product of as many random numbers as it has collisions.
            const bool whole = left < one_flight;
            const Real arriving = left, chance = whole ? uniform(generator) * rate : Real(0);
            Real sigma = Real(0);
            for (uint32_t i = 0; i < medium.count; ++i) {
                ++tracer.statistics->smoke.density_evaluations;
                const Real here = extinction(medium.smokes[i].field, x);
                sigma += here;
                if (whole ? !(chance < sigma) : !(here > Real(0))) continue;
                const Real part = whole ? arriving : arriving * (here / rate);
                collision.weight = whole ? Real(1) : collision.weight + part;
                left -= part;
                if (uniform(generator) * collision.weight < part) {
                    collision.distance = t;
                    collision.smoke = i;
                }
                if (whole) return false;
            }
            rest = exponential(generator);
        }
    };
    for_each_cell(lattice, ray, Real(0), end, [&](const Cell &cell, Real from, Real to) {
        const int64_t i = index_of(lattice.count, cell);
        const Real majorant = majorants.sigma[i];
        if (!majorants.first_part || !(majorant > Real(0))) return fly(majorant, from, to);
        const Real *of_part = majorants.sigma_of_part + majorants.first_part[i];
        bool goes_on = true;
        for_each_cell(parts_of(majorants, cell), ray, from, to, [&](const Cell &part, Real enter, Real leave) {
            return goes_on = fly(of_part[index_of(cube_of(majorants.parts), part)], enter, leave);
        });
        return goes_on;
    });
    return collision;
}

Color sample_radiance(const PathTracer &tracer, Ray ray, Real end, Color radiance, Pcg32 &generator) {
    if (tracer.medium->empty() || !enter(*tracer.medium, ray, end)) return radiance;
    const WeightedCollision collision = sample_collision(tracer, ray, end, generator);
    radiance += emitted(tracer, collision);
    for (uint32_t l = 0; l < tracer.light_count; ++l)
        radiance += single_scattering(tracer, l, ray, end, collision, generator);
    return scattered_again(tracer, ray, collision, radiance, generator);
}

Color sample_multiple_scattering(const PathTracer &tracer, Ray ray, Real end, Pcg32 &generator) {
    const Color none(Real(0));
    if (!enter(*tracer.medium, ray, end)) return none;
    return scattered_again(tracer, ray, sample_collision(tracer, ray, end, generator), none, generator);
}

uint64_t majorant_bytes(const Scene &scene) {
    uint64_t elements = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) elements += elements_of(scene.smokes[i]);
    // The box of the medium is this one but for rounding.
    const Box around = box_around_smoke(scene);
    const Real edge = majorant_edge(scene);
    const Vec3 size = (around.high - around.low) * Real(1 + 0x1p-10) + Vec3(edge * Real(0x1p-4));
    const uint64_t cells = number_of(majorants_in(size, edge)), most = most_majorants_of(elements);
    return cells <= most ? Arena::bytes<Real>(cells) : Arena::bytes<Real>(most) + 2 * Arena::bytes<Real>(1);
}

bool make_path_tracer(const Scene &scene, const Medium &medium, const Light *lights, const Surfaces *surfaces,
                      Arena &arena, Statistics &statistics, PathTracer &tracer, Watch watch) {
    tracer = {&medium, lights, scene.light_count, {}, &statistics, surfaces, watch};
    if (medium.empty()) return true;
    tracer.majorants = make_majorants(medium, majorant_edge(scene), arena, watch);
    return tracer.majorants.sigma != nullptr;
}

Pcg32 pass_generator(const Settings &settings, uint32_t pass, int32_t x, int32_t y) {
    const uint64_t place =
        static_cast<uint64_t>(pass) << 32 | static_cast<uint64_t>(y) << 16 | static_cast<uint64_t>(x);
    const Event seed = photon_event(settings.seed, place);
    return Pcg32(uint64_t{seed.high} << 32 | seed.low);
}

} // namespace wisp::WISP_ARITH
