// The photon map: the store, the map of each smoke, and the radiance estimate (S2, S4-2).
#include "core/photons/photon_map.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

// The collisions, in the order of the photons.
struct Store {
    Vec3 *position, *direction; // direction, power and smoke: nullptr where they are not needed
    Color *power;
    uint32_t *smoke;
    uint8_t *rank; // random: at least k with probability 2^-k
    uint64_t count, capacity;
    uint32_t thinning; // only collisions of at least this rank are in the store
};

void copy(const Store &store, uint64_t from, uint64_t to) {
    store.position[to] = store.position[from];
    if (store.direction) store.direction[to] = store.direction[from];
    if (store.power) store.power[to] = store.power[from];
    if (store.smoke) store.smoke[to] = store.smoke[from];
    store.rank[to] = store.rank[from];
}

// Halves what is in the store, on average: those of the lowest rank go.
void thin_out(Store &store) {
    ++store.thinning;
    uint64_t kept = 0;
    for (uint64_t i = 0; i < store.count; ++i)
        if (store.rank[i] >= store.thinning) copy(store, i, kept++);
    store.count = kept;
}

// The number of zeros at the end of a collision's own random number, at most 31.
uint8_t rank_of(uint64_t key, uint64_t collision) {
    uint32_t bits = draw(photon_event(key, collision), dimension_rank);
    uint8_t rank = 0;
    for (; rank < 31 && !(bits & 1); bits >>= 1) ++rank;
    return rank;
}

bool make_store(const PhotonTracing &tracing, uint64_t capacity, Store &store) {
    const PhotonNeeds &needs = tracing.needs;
    const bool several = tracing.medium.count > 1;
    Arena &arena = tracing.arena;
    store = {};
    store.capacity = capacity;
    store.position = arena.make<Vec3>(capacity);
    store.rank = arena.make<uint8_t>(capacity);
    if (needs.directions) store.direction = arena.make<Vec3>(capacity);
    if (needs.powers) store.power = arena.make<Color>(capacity);
    if (several) store.smoke = arena.make<uint32_t>(capacity);
    return store.position && store.rank && (store.direction || !needs.directions) && (store.power || !needs.powers) &&
           (store.smoke || !several);
}

// Traces one batch. Where the store is full, it is thinned out.
bool trace_batch(const PhotonTracing &tracing, const Emitters &emitters, Mt19937 &generator, uint64_t photons,
                 Store &store) {
    return for_each_photon(tracing, generator, photons, [&](uint64_t key) {
        uint64_t collision = 0;
        trace_photon(tracing, emitters, key, [&](const MediumCollision &at, const Photon &arrived, const Color &power) {
            const uint8_t rank = rank_of(key, collision++);
            while (store.count == store.capacity && store.thinning < 31) thin_out(store);
            if (rank < store.thinning || store.count == store.capacity) return;
            store.position[store.count] = arrived.ray.origin;
            if (store.direction) store.direction[store.count] = arrived.ray.direction;
            if (store.power) store.power[store.count] = power;
            if (store.smoke) store.smoke[store.count] = at.smoke;
            store.rank[store.count++] = rank;
        });
        return true;
    });
}

// The map of the photons that collided with smoke `index`.
bool make_map(const Store &store, uint32_t index, Arena &arena, Watch watch, PhotonMap &map) {
    const auto belongs = [&](uint64_t i) { return !store.smoke || store.smoke[i] == index; };
    uint32_t count = 0;
    for (uint64_t i = 0; i < store.count && watch.go_on(i % 1024 ? 0 : 16); ++i) count += belongs(i) ? 1 : 0;

    const uint32_t slots = point_tree_slots(count);
    Vec3 *direction = store.direction ? arena.make<Vec3>(slots) : nullptr;
    Color *power = store.power ? arena.make<Color>(slots) : nullptr;
    Vec3 *points = store.position;
    uint32_t *origin = nullptr; // which stored photon each point is
    if (store.smoke) {
        points = arena.make<Vec3>(count);
        origin = arena.make<uint32_t>(count);
        if (!points || !origin) return false;
        uint32_t next = 0;
        for (uint64_t i = 0; i < store.count; ++i) {
            if (i % 1024 == 0 && !watch.go_on(32)) return false;
            if (!belongs(i)) continue;
            origin[next] = static_cast<uint32_t>(i);
            points[next++] = store.position[i];
        }
    }
    if ((store.direction && !direction) || (store.power && !power)) return false;
    map.tree = build_point_tree(points, count, arena, watch);
    if (!map.tree.ready) return false;
    for (uint32_t slot = 0; slot < count; ++slot) {
        if (slot % 1024 == 0 && !watch.go_on(256)) return false;
        const uint32_t photon = origin ? origin[map.tree.id[slot]] : map.tree.id[slot];
        if (direction) direction[slot] = store.direction[photon];
        if (power) power[slot] = store.power[photon];
    }
    map.direction = direction;
    map.power = power;
    return true;
}

} // namespace

