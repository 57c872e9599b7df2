// Pictures on surfaces, read from PPM and PNG files.
#pragma once
#include "host/base/files.h"
#include "wisp/scene.h"

namespace wisp {

// The texels of a Texture: the picture, then its averages, each level of half the side.
struct TexturePyramid {
    int32_t width = 0, height = 0, levels = 0;
    std::vector<uint16_t> texels;

    // Valid while this pyramid is not changed.
    Texture view() const { return {width, height, levels, texels.data()}; }
};

// A PPM: P6, comments in its header, maxval 255; bytes behind the last row are ignored. Or a PNG of at most 8 bits a
// value, whose opacities and gamma are ignored; grey is R = G = B. Sides are from 1 to max_texture_side
// (texture_readers.h). The sRGB bytes become linear light, rounded to the nearest. So is each average of the level
// before it, over the area that its texel covers: where a side is odd, a texel is divided between two of the next
// level. Throws InputError `NAME: byte N: ...`.
TexturePyramid parse_texture(const Bytes &bytes, const std::string &name);

// parse_texture() of the file's bytes.
TexturePyramid read_texture(const std::string &path);

} // namespace wisp
