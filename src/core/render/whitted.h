// Whitted's recursive ray tracing: ambient and diffuse light, Phong's highlights, reflection, refraction, hard shadows.
//
//     I = am A tex + sum over lights of E (D tex max(0, N L) + S max(0, R V)^shininess) + S reflected + T transmitted
//
// where tex is the texture's colour and E D is divided by pi for lights of physical units (all but `l`). Smoke
// attenuates E between light and surface. Camera rays, reflected and refracted rays see the smoke in front of what they
// hit. Smoke fills the space of its particles, inside glass too.
#pragma once
#include "core/lights/lightcuts.h"
#include "core/march/ray_march.h"
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

struct SurfaceMaterial {
    Color ambient, diffuse, specular;
    Real shininess, transmission, index;
};
SurfaceMaterial *make_surface_materials(const Scene &scene, Arena &arena); // nullptr: the arena was too small

// A ray of a chain: what it has hit, and the rays that go on from there, reflected and refracted.
struct RayLevel {
    Real weight;          // in its pixel, of what is behind the smoke
    bool found;           // a surface
    uint64_t node_visits; // until it was found
    Segment smoke;        // in front of it
    Color behind;         // radiance behind the smoke: of surface and lights, and of rays that have come back
    uint32_t count, next; // of the rays that go on
    Vec3 direction[2];
    Color factor[2]; // of their radiance in `behind`
    Vec3 position;   // where they start, on this triangle
    uint32_t triangle;
    Real width; // of their cones
};
inline uint64_t ray_level_bytes(uint32_t depth) { return Arena::bytes<RayLevel>(uint64_t{depth} + 1); }

// What the rays of one frame have in common.
struct Whitted {
    const Scene *scene;
    const Surfaces *surfaces;
    const SurfaceMaterial *materials;
    const Light *lights;
    Shadows *shadows;
    Color background;
    uint32_t depth; // of the longest chain of rays behind the camera's
    Real spread;    // growth of a camera ray's cone per unit of distance: the edge of a pixel at distance 1
    Statistics *statistics;
    RayLevel *levels;                // depth + 1: one of each length of chain
    const LightCuts *cuts = nullptr; // where not every light is asked
    // Smoke, where there is any: `medium` attenuates the lights; march() is what a ray sees of it up to a distance.
    const Medium *medium = nullptr;
    void *marcher = nullptr;
    Segment (*march)(void *marcher, const Ray &ray, Real end, PixelRecorder *recorder) = nullptr;
    Watch watch = {};
    PixelRecorder *recorder = nullptr; // of the pixel that is traced, or nullptr
    // What finds the surface that a ray hits.
    using NearestHit = Hit(const Surfaces &, const Ray &, Real begin, Real end, uint32_t ignore_triangle, TreeCounts &);
    NearestHit *nearest_hit = has(parts::surfaces) ? static_cast<NearestHit *>(WISP_ARITH::nearest_hit) : nullptr;
};

// Whether a radiance may have left the range of Fixed, which would have cut it off.
inline bool is_saturated(const Color &radiance) {
    return std::is_same_v<Real, Fixed> && !(largest(radiance) < Real(0x1p30));
}

// Radiance along a camera ray.
Color trace(const Whitted &tracer, const Ray &ray);

} // namespace wisp::WISP_ARITH
