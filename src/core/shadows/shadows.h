// Hard shadows of surfaces: whether an opaque triangle stands between a point and a light. A frame calls the technique
// that the settings name through these functions. All techniques but `paper` give the answers of `trace`.
#pragma once
#include "core/shadows/shadow_query.h"

namespace wisp::WISP_ARITH {

const ShadowTechnique *find_technique(ShadowMethod method);

// The technique of the settings. Without lights it is `trace`, which keeps nothing.
inline const ShadowTechnique *shadow_technique(const Scene &scene, const Settings &settings) {
    return scene.light_count == 0 ? &trace_technique : find_technique(settings.shadows);
}

// What the technique keeps from frame to frame (nullptr: nothing), and the bytes of that and of a frame, at most.
// False: the arena was too small.
inline bool make_shadow_memory(const Scene &scene, const Settings &settings, Arena &arena, void *&memory,
                               Watch watch = {}) {
    const ShadowTechnique &technique = *shadow_technique(scene, settings);
    memory = technique.make ? technique.make(scene, settings, arena, watch) : nullptr;
    return memory || !technique.make;
}
inline uint64_t shadow_bytes(const Scene &scene, const Settings &settings) {
    const ShadowTechnique &technique = *shadow_technique(scene, settings);
    return technique.bytes ? technique.bytes(scene, settings) : 0;
}

// The events of a frame, as ShadowTechnique has them.
inline bool begin_frame(Shadows &shadows, const Settings &settings, Arena &arena) {
    return !shadows.technique->begin_frame || shadows.technique->begin_frame(shadows, settings, arena);
}
inline void end_frame(Shadows &shadows) {
    if (shadows.technique->end_frame) shadows.technique->end_frame(shadows);
}
inline void begin_sample(Shadows &shadows, int32_t x, int32_t y, uint32_t sample) {
    if (shadows.technique->begin_sample) shadows.technique->begin_sample(shadows, x, y, sample);
}
inline void record_primary_hit(Shadows &shadows, const Ray &ray, const Hit &hit) {
    if (shadows.technique->record_primary_hit) shadows.technique->record_primary_hit(shadows, ray, hit);
}

inline bool is_shadowed(Shadows &shadows, const ShadowQuery &query) {
    ++shadows.statistics->rays.shadow;
    return shadows.technique->is_shadowed(shadows, query);
}

} // namespace wisp::WISP_ARITH
