// Hard shadows, by a ray to the light.
#include "wisp/shadows.h"

namespace wisp::WISP_ARITH {

bool is_shadowed(Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    ++shadows.statistics->rays.shadow;
    if (shadows.cells && query.still) return is_shadowed_by_cells(shadows, query);
    return is_blocked(surfaces, query.ray, surfaces.skin, query.end, query.triangle, shadows.statistics->shadow.traced);
}

} // namespace wisp::WISP_ARITH
