// Textures: the mean colour of a footprint, between the two levels whose texels are about its size.
#pragma once
#include "core/numbers/vec.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

// The colour of one level at (u, v), where 1 is the whole picture, which repeats; bilinear between texels' centres.
inline Color texture_level(const Texture &texture, int32_t level, Real u, Real v) {
    int32_t width = texture.width, height = texture.height;
    const uint16_t *texels = texture.texels;
    for (int32_t i = 0; i < level; ++i) {
        texels += static_cast<size_t>(width) * static_cast<size_t>(height) * 3;
        width = max(width >> 1, 1);
        height = max(height >> 1, 1);
    }
    const Real x = (u - Real(floor_to_int(u))) * Real(width) - Real(0.5);
    const Real y = (v - Real(floor_to_int(v))) * Real(height) - Real(0.5);
    const int32_t column = floor_to_int(x), row = floor_to_int(y);
    const auto texel = [&](int32_t i, int32_t j) { // one before the first is the last, and the other way round
        i = i < 0 ? i + width : i >= width ? i - width : i;
        j = j < 0 ? j + height : j >= height ? j - height : j;
        const uint16_t *t = texels + (static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i)) * 3;
        return Color(Real(int32_t{t[0]}), Real(int32_t{t[1]}), Real(int32_t{t[2]}));
    };
    const auto between = [](const Color &a, const Color &b, Real t) { return a + (b - a) * t; };
    const Real s = x - Real(column), t = y - Real(row);
    return between(between(texel(column, row), texel(column + 1, row), s),
                   between(texel(column, row + 1), texel(column + 1, row + 1), s), t) *
           Real(1.0 / 65535);
}

// `lod`: log2 of the footprint's width in texels of level 0.
inline Color texture_at(const Texture &texture, Real u, Real v, Real lod) {
    const Real last = Real(texture.levels - 1), level = min(max(lod, Real(0)), last);
    const int32_t finer = floor_to_int(level);
    const Color fine = texture_level(texture, finer, u, v);
    if (level == Real(finer)) return fine;
    return fine + (texture_level(texture, finer + 1, u, v) - fine) * (level - Real(finer));
}

} // namespace wisp::WISP_ARITH
