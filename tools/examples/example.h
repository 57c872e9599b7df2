// What both examples need beside the library: a camera, and a picture's file.
#pragma once
#include "wisp/wisp.h"
#include <cstdio>

// At `eye`, along -z, y up. A square picture of `size` pixels sees as far across as it looks ahead, from the middle of
// the first pixel to that of the last.
inline wisp::Camera camera_at(wisp::Double3 eye, int size) {
    const double pixel = 1.0 / (size - 1), half = 0.5 * size * pixel;
    return {eye, {-half, half, -1}, {pixel, 0, 0}, {0, -pixel, 0}};
}

// A .pfm of size x size pixels, bottom row first, with the floats of a little-endian machine. False: not written.
inline bool write_pfm(const char *path, const float *rgb, int size) {
    std::FILE *file = std::fopen(path, "wb");
    if (!file) return false;
    std::fprintf(file, "PF\n%d %d\n-1.0\n", size, size);
    for (int y = size - 1; y >= 0; --y)
        std::fwrite(rgb + 3 * size * y, sizeof(float), static_cast<size_t>(3 * size), file);
    const bool written = !std::ferror(file);
    return std::fclose(file) == 0 && written;
}
