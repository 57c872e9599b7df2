// Passes of `--reference`: sums of samples, which add up to the same bits however the passes are divided among runs. As
// pictures, and in `.passes` files, to which later runs add.
#pragma once
#include "host/images/picture.h"
#include "host/results/checksummed_file.h"
#include "wisp/pixel_sums.h"
#include <string>
#include <vector>

namespace wisp {

struct Passes {
    std::string scene;             // fingerprint_of_samples()
    int width = 0, height = 0;     // pixels of the crop
    uint32_t samples = 0;          // per pixel and pass
    int32_t exponent = 0;          // a sample's unit is 2^exponent
    Ranges ranges;                 // of passes
    std::vector<PixelSums> pixels; // width * height, rows from the top
};

// The mean of the samples, and the mean's standard error: the samples' standard deviation / sqrt(number); infinite, as it
// is not known, for a single sample.
Picture mean_picture(const Passes &passes);
Picture error_picture(const Passes &passes);

// Adds the passes of `more`. Throws InputError with `name` in front, and changes nothing, unless both are of the same
// scene, without a common pass.
void add_passes(Passes &passes, const Passes &more, const std::string &name);

// A checksummed file `wisp passes 1` of the lines scene, size, samples, exponent and passes, then the sums as words.
// parse_passes() throws InputError for another file, and for a damaged or truncated one.
Bytes passes_bytes(const Passes &passes);
Passes parse_passes(const Bytes &bytes, const std::string &name);
bool is_passes(const Bytes &bytes); // by its first line

} // namespace wisp
