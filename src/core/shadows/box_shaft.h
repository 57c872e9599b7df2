// What can stop a shadow ray that starts anywhere in a box: proofs in whole numbers, the same in every arithmetic.
//
// Space is a lattice, finer than the still triangles' tree's by `finer`; all coordinates, of lights too, are below 2^26
// steps. Points are rounded down to it, so that they are less than a step off. The shaft of a box towards a light is
// the convex hull of both, or of the box and itself moved against a parallel light's direction beyond all that is
// still. It is given a margin on all sides:
//
//   What a ray from the box may hit before the light lies within `margin` steps of the shaft, in each coordinate.
//
// For in float and double, with e half a last place and M = 2^26 steps, the computed direction is off its true one by 8
// e of its length at most (subtracting, three products and a root, dividing), so the ray is within 8 e 2 sqrt(3) M < 28
// e M of the segment to the light. What it hits has a point within 28 e M of it (triangle.h: 14 e of a difference of
// coordinates, which is 2 M at most). In all 56 e M, below 2^8 steps in float and 1 in double. In Fixed lengths are off
// by no more than the root of 2^-33, of a point right at the light, and components by 2^-33; the ray's end is within
// 2^-16 of the light, and the hit within 3 units of the ray: less than 2^-14. The directions of parallel lights are
// taken as they are. Two more steps are for what is rounded down, and one for the end of a parallel shaft.
//
// A triangle is outside when a plane has it on one side and the shaft, margin and all, on the other: planes of the
// shaft's sides, which are along an axis each, or the triangle's own. Numbers are below 2^30, cross products below
// 2^61, and products of three are taken in 128 bits: nothing is rounded.
#pragma once
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

struct LatticePoint {
    int64_t x[3];
};
struct LatticeBounds {
    LatticePoint low, high;
};

// The lattice of a light's shafts. Steps are 2^exponent long.
struct ShaftLattice {
    int exponent;
    int64_t margin;
    int64_t blur; // by how much the sheared corners of a triangle may be off in testing it: 12 e M and a step
    int64_t ray_epsilon; // that of the scene, rounded up
};
ShaftLattice make_shaft_lattice(const Surfaces &surfaces, int exponent);
int static_exponent(const TriangleTree &still);              // where lights are not considered
int exponent_for(const TriangleTree &still, Real farthest); // where other coordinates are up to this
int light_exponent(const TriangleTree &still, const Light &light);

// A light, and the lattice of its shafts: those of the frame that was asked of last.
struct ShaftLight {
    Light light;
    ShaftLattice lattice;
};
// Takes the light of this frame; false: its shadows are what they were. `known`: there was a frame before.
bool follow_light(ShaftLight &light, const Shadows &shadows, uint32_t number, bool known);

LatticePoint lattice_point(const Vec3 &p, int exponent); // rounded down
// Whether a point has one, of the lattice where lights are not considered.
bool is_on_lattice(const TriangleTree &still, const Vec3 &p);

class BoxShaft {
  public:
    BoxShaft(const ShaftLattice &lattice, const LatticeBounds &box, const Light &light);

    bool may_meet(const LatticeBounds &box) const;
    bool may_meet(const LatticePoint (&triangle)[3]) const;
    // Every ray from the box to the light hits the triangle: it lies across, by more than all that is rounded.
    bool is_cut_by(const LatticePoint (&triangle)[3]) const;

  private:
    struct Side {
        int axis[2];
        int64_t normal[2], at[2];
    };
    ShaftLattice lattice_;
    LatticeBounds from_, to_, around_; // margins included
    Side side_[12];
    int side_count_ = 0;
};

// The opaque still triangles that may lie in the shaft, each once; false: there are more than `most`.
bool find_blockers(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t most,
                   uint32_t *blocker, uint32_t &count);
// Whether the still triangle stops every ray of the shaft.
bool is_cut_by(const Shadows &shadows, const ShaftLattice &lattice, const BoxShaft &shaft, uint32_t triangle);

} // namespace wisp::WISP_ARITH
