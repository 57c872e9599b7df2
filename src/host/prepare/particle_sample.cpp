#include "host/base/double3_algebra.h"
#include "host/prepare/particle_sample.h"
#include <limits>
#include <tuple>

namespace wisp {

namespace {

// Of a mean number of neighbours as SPH has it, around 50, the standard error is then about 1 %.
constexpr size_t most_sampled = 1000;

using Coordinate = double Double3::*;

Coordinate longest_edge(const std::vector<Particle> &particles) {
    Coordinate longest = &Double3::x;
    double most = -1;
    for (const Coordinate axis : {&Double3::x, &Double3::y, &Double3::z}) {
        const auto [low, high] =
            std::minmax_element(particles.begin(), particles.end(), [axis](const Particle &a, const Particle &b) {
                return a.position.*axis < b.position.*axis;
            });
        const double edge = high->position.*axis - low->position.*axis;
        if (edge > most) longest = axis;
        most = std::max(most, edge);
    }
    return longest;
}

struct Surroundings {
    double nearest_squared = std::numeric_limits<double>::infinity();
    uint64_t neighbours = 0;
};

// Of particle i; all are sorted along the axis, and none reaches farther than `reach`.
Surroundings surroundings_of(const std::vector<Particle> &particles, size_t i, Coordinate axis, double reach) {
    Surroundings around;
    const Double3 &middle = particles[i].position;
    const auto look_at = [&](const Particle &other) { // false: neither it nor any beyond it matters
        const double along = other.position.*axis - middle.*axis;
        if (along * along >= std::max(around.nearest_squared, reach * reach)) return false;
        const Double3 d = other.position - middle;
        const double squared = dot(d, d);
        around.nearest_squared = std::min(around.nearest_squared, squared);
        around.neighbours += squared < 4 * other.h * other.h;
        return true;
    };
    for (size_t j = i + 1; j < particles.size() && look_at(particles[j]); ++j) continue;
    for (size_t j = i; j > 0 && look_at(particles[j - 1]); --j) continue;
    return around;
}

} // namespace

ParticleSample sample_particles(std::vector<Particle> particles) {
    ParticleSample sample;
    sample.count = std::min(particles.size(), most_sampled);
    if (particles.empty()) return sample;
    const Coordinate axis = longest_edge(particles);
    std::sort(particles.begin(), particles.end(), [axis](const Particle &a, const Particle &b) {
        return std::make_tuple(a.position.*axis, a.position.x, a.position.y, a.position.z, a.h) <
               std::make_tuple(b.position.*axis, b.position.x, b.position.y, b.position.z, b.h);
    });
    double largest_h = 0;
    for (const Particle &particle : particles) largest_h = std::max(largest_h, particle.h);
    std::vector<double> nearest_squared;
    uint64_t neighbours = 0;
    for (size_t k = 0; k < sample.count; ++k) {
        const size_t i = (2 * k + 1) * particles.size() / (2 * sample.count);
        const Surroundings around = surroundings_of(particles, i, axis, 2 * largest_h);
        nearest_squared.push_back(around.nearest_squared);
        neighbours += around.neighbours;
    }
    const auto median = nearest_squared.begin() + static_cast<ptrdiff_t>(sample.count / 2);
    std::nth_element(nearest_squared.begin(), median, nearest_squared.end());
    if (particles.size() > 1) sample.spacing = std::sqrt(*median);
    if (largest_h > 0) sample.neighbours = static_cast<double>(neighbours) / static_cast<double>(sample.count);
    return sample;
}

} // namespace wisp
