// Whether a smoke has enough particles for its picture (S7, prepare/README), as text for `wisp plan -v`.
#pragma once
#include "core/smoke/density_statistics.h"
#include "host/prepare/prepare.h"
#include <string>
#include <vector>

namespace wisp {

// The relative error (root of the mean square) of the density that independent particles give, from the statistics
// of all of them; infinite where there is no neighbour.
double density_error(const SmokeDescription &smoke, const std::vector<DensityStatistics> &statistics);

// Two lines for each smoke of particles: the error of the density, and how many particles are negligible.
std::vector<std::string> particle_report(const PreparedScene &prepared, Arithmetic arithmetic);

} // namespace wisp
