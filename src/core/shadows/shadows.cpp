// The table of techniques. A program that needs few of them links another file in place of this one.
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

const ShadowTechnique *find_technique(ShadowMethod method) {
#define WISP_TECHNIQUE(name, how) &name##_technique,
    constexpr const ShadowTechnique *techniques[] = {WISP_SHADOW_METHODS(WISP_TECHNIQUE)};
#undef WISP_TECHNIQUE
    return techniques[static_cast<size_t>(method)];
}

} // namespace wisp::WISP_ARITH
