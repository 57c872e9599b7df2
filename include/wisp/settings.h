// How a scene is rendered: what the options of the command line become.
#pragma once
#include "wisp/shadow_methods.h"
#include <cstdint>

namespace wisp {

// How multiple scattering is found: from the photon map at each step (S4-2), from the particle map (S4-3), or as
// `direct` in resampled smoke, with a density_step (S4-1).
enum class Method : uint8_t { direct, map, volume };

enum class IrradianceMap : uint8_t { none, uniform, adaptive }; // S4-4

// Where photons of a map leave their power: on the particle that they collide with; on every particle of a flight, the
// expected collisions; on all particles around, by their shares in the density; at the nodes around (resampled: always).
enum class Deposit : uint8_t { exact, path, kernel, nodes };

// What the map keeps of where light goes: the flux, or the mean of the photons' directions whatever they carry.
enum class Direction : uint8_t { flux, mean };

// Of the particle map: every particle by its own kernel, or the nearest over their ball's volume, as of photons.
enum class Estimate : uint8_t { kernel, knn };

enum class LightChoice : uint8_t { all, cuts }; // that a point of a surface asks: all, or clusters of them

// Over triangles: a tree of boxes, or a kd-tree, as in the papers.
enum class TreeKind : uint8_t { bvh, kd };

// What is made: a picture; the sums of a particle map, without a picture; sums of unbiased path tracing.
enum class Goal : uint8_t { picture, photons, reference };

struct Crop {
    int32_t x0, y0, x1, y1; // pixels, half-open, from the top left
    int32_t step = 1;       // of these, only each so many-th column and row, from the first
    int32_t width() const { return (x1 - x0 + step - 1) / step; }
    int32_t height() const { return (y1 - y0 + step - 1) / step; }
    uint64_t pixels() const { return static_cast<uint64_t>(width()) * static_cast<uint64_t>(height()); }
};

struct Settings {
    Crop crop;
    uint32_t samples; // rays a pixel
    uint32_t depth;   // of the longest chain of rays behind a camera ray: reflected, refracted
    ShadowMethod shadows;
    bool check_shadows;   // counts the pixels that the paper's method gets wrong
    uint64_t photons;     // to emit
    uint32_t paths;       // random paths from each ray, in place of photons; 0: photons
    uint64_t seed;        // of photons, of the lines through smoke and of paths
    uint32_t gather;      // K, most photons in an estimate, or particles
    double gather_radius; // the largest radius of an estimate, in units of H
    double step;          // of the march, in units of H
    Deposit deposit;
    Direction direction;
    Estimate estimate;   // of the particle map
    double density_step; // size of the cells to which smoke is resampled, in units of H; 0: exact densities
    double light_step;   // distance of the points whose depth to the lights is kept, in units of H; 0: none
    IrradianceMap irradiance;
    double irradiance_step; // distance of its points at most, in units of H
    Method method;          // how smoke is rendered
    LightChoice lights;     // of surfaces
    TreeKind tree;          // of surfaces; pictures are the same with either
    Goal goal;
    uint32_t first_pass, last_pass; // of Goal::reference: first <= i < last <= 2^31, `samples` rays a pixel each
    bool layers = false;            // of a picture and a reference: fills Job::layers
};

} // namespace wisp
