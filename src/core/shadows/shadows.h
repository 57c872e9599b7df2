// Hard shadows of surfaces (C): whether anything opaque stands between a point of a surface and a light. However they
// are found, what is seen is the same but for the paper's own method.
#pragma once
#include "core/lights/light.h"
#include "core/surfaces/surfaces.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

// A point of a triangle asks for a light.
struct ShadowQuery {
    Ray ray;           // from the point towards the light
    Real end;          // its distance, less the skin: what is farther stands behind the light
    uint32_t light;    // of the scene
    uint32_t triangle; // that holds the point: it does not stand in its own light
    bool still;        // that triangle never moves
    Real u, v;         // where the point is in it: the weights of corners 1 and 2
    uint32_t instance;     // that it belongs to, or none of the scene's
};

struct Shadows {
    const Scene *scene;
    const Surfaces *surfaces;
    const Light *lights;
    Statistics *statistics;
    ShadowMethod method = ShadowMethod::trace; // of which ...
    void *memory = nullptr;                    // ... this is what it keeps from frame to frame, if anything
};

// That of the settings; without lights there is nothing to keep.
inline ShadowMethod shadow_method(const Scene &scene, const Settings &settings) {
    return scene.light_count == 0 ? ShadowMethod::trace : settings.shadows;
}

// What a method keeps from frame to frame, as long as the scene has the same still triangles and number of lights;
// false: the arena was too small. And the bytes of that and of a frame, at most.
bool make_shadow_memory(const Scene &scene, const Settings &settings, Arena &arena, void *&memory);
uint64_t shadow_bytes(const Scene &scene, const Settings &settings);

// Before the first ray of a frame, false: the arena was too small; and behind the last one.
bool begin_frame(Shadows &shadows, const Settings &settings, Arena &arena);
void end_frame(Shadows &shadows);
// In between: a sample of a pixel begins, pixel after pixel; its camera ray has met something, or nothing.
void begin_sample(Shadows &shadows, int32_t x, int32_t y, uint32_t sample);
void see(Shadows &shadows, const Ray &ray, const Hit &hit);

bool is_shadowed(Shadows &shadows, const ShadowQuery &query);
// Of a point of space that the light reaches so; nothing where `shadows` is nullptr.
inline bool is_shadowed(Shadows *shadows, uint32_t light, const Vec3 &x, const Illumination &from) {
    return shadows && is_shadowed(*shadows, {{x, -from.direction},
                                             from.distance - shadows->surfaces->ray_epsilon,
                                             light,
                                             no_triangle,
                                             false,
                                             Real(0),
                                             Real(0),
                                             shadows->surfaces->instance_count});
}
// The same where it is known that nothing still is in the way, without a test.
bool is_shadowed_by_moving_alone(Shadows &shadows, const ShadowQuery &query);

// By a ray, counted as traced: as those of surfaces.h.
inline bool is_blocked(const Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    return is_blocked(surfaces, query.ray, surfaces.ray_epsilon, query.end, query.triangle, shadows.statistics->shadow.traced);
}
inline bool is_blocked_by_static(const Shadows &shadows, const ShadowQuery &query, uint32_t &occluder) {
    const Surfaces &surfaces = *shadows.surfaces;
    return is_blocked_by_static(surfaces, query.ray, surfaces.ray_epsilon, query.end, query.triangle, occluder,
                               shadows.statistics->shadow.traced);
}
inline bool is_blocked_by_moving(const Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    return is_blocked_by_moving(surfaces, query.ray, surfaces.ray_epsilon, query.end, query.triangle,
                                shadows.statistics->shadow.traced);
}

// Whether shadows of the one light are those of the other.
inline bool same_shadows(const Light &a, const Light &b) {
    return a.kind == b.kind && a.position == b.position && a.direction == b.direction &&
           a.one_minus_cosine == b.one_minus_cosine;
}

} // namespace wisp::WISP_ARITH
