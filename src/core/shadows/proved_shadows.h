// `exact`: shadows without rays where a proof says so (C8). Proofs about cells of static triangles (visibility_cells.h)
// hold as long as the light stays. Proofs about instances (instance_shadows.h) hold for one frame. The answers are
// those of `trace`, whatever has been proved.
#pragma once
#include "core/shadows/instance_shadows.h"
#include "core/shadows/visibility_cells.h"

namespace wisp::WISP_ARITH {

struct ProvedShadows {
    ShadowCells cells;
    InstanceShadows instances;
};

} // namespace wisp::WISP_ARITH
