// `cache`: the shadow cache (Haines & Greenberg 1986) tests the last occluder first (C7).
//
// The paper remembers one occluder for each light. Here each static triangle has its own for each light, because
// neighbouring pixels of a triangle share an occluder more often than successive rays of all depths do. All moving
// triangles share one for each light. Only static occluders are remembered: their tree is searched first in any case,
// and they stay where they are. The cached triangle is tested as its tree tests it, so the answers are those of
// `trace`.
#include "core/shadows/shadow_query.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

struct ShadowCache {
    uint32_t static_count, light_count;
    uint32_t *occluder; // [static triangle, and one row for all others][light], or no_triangle
};

uint64_t entries(const Scene &scene) { return (uint64_t{scene.static_count} + 1) * scene.light_count; }

uint64_t cache_bytes(const Scene &scene, const Settings &) {
    return Arena::bytes<ShadowCache>(1) + Arena::bytes<uint32_t>(entries(scene));
}

void *make_cache(const Scene &scene, const Settings &, Arena &arena, Watch watch) {
    ShadowCache *cache = arena.make<ShadowCache>(1);
    uint32_t *occluder = arena.make<uint32_t>(static_cast<size_t>(entries(scene)));
    if (!cache || !occluder) return nullptr;
    if (!fill(occluder, entries(scene), no_triangle, watch)) return nullptr;
    *cache = {scene.static_count, scene.light_count, occluder};
    return cache;
}

bool is_shadowed_by_cache(Shadows &shadows, const ShadowQuery &query) {
    ShadowCache &cache = memory_of<ShadowCache>(shadows);
    const size_t row = query.is_static ? query.triangle : cache.static_count;
    uint32_t &last = cache.occluder[row * cache.light_count + query.light];
    if (last != no_triangle && last != query.triangle) {
        ++shadows.statistics->shadow.extra_tests;
        if (intersects(*shadows.scene, last, TriangleRay(query.ray.origin, query.ray.direction), query.begin,
                       query.end))
            return true;
    }
    uint32_t occluder;
    if (is_blocked_by_static(shadows, query, occluder)) {
        last = occluder;
        return true;
    }
    return is_blocked_by_moving(shadows, query);
}

} // namespace

const ShadowTechnique cache_technique = {is_shadowed_by_cache, cache_bytes, make_cache};

} // namespace wisp::WISP_ARITH
