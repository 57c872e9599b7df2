// The light buffer (Haines, Greenberg 1986): a grid of cells around each light, each with the opaque still triangles
// that may be seen through it from the light, nearest first.
//
// A shadow ray asks the triangles of the cell that it arrives through, one by one, as far as its own point; each is met
// as its tree meets it. Lists hold all that rays through the cell may hit, so shadows are those of tracing. Where one
// triangle covers all of a cell, what lies behind it is in shadow without a test. Grids are made when the first ray
// asks for their light, and anew when it has changed. What has no place in them is traced: points beside the grid,
// cells with too many triangles.
//
// Triangles are sorted into cells by whole numbers, on the lattice of shaft.h, as seen from the light:
//
//   along   away from the light, along an axis: a light amid the triangles has a cube of six faces; one far from them a
//           single face, along the axis that is nearest to its way to them
//   across  along the next two axes, less along * slope (the way's), times gain, such that all triangles lie in
//           -along to along, for a parallel light in -reach to reach; a cube's slopes are 0, its gains 1
//
// So the cells are those of across / along, and a parallel light is one before which all points lie `reach` away. A ray
// hits what is within shaft.h's margin M of the segment from the light to its point, which is as seen:
//
//   along: M; across: (M + 1 + (M + 1) slope) gain, where 1 is for the rounding of across; and 2 in both for that of a
//   point and of a corner to units of 2^coarser steps. For parallel lights the slope is off by 2^-26 at most, and so M
//   by 2 steps in 2^27.
//
// In a cell is the cone of all (u, v, 1) * z with z >= 0 and low <= u, v <= high, of which the segments are part. It
// lists each triangle of which a corner is above low and one below high, in u and v, and which is not beside one of its
// own edges: in the plane of the light and an edge no point q of the cone that is within `margin` of the triangle is
// beyond the edge by more than margin * normal, and all such q are at least at the triangle's least distance from the
// light, in the largest coordinate, less the margin.
//
// A triangle covers a cell where all of the cone is inside its edges by so much that no rounding of corners and ray
// changes a sign of `meet` (triangle.h): of volumes (light, q, corner, corner) with coordinates below R. Each of those
// points is off by `margin` at most, with the light at 0 the three by twice that, which changes the volume by less than
// 3 * 3 * 2 R^2 * 2 margin = 36 R^2 margin.
#pragma once
#include "core/shadows/box_shaft.h"

namespace wisp::WISP_ARITH {

struct BufferEntry {
    uint32_t triangle;
    int32_t depth; // no ray that hits it ends nearer to the light: along, in units
};

struct BufferCell {
    uint32_t first, count; // or traced
    int32_t shaded;        // what is farther is in shadow

    static constexpr uint32_t traced = 0xffffffff; // count
};

// How points are seen.
struct BufferView {
    LatticePoint origin;
    bool cube;
    int axis, sign; // of the one face, otherwise
    int64_t edge;   // of a face, in cells
    int64_t slope[2], gain[2];
    int64_t reach; // 0: not a parallel light
    int64_t margin[3], depth_margin;
};

struct BufferLight {
    Light light; // as it was when its lists were made
    enum : uint8_t { unasked, ready, useless } state;
    ShaftLattice lattice;
    BufferView view;
    BufferCell *cells;
    BufferEntry *entries;
};

struct LightBuffer {
    uint32_t light_count;
    uint32_t edge;        // of the face of a cube, in cells
    uint32_t entry_count; // of each light
    BufferLight *lights;
};

uint64_t light_buffer_bytes(const Scene &scene);
LightBuffer *make_light_buffer(const Scene &scene, Arena &arena); // nullptr: the arena was too small
void begin_frame(LightBuffer &buffer, const Shadows &shadows);
bool is_shadowed(LightBuffer &buffer, Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
