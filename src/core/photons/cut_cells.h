// Cells of a sparse grid that opaque triangles cut. Light that is kept at nodes must not pass through a surface from
// one node to another: within a cut cell a point deposits at, and interpolates between, the corners that it sees
// (README, Cut cells).
//
//   edge |7       4|  3  |  2  |  1  |  0  |   by brick and node
//        |    0    | cut |  z  |  y  |  x  |
//
// x, y, z: a triangle stands between the node and the next one along that axis. cut: one meets the cell with this
// lowest corner, or parts its corners.
#pragma once
#include "core/smoke/sparse_grid.h"
#include "core/surfaces/surfaces.h"

namespace wisp::WISP_ARITH {

struct CutCells {
    const Surfaces *surfaces; // nullptr: no cell is cut
    const SparseGrid *bricks;
    int32_t spacing; // cells of the grid between nodes
    const uint8_t *edges;

    bool any() const { return has(parts::surfaces) && surfaces; }
    // The cell whose lowest corner is this node of a brick.
    bool is_cut(uint32_t brick, uint32_t node) const { return (edges[first(brick) + node] & 8) != 0; }
    size_t first(uint32_t brick) const { return size_t{brick} * nodes_of(spacing); }
};

// Finds the cells that surfaces cut. False: the arena was too small, or the work is stopped.
bool find_cut_cells(const Surfaces &surfaces, const SparseGrid &bricks, int32_t spacing, Arena &arena, Watch watch,
                    CutCells &cut);
inline uint64_t cut_cell_bytes(uint64_t bricks, int32_t spacing) {
    return Arena::bytes<uint8_t>(bricks * nodes_of(spacing));
}

// Whether any cell of the brick is cut.
bool has_cut_cell(const CutCells &cut, uint32_t brick);

// Whether a triangle stands between two nodes of the brick.
bool are_parted(const CutCells &cut, uint32_t brick, const Cell &a, const Cell &b);

// The weights of a cut cell's corners for its point x, at `at` in the brick: trilinear weights of the corners that x
// sees, divided by their sum. False: x sees none, and all are 0.
struct CornerWeights {
    Real of[8];
};
bool find_weights_in_cut_cell(const CutCells &cut, uint32_t brick, const CellPosition &at, const Vec3 &x,
                              CornerWeights &weights);

} // namespace wisp::WISP_ARITH
