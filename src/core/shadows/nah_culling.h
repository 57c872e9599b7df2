// The paper's shadow culling (C): what the shadow rays of a triangle that never moves met in the frames before, as long
// as all of it is thought to have been seen.
//
// Pictures may be wrong: what was met was met at pixels only. Where the paper leaves something open:
// - PARTIALLY_OCCLUDED goes back to INIT as a frame begins, or else no triangle that was once cut off by the screen
//   would ever be culled. Shadow modes are only ever added to, also while a triangle is partly hidden.
// - The occlusion test and the counts of pixels are of the first sample of each pixel; the pixels beside it whose
//   triangles it may hide have been seen by theirs. Shadow tests are of all samples, and of the points of triangles
//   that reflected and refracted rays meet: their shadow rays leave the triangle, too.
// - A ray that asks moving triangles alone is a culled one: what it meets is not added to the shadow mode.
// - A hit is a hit, whether of what is still or what moves: a shadow of something that has moved on may stay.
// - What is known of a light that is not where it was in the frame before is forgotten, and triangles begin anew: a
//   mode that a frame's first ray has set would be taken for the whole triangle's by the second.
// - Lights beyond the fifteenth have no bits: their rays are traced.
#pragma once
#include "core/shadows/mode_word.h"
#include "core/shadows/shadows.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

struct PaperTriangle {
    ModeWord mode;
    uint32_t pixels, max_pixels; // in this frame; in any before
};

struct PaperShadows {
    PaperTriangle *triangles; // all of the scene
    uint32_t triangle_count;
    Light lights[ModeWord::lights]; // of the frame before
    bool any_frame;                 // there was one before

    // Of this frame.
    uint32_t *row; // what the pixels to the left, and those above, meet: a triangle of the scene or no_triangle
    int32_t width, height;
    int32_t x, y;
    bool first_sample, wrong; // of this pixel; a shadow in it is
};

uint64_t paper_bytes(const Scene &scene, const Settings &settings);
PaperShadows *make_paper_shadows(const Scene &scene, Arena &arena); // nullptr: the arena was too small

bool begin_frame(PaperShadows &paper, const Shadows &shadows, const Settings &settings, Arena &arena);
// In the order of the pixels, row after row: before each sample, then what its camera ray meets, if anything.
void begin_sample(PaperShadows &paper, int32_t x, int32_t y, uint32_t sample);
void see(PaperShadows &paper, const Shadows &shadows, const Ray &ray, const Hit &hit);
bool is_shadowed(PaperShadows &paper, Shadows &shadows, const ShadowQuery &query);
void end_frame(PaperShadows &paper);

} // namespace wisp::WISP_ARITH
