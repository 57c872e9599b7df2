// The shadow cache (Haines, Greenberg 1986): what stopped the last ray to a light is tried first.
//
// The paper remembers one occluder for each light. Here each triangle that never moves has its own, for neighbouring
// pixels of one triangle are stopped by the same more often than neighbouring rays of all depths are; those that move
// share one for each light. Only still occluders are remembered: they are asked first in any case, and in the next
// frame they are where they were. A triangle that is tried is met as its tree meets it, so shadows are those of
// tracing.
#pragma once
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

struct ShadowCache {
    uint32_t static_count, light_count;
    uint32_t *occluder; // [still triangle, and one more][light], or no_triangle
};

uint64_t shadow_cache_bytes(const Scene &scene);
ShadowCache *make_shadow_cache(const Scene &scene, Arena &arena); // nullptr: the arena was too small
bool is_shadowed(ShadowCache &cache, Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
