// Photons: emission, batches, the store, the map, and the radiance estimate (S2).
#include "wisp/photon_map.h"
#include "wisp/photon_walk.h"

namespace wisp::WISP_ARITH {

namespace {

// What the collisions leave behind, in the order of the photons.
struct Store {
    Vec3 *position, *direction; // direction, power and smoke may be nullptr: not needed
    Color *power;
    uint32_t *smoke;
    uint64_t count, capacity;
};

bool make_store(const PhotonPlan &plan, uint32_t smokes, Arena &arena, Store &store) {
    store = {};
    store.capacity = plan.capacity;
    store.position = arena.make<Vec3>(plan.capacity);
    if (plan.directions) store.direction = arena.make<Vec3>(plan.capacity);
    if (plan.powers) store.power = arena.make<Color>(plan.capacity);
    if (smokes > 1) store.smoke = arena.make<uint32_t>(plan.capacity);
    return store.position && (store.direction || !plan.directions) && (store.power || !plan.powers) &&
           (store.smoke || smokes < 2);
}

struct Emitters {
    Emitter *list;
    uint32_t count;
    Real power; // the sum of their largest channels
};

Emitters find_emitters(const Medium &medium, const Light *lights, uint32_t light_count, Arena &arena) {
    Emitters emitters = {arena.make<Emitter>(light_count + medium.count), 0, Real(0)};
    if (!emitters.list) return emitters;
    const auto add = [&](const Emitter &emitter) {
        if (!(largest(emitter.power) > Real(0))) return;
        emitters.list[emitters.count++] = emitter;
        emitters.power += largest(emitter.power);
    };
    for (uint32_t i = 0; i < light_count; ++i) add(make_emitter(lights[i], medium.sphere));
    for (uint32_t i = 0; i < medium.count; ++i) {
        const Color power = medium.smokes[i].emitted_power;
        if (!(largest(power) > Real(0))) continue;
        Emitter glow = {};
        glow.smoke = i;
        glow.power = power;
        glow.photon_color = power / largest(power);
        add(glow);
    }
    return emitters;
}

// A photon of an emitter drawn in proportion to its largest channel, so that all photons carry the same there.
const Emitter &choose(const Emitters &emitters, Event event) {
    Real rest = unit_half_open<Real>(draw(event, dimension_light)) * emitters.power;
    uint32_t i = 0;
    for (; i + 1 < emitters.count; ++i) {
        const Real power = largest(emitters.list[i].power);
        if (rest < power) break;
        rest -= power;
    }
    return emitters.list[i];
}

// Traces one photon. False when the store cannot take all of it.
bool trace(const Medium &medium, const Emitters &emitters, uint64_t key, Store &store, Statistics &statistics) {
    auto &counts = statistics.photons;
    const Event birth = photon_event(key, 0);
    const Emitter &emitter = choose(emitters, birth);
    const Photon photon = emitter.light ? emit(emitter, medium.sphere, birth)
                                        : emit_from_smoke(medium.smokes[emitter.smoke], emitter.photon_color, birth);
    ++counts.emitted;
    if (!photon.leaves) {
        ++counts.escaped;
        return true;
    }
    const bool constant = emitter.light && emitter.light->kind == LightKind::constant;
    const uint32_t first_stored = emitter.light ? 1 : 0;
    bool room = true;
    Real falloff = Real(1);
    const Fate fate = walk(medium, photon, key, [&](const MediumCollision &at, uint32_t number, const Photon &arrived) {
        ++counts.collisions;
        if (constant && number == 0) { // irradiance without falloff: as many photons to the area everywhere
            const Vec3 way = arrived.ray.origin - emitter.light->position;
            falloff = dot(way, way) / emitter.reach_squared;
        }
        if (number < first_stored) return;
        if (store.count == store.capacity) {
            room = false;
            return;
        }
        store.position[store.count] = arrived.ray.origin;
        if (store.direction) store.direction[store.count] = arrived.ray.direction;
        if (store.power) store.power[store.count] = arrived.power * falloff;
        if (store.smoke) store.smoke[store.count] = at.smoke;
        ++store.count;
        ++counts.stored;
    });
    ++(fate == Fate::absorbed ? counts.absorbed : fate == Fate::escaped ? counts.escaped : counts.capped);
    return room;
}

// Photons b * batch_photons and on. False when the store is too small, and then nothing of the batch remains.
bool trace_batch(const Medium &medium, const Emitters &emitters, uint64_t seed, uint64_t batch, uint64_t photons,
                 Store &store, Statistics &statistics) {
    const Statistics before = statistics;
    const uint64_t stored_before = store.count;
    Mt19937 generator(static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32), static_cast<uint32_t>(batch),
                      static_cast<uint32_t>(batch >> 32));
    for (uint64_t i = 0; i < photons; ++i) {
        const uint64_t high = generator();
        const uint64_t low = generator();
        if (trace(medium, emitters, high << 32 | low, store, statistics)) continue;
        statistics = before;
        store.count = stored_before;
        statistics.photons.store_full = true;
        return false;
    }
    return true;
}

// power / emitted as unit * 2^exponent with unit in [1, 2): in fixed point neither end of the range is near.
void split_unit(Real power, uint64_t emitted, Real &unit, int32_t &exponent) {
    unit = Real(1);
    exponent = 0;
    if (emitted == 0 || !(power > Real(0))) return;
    int32_t shift = 0; // emitted / 2^shift in [2^29, 2^30)
    while (emitted >> (29 + shift) > 1) ++shift;
    while (shift <= 0 && (emitted << -shift) >> 29 == 0) --shift;
    const uint64_t mantissa = shift > 0 ? emitted >> shift : emitted << -shift;
    unit = power / scale_pow2(Real(static_cast<int32_t>(mantissa)), -29);
    exponent = -29 - shift;
    for (; unit >= Real(2); ++exponent) unit = scale_pow2(unit, -1);
    for (; unit < Real(1); --exponent) unit = scale_pow2(unit, 1);
}

// The map of the photons that collided with smoke `index`.
bool make_map(const Store &store, uint32_t index, Arena &arena, PhotonMap &map) {
    const auto belongs = [&](uint64_t i) { return !store.smoke || store.smoke[i] == index; };
    uint32_t count = 0;
    for (uint64_t i = 0; i < store.count; ++i) count += belongs(i) ? 1 : 0;

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
            if (!belongs(i)) continue;
            origin[next] = static_cast<uint32_t>(i);
            points[next++] = store.position[i];
        }
    }
    if ((store.direction && !direction) || (store.power && !power)) return false;
    map.tree = build_point_tree(points, count, arena);
    if (!map.tree.ready) return false;
    for (uint32_t slot = 0; slot < count; ++slot) {
        const uint32_t photon = origin ? origin[map.tree.id[slot]] : map.tree.id[slot];
        if (direction) direction[slot] = store.direction[photon];
        if (power) power[slot] = store.power[photon];
    }
    map.direction = direction;
    map.power = power;
    return true;
}

