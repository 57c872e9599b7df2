// The readers behind texture.h, one for each format. Each throws InputError `NAME: byte N: what is wrong, what was
// expected`.
#pragma once
#include "host/base/files.h"

namespace wisp {

constexpr int max_texture_side = 16384;

// As in the file: rows from the top, 3 bytes (R G B, sRGB) each texel. Sides are from 1 to max_texture_side.
struct Texels {
    int32_t width = 0, height = 0;
    Bytes rgb;
};

Texels read_ppm(const Bytes &bytes, const std::string &name);

bool is_png(const Bytes &bytes); // by its first bytes
Texels read_png(const Bytes &bytes, const std::string &name);

} // namespace wisp
