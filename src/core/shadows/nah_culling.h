// `paper`: the shadow culling of Nah, Park & Han 2009 (C1 to C5). A static triangle remembers, for each light, the
// answers that its shadow rays had in earlier frames. They are reused once all of the triangle is thought to be
// visible.
//
// Pictures may be wrong, because the answers are known only at pixels. Where the paper leaves a choice, this is ours:
// - PARTIALLY_OCCLUDED returns to INIT when a frame begins. Otherwise no triangle that was once cut by the screen's
//   edge would ever be culled. Shadow modes are only added to, also while a triangle is partly hidden.
// - The occlusion test and the pixel counts use the first sample of each pixel, because neighbouring pixels' triangles
//   are known from their first samples. Shadow tests use all samples, and also the points that reflected and refracted
//   rays hit: their shadow rays leave the triangle, too.
// - A ray that is traced against moving triangles alone counts as culled. Its answer is not added to the shadow mode.
// - A hit is a hit, of a static triangle or a moving one. The shadow of a triangle that has moved on may stay.
// - When a light has changed since the last frame, its shadow modes are cleared and FULLY_RENDERED triangles return to
//   INIT. Otherwise the mode that the frame's first ray sets would count for the whole triangle at the second ray.
// - Lights beyond the fifteenth have no bits in the mode word: their rays are traced.
#pragma once
#include "core/shadows/mode_word.h"
#include "core/shadows/shadow_query.h"

namespace wisp::WISP_ARITH {

struct CulledTriangle {
    ModeWord mode;
    uint32_t pixels, max_pixels; // in this frame; the most in any frame before
};

struct NahCulling {
    CulledTriangle *triangles; // all of the scene
    uint32_t triangle_count;
    Light lights[ModeWord::lights]; // of the frame before
    bool any_frame;                 // there was a frame before

    // Of this frame.
    uint32_t *row; // by column, the triangle that the camera ray hit: before x in this row, from x on in the row above
    Crop crop;
    int32_t width, height; // of the crop, which is the screen
    int32_t x, y;          // in it
    bool first_sample;     // of the pixel
    bool wrong;            // a shadow in the pixel is not that of `trace`
};

} // namespace wisp::WISP_ARITH
