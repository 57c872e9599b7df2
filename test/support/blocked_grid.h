// A density grid in blocks, as a sparse file gives it.
#pragma once
#include "core/smoke/grid_samples.h"
#include <vector>

namespace wisp {

// The same samples as those of `dense`. The box begins `skipped` samples after the first block; blocks of zeros are
// left out.
struct BlockedGrid {
    BlockedGrid(const GridDescription &dense, int32_t sx, int32_t sy, int32_t sz) : grid(dense) {
        const int32_t skipped[3] = {sx, sy, sz}, count[3] = {dense.nx, dense.ny, dense.nz};
        int32_t along[3];
        for (int a = 0; a < 3; ++a) {
            grid.skipped[a] = skipped[a];
            along[a] = blocks_for(count[a], skipped[a]);
        }
        for (int32_t bz = 0; bz < along[2]; ++bz)
            for (int32_t by = 0; by < along[1]; ++by)
                for (int32_t bx = 0; bx < along[0]; ++bx) {
                    std::vector<float> block;
                    bool any = false;
                    for (int32_t i = 0; i < 512; ++i) {
                        const int32_t x = bx * 8 + i % 8 - sx, y = by * 8 + i / 8 % 8 - sy, z = bz * 8 + i / 64 - sz;
                        const bool inside = x >= 0 && y >= 0 && z >= 0 && x < dense.nx && y < dense.ny && z < dense.nz;
                        block.push_back(inside ? dense.density[(int64_t{z} * dense.ny + y) * dense.nx + x] : 0);
                        any = any || block.back() > 0;
                    }
                    blocks.push_back(any ? static_cast<uint32_t>(samples.size() / 512) : no_block);
                    if (any) samples.insert(samples.end(), block.begin(), block.end());
                }
        grid.density = samples.data();
        grid.blocks = blocks.data();
        grid.block_count = static_cast<uint32_t>(samples.size() / 512);
    }
    BlockedGrid(const BlockedGrid &) = delete;

    std::vector<float> samples;
    std::vector<uint32_t> blocks;
    GridDescription grid;
};

} // namespace wisp
