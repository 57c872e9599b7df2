// Which reader reads a density grid.
#include "host/formats/volume_readers.h"

namespace wisp {

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
