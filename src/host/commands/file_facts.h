// What the files hold that wisp reads and writes, but scenes. Each adds the facts of the file at `path`, whose bytes it
// takes, and throws InputError as the reader of its kind does.
#pragma once
#include "host/base/files.h"
#include "host/commands/facts.h"

namespace wisp {

void add_particle_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_grid_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_map_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_passes_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_pfm_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_exr_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_png_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_ppm_file(Facts &facts, const std::string &path, const Bytes &bytes);
void add_record_file(Facts &facts, const std::string &path, const Bytes &bytes);

// Adds the number of particles, their bounds, how close they are to each other, and their smoothing lengths, none where
// these are 0. Positions are (p - center) * scale.
void add_particles(Facts &facts, const std::vector<Particle> &particles, const Double3 &center, double scale);

} // namespace wisp
