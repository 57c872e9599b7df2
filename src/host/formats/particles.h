// Particles of smoke, read from files: one table whatever the format.
#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace wisp {

// Lengths are in scene units, masses in kg. The doubles hold what the file holds, 32-bit or 64-bit floats, exactly.
// A file may have no particles.
struct Particles {
    const char *format = "";                     // legacy VTK, BGEO or PLY
    std::vector<std::array<double, 3>> position; // finite
    // Each is empty, or has one finite value per particle.
    std::vector<double> density;
    std::vector<double> mass;             // >= 0
    std::vector<double> smoothing_length; // > 0: h; the kernels reach 2 h
    bool has_particle_radius = false;     // there is a `radius` or `pscale`: a particle's radius, which is not used
    bool has_faces = false;               // of a mesh, whose vertices are the particles; PLY and VTK say so
};

// Reads legacy VTK (1.0 to 5.1, UNSTRUCTURED_GRID or POLYDATA, ASCII or BINARY), BGEO version 5 and PLY (ascii or
// binary), each with or without gzip. The content decides which it is, not the name.
// The attributes `density`, `mass`, `h` = `smoothing_length` are used, in upper or lower case, where they have one
// component; all others are skipped, as are cells, faces and primitives.
//
// Throws InputError with one line `NAME:LINE: what is wrong, what was expected` (text) or `NAME: byte N: ...` (binary;
// N counts in the inflated data if the file is compressed and its compression sound). Points are counted from 0.
Particles read_particles(const std::string &path);
// The same for the `size` bytes at `data`; `name` stands in front of errors.
Particles parse_particles(const std::string &name, const unsigned char *data, size_t size);

// Whether the bytes begin like such a file or a related one, which is refused with advice, or are compressed.
bool is_particles(const unsigned char *data, size_t size);

} // namespace wisp
