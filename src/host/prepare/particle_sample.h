// How close the particles of a smoke are to each other, measured at some of them.
#pragma once
#include "wisp/scene.h"
#include <cstddef>
#include <optional>
#include <vector>

namespace wisp {

// The particles are in the middles of as many equal parts of their list, sorted along the longest edge of its box. So
// the order of a file changes nothing.
struct ParticleSample {
    size_t count = 0;                 // all particles where these are few
    std::optional<double> spacing;    // the median distance to the nearest other; none of fewer than two particles
    std::optional<double> neighbours; // the mean number of others whose supports (2 h) hold it; none where h is 0
};
ParticleSample sample_particles(std::vector<Particle> particles);

} // namespace wisp
