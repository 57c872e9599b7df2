// Pictures on surfaces, read from PPM files.
#pragma once
#include "host/base/files.h"
#include "wisp/scene.h"

namespace wisp {

// Owns what a Texture shows.
struct TexturePyramid {
    int32_t width = 0, height = 0, levels = 0;
    std::vector<uint16_t> texels;

    // Stands as long as this does, unchanged.
    Texture view() const { return {width, height, levels, texels.data()}; }
};

// A PPM: P6, comments in its header, maxval 255, sides of 1 to max_texture_side; bytes behind the last row are left
// alone. Its sRGB bytes become linear light, rounded to the nearest; so is each average of the level before it, over
// the area that its texel covers: where a side is odd, texels are shared out. Throws InputError `NAME: byte N: ...`.
TexturePyramid parse_texture(const Bytes &bytes, const std::string &name);
constexpr int max_texture_side = 16384;

// parse_texture() of the file's bytes.
TexturePyramid read_texture(const std::string &path);

} // namespace wisp
