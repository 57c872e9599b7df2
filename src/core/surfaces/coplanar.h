// Whether two triangles lie in one plane, as far as their rounded corners tell. It is asked of the scene's doubles in
// every arithmetic, in fixed point by integers with the same results, so all of them agree.
#pragma once
#include "core/numbers/double_bits.h"
#include "core/numbers/vec.h"

namespace wisp::WISP_ARITH {

using PlaneReal = std::conditional_t<std::is_same_v<Real, Fixed>, DoubleByIntegers, double>;
using PlaneVec = glm::vec<3, PlaneReal, glm::defaultp>;

inline PlaneVec plane_vec_of(const Double3 &v) { return PlaneVec(PlaneReal{v.x}, PlaneReal{v.y}, PlaneReal{v.z}); }

// A triangle's corners in the world.
struct WorldTriangle {
    PlaneVec corner[3];
};

// What the host's computations in double leave of a corner's rounding, in a scene whose largest coordinate is given.
inline PlaneReal corner_rounding(Real largest) { return PlaneReal{to_double(largest)} * PlaneReal{0x1p-48}; }

// Whether p may lie in the plane of a triangle that has a corner a and edges u and v from there; w = p - a. The volume
// w (u x v) is 0 in the plane. It changes with the coordinates of p by u x v, with those of the other corners by v x w
// and w x u, and with those of a by the sum of these three. Each coordinate is off by at most `rounding`.
inline bool may_be_in_plane(const PlaneVec &u, const PlaneVec &v, const PlaneVec &w, PlaneReal rounding) {
    const auto size = [](const PlaneVec &x) { return abs(x.x) + abs(x.y) + abs(x.z); };
    const PlaneVec normal = glm::cross(u, v);
    const PlaneReal volume = normal.x * w.x + normal.y * w.y + normal.z * w.z;
    return abs(volume) <= (rounding + rounding) * (size(normal) + size(glm::cross(v, w)) + size(glm::cross(w, u)));
}

// Whether each corner of either triangle may lie in the plane of the other.
inline bool are_coplanar(const WorldTriangle &a, const WorldTriangle &b, PlaneReal rounding) {
    const auto has_all = [rounding](const WorldTriangle &plane, const WorldTriangle &other) {
        const PlaneVec u = plane.corner[1] - plane.corner[0], v = plane.corner[2] - plane.corner[0];
        for (const PlaneVec &p : other.corner)
            if (!may_be_in_plane(u, v, p - plane.corner[0], rounding)) return false;
        return true;
    };
    return has_all(a, b) && has_all(b, a);
}

} // namespace wisp::WISP_ARITH
