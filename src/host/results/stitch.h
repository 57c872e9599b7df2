// Parts of a picture that were rendered apart, together again.
#pragma once
#include "host/images/picture.h"
#include <string>
#include <vector>

namespace wisp {

// The whole picture of parts, which are .pfm or .exr files made with `--crop`, each with its record. Throws
// InputError for parts of different pictures, for a part that its record does not describe, and for a pixel in two
// parts or in none.
Picture stitch(const std::vector<std::string> &parts);

} // namespace wisp
