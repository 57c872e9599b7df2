// What is known of shadows (C): each still triangle and light own a quarter of a quarter ... of the triangle, with
// states that are proved (shadow_proof.h), or not yet. They are kept from frame to frame, and have no say in what is
// seen.
//
// Cells lie in blocks of four: the children of one, or four triangles that follow each other. Blocks are taken as they
// are needed; where there are none left, cells are not split, and triangles without a cell ask the trees.
#pragma once
#include "core/shadows/shadows.h"
#include "core/shadows/triangle_shaft.h"

namespace wisp {

enum class CellState : uint8_t {
    unknown,
    free,    // nothing still stands between it and the light
    blocked, // something still stands between all of it and the light
    partial  // neither has been proved
};

// 31                  10 9   8  7    6    5    0
// | children            | state |shaded|lit| rays |
//
// children: the block of its quarters, 0: none; shaded, lit: some ray was stopped, got through; rays: asked so far, up
// to as many as count.
struct ShadowCell {
    uint32_t occluder; // that stopped the last ray, or no_triangle
    uint32_t word;

    uint32_t children() const { return word >> 10; }
    CellState state() const { return static_cast<CellState>(word >> 8 & 3); }
    bool shaded() const { return (word & 1 << 7) != 0; }
    bool lit() const { return (word & 1 << 6) != 0; }
    uint32_t rays() const { return word & 63; }

    void set_children(uint32_t block) { word = (word & 1023) | block << 10; }
    void set_state(CellState state) { word = (word & ~(3u << 8)) | static_cast<uint32_t>(state) << 8; }
    void count_ray(bool stopped, uint32_t most) {
        word |= stopped ? 1 << 7 : 1 << 6;
        if (rays() < most) ++word;
    }
};
static_assert(sizeof(ShadowCell) == 8, "a block of four is half a cache line");

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

// The cell of a point of a still triangle; nullptr: there is no room for it.
ShadowCell *find_shadow_cell(ShadowCells &cells, uint32_t light, uint32_t triangle, Real u, Real v, CellPlace &place);
// Gives the cell children, if it is not one of the finest and there is room for them.
void split(ShadowCells &cells, ShadowCell &cell, const CellPlace &place);

} // namespace WISP_ARITH
} // namespace wisp
