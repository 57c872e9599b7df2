// How near a light can be.
#pragma once

namespace wisp {

// In the core's unit of length. What is nearer to a light, or a line that passes it nearer, counts as so far away, in
// each arithmetic: 1 / r^2 stays finite.
constexpr double least_light_distance = 0x1p-10;

} // namespace wisp
