#include "host/prepare/extinction.h"
#include <algorithm>
#include <utility>
#include <vector>

namespace wisp {

namespace {

// Of a smoke's extinction, per unit of length.
struct Extinction {
    double volume, greatest;
};

// Particles are counted in cells of a support's size.
Extinction extinction_of_particles(const SmokeDescription &smoke) {
    const double edge = 2 * smoke.largest_h, volume = edge * edge * edge;
    std::vector<std::pair<uint64_t, double>> cells; // and the cross-section of a particle in it
    cells.reserve(smoke.count);
    const auto index = [edge](double x) { // coordinates are within coordinate_limit, cells at least 2 wide
        return static_cast<uint64_t>(x / edge + (1 << 20));
    };
    double greatest = 0; // in the middle of a particle alone, or of a cell
    for (uint32_t i = 0; i < smoke.count; ++i) {
        const Particle &particle = smoke.particles[i];
        const Double3 &p = particle.position;
        cells.emplace_back(index(p.x) << 42 | index(p.y) << 21 | index(p.z), particle.area);
        greatest = std::max(greatest, 0.6 * particle.area / (particle.h * particle.h * particle.h));
    }
    std::sort(cells.begin(), cells.end());
    size_t occupied = 0;
    for (size_t i = 0; i < cells.size(); ++occupied) {
        const uint64_t cell = cells[i].first;
        double area = 0;
        for (; i < cells.size() && cells[i].first == cell; ++i) area += cells[i].second;
        greatest = std::max(greatest, area / volume);
    }
    return {static_cast<double>(occupied) * edge * edge * edge, greatest};
}

Extinction extinction_of(const SmokeDescription &smoke) {
    if (!smoke.is_grid()) return extinction_of_particles(smoke);
    const GridDescription &grid = smoke.grid;
    double densest = grid.density ? 0 : 1;
    for (uint64_t i = 0; grid.density && i < grid.count(); ++i)
        densest = std::max(densest, static_cast<double>(grid.density[i]));
    return {8 * grid.half.x * grid.half.y * grid.half.z, densest * grid.extinction};
}

} // namespace

double volume_of(const SmokeDescription &smoke) { return extinction_of(smoke).volume; }

DepthOfLength depth_of_length(const Scene &scene) {
    double finest = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty())
            finest = finest > 0 ? std::min(finest, scene.smokes[i].smallest_h) : scene.smokes[i].smallest_h;
    DepthOfLength deepest = {0, 0};
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        const Extinction extinction = extinction_of(smoke);
        deepest.mean = std::max(deepest.mean, smoke.total_area / extinction.volume * finest);
        deepest.greatest = std::max(deepest.greatest, extinction.greatest * finest);
    }
    return deepest;
}

} // namespace wisp
