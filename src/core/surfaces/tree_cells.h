// The cells of the trees of surfaces that hold a point. No search asks for them: they are drawn.
#pragma once
#include "core/surfaces/surfaces.h"

namespace wisp::WISP_ARITH {

struct TreeCells {
    bool found;         // false: the point lies outside of all trees
    uint32_t triangles; // in the leaves that hold the point
    uint64_t nodes;     // a number of the nodes that hold the point: another set of nodes has another one
};

// Of all trees: that of static triangles, those of visible instances, that of deforming triangles.
TreeCells cells_at(const Surfaces &surfaces, const Vec3 &x);

} // namespace wisp::WISP_ARITH
