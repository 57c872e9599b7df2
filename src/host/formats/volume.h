// Density grids, read from files: Mitsuba's VOL, NanoVDB and OpenVDB.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include "wisp/double3.h"
#include "wisp/scene.h"
#include <vector>

namespace wisp {

// Samples stand at the centres of the nx x ny x nz equal cells of a box, each dimension 1 or more. The doubles hold the
// file's floats exactly.
struct Volume {
    uint32_t nx = 0, ny = 0, nz = 0;
    // The axes of the box, at right angles and of length 1; and its corners along them, scene units: finite, low <
    // high.
    std::array<Double3, 3> axis{Double3{1, 0, 0}, Double3{0, 1, 0}, Double3{0, 0, 1}};
    std::array<double, 3> low{}, high{};
    // Finite, >= 0; x runs fastest, then y. All nx * ny * nz samples; or blocks of them, as in GridDescription.
    std::vector<float> density;
    std::vector<uint32_t> blocks; // empty: all samples
    std::array<int32_t, 3> skipped{};
    // The name of the grid, and those of all grids of its file. VOL has none.
    std::string name;
    std::vector<std::string> names;

    // Sets what describes the samples. They stay here.
    void describe_samples(GridDescription &grid) const;
};

// Whether the bytes begin like one of these files.
bool is_volume(const unsigned char *data, size_t size);

// A VOL file of version 3 with one channel of float32, and nothing after the last sample; or a grid of floats of a
// NanoVDB or OpenVDB file, which are no level sets. `grid`: its name; empty: `density`, or the only one. `name` stands
// in front of errors, and is the path of an OpenVDB file. Throws InputError `NAME: byte N: what is wrong, what was
// expected`; samples are counted from 0.
Volume parse_volume(const std::string &name, const unsigned char *data, size_t size, const std::string &grid = "");

} // namespace wisp
