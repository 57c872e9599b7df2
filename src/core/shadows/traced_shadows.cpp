// `trace`: a ray through the trees answers each query. All other techniques are measured against it.
#include "core/shadows/shadow_query.h"

namespace wisp::WISP_ARITH {

const ShadowTechnique trace_technique = {
    [](Shadows &shadows, const ShadowQuery &query) { return is_blocked(shadows, query); }};

} // namespace wisp::WISP_ARITH
