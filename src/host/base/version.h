#pragma once

namespace wisp {

constexpr const char *version = "0.1.0";

} // namespace wisp
