// Rays, axis-aligned boxes, and where a ray crosses a box.
#pragma once
#include "core/numbers/vec.h"
#include "core/numbers/watch.h"

namespace wisp::WISP_ARITH {

// An axis-aligned box; empty when low > high.
struct Box {
    Vec3 low, high;
};

// Bit 0 of `i` is set where the corner is high in x, bit 1 in y, bit 2 in z.
inline Vec3 corner_of(const Box &box, uint32_t i) {
    return Vec3((i & 1 ? box.high : box.low).x, (i & 2 ? box.high : box.low).y, (i & 4 ? box.high : box.low).z);
}

inline bool is_strictly_inside(const Box &box, const Vec3 &p) {
    return p.x > box.low.x && p.y > box.low.y && p.z > box.low.z && p.x < box.high.x && p.y < box.high.y &&
           p.z < box.high.z;
}

struct Sphere {
    Vec3 center;
    Real radius; // 0: empty
};

// A distance larger than the width of any scene.
constexpr Real infinite_distance = Real(0x1p19);

struct Ray {
    Vec3 origin, direction; // the direction is a unit vector
};

// a / b, with the magnitude of the result limited to 2^20. Distances to the slabs of a ray that is almost parallel to
// them become no larger; 2^20 is far outside any scene.
inline Real bounded_quotient(Real a, Real b) {
    constexpr Real far = Real(0x1p20);
    if (abs(a) < abs(b) * far) return a / b;
    return (a < Real(0)) == (b < Real(0)) ? far : -far;
}

// Clips the distances [begin, end] of a ray to the slab between `low` and `high` along one axis. A ray that is parallel
// to the slab and outside it gets end = -1.
inline void clip_axis(Real low, Real high, Real origin, Real direction, Real &begin, Real &end) {
    if (direction == Real(0)) {
        if (origin < low || origin > high) end = Real(-1);
        return;
    }
    const Real t0 = bounded_quotient(low - origin, direction), t1 = bounded_quotient(high - origin, direction);
    begin = max(begin, min(t0, t1));
    end = min(end, max(t0, t1));
}

// Clips the distances [begin, end] to the box and to distances >= 0. Returns false if nothing is left. A ray that runs
// along a face, or starts inside the box, counts as inside (hard case E7).
inline bool clip(const Box &box, const Ray &ray, Real &begin, Real &end) {
    begin = max(begin, Real(0));
    clip_axis(box.low.x, box.high.x, ray.origin.x, ray.direction.x, begin, end);
    clip_axis(box.low.y, box.high.y, ray.origin.y, ray.direction.y, begin, end);
    clip_axis(box.low.z, box.high.z, ray.origin.z, ray.direction.z, begin, end);
    return begin < end;
}

} // namespace wisp::WISP_ARITH
