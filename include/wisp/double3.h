// Three doubles: a point, a direction or a colour, whatever the arithmetic.
#pragma once

namespace wisp {

struct Double3 {
    double x, y, z;
};

} // namespace wisp
