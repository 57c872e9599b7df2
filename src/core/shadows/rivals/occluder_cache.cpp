// The shadow cache: the last occluder first.
#include "core/shadows/rivals/occluder_cache.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

uint64_t entries(const Scene &scene) { return (uint64_t{scene.static_count} + 1) * scene.light_count; }

} // namespace

uint64_t shadow_cache_bytes(const Scene &scene) {
    return Arena::bytes<ShadowCache>(1) + Arena::bytes<uint32_t>(entries(scene));
}

ShadowCache *make_shadow_cache(const Scene &scene, Arena &arena) {
    ShadowCache *cache = arena.make<ShadowCache>(1);
    uint32_t *occluder = arena.make<uint32_t>(static_cast<size_t>(entries(scene)));
    if (!cache || !occluder) return nullptr;
    std::fill(occluder, occluder + entries(scene), no_triangle);
    *cache = {scene.static_count, scene.light_count, occluder};
    return cache;
}

bool is_shadowed(ShadowCache &cache, Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    const size_t row = query.still ? query.triangle : cache.static_count;
    uint32_t &last = cache.occluder[row * cache.light_count + query.light];
    if (last != no_triangle && last != query.triangle) {
        ++statistics.shadow.extra_tests;
        if (intersects(*shadows.scene, last, TriangleRay(query.ray.origin, query.ray.direction), surfaces.ray_epsilon, query.end))
            return true;
    }
    uint32_t occluder;
    if (is_blocked_by_static(shadows, query, occluder)) {
        last = occluder;
        return true;
    }
    return is_blocked_by_moving(shadows, query);
}

} // namespace wisp::WISP_ARITH
