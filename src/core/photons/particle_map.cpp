// Deposits of photons on particles (S4-3).
#include "core/numbers/double_bits.h"
#include "core/photons/particle_map.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

int64_t to_units(Real x) { return round_to_int(scale_pow2(max(Real(-127), min(x, Real(127))), deposit_bits)); }

// A fraction of a photon, in units.
struct Units {
    int64_t power[3], flux[3];
};
Units units_of(const Deposits &deposits, const Color &photon, const Vec3 &direction, Real weight) {
    const Color power = photon * weight;
    const Vec3 flux = direction * (deposits.direction_kind == Direction::mean ? weight : power.x + power.y + power.z);
    return {{to_units(deposits.channels == 1 ? weight : power.x), to_units(power.y), to_units(power.z)},
            {to_units(flux.x), to_units(flux.y), to_units(flux.z)}};
}

void add_power(const Deposits &deposits, uint32_t element, const Units &plus, const Units &minus) {
    int64_t *sum = deposits.power + uint64_t{element} * deposits.channels;
    for (uint32_t c = 0; c < deposits.channels; ++c) sum[c] += plus.power[c] - minus.power[c];
}

void add_flux(const Deposits &deposits, uint32_t element, const Units &plus, const Units &minus) {
    if (!deposits.flux) return;
    int64_t *sum = deposits.flux + uint64_t{element} * 3;
    for (uint32_t c = 0; c < 3; ++c) sum[c] += plus.flux[c] - minus.flux[c];
}

void deposit(const Deposits &deposits, uint32_t element, const Color &photon, const Vec3 &direction, Real weight) {
    const Units units = units_of(deposits, photon, direction, weight);
    add_power(deposits, element, units, {});
    add_flux(deposits, element, units, {});
}

// Divides the sums among the smokes: for each smoke its powers, then its fluxes. Clears them if they are unused.
Status make_deposits(const Scene &scene, const PhotonNeeds &needs, Direction direction_kind, PhotonSums &sums,
                     Deposits *deposits, Watch watch) {
    uint64_t count = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        Deposits &d = deposits[i];
        d = {};
        d.count = elements_of(scene.smokes[i]);
        d.channels = needs.powers ? 3 : 1;
        d.direction_kind = direction_kind;
        const auto take = [&](uint64_t numbers) {
            count += numbers;
            return count <= sums.capacity ? sums.values + (count - numbers) : nullptr;
        };
        d.power = take(uint64_t{d.count} * d.channels);
        if (total_order_key(scene.smokes[i].asymmetry) != 0) d.flux = take(uint64_t{d.count} * 3);
    }
    if (sums.count != 0) return sums.count == count ? Status::done : Status::size_mismatch;
    if (count > sums.capacity) return Status::out_of_memory;
    sums.count = count;
    return fill(sums.values, count, int64_t{0}, watch) ? Status::done : Status::stopped;
}

} // namespace

bool deposit_by_kernel(const Deposits &deposits, const DensityField &field, const Vec3 &x, const Color &photon,
                       const Vec3 &direction) {
    Real total = Real(0), sum = Real(0);
    for_each_extinction(field, x, [&](uint32_t, Real sigma) { total += sigma; });
    if (!(total > Real(0))) return false;
    // Deposit the differences of the rounded partial sums: together they are the whole photon, to the unit.
    const Units whole = units_of(deposits, photon, direction, Real(1));
    Units before = {};
    for_each_extinction(field, x, [&](uint32_t element, Real sigma) {
        sum += sigma;
        const Units after = units_of(deposits, photon, direction, sum / total);
        add_power(deposits, element, after, before);
        if (deposits.direction_kind == Direction::mean)
            // w_t' += w_p (S4-3): the whole direction. A sample at a grid's border is visited once per corner of the
            // cell that it stands for, and adds the direction each time.
            add_flux(deposits, element, whole, {});
        else
            add_flux(deposits, element, after, before);
        before = after;
    });
    return true;
}

ParticleMapPlan plan_particle_map(const Scene &scene, const Settings &settings) {
    ParticleMapPlan plan = {photon_needs(scene, settings), 0, 0};
    if (!plan.needs.traced) return plan;
    plan.bytes = Arena::bytes<Deposits>(scene.smoke_count) + emitter_bytes(scene) + batch_bytes;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const uint64_t count = elements_of(scene.smokes[i]);
        plan.sums += count * ((plan.needs.powers ? 3 : 1) + (total_order_key(scene.smokes[i].asymmetry) != 0 ? 3 : 0));
    }
    plan.bytes += Arena::bytes<int64_t>(plan.sums);
    return plan;
}

uint64_t max_deposits(const Settings &settings) {
    // The largest deposit is a flux: R + G + B of a photon, at most 3, or the directions of a grid cell's eight
    // corners. A deposit of Deposit::path is at most 127, see to_units().
    const int32_t bits = deposit_bits + (settings.deposit == Deposit::path ? 7 : 3);
    return (uint64_t{1} << (63 - bits)) - (max_collisions + 1);
}

Status trace_particle_map(const PhotonTracing &tracing, const Scene &scene, const Light *lights, PhotonSums &sums,
                          ParticleMap &map) {
    const Medium &medium = tracing.medium;
    const Settings &settings = tracing.settings;
    map = {};
    if (!tracing.needs.traced) return sums.count == 0 ? Status::done : Status::size_mismatch;
    Deposits *deposits = tracing.arena.make<Deposits>(medium.count);
    if (!deposits) return Status::out_of_memory;
    const Status made = make_deposits(scene, tracing.needs, settings.direction, sums, deposits, tracing.watch);
    if (made != Status::done) return made;
    const Emitters emitters = find_emitters(medium, lights, scene.light_count, tracing.arena);
    if (!emitters.list) return Status::out_of_memory;
    if (emitters.count == 0) return Status::done;
    auto &counts = tracing.statistics.photons;
    const uint64_t limit = max_deposits(settings);
    bool fits = true;
    const Status status = for_each_batch(tracing, [&](Mt19937 &generator, uint64_t, uint64_t photons) {
        return for_each_photon(tracing, generator, photons, [&](uint64_t key) {
            trace_photon(
                tracing, emitters, key,
                [&](const MediumCollision &at, const Photon &arrived, const Color &power) {
                    const Deposits &to = deposits[at.smoke];
                    const Ray &ray = arrived.ray;
                    if (settings.deposit == Deposit::exact || settings.deposit == Deposit::nodes)
                        deposit(to, at.element, power, ray.direction, Real(1));
                    const bool stored =
                        settings.deposit != Deposit::kernel ||
                        deposit_by_kernel(to, medium.smokes[at.smoke].field, ray.origin, power, ray.direction);
                    ++(stored ? counts.stored : counts.lost);
                },
                [&](const Photon &photon, Real end, const Color &power) {
                    if (settings.deposit != Deposit::path) return;
                    for (uint32_t s = 0; s < medium.count; ++s)
                        for_each_depth(medium.smokes[s].field, photon.ray, end, [&](uint32_t element, Real depth) {
                            deposit(deposits[s], element, power, photon.ray.direction, depth);
                        });
                });
            return fits = counts.stored + counts.emitted <= limit;
        });
    });
    map = {deposits, emitters.list[0].photon_color, photon_unit(emitters.power, settings.photons)};
    return fits ? status : Status::overflow;
}

} // namespace wisp::WISP_ARITH
