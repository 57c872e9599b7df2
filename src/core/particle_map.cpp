// Deposits on particles, and the source functions that they make (S4-3).
#include "wisp/particle_map.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr int32_t unit_bits = 24; // of a deposit

int64_t to_units(Real x) { return round_to_int(scale_pow2(max(Real(-127), min(x, Real(127))), unit_bits)); }
Real from_units(int64_t sum) { return scaled_integer<Real>(sum, -unit_bits); }

void deposit(const Deposits &deposits, uint32_t element, const Color &photon, const Vec3 &direction, Real share) {
    const Color power = photon * share;
    int64_t *to = deposits.power + uint64_t{element} * deposits.channels;
    if (deposits.channels == 1) {
        *to += to_units(share);
    } else {
        to[0] += to_units(power.x);
        to[1] += to_units(power.y);
        to[2] += to_units(power.z);
    }
    if (!deposits.flux) return;
    const Vec3 flux = direction * (power.x + power.y + power.z);
    int64_t *sum = deposits.flux + uint64_t{element} * 3;
    sum[0] += to_units(flux.x);
    sum[1] += to_units(flux.y);
    sum[2] += to_units(flux.z);
}

// The sums of all smokes, one behind the other: powers, then fluxes. Made 0 where there are none yet.
Status make_deposits(const Scene &scene, const PhotonNeeds &needs, MapSums &sums, Deposits *deposits) {
    uint64_t count = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        Deposits &d = deposits[i];
        d = {};
        d.count = elements_of(scene.smokes[i]);
        d.channels = needs.powers ? 3 : 1;
        const auto take = [&](uint64_t numbers) {
            count += numbers;
            return count <= sums.capacity ? sums.values + (count - numbers) : nullptr;
        };
        d.power = take(uint64_t{d.count} * d.channels);
        if (scene.smokes[i].asymmetry != 0) d.flux = take(uint64_t{d.count} * 3);
    }
    if (sums.count != 0) return sums.count == count ? Status::done : Status::wrong_sums;
    if (count > sums.capacity) return Status::out_of_memory;
    sums.count = count;
    for (uint64_t k = 0; k < count; ++k) sums.values[k] = 0;
    return Status::done;
}

// What all photons put on an element, in photons.
Color power_of(const Deposits &deposits, const Color &photon_color, uint32_t element) {
    const int64_t *sum = deposits.power + uint64_t{element} * deposits.channels;
    if (deposits.channels == 1) return photon_color * from_units(*sum);
    return Color(from_units(sum[0]), from_units(sum[1]), from_units(sum[2]));
}

// p towards `out` of light that arrives with a flux: Henyey and Greenstein's about the flux's direction, with g times
// the share of the power that flows that way. Positive, exact for even light, right in its first moment.
Real phase_of_flux(const Phase &phase, const Deposits &deposits, const Color &power, uint32_t element,
                   const Vec3 &out) {
    const int64_t *sum = deposits.flux + uint64_t{element} * 3;
    const Vec3 flux(from_units(sum[0]), from_units(sum[1]), from_units(sum[2]));
    const Real all = power.x + power.y + power.z, along = length(flux);
    if (!(along > all * Real(0x1p-16))) return inv_four_pi<Real>; // a direction out of rounding (D7)
    return phase.with_share(min(along / all, Real(1)))(flux / along, out);
}

struct Element {
    Vec3 position;
    Real cross_section; // the integral of its part of sigma_t
};
Element element_of(const Smoke &smoke, uint32_t index) {
    if (smoke.field.is_grid) {
        const GridField &grid = smoke.field.grid;
        const Vec3 &edge = grid.between.edge;
        return {position_of_sample(grid, index), grid.extinction[index] * edge.x * edge.y * edge.z};
    }
    const PointTree &tree = smoke.field.particles.tree;
    return {Vec3(tree.x[index], tree.y[index], tree.z[index]),
            to_real<Real>(smoke.source->particles[tree.id[index]].area)};
}

// power / cross-section * 2^exponent * unit, half of the scaling before the division: in fixed point neither leaves the
// range.
Color per_cross_section(const Color &power, Real cross_section, const PhotonUnit &unit) {
    const int32_t half = unit.exponent / 2;
    return scale_pow2(scale_pow2(power, half) * unit.unit / cross_section, unit.exponent - half);
}

// Sum of p times the light that was scattered before, towards the eye, at an element.
Color multiple_scattering(const ParticleMap &map, const Smoke &smoke, uint32_t index, uint32_t i,
                          const Element &element, const Vec3 &eye) {
    if (!map.of_smoke) return Color(Real(0));
    const Deposits &deposits = map.of_smoke[index];
    const Color power = power_of(deposits, map.photon_color, i);
    if (!(largest(power) > Real(0))) return power;
    Real p = inv_four_pi<Real>;
    if (deposits.flux) {
        const Vec3 way = eye - element.position;
        const Real distance = length(way);
        if (distance > Real(0)) p = phase_of_flux(smoke.phase, deposits, power, i, way / distance);
    }
    return per_cross_section(power * p, element.cross_section, map.unit);
}

} // namespace

