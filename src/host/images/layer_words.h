// The names of the core's layers, in the order of Layer: of the file beside a .pfm, and in the C interface.
#pragma once
#include "wisp/layers.h"

namespace wisp {

constexpr const char *layer_words[layer_count] = {"emission", "single", "multiple", "surfaces", "background", "direct",
                                                  "albedo",   "normal", "depth",    "alpha",    "shadow",     "visits"};

} // namespace wisp
