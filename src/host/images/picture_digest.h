// The digest of a picture in memory, for programs that have no files: no heap is needed.
#pragma once
#include "core/numbers/elementary.h"
#include "host/base/sha256.h"

namespace wisp {

// SHA-256 of the .pfm of `height` rows of `width` linear radiances, three floats each, top row first: what
// `wisp render --digest` prints.
inline HexDigest digest_of_picture(const float *rgb, int32_t width, int32_t height) {
    Sha256 hash;
    const auto text = [&hash](const char *c) {
        for (; *c; ++c) hash.update(c, 1);
    };
    const auto number = [&hash](int32_t n) { // 1 or more
        char digits[10];
        int count = 0;
        for (; n > 0; n /= 10) digits[count++] = static_cast<char>('0' + n % 10);
        while (count > 0) hash.update(&digits[--count], 1);
    };
    text("PF\n");
    number(width);
    text(" ");
    number(height);
    text("\n-1.0\n");
    for (int32_t y = height - 1; y >= 0; --y) // bottom row first, little-endian
        for (int32_t i = 0; i < 3 * width; ++i) {
            const uint32_t bits = detail::to_bits(rgb[y * 3 * width + i]);
            for (int shift = 0; shift < 32; shift += 8) {
                const uint8_t byte = static_cast<uint8_t>(bits >> shift);
                hash.update(&byte, 1);
            }
        }
    return hash.finish();
}

} // namespace wisp