PhotonPlan plan_photons(const Scene &scene, const Settings &settings) {
    const PhotonNeeds needs = photon_needs(scene, settings);
    if (!needs.traced) return {};
    PhotonPlan plan = {needs, 0, 0};
    // If there are more collisions than the store holds, it is thinned out. A single batch has room for more per
    // photon.
    constexpr uint64_t per_photon = 4, per_photon_of_one_batch = 64, max_capacity = 0x7fffffff;
    const uint64_t of_one_batch = per_photon_of_one_batch * min(settings.photons, uint64_t{batch_photons});
    plan.capacity = max(per_photon * min(settings.photons, max_capacity / per_photon), of_one_batch);
    plan.bytes = emitter_bytes(scene) + Arena::bytes<PhotonMap>(scene.smoke_count) + Arena::bytes<Vec3>(plan.capacity) +
                 Arena::bytes<uint8_t>(plan.capacity) + batch_bytes;
    const uint64_t arrays = (plan.directions ? 1 : 0) + (plan.powers ? 1 : 0);
    // The maps of all smokes have as many slots as the capacity, and less than a leaf more each.
    const uint64_t slots = plan.capacity + scene.smoke_count * leaf_points;
    plan.bytes += arrays * (Arena::bytes<Vec3>(plan.capacity) + Arena::bytes<Vec3>(slots));
    plan.bytes += point_tree_bytes(static_cast<uint32_t>(plan.capacity));
    if (scene.smoke_count > 1)
        plan.bytes += 2 * Arena::bytes<uint32_t>(plan.capacity) + Arena::bytes<Vec3>(plan.capacity) +
                      scene.smoke_count * (point_tree_bytes(leaf_points) + 4 * Arena::bytes<Vec3>(1));
    return plan;
}

PhotonMaps trace_photons(const PhotonTracing &tracing, const Light *lights, uint32_t light_count, uint64_t capacity) {
    const Medium &medium = tracing.medium;
    Arena &arena = tracing.arena;
    if (!tracing.needs.traced) return {nullptr, Status::done};
    PhotonMap *maps = arena.make<PhotonMap>(medium.count);
    const Emitters emitters = find_emitters(medium, lights, light_count, arena);
    Store store;
    if (!maps || !emitters.list || !make_store(tracing, capacity, store)) return {nullptr, Status::out_of_memory};
    if (emitters.count == 0) return {nullptr, Status::done};

    const Status status = for_each_batch(tracing, [&](Mt19937 &generator, uint64_t, uint64_t photons) {
        return trace_batch(tracing, emitters, generator, photons, store);
    });
    if (status != Status::done) return {nullptr, status};
    tracing.statistics.photons.stored = store.count;
    tracing.statistics.photons.thinning = store.thinning;

    const size_t before = arena.mark();
    for (uint32_t i = 0; i < medium.count; ++i) {
        maps[i] = {};
        maps[i].uniform_power = emitters.list[0].photon_color;
        maps[i].unit = photon_unit(emitters.power, tracing.statistics.photons.emitted);
        maps[i].unit.exponent += static_cast<int32_t>(store.thinning);
        if (!make_map(store, i, arena, tracing.watch, maps[i])) return {nullptr, Status::out_of_memory};
    }
    tracing.statistics.bytes.photon_map = arena.mark() - before;
    return {maps, Status::done};
}

