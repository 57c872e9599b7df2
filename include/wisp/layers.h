// What a picture consists of, and what else its pixels show: planes of floats, beside the picture.
#pragma once
#include <cstdint>

namespace wisp {

// Job::layers are planes of width() * height() floats, top row first: those of each layer that is there, in this order,
// channel by channel. The picture is the same with them. A layer is there where the scene has what it shows
// (Plan::layers); elsewhere it would be 0. Goal::reference has those from `albedo` on: paths keep no parts apart. The
// value of a pixel is the mean of its camera rays. "First" is what a camera ray meets first.
enum class Layer : uint8_t {
    // Radiance, R G B, linear as the picture: what of it comes from where, straight or by way of mirrors and glass, and
    // weakened by the smoke in between. The five add up to the picture, to the bit, in any order and in any precision
    // that has a float's: see below.
    emission,   // of smoke
    single,     // light of lamps that smoke has scattered once
    multiple,   // light that smoke has scattered more often, and its own light that it has scattered
    surfaces,   // ambient light and light of lamps, off surfaces
    background, // where a ray meets nothing
    // Of `surfaces`, without ambient light: what lamps give. The mean, rounded to float by itself.
    direct,
    // Of the first surface; a ray that meets none counts as 0. As denoisers and compositing want them.
    albedo, // R G B: diffuse colour, textured; 0 to 1 where the scene's are
    normal, // X Y Z: that of shading, on the plane's side to the eye, in the scene's axes. A mean of unit vectors: its
            // length is 1 where they agree, less at edges
    depth,  // Z: distance along the camera's axis, in the scene's unit of length. The mean of the rays that meet a
            // surface; infinite where none does
    alpha,  // A: 1 less the transmittance of the smoke, 1 where there is a surface, of glass too
    shadow, // 0 to 1: of the irradiance that lamps in front of the first surface would give it (the largest channel of
            // each), the part that other surfaces and smoke keep away; with --lights cuts, of the clusters asked
    node_visits // nodes of triangle trees that camera rays, reflected and refracted ones visited, of all samples
};
constexpr uint32_t layer_count = 12;

// How the five add up. Sums of floats that were rounded one by one are not the rounded sum. So each channel of the five
// is a whole number, 0 or more, of the picture's unit in the last place, of that pixel and channel; the largest of them
// takes up what rounding leaves over. All sums are then whole numbers below 2^24 of one unit, which floats hold
// exactly. A part errs by half a unit for this, 2^-24 of the pixel or less, and the largest by some units: what the
// sums of the steps and of the samples have lost to rounding.
constexpr uint32_t summed_layers = 5;

constexpr uint32_t channels_of(Layer layer) { return layer < Layer::depth ? 3 : 1; }

// Some layers, as bits.
constexpr uint32_t bit_of(Layer layer) { return 1u << static_cast<uint32_t>(layer); }
constexpr bool has_layer(uint32_t layers, Layer layer) { return (layers & bit_of(layer)) != 0; }
// The number of their planes before that of `end`; of all of them.
constexpr uint32_t planes_before(uint32_t layers, uint32_t end) {
    uint32_t planes = 0;
    for (uint32_t i = 0; i < end; ++i) planes += layers >> i & 1 ? channels_of(static_cast<Layer>(i)) : 0;
    return planes;
}
constexpr uint32_t planes_of(uint32_t layers) { return planes_before(layers, layer_count); }

} // namespace wisp
