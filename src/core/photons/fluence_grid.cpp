// Photons from the first collisions of light in resampled smoke, and their fluence (S2, S4-3).
#include "core/photons/fluence_grid.h"
#include "core/shadows/shadows_in_space.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t asked_after = 1 << 12; // tentative collisions of a flight

// What is scattered widely towards the eye.
struct TowardsEye {
    Vec3 eye;
    ForwardPeak peak;
    int32_t shift; // 4 pi times the wide part is scaled by 2^shift, to at most 1

    TowardsEye(const Vec3 &of_camera, const ForwardPeak &of_smoke) : eye(of_camera), peak(of_smoke), shift(0) {
        while (scale_pow2(peak.largest * four_pi<Real>, shift) > Real(1)) --shift;
        while (shift < 20 && scale_pow2(peak.largest * four_pi<Real>, shift) < Real(0.5)) ++shift;
    }
    Real operator()(const Vec3 &x, const Vec3 &direction) const {
        return scale_pow2(peak.wide(direction, direction_between(x, eye)) * four_pi<Real>, shift);
    }
};
// All that tracing needs.
struct Tracer : PhotonSources {
    const Surfaces *surfaces; // nullptr: there are none
    Statistics &statistics;
    const TowardsEye *eye; // nullptr: what is deposited does not depend on directions
    const FlightRecorder *flights;
    Watch watch;
};

Real exponential(Pcg32 &generator) { return -log(unit_open<Real>(generator())); }

// How a flight ends.
struct FlightEnd {
    bool collides, stopped; // by a surface
    uint32_t smoke;         // with which it collides
    Vec3 position;
};

// Draws the smoke that a photon collides with, in proportion to density(field).
template <class Density> uint32_t smoke_at(const Medium &medium, Pcg32 &generator, Density &&density) {
    if (medium.count == 1) return 0;
    Real rest = unit_half_open<Real>(generator()) * sum_of_resampled(medium, density);
    uint32_t chosen = 0;
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!medium.smokes[i].field.is_resampled) continue;
        chosen = i;
        rest -= density(medium.smokes[i].field.resampled);
        if (rest < Real(0)) break;
    }
    return chosen;
}

// A collision that is real with a probability of sigma_t / rate.
struct Tentative {
    uint32_t brick;
    Vec3 at; // in the brick, in cells
    Real distance, extinction, rate, probability;
};

// Calls visit(tentative collision) for those of a flight, until it returns false.
template <class Visit>
void for_each_tentative(const Tracer &tracer, const Ray &ray, Real end, Pcg32 &generator, Visit &&visit) {
    const SparseGrid &bricks = tracer.bricks;
    Real begin = Real(0);
    if (!clip(bricks.bounds, ray, begin, end)) return;
    Real rest = exponential(generator);
    uint32_t count = 0;
    for_each_brick(bricks, ray, begin, end, [&](uint32_t brick, Real from, Real to) {
        const Real rate = tracer.distribution.rate[brick], inverse_rate = Real(1) / rate;
        const Vec3 start = position_in(bricks, brick, ray.origin), step = ray.direction * bricks.inverse_cell;
        for (Real t = from;;) {
            const Real depth = rate * (to - t);
            if (!(rest < depth)) {
                rest -= depth;
                return true;
            }
            if (++count % asked_after == 0 && !tracer.watch.go_on(asked_after)) return false;
            if (count == max_tentative) {
                ++tracer.statistics.photons.capped;
                return false;
            }
            t += rest * inverse_rate;
            rest = exponential(generator);
            const Vec3 at = start + step * t;
            const Real sigma = sum_of_resampled(
                tracer.medium, [&](const ResampledField &field) { return extinction(field, brick, at); });
            if (!visit(Tentative{brick, at, t, sigma, rate, min(sigma * inverse_rate, Real(1))})) return false;
        }
    });
}

// The smoke that a photon collides with.
uint32_t smoke_at(const Medium &medium, const Tentative &collision, Pcg32 &generator) {
    return smoke_at(medium, generator,
                    [&](const ResampledField &field) { return extinction(field, collision.brick, collision.at); });
}

// One flight. Calls visit(tentative collision). By delta tracking; or, where `taken` is given, from a light: of all of
// a photon each collision takes its probability of what is left, and the flight ends at one that is chosen in
// proportion to that.
template <class Visit>
FlightEnd fly(const Tracer &tracer, const Ray &ray, Pcg32 &generator, Real *taken, Visit &&visit) {
    constexpr Real least_left = Real(0x1p-20); // less of a photon goes on unseen
    // A light may stand on a surface: its photons begin beyond that.
    const Real begin = taken && tracer.surfaces ? tracer.surfaces->ray_epsilon : Real(0);
    const Real end = distance_to_surface(tracer.surfaces, ray, begin);
    FlightEnd flight = {false, end < infinite_distance, 0, ray.origin};
    for_each_tentative(tracer, ray, end, generator, [&](const Tentative &collision) {
        visit(collision);
        const Real xi = unit_half_open<Real>(generator());
        bool collides, goes_on;
        if (taken) {
            const Real here = (Real(1) - *taken) * collision.probability;
            *taken += here;
            collides = xi * *taken < here;
            goes_on = Real(1) - *taken > least_left;
        } else {
            collides = xi * collision.rate < collision.extinction;
            goes_on = !collides;
        }
        if (collides)
            flight = {true, false, smoke_at(tracer.medium, collision, generator),
                      ray.origin + ray.direction * collision.distance};
        return goes_on;
    });
    return flight;
}