ParticleMapPlan plan_particle_map(const Scene &scene, const Settings &settings) {
    ParticleMapPlan plan = {photon_needs(scene, settings), 0, 0};
    if (!plan.needs.traced) return plan;
    plan.bytes = Arena::bytes<Deposits>(scene.smoke_count) +
                 Arena::bytes<Emitter>(uint64_t{scene.light_count} + scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const uint64_t count = elements_of(scene.smokes[i]);
        plan.sums += count * ((plan.needs.powers ? 3 : 1) + (scene.smokes[i].asymmetry != 0 ? 3 : 0));
    }
    plan.bytes += Arena::bytes<int64_t>(plan.sums);
    return plan;
}

uint64_t most_deposits(const Settings &settings) {
    // The largest is a flux: R + G + B of a photon, at most 3; along a flight what to_units lets pass.
    const int32_t bits = unit_bits + (settings.deposit == Deposit::path ? 7 : 2);
    return (uint64_t{1} << (63 - bits)) - (most_collisions + 1);
}

Status trace_particle_map(const Scene &scene, const Medium &medium, const Light *lights, const Settings &settings,
                          const PhotonNeeds &needs, const Batches &batches, const Observer &observer, Arena &arena,
                          MapSums &sums, Statistics &statistics, ParticleMap &map) {
    map = {};
    if (!needs.traced) return sums.count == 0 ? Status::done : Status::wrong_sums;
    Deposits *deposits = arena.make<Deposits>(medium.count);
    if (!deposits) return Status::out_of_memory;
    const Status made = make_deposits(scene, needs, sums, deposits);
    if (made != Status::done) return made;
    statistics.bytes.particle_map = sums.count * sizeof(int64_t);
    const Emitters emitters = find_emitters(medium, lights, scene.light_count, arena);
    if (!emitters.list) return Status::out_of_memory;
    if (emitters.count == 0) return Status::done;
    const auto &counts = statistics.photons;
    const uint64_t most = most_deposits(settings);
    bool fits = true;
    const Status status = for_each_batch(settings.photons, batches, observer, [&](uint64_t batch, uint64_t photons) {
        return for_each_photon(settings.seed, batch, photons, [&](uint64_t key) {
            trace_photon(
                medium, emitters, key, statistics,
                [&](const MediumCollision &at, const Photon &arrived, const Color &power) {
                    if (settings.deposit == Deposit::exact)
                        deposit(deposits[at.smoke], at.element, power, arrived.ray.direction, Real(1));
                    ++statistics.photons.stored;
                },
                [&](const Photon &photon, Real end, const Color &power) {
                    if (settings.deposit != Deposit::path) return;
                    for (uint32_t s = 0; s < medium.count; ++s)
                        for_each_depth(medium.smokes[s].field, photon.ray, end, [&](uint32_t element, Real depth) {
                            deposit(deposits[s], element, power, photon.ray.direction, depth);
                        });
                });
            return fits = counts.stored + counts.emitted <= most;
        });
    });
    map = {deposits, emitters.list[0].photon_color, photon_unit(emitters.power, settings.photons)};
    return fits ? status : Status::overflow;
}

const Color *const *make_sources(const Scene &scene, const Medium &medium, const ParticleMap &map, const Vec3 &eye,
                                 Arena &arena) {
    const Color **sources = arena.make<const Color *>(medium.count);
    if (!sources) return nullptr;
    for (uint32_t s = 0; s < medium.count; ++s) {
        const Smoke &smoke = medium.smokes[s];
        const uint32_t count = elements_of(scene.smokes[s]);
        Color *source = arena.make<Color>(count);
        if (!source) return nullptr;
        sources[s] = source;
        const Color glow = (Color(Real(1)) - smoke.albedo) * smoke.emission;
        for (uint32_t i = 0; i < count; ++i) {
            const Element element = element_of(smoke, i);
            source[i] = Color(Real(0));
            if (element.cross_section > Real(0))
                source[i] = smoke.albedo * multiple_scattering(map, smoke, s, i, element, eye) + glow;
        }
    }
    return sources;
}

uint64_t source_bytes(const Scene &scene) {
    uint64_t bytes = Arena::bytes<const Color *>(scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) bytes += Arena::bytes<Color>(elements_of(scene.smokes[i]));
    return bytes;
}

} // namespace wisp::WISP_ARITH
