// What the core renders: plain data that the caller owns, the same for every arithmetic.
//
// The caller has prepared it (the host does so in src/host/prepare.cpp):
// - Lengths are in units of a power of two of the scene's own, so that the smallest smoothing length is in [1, 2), and
//   positions are relative to the middle of the smoke: neither range nor resolution runs out in any arithmetic.
// - Radiances (background, emission, light) are scaled by 2^-radiance_exponent, so that the brightest is about 1; the
//   film multiplies the power back.
// - Directions are unit vectors. Particles are in canonical order (ascending x, y, z, h, area), so that a permuted
//   file gives the same picture.
// Coordinates must lie within +-coordinate_limit; the caller refuses a scene that does not.
#pragma once
#include "core/numbers/double_bits.h"

namespace wisp {

struct Double3 {
    double x, y, z;
};
inline bool any_above_zero(const Double3 &v) { return total_order_key(v.x) > 0 || total_order_key(v.y) > 0 || total_order_key(v.z) > 0; }

constexpr double coordinate_limit = 8192; // squares of distances stay below 2^31, the range of Fixed

// A ray through the picture at (column, row) in pixels, from the top left corner of the top left pixel, leaves
// `origin` along corner + column * right + row * down (not normalised).
struct Camera {
    Double3 origin, corner, right, down;
};

enum class LightKind : uint8_t {
    point,    // lp: radiant intensity `color`, falls off with the squared distance
    spot,     // ls: the same inside a cone
    parallel, // ld: irradiance `color` along `direction`
    constant, // l: irradiance `color` from `position`, without falloff
};

struct LightSource {
    LightKind kind;
    Double3 position;
    Double3 direction;       // whither the light travels (spot, parallel)
    double one_minus_cosine; // of half the angle of a spot's cone: narrow ones keep their digits
    Double3 color;           // intensity (per squared unit of length) or irradiance
};

enum class Kernel : uint8_t { spline, poly6 };

struct Particle {
    Double3 position;
    double h;    // smoothing length; the support is 2 h, for both kernels
    double area; // extinction cross-section C_ext m, in squared units of length
};

// A box of nx * ny * nz cells, turned about its middle, with a density at the centre of each.
struct GridDescription {
    int32_t nx, ny, nz;   // 0: there is no grid
    const float *density; // x fastest, 0 or more; nullptr: 1 everywhere
    double extinction;    // sigma_t of density 1, per unit of length
    Double3 center, half; // half the box's edges
    Double3 axis[3];      // the directions of its edges: unit vectors at right angles

    uint64_t count() const { return static_cast<uint64_t>(nx) * static_cast<uint64_t>(ny) * static_cast<uint64_t>(nz); }
};

// One `smoke` block: particles, sigma_t(x) = sum_i area_i W(|x - x_i|, h_i) (S3), or a grid.
struct SmokeDescription {
    const Particle *particles; // in canonical order
    uint32_t count;            // 0 where there is a grid
    Kernel kernel;
    GridDescription grid;
    // March steps are fractions of the one, the gather radius of the other. Of a grid both are the shortest edge of a
    // cell, of a constant box a twentieth of its shortest edge.
    double smallest_h, largest_h;
    double total_area; // the integral of sigma_t
    Double3 albedo;    // 0 to 1 a channel
    double asymmetry;  // g of Henyey and Greenstein, -1 < g < 1
    Double3 emission;  // radiance L_e

    bool is_grid() const { return grid.nx > 0; }
    bool empty() const { return count == 0 && !is_grid(); }
};

// What Whitted's shading asks of a surface. The scene's ambient light is in `ambient`, scaled like radiances.
struct Material {
    Double3 ambient, diffuse, specular; // specular: Phong's, and the mirror's
    double shininess;                   // 0 or more
    double transmission;                // the weight of the transmitted ray; above 0: casts no shadow
    double index;                       // of refraction, above 0
};

// A picture, and its averages of half the size, a quarter, ... down to 1 x 1: level i has max(1, width >> i) by
// max(1, height >> i) texels.
struct Texture {
    int32_t width, height, levels;
    const uint16_t *texels; // R G B, linear, in 1/65535; rows from the top, level after level
};

struct Triangle {
    Double3 corner[3];
    Double3 normal[3];  // unit vectors; 0 0 0: that of its plane
    double texel[3][2]; // u along the rows, v down the columns; 1 is the whole picture, which repeats
    uint32_t material;
    int32_t texture; // -1: none
};

// Triangles first <= i < first + count that move as one: in a space of their own, placed by
// p' = axis[0] p.x + axis[1] p.y + axis[2] p.z + origin, and `inverse` are the axes of the way back (p' - origin to p).
struct Instance {
    uint32_t first, count;
    Double3 axis[3], origin, inverse[3];
    bool visible; // one that has no inverse is not
};

struct Scene {
    Camera camera;
    Double3 background; // what a ray sees that meets nothing; it lights nothing
    const LightSource *lights;
    uint32_t light_count;
    const SmokeDescription *smokes;
    uint32_t smoke_count;
    int32_t radiance_exponent;
    // Triangles: those that never move, then those of the bodies, then those that change their form.
    const Triangle *triangles;
    uint32_t static_count, instance_triangle_count, deforming_count;
    const Instance *instances;
    uint32_t instance_count;
    const Material *materials;
    uint32_t material_count;
    const Texture *textures;
    uint32_t texture_count;
    double ray_epsilon; // rays that leave a surface meet nothing that is nearer than this (1e-6 of the still scene's diagonal)

