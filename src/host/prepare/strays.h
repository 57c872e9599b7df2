// Particles that are so far from everything else that no picture shows them.
#pragma once
#include "wisp/scene.h"
#include <cstddef>
#include <optional>
#include <vector>

namespace wisp {

// What a scene has beside its particles, in the units of the file.
struct Surroundings {
    std::vector<Double3> points; // the eye, lights that have a place, corners of surfaces and of grids
    std::vector<Double3> beams;  // the directions of parallel lights
    Camera camera;
    int width, height;
    bool mirrors; // the camera may see anything
};

struct Stray {
    size_t smoke, index; // of its smoke's particles as they were
    Double3 position;
    double distance; // from everything else, in its smoothing lengths
};

// Removes the strays, and returns them. A stray is 2^13 of its smoothing lengths from everything else, 2^16 if it is in
// view, and no parallel light shines past it on the rest. Nothing is removed where all of them together cover more than
// 2^-28 of a steradian of the view, or 2^-13 outside it: less is lost than f32 or a pixel can tell.
std::vector<Stray> remove_strays(std::vector<std::vector<Particle>> &particles, const Surroundings &surroundings);

// The middle of the box that leaves out a tenth of the particles on each side, if there are any.
std::optional<Double3> middle_of_most(const std::vector<std::vector<Particle>> &particles);

} // namespace wisp