double largest_of(const Double3 &c) { return max(c.x, max(c.y, c.z)); }

} // namespace

PhotonPlan plan_photons(const Scene &scene, const Settings &settings) {
    PhotonPlan plan = {};
    bool scatters = false, glows = false, grey = true;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeSource &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        if (largest_of(smoke.albedo) > 0) scatters = true;
        if (largest_of(smoke.emission) > 0) glows = true;
        if (smoke.asymmetry != 0) plan.directions = true;
        if (smoke.albedo.x != smoke.albedo.y || smoke.albedo.y != smoke.albedo.z) grey = false;
    }
    plan.traced = scatters && (glows || scene.light_count > 0) && settings.photons > 0;
    if (!plan.traced) return {};
    // All photons carry one and the same power where neither lights nor albedos tell them apart.
    plan.powers = !grey || glows;
    const Double3 *color = nullptr; // of the first light that is not black
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const Double3 &c = scene.lights[i].color;
        const double brightest = largest_of(c);
        if (!(brightest > 0)) continue;
        if (!color) color = &c;
        const double first = largest_of(*color); // compared without dividing
        if (c.x * first != color->x * brightest || c.y * first != color->y * brightest ||
            c.z * first != color->z * brightest || scene.lights[i].kind == LightKind::constant)
            plan.powers = true;
    }
    // Where more collisions are to be stored, tracing ends early and says so. A single batch has room for more.
    constexpr uint64_t per_photon = 4, per_photon_of_one_batch = 64, most = 0x7fffffff;
    const uint64_t of_one_batch = per_photon_of_one_batch * min(settings.photons, uint64_t{batch_photons});
    plan.capacity = max(per_photon * min(settings.photons, most / per_photon), of_one_batch);
    const uint64_t emitters = scene.light_count + scene.smoke_count;
    plan.bytes = Arena::bytes<Emitter>(emitters) + Arena::bytes<PhotonMap>(scene.smoke_count) +
                 Arena::bytes<Vec3>(plan.capacity);
    const uint64_t payloads = (plan.directions ? 1 : 0) + (plan.powers ? 1 : 0);
    // Each smoke's map is built at its turn: the slots of all together are the capacity and less than a leaf each.
    const uint64_t slots = plan.capacity + scene.smoke_count * leaf_points;
    plan.bytes += payloads * (Arena::bytes<Vec3>(plan.capacity) + Arena::bytes<Vec3>(slots));
    plan.bytes += point_tree_bytes(static_cast<uint32_t>(plan.capacity));
    if (scene.smoke_count > 1)
        plan.bytes += 2 * Arena::bytes<uint32_t>(plan.capacity) + Arena::bytes<Vec3>(plan.capacity) +
                      scene.smoke_count * (point_tree_bytes(leaf_points) + 4 * Arena::bytes<Vec3>(1));
    return plan;
}

