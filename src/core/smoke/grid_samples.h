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

// The number of a block of a sparse grid, or no_block.
constexpr uint32_t number_of_block(const GridDescription &grid, int32_t x, int32_t y, int32_t z) {
    return grid.blocks[(int64_t{z} * blocks_along(grid, 1) + y) * blocks_along(grid, 0) + x];
}

// Visits the blocks of a sparse grid that are there, x fastest: visit(low, samples) returns whether to go on. `low` is
// the place of the first of its samples, of which some may lie outside of the box. `backwards`: in descending order.
template <class Visit> bool for_each_block(const GridDescription &grid, Visit &&visit, bool backwards = false) {
    const int32_t count[3] = {blocks_along(grid, 0), blocks_along(grid, 1), blocks_along(grid, 2)};
    const auto at = [&](int32_t i, int axis) { return backwards ? count[axis] - 1 - i : i; };
    for (int32_t k = 0; k < count[2]; ++k)
        for (int32_t j = 0; j < count[1]; ++j)
            for (int32_t i = 0; i < count[0]; ++i) {
                const int32_t block[3] = {at(i, 0), at(j, 1), at(k, 2)};
                const uint32_t number = number_of_block(grid, block[0], block[1], block[2]);
                if (number == no_block) continue;
                const int32_t low[3] = {block[0] * block_edge - grid.skipped[0],
                                        block[1] * block_edge - grid.skipped[1],
                                        block[2] * block_edge - grid.skipped[2]};
                if (!visit(low, grid.density + uint64_t{number} * samples_of_block)) return false;
            }
    return true;
}

// Visits all samples of the box that are stored, in runs along x: visit(x, y, z, densities, count) returns whether to
// go on. The blocks are in ascending order, in each the rows. `backwards`: in descending order, but each run ascends.
template <class Visit> bool for_each_run(const GridDescription &grid, Visit &&visit, bool backwards = false) {
    const int32_t box[3] = {grid.nx, grid.ny, grid.nz};
    // The rows of `edge` samples a row, of samples that begin at `low`.
    const auto rows = [&](const int32_t(&low)[3], const int32_t(&edge)[3], const float *samples) {
        int32_t first[3], end[3]; // in the box
        for (int a = 0; a < 3; ++a) {
            first[a] = low[a] < 0 ? 0 : low[a];
            end[a] = low[a] + edge[a] > box[a] ? box[a] : low[a] + edge[a];
        }
        const auto at = [&](int32_t i, int axis) { return backwards ? end[axis] - 1 - i + first[axis] : i; };
        for (int32_t k = first[2]; k < end[2]; ++k)
            for (int32_t j = first[1]; j < end[1]; ++j) {
                const int32_t z = at(k, 2), y = at(j, 1);
                const int64_t row = (int64_t{z - low[2]} * edge[1] + (y - low[1])) * edge[0];
                if (!visit(first[0], y, z, samples + row + (first[0] - low[0]), end[0] - first[0])) return false;
            }
        return true;
    };
    if (!grid.blocks) return rows({0, 0, 0}, box, grid.density);
    return for_each_block(
        grid,
        [&](const int32_t(&low)[3], const float *samples) {
            return rows(low, {block_edge, block_edge, block_edge}, samples);
        },
        backwards);
}

} // namespace wisp
