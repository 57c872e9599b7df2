// Photons from the first collisions of light in resampled smoke, and their fluence (S2, S4-3).
#include "core/photons/fluence_grid.h"
#include "core/shadows/shadows_in_space.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr int32_t brick_nodes = nodes_along(1);
constexpr uint32_t asked_after = 1 << 12; // tentative collisions of a flight
constexpr uint32_t units_of_tent = 2;     // of work

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

// A fraction of a number of units of 2^-24, rounded to nearest.
int64_t units_of(Real weight, Real units) { return truncate(weight * units + Real(0.5)); }

// Deposits harmonics at the nearest node only: they vary little between nodes, and twelve numbers at eight corners
// would take long.
void deposit_harmonics(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, Real power,
                       const SphericalHarmonics &halves) {
    const int32_t spacing = harmonic_spacing(fluence.spacing), n = nodes_along(spacing);
    const Vec3 q = p * (Real(n - 1) * Real(1.0 / brick_cells)) + Vec3(Real(0.5));
    const auto nearest = [n](Real x) { return min(truncate(max(x, Real(0))), n - 1); };
    const int32_t node = (nearest(q.z) * n + nearest(q.y)) * n + nearest(q.x);
    int64_t *sum =
        fluence.harmonics + (size_t{brick} * nodes_of(spacing) + static_cast<uint32_t>(node)) * harmonic_numbers;
    const Real units = scale_pow2(power, deposit_bits); // below 2^27: power is at most 3.75
    sum[0] += truncate(units);
    for (uint32_t i = 0; i < harmonic_count; ++i) sum[1 + i] += truncate(halves.value[i] * units);
}

// (1 + m) / 2 for each harmonic m of a direction: not below 0.
SphericalHarmonics halves_of(const Vec3 &direction) {
    SphericalHarmonics halves = harmonics_of(direction);
    for (Real &m : halves.value) m = max(Real(0), Real(0.5) * m + Real(0.5));
    return halves;
}

// How a deposit at p is shared among the corners of its cell.
CornerWeights weights_of_corners(const FluenceSums &fluence, uint32_t brick, const CellPosition &at, const Vec3 &p) {
    const SparseGrid &bricks = *fluence.bricks;
    CornerWeights weights;
    if (fluence.cut.any() && fluence.cut.is_cut(brick, at.node))
        find_weights_in_cut_cell(fluence.cut, brick, at, low_of(bricks, brick) + p * bricks.cell, weights);
    else
        for (uint32_t corner = 0; corner < 8; ++corner) weights.of[corner] = corner_weight(at.t, corner);
    return weights;
}

