// The counters of a frame by the names that users read, in --stats and in the C interface.
#pragma once
#include "wisp/statistics.h"

namespace wisp {

struct Counter {
    const char *group, *name;
    uint64_t (*value)(const Statistics &statistics);
};

#define WISP_COUNTER(group, name, member)                                                                              \
    {                                                                                                                  \
        group, name, [](const Statistics &s) { return s.member; }                                                      \
    }

// Group by group.
constexpr Counter counters[] = {
    WISP_COUNTER("rays", "primary", rays.primary),
    WISP_COUNTER("rays", "reflected", rays.reflected),
    WISP_COUNTER("rays", "refracted", rays.refracted),
    WISP_COUNTER("rays", "shadow", rays.shadow),
    WISP_COUNTER("rays", "shadow_culled", rays.shadow_culled),
    WISP_COUNTER("rays", "shadow_dynamic_only", rays.shadow_dynamic_only),
    WISP_COUNTER("shadow", "node_visits", shadow.traced.node_visits),
    WISP_COUNTER("shadow", "triangle_tests", shadow.traced.triangle_tests),
    WISP_COUNTER("shadow", "extra_tests", shadow.extra_tests),
    WISP_COUNTER("shadow", "proof_node_visits", shadow.proofs.node_visits),
    WISP_COUNTER("shadow", "proof_triangle_tests", shadow.proofs.triangle_tests),
    WISP_COUNTER("photons", "emitted", photons.emitted),
    WISP_COUNTER("photons", "collisions", photons.collisions),
    WISP_COUNTER("photons", "stored", photons.stored),
    WISP_COUNTER("photons", "absorbed", photons.absorbed),
    WISP_COUNTER("photons", "escaped", photons.escaped),
    WISP_COUNTER("photons", "blocked", photons.blocked),
    WISP_COUNTER("photons", "unclaimed", photons.lost),
    WISP_COUNTER("photons", "capped", photons.capped),
    WISP_COUNTER("smoke", "particles", smoke.particles),
    WISP_COUNTER("smoke", "density_evaluations", smoke.density_evaluations),
    WISP_COUNTER("smoke", "march_samples", smoke.march_samples),
    WISP_COUNTER("smoke", "gathers", smoke.gathers),
    WISP_COUNTER("smoke", "gathered", smoke.gathered),
    WISP_COUNTER("bytes", "particle_tree", bytes.particle_tree),
    WISP_COUNTER("bytes", "photon_map", bytes.photon_map),
    WISP_COUNTER("bytes", "particle_map", bytes.particle_map),
    WISP_COUNTER("bytes", "irradiance", bytes.irradiance),
    WISP_COUNTER("bytes", "triangle_trees", bytes.triangle_trees),
    WISP_COUNTER("bytes", "mode_words", bytes.mode_words),
    WISP_COUNTER("bytes", "arena_peak", bytes.arena_peak),
    WISP_COUNTER("bytes", "arena_size", bytes.arena_size),
};

#undef WISP_COUNTER

} // namespace wisp
