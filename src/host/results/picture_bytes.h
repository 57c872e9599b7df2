// Memory of a picture beside the core's arena.
#pragma once
#include "wisp/wisp.h"

namespace wisp {

// Floats of a pixel's layers, the host's too.
uint32_t layer_planes(const Settings &settings, const Plan &plan);

// Bytes of the picture and its layers, which are held twice, as numbers and as their file, and of the sums of
// --reference.
uint64_t picture_bytes(const Settings &settings, const Plan &plan);

// Of the arena and the picture.
inline uint64_t needed_bytes(const Settings &settings, const Plan &plan) {
    return plan.arena_bytes + picture_bytes(settings, plan);
}

} // namespace wisp
