// --thin: which particles can be removed because their opacity is negligible on every ray (S7, prepare/README).
#pragma once
#include "wisp/scene.h"
#include <vector>

namespace wisp {

struct Removal {
    uint32_t index;         // of a particle that is removed
    uint32_t mass_receiver; // the particle that gets its mass; itself where the mass is lost
};

// The removable particles of each smoke, by ascending index. On every segment of every ray that leaves the eye or a
// light, the removed particles together have an opacity of at most `epsilon`, and the moved mass adds at most as much;
// 0 < epsilon < 1. All in double, so that the result is the same in every arithmetic. Only the kernels of `smokes` are
// used, and kind, position and direction of the lights. All lengths are in the units of the particles.
std::vector<std::vector<Removal>> find_negligible(const std::vector<std::vector<Particle>> &particles,
                                                  const std::vector<SmokeDescription> &smokes, const Double3 &eye,
                                                  const std::vector<LightSource> &lights, double epsilon);

// Removes these particles, and adds their mass to that of their receivers.
void remove_particles(std::vector<Particle> &particles, const std::vector<Removal> &removals);

} // namespace wisp