void record_flight(const Tracer &tracer, const Ray &ray, Real end, bool collides, const Color &power) {
    tracer.flights->on_flight(tracer.flights->context,
                              {tracer.medium, tracer.statistics.photons.emitted - 1, ray, end, collides, power});
}

// A photon where its path starts.
struct Start {
    Color power; // 0: there is none
    Vec3 direction;
    FlightEnd collision; // the first; from where smoke glows, or from a light, there is none yet
};

Start start_at_light(const Tracer &tracer, const PhotonSource &source, const Color &color, uint64_t key) {
    const Photon photon = emit(source.emitter, tracer.medium.sphere, photon_event(key, 0));
    if (!photon.emitted) ++tracer.statistics.photons.escaped;
    return {photon.emitted ? color : Color(Real(0)), photon.ray.direction, {false, false, 0, photon.ray.origin}};
}

// A photon that starts around a node: where light first collides, or where smoke glows.
Start start_at_node(const Tracer &tracer, const PhotonSource &source, const Color &color, const StartCursor &cursor,
                    Pcg32 &generator) {
    const Start nowhere = {Color(Real(0)), {}, {}};
    const Vec3 x = draw_start(tracer, cursor, generator);
    auto &counts = tracer.statistics.photons;
    const bool glows = source.light >= tracer.depths.light_count;
    const Real here = glows ? Real(1) : power_between_nodes(tracer, source, x);
    if (!(here > Real(0))) { // outside of the smoke
        ++counts.escaped;
        return nowhere;
    }
    Start start = {color * here, {}, {!glows, false, 0, x}};
    if (glows) {
        const Phase::Cosine angle = Phase(Real(0)).sample(unit_open<Real>(generator()));
        const Real turns = unit_half_open<Real>(generator());
        start.direction = deflect(Vec3(Real(0), Real(0), Real(1)), angle, turns);
        return start;
    }
    const Light &light = tracer.depths.lights[source.light];
    const Illumination from = illuminate(light, x, x, x);
    if (light.kind == LightKind::spot && !in_cone(from.direction, light.direction, light.one_minus_cosine)) {
        ++counts.escaped;
        return nowhere;
    }
    TreeCounts unused = {};
    if (has(parts::surfaces) && tracer.surfaces && is_blocked_in_space(*tracer.surfaces, x, from, unused)) {
        ++counts.blocked;
        return nowhere;
    }
    start.direction = from.direction;
    start.collision.smoke =
        smoke_at(tracer.medium, generator, [&](const ResampledField &field) { return extinction(field, x); });
    ++counts.collisions;
    if (is_recording(tracer.flights)) {
        const Box &box = tracer.bricks.bounds;
        const Real reach = light.kind == LightKind::parallel ? length(box.high - box.low) : from.distance;
        record_flight(tracer, {x - from.direction * reach, from.direction}, reach, true, start.power);
    }
    return start;
}

// `target`: a number below the sum of all weights, which chooses the source and the node.
void trace_photon(const Tracer &tracer, const FluenceSums &fluence, uint64_t target, uint64_t key, Pcg32 &generator,
                  StartCursor &cursor) {
    seek(tracer, target, cursor);
    const SparseGrid &bricks = tracer.bricks;
    const Medium &medium = tracer.medium;
    const PhotonSource &source = source_at(tracer, cursor);
    auto &counts = tracer.statistics.photons;
    ++counts.emitted;
    const Color color = fluence.channels == 1 ? Color(Real(1)) : source.color / source.max_channel;
    bool from_light = source.starts_at_light(); // and has not collided yet
    const Start start = from_light ? start_at_light(tracer, source, color, key)
                                   : start_at_node(tracer, source, color, cursor, generator);
    if (!(largest(start.power) > Real(0))) return;
    Color power = start.power;
    FlightEnd at = start.collision;
    Ray ray = {at.position, start.direction};
    for (uint32_t number = 0;; ++number) {
        if (at.collides) {
            // The photon survives if xi < q. The comparison is strict: an albedo of 0 never survives, and 1 always
            // does.
            const SmokeVolume &smoke = medium.smokes[at.smoke];
            const Color scattered = power * smoke.albedo;
            const Real q = largest(scattered) / largest(power);
            if (!(unit_half_open<Real>(generator()) < q)) {
                ++counts.absorbed;
                return;
            }
            power = scattered / q;
            ray.origin = at.position;
            const Phase::Cosine angle = smoke.phase.sample(unit_open<Real>(generator()));
            ray.direction = deflect(ray.direction, angle, unit_half_open<Real>(generator()));
        }
        const uint64_t capped = counts.capped;
        const SphericalHarmonics halves = fluence.harmonics ? halves_of(ray.direction) : SphericalHarmonics{};
        Real taken = Real(0);
        at = fly(tracer, ray, generator, from_light ? &taken : nullptr, [&](const Tentative &collision) {
            if (from_light) return; // its light is single scattering
            Real part = scale_pow2(collision.probability, tracer.distribution.deposit_shift);
            if (tracer.eye)
                part *= (*tracer.eye)(low_of(bricks, collision.brick) + collision.at * bricks.cell, ray.direction);
            deposit(fluence, collision.brick, collision.at, power * part, ray.direction, halves);
        });
        if (counts.capped != capped || !tracer.watch.go_on(units_of_flight)) return;
        if (from_light) power = power * (taken / source.most_power);
        if (is_recording(tracer.flights))
            record_flight(tracer, ray,
                          at.collides ? length(at.position - ray.origin)
                                      : distance_to_surface(tracer.surfaces, ray, Real(0)),
                          at.collides, power);
        if (!at.collides) {
            ++(at.stopped ? counts.blocked : counts.escaped);
            return;
        }
        ++counts.collisions;
        if (!from_light) ++counts.stored;
        from_light = false;
        if (number == max_collisions) {
            ++counts.capped;
            return;
        }
    }
}

