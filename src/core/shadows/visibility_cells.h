// The visibility of lights from cells of static triangles (C8). Each static triangle and light have a tree of cells: a
// cell is the triangle or one of the quarters into which it is divided again and again. A cell has a state that is
// proved (triangle_shaft.h) or not yet known. Cells are kept from frame to frame, and they do not change any picture.
//
// Cells lie in blocks of four: the children of one cell, or four consecutive triangles. Blocks are taken when they are
// needed. When none is left, cells are not divided, and rays of triangles without a cell are traced.
#pragma once
#include "core/shadows/shadow_query.h"
#include "core/shadows/triangle_shaft.h"
#include "wisp/probe.h"

namespace wisp {

// 31                  10 9   8  7         6    5    0
// | children            | state |shadowed|lit | rays |
//
// children: the block of the cell's quarters, 0: none; shadowed, lit: some ray was blocked, some ray reached the light;
// rays: the number traced so far, which stops at count_ray's `max_rays`.
struct ShadowCell {
    uint32_t occluder; // that blocked the last ray, or no_triangle
    uint32_t word;

    uint32_t children() const { return word >> 10; }
    CellState state() const { return static_cast<CellState>(word >> 8 & 3); }
    bool has_shadowed_ray() const { return (word & 1 << 7) != 0; }
    bool has_lit_ray() const { return (word & 1 << 6) != 0; }
    uint32_t rays() const { return word & 63; }

    void set_children(uint32_t block) { word = (word & 1023) | block << 10; }
    void set_state(CellState state) { word = (word & ~(3u << 8)) | static_cast<uint32_t>(state) << 8; }
    void count_ray(bool blocked, uint32_t max_rays) {
        word |= blocked ? 1 << 7 : 1 << 6;
        if (rays() < max_rays) ++word;
    }
};
static_assert(sizeof(ShadowCell) == 8, "a block of four is half a cache line");

namespace WISP_ARITH {

struct ShadowCells {
    bool ready; // false: the arena was too small
    ShadowCell (*blocks)[4];
    uint32_t block_count;
    uint32_t used;   // blocks ever taken; block 0 means none
    uint32_t spare;  // the first of those returned, or 0: a list through their first cells' children
    uint32_t *roots; // [light][triangle / 4]: the block of four triangles; 0: none yet
    Light *lights;   // as they were when the cells were resolved
    uint32_t light_count, roots_per_light;
};

// After so many rays a cell that is mixed is divided.
constexpr uint32_t rays_before_split = 24;

// An upper bound of what make_shadow_cells takes from the arena. Memory is in proportion to what can be learnt: there
// are blocks for each root and for the cells that the camera rays of six frames can divide at most.
uint64_t shadow_cell_bytes(const Scene &scene, const Settings &settings);
ShadowCells make_shadow_cells(const Scene &scene, const Settings &settings, Arena &arena, Watch watch = {});

// Returns the cells of lights that have moved.
void update_shadow_cells(ShadowCells &cells, const Light *lights, uint32_t light_count);

// The finest cell that holds a point of a static triangle, and its place; nullptr: there is no room for it.
ShadowCell *find_shadow_cell(ShadowCells &cells, uint32_t light, uint32_t triangle, Real u, Real v, CellPlace &place);
// Gives the cell children, if it is not one of the finest and there is room for them.
void split(ShadowCells &cells, ShadowCell &cell, const CellPlace &place);

} // namespace WISP_ARITH
} // namespace wisp
