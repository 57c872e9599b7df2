// Density grids, read from Mitsuba's VOL files.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace wisp {

// Samples stand at the centres of the nx x ny x nz equal cells of a box, each dimension 1 or more. The doubles hold the
// file's floats exactly.
struct Volume {
    uint32_t nx = 0, ny = 0, nz = 0;
    std::array<double, 3> low{}, high{}; // corners of the box, scene units; finite, low < high
    std::vector<float> density;          // nx * ny * nz, finite, >= 0; x runs fastest, then y
};

// Whether the bytes begin like a VOL file.
bool is_volume(const unsigned char *data, size_t size);

// A VOL file of version 3 with one channel of float32, and nothing after the last sample. `name` stands in front of
// errors. Throws InputError `NAME: byte N: what is wrong, what was expected`; samples are counted from 0.
Volume parse_volume(const std::string &name, const unsigned char *data, size_t size);

} // namespace wisp
