// Which particles are noise (S7): those without which no ray that a picture asks shows anything else.
#pragma once
#include "wisp/scene.h"
#include <string>
#include <vector>

namespace wisp {

// Particles of each block that may go together: no ray that leaves the eye or a light, and no part of one, loses more
// than `epsilon` of its opacity, 0 < epsilon < 1. Ascending indices; the same in every arithmetic. Of `smokes` the
// kernels are used, of the lights kind, position and direction; units are those of the particles, whatever they are.
std::vector<std::vector<uint32_t>> find_noise(const std::vector<std::vector<Particle>> &particles,
                                              const std::vector<SmokeSource> &smokes, const Double3 &eye,
                                              const std::vector<LightSource> &lights, double epsilon);

// Takes these away.
void remove_particles(std::vector<Particle> &particles, const std::vector<uint32_t> &indices);

} // namespace wisp
