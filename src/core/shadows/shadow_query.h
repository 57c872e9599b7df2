// A query for a hard shadow, what a technique needs to answer it, and what a technique is (C3).
#pragma once
#include "core/lights/light.h"
#include "core/surfaces/surfaces.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

// Whether an opaque triangle stands between a point of a triangle and a light.
struct ShadowQuery {
    Ray ray;           // from the point towards the light; its direction has length 1
    Real begin;        // ray_epsilon: a nearer hit is the triangle that holds the point
    Real end;          // distance to the light less ray_epsilon: a farther hit lies behind the light
    uint32_t light;    // of the scene
    uint32_t triangle; // that holds the point, and does not shadow it
    bool is_static;    // the triangle never moves
    Real u, v;         // weights of the triangle's corners 1 and 2 at the point
    uint32_t instance; // that the triangle belongs to, or Surfaces::instance_count: none
};

// The query of a point that light number `light` reaches as `from` says.
inline ShadowQuery make_shadow_query(const Surfaces &surfaces, const Vec3 &position, uint32_t light,
                                     const Illumination &from, uint32_t triangle, Real u, Real v, uint32_t instance) {
    return {{position, -from.direction},
            surfaces.ray_epsilon,
            from.distance - surfaces.ray_epsilon,
            light,
            triangle,
            triangle < surfaces.static_count,
            u,
            v,
            instance};
}

struct Shadows;

// A way to answer queries. Functions that a technique does not need are nullptr.
struct ShadowTechnique {
    bool (*is_shadowed)(Shadows &shadows, const ShadowQuery &query);

    // What the technique keeps from frame to frame, while the scene has the same static triangles and number of lights.
    // `bytes` bounds that together with what it takes in each frame; `make` returns nullptr when the arena is too
    // small.
    uint64_t (*bytes)(const Scene &scene, const Settings &settings) = nullptr;
    void *(*make)(const Scene &scene, const Settings &settings, Arena &arena, Watch watch) = nullptr;

    // Before the first query of a frame, false: the arena was too small; after the last one.
    bool (*begin_frame)(Shadows &shadows, const Settings &settings, Arena &arena) = nullptr;
    void (*end_frame)(Shadows &shadows) = nullptr;

    // For techniques that learn from what camera rays hit: before each sample, pixel after pixel and row after row, and
    // once the sample's camera ray has hit something or nothing.
    void (*begin_sample)(Shadows &shadows, int32_t x, int32_t y, uint32_t sample) = nullptr;
    void (*record_primary_hit)(Shadows &shadows, const Ray &ray, const Hit &hit) = nullptr;
};

// Each technique is defined in a file of its own.
#define WISP_DECLARE_TECHNIQUE(name, how) extern const ShadowTechnique name##_technique;
WISP_SHADOW_METHODS(WISP_DECLARE_TECHNIQUE)
#undef WISP_DECLARE_TECHNIQUE

// The shadows of one frame.
struct Shadows {
    const Scene *scene;
    const Surfaces *surfaces;
    const Light *lights;
    Statistics *statistics;
    const ShadowTechnique *technique = has(parts::surfaces) ? &trace_technique : nullptr;
    void *memory = nullptr; // what the technique's `make` returned
    Watch watch = {};
};
template <class Memory> Memory &memory_of(const Shadows &shadows) { return *static_cast<Memory *>(shadows.memory); }

// The answer by a ray through the trees, counted as traced: of all triangles, of static ones, of moving ones.
inline bool is_blocked(const Shadows &shadows, const ShadowQuery &query) {
    return is_blocked(*shadows.surfaces, query.ray, query.begin, query.end, query.triangle,
                      shadows.statistics->shadow.traced);
}
inline bool is_blocked_by_static(const Shadows &shadows, const ShadowQuery &query, uint32_t &occluder) {
    return is_blocked_by_static(*shadows.surfaces, query.ray, query.begin, query.end, query.triangle, occluder,
                                shadows.statistics->shadow.traced);
}
inline bool is_blocked_by_moving(const Shadows &shadows, const ShadowQuery &query) {
    return is_blocked_by_moving(*shadows.surfaces, query.ray, query.begin, query.end, query.triangle,
                                shadows.statistics->shadow.traced);
}
// The answer where it is known, without a test, that no static triangle blocks the ray.
inline bool is_shadowed_by_moving_alone(const Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    auto &rays = shadows.statistics->rays;
    if (surfaces.deforming_count == 0 && surfaces.group_count == 0) {
        ++rays.shadow_culled;
        return false;
    }
    ++rays.shadow_dynamic_only;
    return is_blocked_by_moving(shadows, query);
}

// Whether two lights have the same shadows.
inline bool same_shadows(const Light &a, const Light &b) {
    return a.kind == b.kind && a.position == b.position && a.direction == b.direction &&
           a.one_minus_cosine == b.one_minus_cosine;
}

} // namespace wisp::WISP_ARITH
