// Whether two triangles lie in one plane, as far as their rounded corners tell. Computed in double by every arithmetic,
// so that all of them agree.
#pragma once
#include "core/numbers/vec.h"

namespace wisp::WISP_ARITH {

// What the host's computations in double leave of a corner's rounding, relative to the largest coordinate of the scene.
constexpr double corner_rounding = 0x1p-48;

using DoubleVec = glm::vec<3, double, glm::defaultp>;

// A triangle's corners in the world.
struct WorldTriangle {
    DoubleVec corner[3];
};

// Whether p may lie in the plane of a triangle that has a corner a and edges u and v from there; w = p - a. The volume
// w (u x v) is 0 in the plane. It changes with the coordinates of p by u x v, with those of the other corners by v x w
// and w x u, and with those of a by the sum of these three. Each coordinate is off by at most `rounding`.
inline bool may_be_in_plane(const DoubleVec &u, const DoubleVec &v, const DoubleVec &w, double rounding) {
    const auto size = [](const DoubleVec &x) { return abs(x.x) + abs(x.y) + abs(x.z); };
    const DoubleVec normal = glm::cross(u, v);
    const double volume = normal.x * w.x + normal.y * w.y + normal.z * w.z;
    return abs(volume) <= 2 * rounding * (size(normal) + size(glm::cross(v, w)) + size(glm::cross(w, u)));
}

// Whether each corner of either triangle may lie in the plane of the other.
inline bool are_coplanar(const WorldTriangle &a, const WorldTriangle &b, double rounding) {
    const auto has_all = [rounding](const WorldTriangle &plane, const WorldTriangle &other) {
        const DoubleVec u = plane.corner[1] - plane.corner[0], v = plane.corner[2] - plane.corner[0];
        for (const DoubleVec &p : other.corner)
            if (!may_be_in_plane(u, v, p - plane.corner[0], rounding)) return false;
        return true;
    };
    return has_all(a, b) && has_all(b, a);
}

} // namespace wisp::WISP_ARITH
