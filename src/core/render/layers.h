// Layers of a picture (wisp/layers.h): a recorder of every pixel takes apart what the march and the shading add up.
#pragma once
#include "core/render/whitted.h"
#include "wisp/layers.h"

namespace wisp::WISP_ARITH {

struct LayerRecorder : PixelRecorder {
    const SurfaceMaterial *materials; // of the scene
    Vec3 axis;                        // of the camera: a unit vector
    int32_t radiance_exponent;        // of the scene
    float *plane[layer_count]; // the next pixel in the first plane of each layer; nullptr: there is no such layer
    uint64_t plane_size;

    // The ray that is traced, and those that it comes from: one for each level.
    struct Level {
        Color factor, behind; // by which its pixel sees radiance along the ray, and radiance behind the ray's smoke
        Color marched;        // radiance of the march
    } * levels;
    uint32_t level;

    // Of this sample, and the sums of this pixel's samples.
    struct Sums {
        Color light[summed_layers], direct, albedo, normal;
        Real depth, alpha, shadow;
    } sample_sums, pixel_sums;
    int32_t hits; // of this pixel's camera rays
    uint64_t node_visits;

    // Of this sample's camera ray.
    Real along;                  // the camera's axis, of a unit of length
    Vec3 shading_normal;         // where it hits
    Real lit;                    // the part that surfaces let pass of the light that is recorded next
    Real irradiance, unshadowed; // of lights in front: what arrives, and what would
};

// `there`: layers, as bits; `planes`: of Job::layers. nullptr: the arena was too small.
LayerRecorder *make_layer_recorder(const Scene &scene, uint32_t there, const SurfaceMaterial *materials, uint32_t depth,
                                   float *planes, uint64_t plane_size, Arena &arena);
uint64_t layer_bytes(uint32_t depth); // of the arena, at most

} // namespace wisp::WISP_ARITH
