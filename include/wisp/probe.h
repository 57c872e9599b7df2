// What the stages of a frame have made, for `wisp show` to draw: numbers at points or along camera rays, or marks in
// places of their own. Plain data, the same for every arithmetic, in the units of Scene.
#pragma once
#include "wisp/double3.h"
#include "wisp/progress.h"

namespace wisp {

struct Job;

// Whether a light is visible from a cell of a static triangle, as far as that is proved.
enum class CellState : uint8_t {
    unresolved, // too few rays have been traced
    lit,        // proved: no static triangle blocks a ray from the cell to the light
    shadowed,   // proved: one static triangle blocks all rays from the cell to the light
    mixed       // neither can be proved: rays are traced, and the cell is divided
};

enum class Quantity : uint8_t {
    // Numbers at Probe::points.
    density,     // sigma_t; its cells are the bricks of the sparse grid
    light_depth, // the optical depth to the light, between the nodes of the grid; its cells are the same
    tree,        // triangles in the leaves that hold the point: its cells are the nodes that hold it
    // Numbers of the camera rays through the middles of the crop's pixels, top row first.
    optical_depth, // of the smoke, as far as the first surface
    proofs,        // a CellState, of the cell that the ray hits; its cells are those of the triangles
    // Marks.
    photons, // where they collide with smoke
    flights, // of photons, from collision to collision
    nodes    // of the irradiance map, as far as light is known there
};

struct Mark {
    Double3 from, to; // a point: both are the same
    double value;     // of a photon: its largest channel, relative to that of one that starts; of a node: the largest
                      // channel of the mean radiance from all directions, which all smoke scatters or has scattered
    double size;      // of a node: how far the next ones are; of a photon: 0
    uint64_t photon;  // its number
};

struct Probe {
    Quantity quantity;
    uint32_t light; // of light_depth and proofs: index in the scene
    const Double3 *points;
    uint64_t count; // of points, or of pixels
    // One for each point or pixel. NaN: nothing is there. Neighbours in one cell have the same number, 0: in none.
    float *values;
    uint64_t *cells;
    void *context;
    void (*on_mark)(void *context, const Mark &mark);
};

// Renders as Renderer::render does, as far as the stage that makes the quantity, and passes it to the probe. The plan
// must say that this stage is needed. A program that does not call show() does not link what it needs.
namespace f32 {
Status show(const Job &job, const Probe &probe);
}
namespace f64 {
Status show(const Job &job, const Probe &probe);
}
namespace fixed {
Status show(const Job &job, const Probe &probe);
}

} // namespace wisp
