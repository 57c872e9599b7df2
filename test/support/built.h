// What was built beside the test program.
#pragma once
#include <string>

namespace wisp {

// A file of the folder that the test program lies in, as `build/wisp`.
std::string built(const std::string &name);

} // namespace wisp
