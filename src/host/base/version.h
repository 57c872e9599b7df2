#pragma once

namespace wisp {

constexpr const char *version = "0.2.0";

} // namespace wisp
