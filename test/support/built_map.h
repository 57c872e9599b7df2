// Particle maps for tests: traced, or made of sums that a test chooses.
#pragma once
#include "core/photons/packed_particle_map.h"
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

// The sums of a scene's photons.
struct TracedMap {
    TracedMap(const Scene &scene, const Settings &settings)
        : plan(plan_particle_map(scene, settings)), memory(medium_bytes(scene, 0) + plan.bytes),
          arena(memory.data(), memory.size()), medium(make_medium(scene, 0, arena)) {
        sums = {arena.make<int64_t>(plan.sums), plan.sums, 0};
        for (uint32_t i = 0; i < scene.light_count; ++i) lights.push_back(make_light(scene.lights[i]));
        REQUIRE(trace_particle_map(scene, medium, nullptr, lights.data(), settings, plan.needs, all_batches(settings),
                                   {}, arena, sums, statistics, map) == Status::done);
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
    static PhotonNeeds needs_of(const ParticleMap &map) { return {true, true, false, map.per_smoke[0].channels == 3}; }

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