// Deposits a photon that flies along `direction` at a place in a brick.
void deposit(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, const Color &power, const Vec3 &direction,
             const SphericalHarmonics &halves) {
    const int32_t spacing = fluence.spacing;
    const int32_t n = nodes_along(spacing);
    const CellPosition at = find_cell(p, spacing);
    const size_t first = size_t{brick} * nodes_of(spacing) + at.node;
    const CornerWeights weight = weights_of_corners(fluence, brick, at, p);
    const auto node = [&](uint32_t corner) { return first + offset_of_corner(corner, n); };
    for (uint32_t c = 0; c < fluence.channels; ++c) {
        const Real units = scale_pow2(power[static_cast<int>(c)], deposit_bits);
        for (uint32_t corner = 0; corner < 8; ++corner)
            fluence.power[node(corner) * fluence.channels + c] += units_of(weight.of[corner], units);
    }
    if (!fluence.flux) return;
    const Vec3 flux = direction * (power.x + power.y + power.z);
    for (uint32_t corner = 0; corner < 8; ++corner)
        for (uint32_t c = 0; c < 3; ++c) {
            const Real units = scale_pow2(flux[static_cast<int>(c)], deposit_bits);
            const int64_t amount = units_of(weight.of[corner], abs(units));
            fluence.flux[node(corner) * 3 + c] += units < Real(0) ? -amount : amount;
        }
    if (fluence.harmonics) deposit_harmonics(fluence, brick, p, power.x + power.y + power.z, halves);
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

FluencePlan plan_fluence(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing) {
    FluencePlan plan = {0, 0};
    if (!needs.traced) return plan;
    plan.sums = bricks * nodes_of(spacing) * ((needs.powers ? 3 : 1) + (needs.directions ? 3 : 0)) +
                (needs.harmonics ? bricks * nodes_of(harmonic_spacing(spacing)) * harmonic_numbers : 0);
    plan.bytes =
        Arena::bytes<int64_t>(plan.sums) + emission_bytes(scene, bricks) + Arena::bytes<StartCursor>(1) + batch_bytes;
    return plan;
}

Status trace_fluence(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, int32_t spacing, PhotonSums &sums,
                     FluenceSums &fluence) {
    const SparseGrid &bricks = *tracing.medium.bricks;
    const Settings &settings = tracing.settings;
    const PhotonNeeds &needs = tracing.needs;
    const uint64_t nodes = uint64_t{bricks.count} * nodes_of(spacing);
    fluence = {&tracing.medium,        &bricks,        spacing,      sums.values,        nullptr, nullptr,
               needs.powers ? 3u : 1u, Color(Real(1)), {Real(1), 0}, distribution.shift, nullptr};
    const uint64_t powers = nodes * fluence.channels, with_flux = powers + (needs.directions ? nodes * 3 : 0);
    const uint64_t harmonic_nodes = uint64_t{bricks.count} * nodes_of(harmonic_spacing(spacing));
    const uint64_t numbers = with_flux + (needs.harmonics ? harmonic_nodes * harmonic_numbers : 0);
    if (needs.directions) fluence.flux = sums.values + powers;
    if (needs.harmonics) fluence.harmonics = sums.values + with_flux;
    if (sums.count != 0 && sums.count != numbers) return Status::size_mismatch;
    if (numbers > sums.capacity) return Status::out_of_memory;
    if (tracing.surfaces &&
        !find_cut_cells(*tracing.surfaces, bricks, spacing, tracing.arena, tracing.watch, fluence.cut))
        return Status::out_of_memory;
    if (sums.count == 0 && !fill(sums.values, numbers, int64_t{0}, tracing.watch)) return Status::stopped;
    sums.count = numbers;
    tracing.statistics.bytes.particle_map = numbers * sizeof(int64_t);

    if (sum_of_weights(distribution, bricks) == 0) return Status::done;
    fluence.photon_color = distribution.sources[0].color / distribution.sources[0].max_channel;
    fluence.unit = photon_unit(emitted_power(distribution, bricks), settings.photons);
    fluence.unit.exponent -= distribution.deposit_shift;
    if (!needs.towards_eye) return trace_batches(tracing, depths, distribution, nullptr, fluence);
    const TowardsEye eye(tracing.eye, forward_peak(tracing.medium, depths.lights, depths.light_count, tracing.eye));
    fluence.unit.exponent -= eye.shift;
    fluence.straight = eye.peak.narrow;
    return trace_batches(tracing, depths, distribution, &eye, fluence);
}

namespace {

// What the nodes of a brick along one axis give to the integral of sigma_t times the tent of a node: weights of nodes
// `first` to `last`, in sixths of a cell. In whole cells these are exact.
struct AxisWeights {
    int32_t first, last;
    Real weight[brick_nodes];
};

// The tent of node `at` is `spacing` cells wide to either side; smoke lies between `low` and `high`; all in cells from
// the low corner of the brick.
AxisWeights weights_along(int32_t at, int32_t spacing, Real low, Real high) {
    AxisWeights axis = {max(at - spacing, 0), min(at + spacing, brick_cells), {}};
    const auto tent = [&](int32_t t) { return Real(1) - Real(t < at ? at - t : t - at) / Real(spacing); };
    for (int32_t c = axis.first; c < axis.last; ++c) {
        const Real a = min(max(low - Real(c), Real(0)), Real(1)), b = min(max(high - Real(c), Real(0)), Real(1));
        if (!(a < b)) continue;
        // Between nodes c and c + 1, at u from a to b, the tent is p + q u and sigma_t is linear.
        const Real p = tent(c), q = tent(c + 1) - p;
        const Real one = Real(6) * (b - a), two = Real(3) * (b * b - a * a), three = Real(2) * (b * b * b - a * a * a);
        const Real above = p * two + q * three;
        axis.weight[c + 1] += above;
        axis.weight[c] += p * one + q * two - above;
    }
    return axis;
}

// The integrals of sigma_t 2^sigma_shift times the tents of a brick's nodes over that brick, in units of 1/216 of a
// cell.
void find_tents_of_brick(const FluenceSums &fluence, uint32_t brick, Real *tents) {
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    const Vec3 low = (bricks.bounds.low - low_of(bricks, brick)) * bricks.inverse_cell,
               high = (bricks.bounds.high - low_of(bricks, brick)) * bricks.inverse_cell;
    AxisWeights along[3][brick_nodes];
    for (int axis = 0; axis < 3; ++axis)
        for (int32_t i = 0; i < n; ++i) along[axis][i] = weights_along(i * spacing, spacing, low[axis], high[axis]);
    for (uint32_t node = 0; node < nodes_of(spacing); ++node) {
        const Cell at = cell_of_index(n, node);
        const AxisWeights &x = along[0][at.x], &y = along[1][at.y], &z = along[2][at.z];
        Real sum = Real(0);
        for (uint32_t s = 0; s < fluence.medium->count; ++s) {
            if (!fluence.medium->smokes[s].field.is_resampled) continue;
            const Real *sigma = fluence.medium->smokes[s].field.resampled.nodes(brick);
            for (int32_t k = z.first; k <= z.last; ++k)
                for (int32_t j = y.first; j <= y.last; ++j) {
                    Real row = Real(0);
                    for (int32_t i = x.first; i <= x.last; ++i)
                        row += x.weight[i] *
                               scale_pow2(sigma[(k * brick_nodes + j) * brick_nodes + i], fluence.sigma_shift);
                    sum += y.weight[j] * z.weight[k] * row;
                }
        }
        tents[node] = sum;
    }
}

// Within cut cells the corners' weights are others: adds the integrals of what these differ by from tents, by random
// points.
void restrict_tents_of_brick(const FluenceSums &fluence, uint32_t brick, Real *tents) {
    constexpr uint32_t points = 64; // a cell
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    Pcg32 generator(brick);
    for (uint32_t node = 0; node < nodes_of(spacing); ++node) {
        if (!fluence.cut.is_cut(brick, node)) continue;
        const Cell lowest = cell_of_index(n, node);
        for (uint32_t point = 0; point < points; ++point) { // one in each of 4 x 4 x 4 parts of the cell
            const Cell part = cell_of_index(4, point);
            Vec3 t(Real(part.x), Real(part.y), Real(part.z));
            for (int axis = 0; axis < 3; ++axis) t[axis] = (t[axis] + unit_half_open<Real>(generator())) * Real(0.25);
            const Vec3 p = (Vec3(Real(lowest.x), Real(lowest.y), Real(lowest.z)) + t) * Real(spacing);
            const Vec3 x = low_of(bricks, brick) + p * bricks.cell;
            if (!is_strictly_inside(bricks.bounds, x)) continue;
            const Real sigma = sum_of_resampled(
                *fluence.medium, [&](const ResampledField &field) { return extinction(field, brick, p); });
            if (!(sigma > Real(0))) continue;
            CornerWeights weights;
            find_weights_in_cut_cell(fluence.cut, brick, {node, t}, x, weights);
            const Real amount =
                scale_pow2(sigma, fluence.sigma_shift) * (Real(216.0 / points) * Real(spacing * spacing * spacing));
            for (uint32_t corner = 0; corner < 8; ++corner)
                tents[node + offset_of_corner(corner, n)] += (weights.of[corner] - corner_weight(t, corner)) * amount;
        }
    }
}

} // namespace

bool find_tents(FluenceSums &fluence, Arena &arena, Watch watch) {
    const uint32_t nodes = nodes_of(fluence.spacing);
    Real *tents = arena.make<Real>(uint64_t{fluence.bricks->count} * nodes);
    if (!tents) return false;
    for (uint32_t b = 0; b < fluence.bricks->count; ++b) {
        if (!watch.go_on(nodes * units_of_tent)) return false;
        find_tents_of_brick(fluence, b, tents + size_t{b} * nodes);
        if (fluence.cut.any()) restrict_tents_of_brick(fluence, b, tents + size_t{b} * nodes);
    }
    fluence.tents = tents;
    return true;
}

bool light_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node, FluenceAndFlux &light) {
    constexpr Real least = Real(0x1p-10);
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    int64_t power[3] = {0, 0, 0}, flux[3] = {0, 0, 0};
    Real integral = Real(0), densest = Real(0); // of sigma_t times the node's tent; of all holders
    for_each_holder(bricks, bricks.position[brick], node, n, [&](uint32_t other, uint32_t there) {
        densest = max(densest, sum_of_resampled(*fluence.medium, [other](const ResampledField &field) {
                          return field.majorants[other];
                      }));
        const size_t k = size_t{other} * nodes_of(spacing) + there;
        integral += fluence.tents[k];
        for (uint32_t c = 0; c < fluence.channels; ++c)
            power[c] = wrapped_sum(power[c], fluence.power[k * fluence.channels + c]);
        for (uint32_t c = 0; fluence.flux && c < 3; ++c) flux[c] = wrapped_sum(flux[c], fluence.flux[k * 3 + c]);
    });
    integral *= Real(1.0 / 216);
    light = {Color(Real(0)), Vec3(Real(0))};
    if (!(integral > scale_pow2(densest, fluence.sigma_shift) * (least * Real(spacing * spacing * spacing))))
        return false;
    const Color sum = fluence.channels == 1 ? fluence.photon_color * photons_of(power[0])
                                            : Color(photons_of(power[0]), photons_of(power[1]), photons_of(power[2]));
    const Real all = sum.x + sum.y + sum.z;
    if (fluence.flux && all > Real(0))
        light.flux = Vec3(photons_of(flux[0]), photons_of(flux[1]), photons_of(flux[2])) / all;
    // sum / integral * unit * 2^exponent; half of the scaling comes before the division.
    const Vec3 &cell = bricks.cell;
    const int32_t exponent = fluence.unit.exponent + fluence.sigma_shift, half = exponent / 2;
    const Color scaled = scale_pow2(sum * (inv_four_pi<Real> * fluence.unit.unit), half);
    light.radiance = scale_pow2(scaled / (cell.x * cell.y * cell.z * integral), exponent - half);
    return true;
}

SphericalHarmonics harmonics_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node) {
    const int32_t spacing = harmonic_spacing(fluence.spacing);
    int64_t sum[harmonic_numbers] = {};
    for_each_holder(*fluence.bricks, fluence.bricks->position[brick], node, nodes_along(spacing),
                    [&](uint32_t other, uint32_t there) {
                        const size_t k = size_t{other} * nodes_of(spacing) + there;
                        for (uint32_t i = 0; i < harmonic_numbers; ++i)
                            sum[i] = wrapped_sum(sum[i], fluence.harmonics[k * harmonic_numbers + i]);
                    });
    SphericalHarmonics harmonics = {};
    const Real all = photons_of(sum[0]);
    for (uint32_t i = 0; all > Real(0) && i < harmonic_count; ++i) // (1 + m) / 2 minus (1 - m) / 2
        harmonics.value[i] = photons_of(wrapped_difference(sum[1 + i], wrapped_difference(sum[0], sum[1 + i]))) / all;
    return harmonics;
}

} // namespace wisp::WISP_ARITH
