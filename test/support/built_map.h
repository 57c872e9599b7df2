// Particle maps for tests: traced, or made of sums that a test chooses.
#pragma once
#include "core/photons/packed_particle_map.h"
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

inline Settings map_settings(int pixels, uint64_t photons) {
    Settings settings = small_settings(pixels);
    settings.method = Method::map;
    settings.photons = photons;
    return settings;
}

// The sums of a scene's photons.
struct TracedMap {
    TracedMap(const Scene &scene, const Settings &settings)
        : plan(plan_particle_map(scene, settings)), memory(medium_bytes(scene, 0) + plan.bytes),
          arena(memory.data(), memory.size()), medium(make_medium(scene, 0, arena)) {
        sums = {arena.make<int64_t>(plan.sums), plan.sums, 0};
        for (uint32_t i = 0; i < scene.light_count; ++i) lights.push_back(make_light(scene.lights[i]));
        REQUIRE(
            trace_particle_map({medium, nullptr, settings, plan.needs, all_batches(settings), {}, arena, statistics},
                               scene, lights.data(), sums, map) == Status::done);
    }
    // The photons of the first batch once more, one by one, with trace_photon()'s on_collision.
    template <class OnCollision> void trace_again(const Settings &settings, OnCollision &&on_collision) const {
        std::vector<unsigned char> room(Arena::bytes<Emitter>(lights.size() + medium.count));
        Arena own(room.data(), room.size());
        const Emitters emitters = find_emitters(medium, lights.data(), static_cast<uint32_t>(lights.size()), own);
        REQUIRE(emitters.count > 0);
        Statistics unused;
        const PhotonTracing tracing = {medium, nullptr, settings, plan.needs, {}, {}, own, unused};
        Mt19937 generator(0, 0, 0, 0);
        seed_batch(generator, settings.seed, 0);
        for_each_photon(generator, settings.photons, [&](uint64_t key) {
            trace_photon(tracing, emitters, key, on_collision);
            return true;
        });
    }
    ParticleMapPlan plan;
    std::vector<unsigned char> memory;
    Arena arena;
    Medium medium;
    std::vector<Light> lights;
    PhotonSums sums;
    Statistics statistics;
    ParticleMap map;
};

// A map of one smoke, packed.
struct PackedSums {
    PackedSums(const Scene &scene, const ParticleMap &map)
        : memory(packed_map_bytes(scene, needs_of(map)) + source_bytes(scene)), arena(memory.data(), memory.size()) {
        REQUIRE(make_packed_map(scene, needs_of(map), map.per_smoke[0].direction_kind, arena, packed));
        pack_map(map, packed);
    }
    static PhotonNeeds needs_of(const ParticleMap &map) {
        return {true, true, false, map.per_smoke[0].channels == 3, false};
    }

    // The source function of an element towards the eye.
    Color source(const Scene &scene, const Medium &medium, const Vec3 &eye, uint32_t element = 0) {
        const size_t before = arena.mark();
        const Color *const *sources = make_sources(scene, medium, packed, eye, arena);
        REQUIRE(sources);
        arena.rewind(before);
        return sources[0][element];
    }
    std::vector<unsigned char> memory;
    Arena arena;
    PackedMap packed;
};

} // namespace wisp::WISP_ARITH
