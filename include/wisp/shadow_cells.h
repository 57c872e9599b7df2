// What is known of shadows (C): each still triangle and light own a quarter of a quarter ... of the triangle, with
// states that are proved (shadow_proof.h), or not yet. They are kept from frame to frame, and have no say in what is
// seen.
//
// Cells lie in blocks of four: the children of one, or four triangles that follow each other. Blocks are taken as they
// are needed; where there are none left, cells are not split, and triangles without a cell ask the trees.
#pragma once
#include "wisp/shadow_proof.h"
#include "wisp/shadows.h"

namespace wisp {

enum class CellState : uint8_t {
    unknown,
    free,    // nothing still stands between it and the light
    blocked, // something still stands between all of it and the light
    partial  // neither has been proved
};

struct ShadowCell {
    uint32_t children; // block; 0: none
    uint32_t occluder; // that stopped the last ray, or no_triangle
    CellState state;
    uint8_t rays;     // asked so far, up to as many as count
    bool lit, shaded; // some ray got through, was stopped
};

namespace WISP_ARITH {

struct ShadowCells {
    bool ready; // false: the arena was too small
    ShadowCell (*blocks)[4];
    uint32_t block_count, used, spare; // used: blocks so far, spare: the first of those given back
    uint32_t *roots;                   // of four triangles, light after light; 0: none yet
    Light *lights;                     // as they were when all this was found out
    uint32_t light_count, roots_per_light;
};

// Bytes of what make_shadow_cells takes: so many for so many triangles and lights.
uint64_t shadow_cell_bytes(const Scene &scene);
ShadowCells make_shadow_cells(const Scene &scene, Arena &arena);

// Forgets what was known of lights that have moved.
void update_shadow_cells(ShadowCells &cells, const Light *lights, uint32_t light_count);

// Of a point of a still triangle, with what is known of its cells; counts all but the query.
bool is_shadowed_by_cells(Shadows &shadows, const ShadowQuery &query);

// The cell of a point of a still triangle; nullptr: there is no room for it.
ShadowCell *find_shadow_cell(ShadowCells &cells, uint32_t light, uint32_t triangle, Real u, Real v, CellPlace &place);

} // namespace WISP_ARITH
} // namespace wisp
