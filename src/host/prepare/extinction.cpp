#include "host/prepare/extinction.h"
#include "core/smoke/grid_samples.h"
#include "host/base/double3_algebra.h"
#include "host/prepare/core_units.h"
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace wisp {

namespace {

// Of a smoke's extinction, per unit of length.
struct Extinction {
    double volume, greatest;
};

double cube(double x) { return x * x * x; }

// The cell of a lattice of that edge: one number. `along` as in areas_in_cells().
uint64_t cell_of(const Double3 &position, double edge, int along) {
    const auto index = [&](double x, int axis) {
        constexpr double most = 1 << 20;
        return axis == along ? 0 : static_cast<uint64_t>(std::clamp(x / edge + most, 0.0, 2 * most - 1));
    };
    return index(position.x, 0) << 42 | index(position.y, 1) << 21 | index(position.z, 2);
}

// The summed cross-sections of the particles of a cell, one of which is at `position`.
struct CellArea {
    uint64_t cell;
    double area;
    Double3 position;
};

// In ascending order of cells.
std::vector<CellArea> sum_in_cells(std::vector<CellArea> particles) {
    std::sort(particles.begin(), particles.end(),
              [](const CellArea &a, const CellArea &b) { return std::tie(a.cell, a.area) < std::tie(b.cell, b.area); });
    std::vector<CellArea> cells;
    for (const CellArea &particle : particles)
        if (!cells.empty() && cells.back().cell == particle.cell)
            cells.back().area += particle.area;
        else
            cells.push_back(particle);
    return cells;
}

double area_of(const std::vector<CellArea> &cells, uint64_t cell) {
    const auto found = std::lower_bound(cells.begin(), cells.end(), cell,
                                        [](const CellArea &area, uint64_t wanted) { return area.cell < wanted; });
    return found != cells.end() && found->cell == cell ? found->area : 0;
}

// The greatest density of a cell. Particles of like radii are counted in cells of their support's size. Small particles
// may stand in the place of large ones: the densities of their cells are added. `shift`: of all cells, in their edges.
double greatest_in_cells(const SmokeDescription &smoke, double shift) {
    const auto edge_of = [&](size_t octave) { return std::scalbn(2 * smoke.largest_h, -static_cast<int>(octave)); };
    const auto cell_at = [&](const Double3 &position, size_t octave) {
        const double edge = edge_of(octave), by = shift * edge;
        return cell_of({position.x + by, position.y + by, position.z + by}, edge, -1);
    };
    std::vector<std::vector<CellArea>> octaves; // the radii of each are at most half of those of the one before
    for (uint32_t i = 0; i < smoke.count; ++i) {
        const Particle &particle = smoke.particles[i];
        const size_t octave = static_cast<size_t>(std::max(0, std::ilogb(smoke.largest_h / particle.h)));
        if (octaves.size() <= octave) octaves.resize(octave + 1);
        octaves[octave].push_back({cell_at(particle.position, octave), particle.area, particle.position});
    }
    for (std::vector<CellArea> &areas : octaves) areas = sum_in_cells(std::move(areas));
    double greatest = 0;
    for (size_t octave = 0; octave < octaves.size(); ++octave)
        for (const CellArea &cell : octaves[octave]) {
            double sum = cell.area / cube(edge_of(octave));
            for (size_t wider = 0; wider < octave; ++wider)
                sum += area_of(octaves[wider], cell_at(cell.position, wider)) / cube(edge_of(wider));
            greatest = std::max(greatest, sum);
        }
    return greatest;
}

// About: where the smoke is densest, in the middle of a particle alone or in a cell. Of two lattices, the borders of
// one do not hide the particles of one place.
double greatest_extinction(const SmokeDescription &smoke) {
    double greatest = std::max(greatest_in_cells(smoke, 0), greatest_in_cells(smoke, 0.5));
    for (uint32_t i = 0; i < smoke.count; ++i)
        greatest = std::max(greatest, 0.6 * smoke.particles[i].area / cube(smoke.particles[i].h));
    return greatest;
}

Extinction extinction_of_particles(const SmokeDescription &smoke) {
    const double edge = 2 * smoke.largest_h;
    return {static_cast<double>(areas_in_cells(smoke, edge).size()) * cube(edge), greatest_extinction(smoke)};
}

Extinction extinction_of(const SmokeDescription &smoke) {
    if (!smoke.is_grid()) return extinction_of_particles(smoke);
    const GridDescription &grid = smoke.grid;
    double densest = grid.density ? 0 : 1;
    for (uint64_t i = 0; grid.density && i < stored_samples(grid); ++i)
        densest = std::max(densest, static_cast<double>(grid.density[i]));
    return {8 * grid.half.x * grid.half.y * grid.half.z, densest * grid.extinction};
}

double longest_element(const SmokeDescription &smoke) {
    if (!smoke.is_grid()) return smoke.largest_h;
    const GridDescription &grid = smoke.grid;
    return 2 * std::max({grid.half.x / grid.nx, grid.half.y / grid.ny, grid.half.z / grid.nz});
}

// The mean square of the depths of samples, weighted by the diffuse light that goes out in each: of light that enters a
// grid along an axis (0, 1, 2) or against it. `edges`: a sample's optical depths at density 1.
double lit_square(const GridDescription &grid, int axis, bool against, const double (&edges)[3]) {
    const double edge = edges[axis], longest = std::max({edges[0], edges[1], edges[2]});
    constexpr double deepest = 1e6; // of a sample: squares are finite
    struct Column {
        int32_t last = -2; // the sample before
        double tau = 0;    // so far, through samples side by side
    };
    const int32_t counts[3] = {grid.nx, grid.ny, grid.nz};
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::vector<Column> columns(static_cast<size_t>(counts[u]) * static_cast<size_t>(counts[v]));
    double light = 0, sum = 0;
    const auto run = [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t count) {
        for (int32_t i = 0; i < count; ++i) {
            const int32_t offset = against ? count - 1 - i : i, at[3] = {x + offset, y, z};
            const double density = densities[offset];
            if (!(density > 0)) continue;
            Column &column =
                columns[static_cast<size_t>(at[v]) * static_cast<size_t>(counts[u]) + static_cast<size_t>(at[u])];
            if (std::abs(at[axis] - column.last) > 1) column.tau = 0; // nothing lies between
            const double depth = std::min(density * longest, deepest);
            const double deeper = column.tau + std::min(density * edge, deepest);
            const double out = 1 / (1 + 0.75 * column.tau) - 1 / (1 + 0.75 * deeper);
            column = {at[axis], deeper};
            light += out;
            sum += out * depth * depth;
        }
        return true;
    };
    for_each_run(grid, run, against);
    return light > 0 ? sum / light : 0;
}

} // namespace

double lit_depth(const GridDescription &grid) {
    const double edges[3] = {2 * grid.half.x / grid.nx * grid.extinction, 2 * grid.half.y / grid.ny * grid.extinction,
                             2 * grid.half.z / grid.nz * grid.extinction};
    double greatest = 0;
    for (const int axis : {0, 1, 2})
        for (const bool against : {false, true}) greatest = std::max(greatest, lit_square(grid, axis, against, edges));
    return std::sqrt(greatest);
}

bool has_particles(const Scene &scene) {
    return std::any_of(scene.smokes, scene.smokes + scene.smoke_count,
                       [](const SmokeDescription &smoke) { return smoke.count > 0; });
}

std::vector<double> areas_in_cells(const SmokeDescription &smoke, double edge, int along) {
    std::vector<CellArea> particles;
    particles.reserve(smoke.count);
    for (uint32_t i = 0; i < smoke.count; ++i) {
        const Particle &particle = smoke.particles[i];
        particles.push_back({cell_of(particle.position, edge, along), particle.area, particle.position});
    }
    std::vector<double> areas;
    for (const CellArea &cell : sum_in_cells(std::move(particles))) areas.push_back(cell.area);
    return areas;
}

namespace {

// Of a density grid the greatest extinction next to x, of particles the mean in a ball that is as large as theirs.
double extinction_around(const SmokeDescription &smoke, const Double3 &x) {
    if (!smoke.is_grid()) {
        double sum = 0;
        for (uint32_t i = 0; i < smoke.count; ++i) {
            const Particle &particle = smoke.particles[i];
            const Double3 d = x - particle.position;
            const double reach = 2 * particle.h;
            if (dot(d, d) < reach * reach) sum += particle.area / (volume_of_unit_ball * cube(reach));
        }
        return sum;
    }
    const GridDescription &grid = smoke.grid;
    const Double3 d = x - grid.center;
    const double half[3] = {grid.half.x, grid.half.y, grid.half.z};
    const int32_t counts[3] = {grid.nx, grid.ny, grid.nz};
    int32_t at[3]; // the sample at x
    for (int k = 0; k < 3; ++k) {
        const double part = dot(d, grid.axis[k]) / half[k]; // -1 to 1
        if (!(std::abs(part) <= 1)) return 0;
        at[k] = static_cast<int32_t>(0.5 * (part + 1) * counts[k]);
    }
    double densest = grid.density ? 0 : 1;
    const auto run = [&](int32_t first, int32_t y, int32_t z, const float *densities, int32_t count) {
        if (std::abs(y - at[1]) <= 1 && std::abs(z - at[2]) <= 1)
            for (int32_t i = std::max(0, at[0] - 1 - first); i < std::min(count, at[0] + 2 - first); ++i)
                densest = std::max(densest, static_cast<double>(densities[i]));
        return true;
    };
    if (grid.density) for_each_run(grid, run);
    return densest * grid.extinction;
}

// The same of a place that may be anywhere: most lights, and most eyes, are outside of the smoke.
double extinction_at(const SmokeDescription &smoke, const SmokeExtent &extent, const Double3 &x) {
    const double reach = 2 * extent.largest_h;
    const auto reaches = [reach](double v, double low, double high) { return v > low - reach && v < high + reach; };
    return reaches(x.x, extent.low.x, extent.high.x) && reaches(x.y, extent.low.y, extent.high.y) &&
                   reaches(x.z, extent.low.z, extent.high.z)
               ? extinction_around(smoke, x)
               : 0;
}

// The greatest extinction around a point light or spot.
double extinction_at_lights(const Scene &scene, const SmokeDescription &smoke, const SmokeExtent &extent) {
    double greatest = 0;
    for (uint32_t l = 0; l < scene.light_count; ++l) {
        const LightSource &light = scene.lights[l];
        if (light.kind == LightKind::point || light.kind == LightKind::spot)
            greatest = std::max(greatest, extinction_at(smoke, extent, light.position));
    }
    return greatest;
}

} // namespace

SmokeDensity density_of(const Scene &scene) {
    SmokeDensity density = {};
    double area = 0, squares = 0; // of all particles; the squares per volume of a cell of their size
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty())
            density.length =
                density.length > 0 ? std::min(density.length, scene.smokes[i].smallest_h) : scene.smokes[i].smallest_h;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        const Extinction extinction = extinction_of(smoke);
        density.volume += extinction.volume;
        for (uint32_t k = 0; k < smoke.count; ++k) {
            const Particle &particle = smoke.particles[k];
            area += particle.area;
            squares += particle.area * particle.area / cube(2 * particle.h);
        }
        density.mean_depth = std::max(density.mean_depth, smoke.total_area / extinction.volume * density.length);
        const double length = smoke.grid.density ? longest_element(smoke) : density.length; // cells are of samples
        density.greatest_depth = std::max(density.greatest_depth, extinction.greatest * length);
        density.deepest_element = std::max(density.deepest_element, extinction.greatest * longest_element(smoke));
        const SmokeExtent extent = extent_of(smoke.particles, smoke.count, smoke);
        density.depth_at_lights =
            std::max(density.depth_at_lights, extinction_at_lights(scene, smoke, extent) * length);
        if (smoke.grid.density) density.depth_where_lit = std::max(density.depth_where_lit, lit_depth(smoke.grid));
    }
    density.even_volume = squares > 0 ? std::min(density.volume, area * area / squares) : density.volume;
    return density;
}

} // namespace wisp
