// The samples of a density grid: all of its box, or blocks of 8 x 8 x 8 where there is smoke, as OpenVDB's leaf nodes
// (Museth 2013).
#pragma once
#include <cstdint>
#include "wisp/scene.h"

namespace wisp {

constexpr int32_t log_block_edge = 3, block_edge = 8; // samples
constexpr uint32_t samples_of_block = 512, no_block = UINT32_MAX;

// Samples in the box, and those that GridDescription::density has: the elements of the grid.
constexpr uint64_t samples_of_box(const GridDescription &grid) {
    return static_cast<uint64_t>(grid.nx) * static_cast<uint64_t>(grid.ny) * static_cast<uint64_t>(grid.nz);
}
constexpr uint64_t stored_samples(const GridDescription &grid) {
    return grid.blocks ? uint64_t{grid.block_count} * samples_of_block : samples_of_box(grid);
}

// Blocks along an axis that has so many samples, and along axis 0, 1 or 2 of a grid.
constexpr int32_t blocks_for(int64_t samples, int32_t skipped) {
    return static_cast<int32_t>((samples + skipped + block_edge - 1) / block_edge);
}
constexpr int32_t blocks_along(const GridDescription &grid, int axis) {
    return blocks_for(axis == 0 ? grid.nx : axis == 1 ? grid.ny : grid.nz, grid.skipped[axis]);
}
// The length of GridDescription::blocks.
constexpr uint64_t block_places(const GridDescription &grid) {
    return static_cast<uint64_t>(blocks_along(grid, 0)) * static_cast<uint64_t>(blocks_along(grid, 1)) *
           static_cast<uint64_t>(blocks_along(grid, 2));
}

// Visits all samples of the box that are stored, in runs along x: visit(x, y, z, densities, count) returns whether to
// go on. The blocks are in ascending order, in each the rows. `backwards`: in descending order, but each run ascends.
template <class Visit> bool for_each_run(const GridDescription &grid, Visit &&visit, bool backwards = false) {
    const auto at = [backwards](int32_t i, int32_t first, int32_t last) { return backwards ? last - i + first : i; };
    if (!grid.blocks) {
        for (int32_t k = 0; k < grid.nz; ++k)
            for (int32_t j = 0; j < grid.ny; ++j) {
                const int32_t z = at(k, 0, grid.nz - 1), y = at(j, 0, grid.ny - 1);
                const int64_t row = (int64_t{z} * grid.ny + y) * grid.nx;
                if (!visit(0, y, z, grid.density + row, grid.nx)) return false;
            }
        return true;
    }
    struct Range {
        int32_t low, first, last; // the block's first sample, and those of it that are in the box
        Range(int32_t block, int32_t count, int32_t skipped) : low(block * block_edge - skipped) {
            first = low < 0 ? 0 : low;
            last = low + block_edge > count ? count - 1 : low + block_edge - 1;
        }
    };
    const int32_t nx = blocks_along(grid, 0), ny = blocks_along(grid, 1), nz = blocks_along(grid, 2);
    for (int32_t c = 0; c < nz; ++c)
        for (int32_t b = 0; b < ny; ++b)
            for (int32_t a = 0; a < nx; ++a) {
                const int32_t bx = at(a, 0, nx - 1), by = at(b, 0, ny - 1), bz = at(c, 0, nz - 1);
                const uint32_t number = grid.blocks[(int64_t{bz} * ny + by) * nx + bx];
                if (number == no_block) continue;
                const float *samples = grid.density + uint64_t{number} * samples_of_block;
                const Range x(bx, grid.nx, grid.skipped[0]), y(by, grid.ny, grid.skipped[1]),
                    z(bz, grid.nz, grid.skipped[2]);
                for (int32_t k = z.first; k <= z.last; ++k)
                    for (int32_t j = y.first; j <= y.last; ++j) {
                        const int32_t iz = at(k, z.first, z.last), iy = at(j, y.first, y.last);
                        const int32_t row = ((iz - z.low) * block_edge + (iy - y.low)) * block_edge;
                        if (!visit(x.first, iy, iz, samples + row + (x.first - x.low), x.last - x.first + 1))
                            return false;
                    }
            }
    return true;
}

} // namespace wisp
