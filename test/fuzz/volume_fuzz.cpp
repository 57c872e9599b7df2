// Any bytes read as a density grid give an error of one line, or a grid; one of VOL is written as the same bytes.
#include "core/smoke/grid_samples.h"
#include "host/base/error.h"
#include "host/formats/volume_readers.h"
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

void put(std::string &bytes, uint32_t number) {
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift & 0xff);
}

void put(std::string &bytes, float number) {
    uint32_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    put(bytes, bits);
}

std::string written(const wisp::Volume &volume) {
    std::string bytes = "VOL\3";
    for (uint32_t number : {1u, volume.nx, volume.ny, volume.nz, 1u}) put(bytes, number);
    for (const auto &corner : {volume.low, volume.high})
        for (double coordinate : corner) put(bytes, static_cast<float>(coordinate));
    for (float density : volume.density) put(bytes, density);
    return bytes;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (wisp::is_vdb(data, size)) return 0; // another program reads these
    try {
        const wisp::Volume volume = wisp::parse_volume("name", data, size);
        promise(wisp::is_volume(data, size));
        for (size_t k = 0; k < 3; ++k)
            promise(volume.low[k] < volume.high[k] && std::isfinite(volume.high[k] - volume.low[k]));
        wisp::GridDescription grid = {};
        volume.describe_samples(grid);
        promise(volume.density.size() == wisp::stored_samples(grid));
        uint32_t blocks = 0;
        for (const uint32_t number : volume.blocks) promise(number == wisp::no_block || number == blocks++);
        if (grid.blocks) promise(volume.blocks.size() == wisp::block_places(grid) && blocks == grid.block_count);
        for (float density : volume.density) promise(std::isfinite(density) && density >= 0);
        if (wisp::is_vol(data, size)) promise(written(volume) == std::string(data, data + size));
    } catch (const wisp::InputError &error) {
        const std::string line = error.what();
        promise(line.rfind("name: byte ", 0) == 0);
        promise(line.find(", expected ") != std::string::npos);
        promise(line.find('\n') == std::string::npos);
    }
    return 0;
}
