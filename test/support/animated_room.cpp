// Shading whose shadows are heard of.
#include "support/animated_room.h"

namespace wisp::WISP_ARITH {

static bool is_shadowed_and_heard(Shadows &shadows, const ShadowQuery &query) {
    const bool shadowed = is_shadowed(shadows, query);
    static_cast<HeardShadows &>(shadows).heard(query, shadowed);
    return shadowed;
}

} // namespace wisp::WISP_ARITH

#define is_shadowed            is_shadowed_and_heard
#define trace                  trace_heard
#define make_surface_materials make_heard_materials
#include "core/render/whitted.cpp"
