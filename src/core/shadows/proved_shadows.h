// Shadows without rays, where that is proved (C8): of cells of still triangles (shadow_cells.h), for as long as the
// light stays, and of bodies (body_shadows.h), for one frame. Whatever is known, shadows are those of tracing.
#pragma once
#include "core/shadows/instance_shadows.h"
#include "core/shadows/visibility_cells.h"

namespace wisp::WISP_ARITH {

struct ProvedShadows {
    ShadowCells cells;
    InstanceShadows instances;
};

uint64_t proved_shadow_bytes(const Scene &scene);
ProvedShadows *make_proved_shadows(const Scene &scene, Arena &arena);          // nullptr: the arena was too small
bool begin_frame(ProvedShadows &exact, const Shadows &shadows, Arena &arena); // false: the arena was too small
bool is_shadowed(ProvedShadows &exact, Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
