// Which particles are noise (S7): those without which no ray that a picture asks shows anything else.
#pragma once
#include "wisp/scene.h"
#include <vector>

namespace wisp {

struct Removal {
    uint32_t index; // of a particle that goes
    uint32_t mass_receiver;  // the particle that its mass goes to; itself where there is none
};

// Particles of each block that may go together, by ascending index: no ray that leaves the eye or a light, and no part
// of one, loses more than `epsilon` of its opacity by what goes, nor gains more by what is given; 0 < epsilon < 1.
// The same in every arithmetic. Of `smokes` the kernels are used, of the lights kind, position and direction; units are
// those of the particles, whatever they are.
std::vector<std::vector<Removal>> find_negligible(const std::vector<std::vector<Particle>> &particles,
                                             const std::vector<SmokeDescription> &smokes, const Double3 &eye,
                                             const std::vector<LightSource> &lights, double epsilon);

// Takes these away and gives their mass to their heirs.
void remove_particles(std::vector<Particle> &particles, const std::vector<Removal> &removals);

} // namespace wisp
