// The digest of a picture in memory, for programs that have no files: no heap is needed.
#pragma once
#include "host/base/sha256.h"
#include "host/images/pfm_writer.h"

namespace wisp {

// SHA-256 of the .pfm of `height` rows of `width` linear radiances, three floats each, top row first: what
// `wisp render --digest` prints.
inline HexDigest digest_of_picture(const float *rgb, int32_t width, int32_t height) {
    Sha256 hash;
    write_pfm(
        width, height, 3, [rgb](size_t i) { return rgb[i]; },
        [&hash](const char *data, size_t size) { hash.update(data, size); });
    return hash.finish();
}

} // namespace wisp
