// How dense the smoke of a prepared scene is.
#pragma once
#include "wisp/scene.h"
#include <vector>

namespace wisp {

constexpr double volume_of_unit_ball = 4.18879; // 4 / 3 pi

bool has_particles(const Scene &scene); // not grids alone

// The cross-sections of a smoke's particles, summed in cells of the given edge: of each cell that has particles. Of
// columns along an axis (0, 1, 2) instead of cells, if there is one.
std::vector<double> areas_in_cells(const SmokeDescription &smoke, double edge, int along = -1);

// All smoke of a scene. Without smoke all is 0.
struct SmokeDensity {
    double length;      // the smallest smoothing length
    double volume;      // of all smokes together: of particles that of the cells, of a support's size, that have some
    double even_volume; // of so many particles alike as take as much light as evenly as these; at most `volume`
    double mean_depth;  // of one such length in the densest smoke, over its volume
    double greatest_depth;  // about: of one such length where a smoke is densest; of a density grid, of a sample's edge
    double deepest_element; // about: the depth of a smoothing length of its own, or of a sample's longest edge
    double depth_where_lit; // of density grids: the greatest lit_depth()
    double depth_at_lights; // about: as greatest_depth, around the point lights and spots that stand in smoke
};
SmokeDensity density_of(const Scene &scene);

// Of a density grid: the depth of a sample's longest edge where diffuse light goes out that enters from one of its six
// sides. It is the root mean square over that light, of the side where it is the greatest. Of diffuse light
// 1 / (1 + 3/4 tau) gets through an optical depth tau (Schuster's two streams; albedo 1, even phase). Behind an empty
// sample light is as bright as outside.
double lit_depth(const GridDescription &grid);

} // namespace wisp