bool make_gather(uint32_t max_photons, Arena &arena, Gather &gather) {
    gather.max_photons = max_photons;
    gather.slot = arena.make<uint32_t>(max_photons);
    gather.distance_squared = arena.make<Real>(max_photons);
    return gather.slot && gather.distance_squared && make_nearest_scratch(max_photons, arena, gather.scratch);
}

uint64_t gather_bytes(uint32_t max_photons) {
    return Arena::bytes<uint32_t>(max_photons) + Arena::bytes<Real>(max_photons) + nearest_scratch_bytes(max_photons);
}

namespace {

// Calls add(photon) for the photons of an estimate, without the one on the surface of the ball (N-E5). Returns the
// radius of the ball; 0: there is no photon. A radius below 0.001 of the largest is raised, so that coincident photons
// do not divide by 0.
template <class Add>
Real for_each_near(const PhotonMap &map, const Vec3 &x, Real largest_radius, Gather &gather, Statistics &statistics,
                   Add &&add) {
    if (map.tree.count == 0) return Real(0);
    const Nearest found =
        nearest(map.tree, x, gather.max_photons, largest_radius, gather.scratch, gather.slot, gather.distance_squared);
    ++statistics.smoke.gathers;
    statistics.smoke.gathered += found.count;
    if (found.count == 0) return Real(0);
    const bool full = found.count == gather.max_photons;
    const uint32_t left_out = full ? found.farthest : found.count;
    for (uint32_t i = 0; i < found.count; ++i)
        if (i != left_out) add(gather.slot[i]);
    return full ? max(sqrt(found.radius_squared), largest_radius * Real(0.001)) : largest_radius;
}

const Color &power_of(const PhotonMap &map, uint32_t photon) {
    return map.power ? map.power[photon] : map.uniform_power;
}

// sum / (4/3 pi r^3) * unit * 2^exponent. A third of the scaling follows each division: in fixed point no intermediate
// result leaves the range.
Color per_volume(Color sum, Real radius, const PhotonUnit &unit) {
    sum = sum * (unit.unit * (Real(3) * inv_four_pi<Real>));
    const int32_t third = unit.exponent / 3;
    sum = scale_pow2(sum / radius, third);
    sum = scale_pow2(sum / radius, third);
    return scale_pow2(sum / radius, unit.exponent - 2 * third);
}

} // namespace

Color estimate_radiance(const PhotonMap &map, const Phase &phase, const Vec3 &x, const Vec3 &out, Real largest_radius,
                        Gather &gather, Statistics &statistics) {
    Color sum(Real(0));
    const Real radius = for_each_near(map, x, largest_radius, gather, statistics, [&](uint32_t photon) {
        const Color &power = power_of(map, photon);
        if (!map.direction)
            sum += power;
        else if (map.fluxes)
            sum += power * phase_of_flux(phase, map.direction[photon], out);
        else
            sum += power * phase(map.direction[photon], out);
    });
    if (!(radius > Real(0))) return sum;
    if (!map.direction) sum = sum * inv_four_pi<Real>;
    return per_volume(sum, radius, map.unit);
}

FluenceAndFlux estimate_fluence(const PhotonMap &map, const Vec3 &x, Real largest_radius, Gather &gather,
                                Statistics &statistics, Real &radius) {
    Color sum(Real(0));
    Vec3 flux(Real(0));
    radius = for_each_near(map, x, largest_radius, gather, statistics, [&](uint32_t photon) {
        const Color &power = power_of(map, photon);
        sum += power;
        if (map.direction) flux += map.direction[photon] * (power.x + power.y + power.z);
    });
    FluenceAndFlux light = {Color(Real(0)), Vec3(Real(0))};
    if (!(radius > Real(0))) return light;
    const Real all = sum.x + sum.y + sum.z;
    if (all > Real(0)) light.flux = flux / all;
    light.radiance = per_volume(sum * inv_four_pi<Real>, radius, map.unit);
    return light;
}

} // namespace wisp::WISP_ARITH
