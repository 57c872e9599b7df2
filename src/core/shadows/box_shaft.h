// The triangles that can block a shadow ray that starts anywhere in a box: proofs by integers, the same in every
// arithmetic.
//
// Space is a lattice, finer than that of the static triangles' tree by 2^`finer`. All coordinates, also of lights, are
// below 2^26 steps. Points are rounded down to the lattice, so they are less than a step off. The shaft of a box
// towards a light is the convex hull of both. For a parallel light it is the hull of the box and of the box moved
// against the light's direction, beyond all static triangles. The shaft has a margin on all sides:
//
//   If a ray from the box hits a triangle before the light, the triangle has a point within `margin` steps of the
//   shaft, in each coordinate.
//
// The margin in float and double, where e is half a last place of 1, and M = 2^26 steps:
//   - The computed direction errs by at most 8 e of its length: a difference, three products and a root, a quotient. So
//     the ray lies within 8 e 2 sqrt(3) M < 28 e M of the segment to the light.
//   - The triangle that it hits has a point within 28 e M of the ray: triangle.h gives 14 e times a difference of
//     coordinates, which is at most 2 M.
//   - The sum is 56 e M: below 2^8 steps in float, below 1 step in double.
// The margin in Fixed:
//   - A length errs by at most the root of 2^-33 (next to the light), a component by 2^-33. So the ray ends within
//     2^-16 of the light.
//   - The triangle has a point within 3 units of the ray. The sum is below 2^-14.
// Directions of parallel lights have no error: rays and shafts use the same. In each arithmetic two steps are added for
// rounding points down, and one for the end of a parallel shaft.
//
// A triangle is outside when a plane has the triangle on one side and the shaft with its margin on the other. The
// planes are those of the shaft's sides, each parallel to an axis, and the triangle's own. Numbers are below 2^30,
// cross products below 2^61, and products of three are computed in 128 bits: nothing is rounded.
#pragma once
#include "core/shadows/shadow_query.h"

namespace wisp::WISP_ARITH {

struct LatticePoint {
    int64_t x[3];
};
struct LatticeBounds {
    LatticePoint low, high;
};
// Bit 0 of `i` is set where the corner is high in x, bit 1 in y, bit 2 in z.
inline LatticePoint corner_of(const LatticeBounds &box, int i) {
    return {{(i & 1 ? box.high : box.low).x[0], (i & 2 ? box.high : box.low).x[1], (i & 4 ? box.high : box.low).x[2]}};
}

// The lattice of a light's shafts. Steps are 2^exponent long.
struct ShaftLattice {
    int exponent;
    int64_t margin;      // in steps, as are the following
    int64_t blur;        // error of a triangle's sheared corners in its ray test: 12 e M and a step
    int64_t ray_epsilon; // of the scene, rounded up
};
ShaftLattice make_shaft_lattice(const Surfaces &surfaces, int exponent);

// Exponents of lattices that hold the static triangles: with nothing else; with coordinates up to `farthest`; with a
// light.
int static_exponent(const TriangleTree &tree);
int exponent_for(const TriangleTree &tree, Real farthest);
int light_exponent(const TriangleTree &tree, const Light &light);

// A light of the last frame that was rendered, and the lattice of its shafts.
struct ShaftLight {
    Light light;
    ShaftLattice lattice;
};
// Replaces it by light `number` of this frame. Returns whether the light's shadows may differ from those of the last
// frame; `first`: there was none.
bool update_light(ShaftLight &light, const Shadows &shadows, uint32_t number, bool first);

LatticePoint lattice_point(const Vec3 &p, int exponent); // rounded down
// Whether the lattice of static_exponent() reaches as far as the point.
bool is_on_lattice(const TriangleTree &tree, const Vec3 &p);

class BoxShaft {
  public:
    BoxShaft(const ShaftLattice &lattice, const LatticeBounds &box, const Light &light);

    // False: the shaft with its margin does not touch the box or triangle.
    bool may_intersect(const LatticeBounds &box) const;
    bool may_intersect(const LatticePoint (&triangle)[3]) const;
    // True: every ray from the box to the light hits the triangle. It crosses the whole shaft, with more to spare than
    // the roundings of rays and corners.
    bool is_shadowed_by(const LatticePoint (&triangle)[3]) const;

  private:
    struct Side { // the plane through `at` of this outward normal; both have two coordinates, the third is free
        int axis[2];
        int64_t normal[2], at[2];
    };
    ShaftLattice lattice_;
    LatticeBounds from_, to_, around_; // the box, the light, both; margins included
    Side side_[12];
    int side_count_ = 0;
};

// The opaque static triangles that may lie in the shaft, each once; false: there are more than `max_count`.
bool find_blockers(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t max_count,
                   uint32_t *blocker, uint32_t &count);
// Whether the static triangle blocks every ray of the shaft.
bool is_shaft_shadowed(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t triangle);

} // namespace wisp::WISP_ARITH