    uint32_t triangle_count() const { return static_count + instance_triangle_count + deforming_count; }
};

// Whether all smoke is a single grid whose edges are those of space.
inline bool is_aligned_grid(const Scene &scene) {
    uint32_t smokes = 0;
    const GridDescription *grid = nullptr;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        if (scene.smokes[i].empty()) continue;
        ++smokes;
        if (scene.smokes[i].is_grid()) grid = &scene.smokes[i].grid;
    }
    return smokes == 1 && grid && total_order_key(grid->axis[0].x) == total_order_key(1.0) &&
           total_order_key(grid->axis[1].y) == total_order_key(1.0) && total_order_key(grid->axis[2].z) == total_order_key(1.0);
}

// Whether the scene's smoke can be resampled to a lattice along the axes (S4-1): particles, or such a grid.
inline bool can_resample(const Scene &scene) {
    bool particles = true, any = false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        any = any || !scene.smokes[i].empty();
        particles = particles && !scene.smokes[i].is_grid();
    }
    return any && (particles || is_aligned_grid(scene));
}

enum class Method : uint8_t { direct, map, volume }; // S4; `volume` is `direct` with a density_step

enum class IrradianceMap : uint8_t { none, uniform, adaptive }; // S4-4

// What a photon leaves on the particle map: all of it on the particle that it collides with, or on every particle of a
// flight its expected collisions with that, or on all particles around the collision by their shares in the density.
enum class Deposit : uint8_t { exact, path, kernel };

// What the map keeps of where light goes: the flux, or the mean of the photons' directions whatever they carry.
enum class Direction : uint8_t { flux, mean };

// Of the particle map: every particle by its own kernel, or the nearest of them over their ball's volume, as of
// photons.
enum class Estimate : uint8_t { kernel, knn };

// Which lights a point of a surface asks: all, or clusters of them.
enum class LightChoice : uint8_t { all, cuts };

// How hard shadows of surfaces are found (C): by a ray to every light; by the last occluder first; by the paper's
// method; without a ray where that is proved; by others' methods.
enum class ShadowMethod : uint8_t { trace, cache, paper, exact, voxel, lightbuffer, lie };

struct Crop {
    int32_t x0, y0, x1, y1; // pixels, half-open, from the top left
};

struct Settings {
    Crop crop;
    uint32_t samples; // rays a pixel
    uint32_t depth;   // of the longest chain of rays behind a camera ray: reflected, refracted
    ShadowMethod shadows;
    bool check_shadows; // counts the pixels that the paper's method gets wrong
    uint64_t photons;   // to emit
    uint64_t seed;
    uint32_t gather;      // K, most photons in an estimate, or particles
    double gather_radius; // the largest radius of an estimate, in units of H
    double step;          // of the march, in units of H
    Deposit deposit;
    Direction direction;
    Estimate estimate;   // of the particle map
    double density_step; // size of the cells to which smoke is resampled, in units of H; 0: exact densities
    double light_step;   // distance of the points whose depth to the lights is kept, in units of H; 0: none
    IrradianceMap irradiance;
    double irradiance_step;         // distance of its points at most, in units of H
    Method method;                  // how smoke is rendered
    LightChoice lights;             // of surfaces
    bool reference;                 // path tracing, ...
    uint32_t first_pass, last_pass; // ... passes first_pass <= i < last_pass <= 2^31 of `samples` rays a pixel each
};

} // namespace wisp
