// The table of techniques.
#include "core/numbers/parts.h"
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr bool has_technique(ShadowMethod method) {
    return method == ShadowMethod::trace ||
           has(method == ShadowMethod::exact ? parts::shadow_proofs : parts::other_shadows);
}

} // namespace

const ShadowTechnique *find_technique(ShadowMethod method) {
#define WISP_TECHNIQUE(name, how) has_technique(ShadowMethod::name) ? &name##_technique : nullptr,
    constexpr const ShadowTechnique *techniques[] = {WISP_SHADOW_METHODS(WISP_TECHNIQUE)};
#undef WISP_TECHNIQUE
    return techniques[static_cast<size_t>(method)];
}

} // namespace wisp::WISP_ARITH