PhotonMaps trace_photons(const Medium &medium, const Light *lights, uint32_t light_count, const Settings &settings,
                         const PhotonPlan &plan, const Observer &observer, Arena &arena, Statistics &statistics) {
    if (!plan.traced) return {nullptr, Status::done};
    PhotonMap *maps = arena.make<PhotonMap>(medium.count);
    const Emitters emitters = find_emitters(medium, lights, light_count, arena);
    Store store;
    if (!maps || !emitters.list || !make_store(plan, medium.count, arena, store))
        return {nullptr, Status::out_of_memory};
    if (emitters.count == 0) return {nullptr, Status::done};

    const uint64_t batches = (settings.photons + batch_photons - 1) / batch_photons;
    for (uint64_t batch = 0; batch < batches; ++batch) {
        if (!observer(Stage::photons, batch, batches)) return {nullptr, Status::stopped};
        const uint64_t left = settings.photons - batch * batch_photons;
        if (!trace_batch(medium, emitters, settings.seed, batch, left < batch_photons ? left : batch_photons, store,
                         statistics)) {
            if (batch == 0) return {nullptr, Status::out_of_memory};
            break;
        }
    }

    const size_t before = arena.mark();
    for (uint32_t i = 0; i < medium.count; ++i) {
        maps[i] = {};
        maps[i].uniform_power = emitters.list[0].photon_color;
        split_unit(emitters.power, statistics.photons.emitted, maps[i].unit, maps[i].exponent);
        if (!make_map(store, i, arena, maps[i])) return {nullptr, Status::out_of_memory};
    }
    statistics.bytes.photon_map = arena.mark() - before;
    return {maps, Status::done};
}

bool make_gather(uint32_t most, Arena &arena, Gather &gather) {
    gather.most = most;
    gather.slot = arena.make<uint32_t>(most);
    gather.distance_squared = arena.make<Real>(most);
    return gather.slot && gather.distance_squared && make_nearest_scratch(most, arena, gather.scratch);
}

uint64_t gather_bytes(uint32_t most) {
    return Arena::bytes<uint32_t>(most) + Arena::bytes<Real>(most) + nearest_scratch_bytes(most);
}

Color in_scattered(const PhotonMap &map, const Phase &phase, const Vec3 &x, const Vec3 &out, Real largest_radius,
                   Gather &gather, Statistics &statistics) {
    if (map.tree.count == 0) return Color(Real(0));
    const Nearest found =
        nearest(map.tree, x, gather.most, largest_radius, gather.scratch, gather.slot, gather.distance_squared);
    ++statistics.smoke.gathers;
    statistics.smoke.gathered += found.count;
    if (found.count == 0) return Color(Real(0));

    // The ball, and the photon on its surface, which is left out.
    const bool full = found.count == gather.most;
    const Real radius = full ? max(sqrt(found.radius_squared), largest_radius * Real(0.001)) : largest_radius;
    const uint32_t left_out = full ? found.farthest : found.count;

    Color sum(Real(0));
    if (!map.direction && !map.power) {
        sum = map.uniform_power * Real(static_cast<int32_t>(found.count - (full ? 1 : 0)));
    } else {
        for (uint32_t i = 0; i < found.count; ++i) {
            if (i == left_out) continue;
            const uint32_t photon = gather.slot[i];
            const Color &power = map.power ? map.power[photon] : map.uniform_power;
            sum += map.direction ? power * phase(map.direction[photon], out) : power;
        }
    }
    if (!map.direction) sum = sum * inv_four_pi<Real>;

    // / (4/3 pi r^3) * unit * 2^exponent, a third of the scaling after each division.
    sum = sum * (map.unit * (Real(3) * inv_four_pi<Real>));
    const int32_t third = map.exponent / 3;
    sum = scale_pow2(sum / radius, third);
    sum = scale_pow2(sum / radius, third);
    return scale_pow2(sum / radius, map.exponent - 2 * third);
}

} // namespace wisp::WISP_ARITH
