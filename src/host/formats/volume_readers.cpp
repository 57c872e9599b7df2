// Which reader reads a density grid.
#include "host/formats/volume_readers.h"

#include "core/smoke/grid_samples.h"

namespace wisp {

void Volume::describe_samples(GridDescription &grid) const {
    grid.nx = static_cast<int32_t>(nx);
    grid.ny = static_cast<int32_t>(ny);
    grid.nz = static_cast<int32_t>(nz);
    grid.density = density.data();
    if (blocks.empty()) return;
    grid.blocks = blocks.data();
    grid.block_count = static_cast<uint32_t>(density.size() / samples_of_block);
    for (size_t a = 0; a < 3; ++a) grid.skipped[a] = skipped[a];
}

bool is_volume(const unsigned char *data, size_t size) {
    return is_vol(data, size) || is_nvdb(data, size) || is_vdb(data, size);
}

Volume parse_volume(const std::string &name, const unsigned char *data, size_t size, const std::string &grid) {
    if (is_nvdb(data, size)) return parse_nvdb(name, data, size, grid);
    if (is_vdb(data, size)) {
        const Bytes bytes = nvdb_of_vdb(name);
        return parse_nvdb(name, bytes.data(), bytes.size(), grid);
    }
    return parse_vol(name, data, size);
}

} // namespace wisp
