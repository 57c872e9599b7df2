#include "host/prepare/extinction.h"
#include <algorithm>
#include <utility>

namespace wisp {

namespace {

// Of a smoke's extinction, per unit of length.
struct Extinction {
    double volume, greatest;
};

// Particles are counted in cells of a support's size.
Extinction extinction_of_particles(const SmokeDescription &smoke) {
    const double edge = 2 * smoke.largest_h, volume = edge * edge * edge;
    double greatest = 0; // in the middle of a particle alone, or of a cell
    for (uint32_t i = 0; i < smoke.count; ++i) {
        const Particle &particle = smoke.particles[i];
        greatest = std::max(greatest, 0.6 * particle.area / (particle.h * particle.h * particle.h));
    }
    const std::vector<double> areas = areas_in_cells(smoke, edge);
    for (double area : areas) greatest = std::max(greatest, area / volume);
    return {static_cast<double>(areas.size()) * edge * edge * edge, greatest};
}

Extinction extinction_of(const SmokeDescription &smoke) {
    if (!smoke.is_grid()) return extinction_of_particles(smoke);
    const GridDescription &grid = smoke.grid;
    double densest = grid.density ? 0 : 1;
    for (uint64_t i = 0; grid.density && i < grid.count(); ++i)
        densest = std::max(densest, static_cast<double>(grid.density[i]));
    return {8 * grid.half.x * grid.half.y * grid.half.z, densest * grid.extinction};
}

double longest_element(const SmokeDescription &smoke) {
    if (!smoke.is_grid()) return smoke.largest_h;
    const GridDescription &grid = smoke.grid;
    return 2 * std::max({grid.half.x / grid.nx, grid.half.y / grid.ny, grid.half.z / grid.nz});
}

} // namespace

std::vector<double> areas_in_cells(const SmokeDescription &smoke, double edge, int along) {
    std::vector<std::pair<uint64_t, double>> areas; // by cell
    areas.reserve(smoke.count);
    const auto index = [&](double x, int axis) {
        constexpr double most = 1 << 20;
        return axis == along ? 0 : static_cast<uint64_t>(std::clamp(x / edge + most, 0.0, 2 * most - 1));
    };
    for (uint32_t i = 0; i < smoke.count; ++i) {
        const Double3 &p = smoke.particles[i].position;
        areas.emplace_back(index(p.x, 0) << 42 | index(p.y, 1) << 21 | index(p.z, 2), smoke.particles[i].area);
    }
    std::sort(areas.begin(), areas.end());
    std::vector<double> sums;
    for (size_t i = 0; i < areas.size(); ++i) {
        if (i == 0 || areas[i].first != areas[i - 1].first) sums.push_back(0);
        sums.back() += areas[i].second;
    }
    return sums;
}

SmokeDensity density_of(const Scene &scene) {
    SmokeDensity density = {};
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty())
            density.length =
                density.length > 0 ? std::min(density.length, scene.smokes[i].smallest_h) : scene.smokes[i].smallest_h;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        const Extinction extinction = extinction_of(smoke);
        density.volume += extinction.volume;
        density.mean_depth = std::max(density.mean_depth, smoke.total_area / extinction.volume * density.length);
        density.greatest_depth = std::max(density.greatest_depth, extinction.greatest * density.length);
        density.deepest_element = std::max(density.deepest_element, extinction.greatest * longest_element(smoke));
    }
    return density;
}

} // namespace wisp
