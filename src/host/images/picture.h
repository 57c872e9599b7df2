// Pictures: linear in memory and in PFM (exact, what is compared and hashed), 8-bit sRGB in PNG (for viewing).
#pragma once
#include "host/base/files.h"
#include <cstdint>
#include <string>
#include <vector>

namespace wisp {

// Linear radiance of width x height pixels, each R G B, rows from the top, pixels from the left:
// rgb.size() == 3 * width * height. Values may be anything, NaN included.
struct Picture {
    int width = 0, height = 0;
    std::vector<float> rgb;
};

// The picture as PFM: `PF\n`, `W H\n`, `-1.0\n`, rows from the bottom, little-endian. The same bits give the same
// bytes.
Bytes pfm_bytes(const Picture &picture);
// The same of one plane (`Pf`), or of three, one behind the other, rows from the top.
Bytes pfm_bytes(int width, int height, const float *planes, size_t channels);

// A PFM as pfm_bytes() or another program writes it: PF, or Pf (its grey fills all three channels), either byte order,
// sides of 1 to max_side pixels, scale 1 or -1, no comments, nothing after the last row. Bits are kept, NaN's too.
// Throws InputError `NAME: byte N: ...`, N counted from 0.
Picture parse_pfm(const Bytes &bytes, const std::string &name);
bool is_pfm(const Bytes &bytes); // by its first bytes
constexpr int max_side = 1000000;

// parse_pfm() of the file's bytes.
Picture read_pfm(const std::string &path);

// Linear light of an sRGB value, both 0 to 1 (IEC 61966-2-1).
double srgb_to_linear(double s);

// What PNG shows: clamp(2^exposure L, 0, 1) through the sRGB curve, times 255, rounded half up; 3 bytes a pixel, rows
// from the top. Infinities are clamped like any value. A pixel with a NaN has the colour nan_color. exposure: -1000 to
// 1000.
Bytes srgb_bytes(const Picture &picture, double exposure = 0);
constexpr uint8_t nan_color[3] = {255, 0, 255};

// srgb_bytes() as a PNG file. Throws Error(exit_output) when the picture has more than 2^29 bytes of pixels.
Bytes png_bytes(const Picture &picture, double exposure = 0);

} // namespace wisp
