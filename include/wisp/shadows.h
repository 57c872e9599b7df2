// Hard shadows of surfaces (C): whether anything opaque stands between a point of a surface and a light. However they
// are found, what is seen is the same but for the paper's own method.
#pragma once
#include "wisp/light.h"
#include "wisp/surfaces.h"

namespace wisp::WISP_ARITH {

// A point of a triangle asks for a light.
struct ShadowQuery {
    Ray ray;           // from the point towards the light
    Real end;          // its distance, less the skin: what is farther stands behind the light
    uint32_t light;    // of the scene
    uint32_t triangle; // that holds the point: it does not stand in its own light
    bool still;        // that triangle never moves
    Real u, v;         // where the point is in it: the weights of corners 1 and 2
};

struct ShadowCells; // shadow_cells.h

struct Shadows {
    const Scene *scene;
    const Surfaces *surfaces;
    const Light *lights;
    Statistics *statistics;
    ShadowCells *cells; // or nullptr: every ray is sent
};

bool is_shadowed(Shadows &shadows, const ShadowQuery &query);

// The same for points of still triangles, with what is known of their cells; it counts all but the query.
bool is_shadowed_by_cells(Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
