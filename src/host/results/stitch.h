// Parts of a picture that were rendered apart, together again.
#pragma once
#include "host/images/picture.h"
#include <string>
#include <vector>

namespace wisp {

// The whole picture of parts (`--crop`, .pfm with their proofs beside them). Throws InputError for parts of different
// pictures, parts that are not what their proofs say, pixels that two of them have, or none.
Picture stitch(const std::vector<std::string> &parts);

} // namespace wisp
