// What the core renders: plain data that the caller owns, the same for every arithmetic.
//
// The caller has prepared it (the host does so in src/host/prepare):
// - Lengths are in units of a power of two of the scene's own, so that the smallest smoothing length is in [1, 2), less
//   in wide smoke, and positions are relative to its middle: neither range nor resolution runs out in any arithmetic.
// - Radiances (background, emission, light) are scaled by 2^-radiance_exponent, to about 1 at most; the film undoes it.
// - Directions are unit vectors. Particles are in canonical order (ascending x, y, z, h, area), not in a file's.
// Coordinates must lie within +-coordinate_limit; the caller refuses a scene that does not.
#pragma once
#include "wisp/double3.h"
#include <cstdint>

namespace wisp {

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

// A box of nx * ny * nz cells, turned about its middle, with a density at the centre of each. A sparse grid has blocks
// of 8 * 8 * 8 samples, and only those with smoke: `blocks` has for each block of the box, x fastest, its number, whose
// samples are density[512 * number ...], or UINT32_MAX. The box begins `skipped` samples after the first block does.
struct GridDescription {
    int32_t nx, ny, nz;               // 0: there is no grid
    const float *density;             // x fastest, 0 or more; nullptr: 1 everywhere
    double extinction;                // sigma_t of density 1, per unit of length
    Double3 center, half;             // half the box's edges
    Double3 axis[3];                  // the directions of its edges: unit vectors at right angles
    const uint32_t *blocks = nullptr; // nullptr: all samples of the box are in `density`
    uint32_t block_count = 0;         // in `density`, whose samples outside of the box are 0
    int32_t skipped[3] = {0, 0, 0};   // 0 to 7
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
    bool visible, mirrored = false; // one that has no inverse is not visible; axes of a determinant below 0 mirror it
};

struct Scene {
    Camera camera;
    Double3 background; // what a ray sees that meets nothing; it lights nothing
    const LightSource *lights;
    uint32_t light_count;
    const SmokeDescription *smokes;
    uint32_t smoke_count;
    int32_t radiance_exponent;
    // Those that never move (static), then those of the instances, then those that change their form (deforming).
    const Triangle *triangles;
    uint32_t static_count, instance_triangle_count, deforming_count;
    const Instance *instances;
    uint32_t instance_count;
    const Material *materials;
    uint32_t material_count;
    const Texture *textures;
    uint32_t texture_count;
    double ray_epsilon; // rays from a surface hit nothing nearer than this: 1e-6 of the static triangles' diagonal

    uint32_t triangle_count() const { return static_count + instance_triangle_count + deforming_count; }
};

} // namespace wisp
