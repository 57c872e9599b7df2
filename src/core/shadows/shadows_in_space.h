// The shadows of surfaces in smoke. No technique takes part: these learn of the points of triangles.
#pragma once
#include "core/shadows/shadow_query.h"

namespace wisp::WISP_ARITH {

// Whether an opaque triangle stands between x and a light that reaches it as `from` says. A wall shadows x however near
// it is.
inline bool is_blocked_in_space(const Surfaces &surfaces, const Vec3 &x, const Illumination &from, TreeCounts &counts) {
    return is_blocked(surfaces, {x, -from.direction}, Real(0), from.distance - surfaces.ray_epsilon, no_triangle,
                      counts);
}

// Sets lit[i] to the part of step i, 0 to 1, from which no opaque triangle hides the light, in units of
// 1 / shadow_parts (README, Shadows on a ray). Step i has this length around distance middle[i] of the ray; of length 0
// it is not asked for. At most `lanes` steps, in order.
void find_lit_parts(const Shadows &shadows, uint32_t light, const Ray &ray, uint32_t count, const Real *middle,
                    const Real *length, Real *lit);

} // namespace wisp::WISP_ARITH
