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

// What a PNG may ask for before it is decoded: sides, and bytes of texels. Those may be `ratio` times the file's bytes,
// beyond an allowance, so that a hostile file takes memory in proportion to its own size.
struct PngLimits {
    int side;
    uint64_t ratio;
    const char *what; // what errors call texels
};
constexpr PngLimits texture_limits = {max_texture_side, 256, "texels"};

// Throws Error(exit_memory) for a PNG that does not fit in memory.
Texels read_png(const Bytes &bytes, const std::string &name, const PngLimits &limits = texture_limits);

} // namespace wisp
