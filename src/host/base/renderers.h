// The library in the arithmetic that the user chose.
#pragma once
#include "wisp/pixel_trace.h"
#include "wisp/wisp.h"

namespace wisp {

enum class Arithmetic { f32, f64, fixed };

inline const Renderer &renderer_of(Arithmetic arithmetic) {
    constexpr const Renderer *renderers[] = {&f32::renderer, &f64::renderer, &fixed::renderer};
    return *renderers[static_cast<int>(arithmetic)];
}

} // namespace wisp
