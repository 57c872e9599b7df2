// Passes of `--reference`: sums of samples that any division of the work adds up to the same bits, in memory, as
// pictures, and in `.passes` files from which later passes go on.
#pragma once
#include "host/images/picture.h"
#include "host/results/checksummed_file.h"
#include "wisp/pixel_sums.h"
#include <string>
#include <vector>

namespace wisp {

struct Passes {
    std::string scene;             // SHA-256 of all that the samples depend on but the passes
    int width = 0, height = 0;     // pixels of the crop
    uint32_t samples = 0;          // a pixel and pass
    int32_t exponent = 0;          // a sample's unit is 2^exponent
    Ranges ranges;                 // of passes
    std::vector<PixelSums> pixels; // width * height, rows from the top
};

// The mean of the samples, and its standard error: the samples' deviation / sqrt(number), 0 for a single sample.
Picture mean_picture(const Passes &passes);
Picture error_picture(const Passes &passes);

// Adds passes of the same scene that are not in `passes` yet. Throws InputError, with `name` in front, for others.
void add_passes(Passes &passes, const Passes &more, const std::string &name);

// A file of text lines (`wisp passes 1`, scene, size, samples, exponent, ranges, the SHA-256 of the rest) and the sums,
// little-endian. Reading throws InputError for a file that is none, is damaged or was cut.
Bytes passes_bytes(const Passes &passes);
Passes parse_passes(const Bytes &bytes, const std::string &name);

} // namespace wisp
