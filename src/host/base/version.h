#pragma once

namespace wisp {

constexpr const char *version = "0.3.0";

} // namespace wisp