detail::Wide whole_product(uint64_t a, uint64_t b) { // both below 2^63
    return detail::product<detail::Wide>(static_cast<int64_t>(a), static_cast<int64_t>(b));
}

Status trace_batches(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, const TowardsEye *eye, FluenceSums &fluence) {
    const Settings &settings = tracing.settings;
    Arena &arena = tracing.arena;
    Statistics &statistics = tracing.statistics;
    const size_t mark = arena.mark();
    StartCursor *cursor = arena.make<StartCursor>(1);
    if (!cursor) return Status::out_of_memory;
    const Tracer tracer = {{tracing.medium, *fluence.bricks, depths, distribution},
                           tracing.surfaces,
                           statistics,
                           eye,
                           tracing.flights,
                           tracing.watch};
    cursor->entry = UINT64_MAX;
    const uint64_t total = sum_of_weights(distribution, *fluence.bricks);
    const auto first_weight = [&](uint64_t photon) {
        return detail::divide(whole_product(photon, total), settings.photons).quotient;
    };
    const auto &counts = statistics.photons;
    bool fits = true;
    const Status status = for_each_batch(tracing, [&](Mt19937 &keys, uint64_t batch, uint64_t photons) {
        uint64_t photon = batch * batch_photons;
        return for_each_photon(tracing, keys, photons, [&](uint64_t key) {
            // Stratification: photon i takes the i-th of `settings.photons` equal intervals of all weights, and a
            // random place in that interval.
            Pcg32 generator(key);
            const uint64_t from = first_weight(photon), width = first_weight(photon + 1) - from;
            const detail::Wide place = whole_product(width, generator());
            const uint64_t offset =
                static_cast<uint64_t>(detail::high_word(place)) << 32 | detail::low_word(place) >> 32;
            trace_photon(tracer, fluence, from + offset, key, generator, *cursor);
            ++photon;
            return fits = counts.stored + counts.emitted <= max_fluence_flights;
        });
    });
    arena.rewind(mark);
    return fits ? status : Status::overflow;
}

} // namespace

uint64_t fluence_bytes(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing) {
    return Arena::bytes<int64_t>(sums_of_fluence(needs, bricks, spacing)) + emission_bytes(scene, bricks) +
           Arena::bytes<StartCursor>(1) + batch_bytes;
}

Status trace_fluence(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, int32_t spacing, PhotonSums &sums,
                     FluenceSums &fluence) {
    const SparseGrid &bricks = *tracing.medium.bricks;
    const Settings &settings = tracing.settings;
    const PhotonNeeds &needs = tracing.needs;
    const Status laid_out = lay_out_sums(tracing, bricks, spacing, sums, fluence);
    if (laid_out != Status::done) return laid_out;
    fluence.sigma_shift = distribution.shift;
    if (sum_of_weights(distribution, bricks) == 0) return Status::done;
    fluence.photon_color = distribution.sources[0].color / distribution.sources[0].max_channel;
    fluence.unit = fluence.photon = photon_unit(emitted_power(distribution, bricks), settings.photons);
    fluence.unit.exponent -= distribution.deposit_shift;
    if (!needs.towards_eye) return trace_batches(tracing, depths, distribution, nullptr, fluence);
    const Phase phase = common_phase(tracing.medium);
    const bool is_peaked = phase.asymmetry() > Real(max_asymmetry_of_harmonics);
    const TowardsEye eye(tracing.eye, is_peaked
                                          ? forward_peak(tracing.medium, depths.lights, depths.light_count, tracing.eye)
                                          : ForwardPeak(phase));
    fluence.unit.exponent -= eye.shift;
    fluence.straight = eye.peak.narrow;
    fluence.largest = eye.peak.largest * four_pi<Real>;
    fluence.one_eye = one_eye(fluence, tracing.eye);
    return trace_batches(tracing, depths, distribution, &eye, fluence);
}

} // namespace wisp::WISP_ARITH
