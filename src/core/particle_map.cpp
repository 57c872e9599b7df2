// Deposits on particles (S4-3).
#include "wisp/particle_map.h"

namespace wisp::WISP_ARITH {

namespace {

int64_t to_units(Real x) { return round_to_int(scale_pow2(min(x, Real(127)), deposit_bits)); }

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

bool make_deposits(const Scene &scene, const PhotonNeeds &needs, Arena &arena, Deposits *deposits) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        Deposits &d = deposits[i];
        d = {};
        d.count = elements_of(scene.smokes[i]);
        d.channels = needs.powers ? 3 : 1;
        const uint64_t powers = uint64_t{d.count} * d.channels, fluxes = uint64_t{d.count} * 3;
        d.power = arena.make<int64_t>(powers);
        if (!d.power) return false;
        for (uint64_t k = 0; k < powers; ++k) d.power[k] = 0;
        if (scene.smokes[i].asymmetry == 0) continue;
        d.flux = arena.make<int64_t>(fluxes);
        if (!d.flux) return false;
        for (uint64_t k = 0; k < fluxes; ++k) d.flux[k] = 0;
    }
    return true;
}

} // namespace

ParticleMapPlan plan_particle_map(const Scene &scene, const Settings &settings) {
    ParticleMapPlan plan = {photon_needs(scene, settings), 0};
    if (!plan.needs.traced) return plan;
    plan.bytes = Arena::bytes<Deposits>(scene.smoke_count) +
                 Arena::bytes<Emitter>(uint64_t{scene.light_count} + scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const uint64_t count = elements_of(scene.smokes[i]);
        plan.bytes += Arena::bytes<int64_t>(count * (plan.needs.powers ? 3 : 1));
        if (scene.smokes[i].asymmetry != 0) plan.bytes += Arena::bytes<int64_t>(count * 3);
    }
    return plan;
}

Status trace_particle_map(const Scene &scene, const Medium &medium, const Light *lights, const Settings &settings,
                          const PhotonNeeds &needs, const Observer &observer, Arena &arena, Statistics &statistics,
                          ParticleMap &map) {
    map = {};
    if (!needs.traced) return Status::done;
    Deposits *deposits = arena.make<Deposits>(medium.count);
    if (!deposits || !make_deposits(scene, needs, arena, deposits)) return Status::out_of_memory;
    const Emitters emitters = find_emitters(medium, lights, scene.light_count, arena);
    if (!emitters.list) return Status::out_of_memory;
    if (emitters.count == 0) return Status::done;
    const Status status = for_each_batch(settings.photons, observer, [&](uint64_t batch, uint64_t photons) {
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
            return true;
        });
    });
    map = {deposits, emitters.list[0].photon_color, photon_unit(emitters.power, statistics.photons.emitted)};
    return status;
}

} // namespace wisp::WISP_ARITH
