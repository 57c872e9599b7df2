// Proofs that nothing static stands between any point of a cell of a triangle and a light, or that one triangle stands
// between all of them. A proof holds for every shadow ray with its roundings, so that none need be traced (C8).
//
// A shadow ray leaves x' for a point x of the cell, along d' for the direction to the light. It hits a triangle when
// intersect() (triangle.h) says so, at a distance t in (ray_epsilon, end). These are the errors in each coordinate,
// with e = 2^-24 and 2^-53 for float and double. E and L are the largest coordinates of the receiver's edges and
// corners, R that of light - x, M that of the triangle's corners - x':
//
//   x' - x                 4 e E + 2 e L   edges (e each, twice), products (e), two sums; u + v may exceed 1 by e
//   t d' - (the same part of light - x)  5 e R  differences, quotients (e each), the square root (the scale of t alone)
//   the hit - (x' + t d')  14 e M          triangle.h; the triangle's sheared corners are 6 e M off
//   end                    e R             less than half a last place of the distance
//
// So for each hit there is a point of the triangle that is at most `margin` + 15 e M in each coordinate from a point of
// the segment from x to the light. Here margin >= max(5 e E + 3 e L, 8 e R), because the first error fades towards the
// light and the second towards x. A parallel light's d' is its direction itself. The proofs compute in double, to 2^-48
// of the largest coordinate, which is added.
//
// In Fixed the errors are some units of 2^-32 each; those of weights and directions are multiplied by lengths of up to
// 2^14. Together they are below 3 units of 2^-18. Proofs compute in 64-bit integers of that unit, and lose less than 5
// by rounding corners, those of cells and those of shafts.
//
// The segments begin at t = ray_epsilon, and so does the shaft that holds them. The shaft is the hull of the light and
// of the cell's corners moved towards the light. They move by the fraction that ray_epsilon is of the longest distance
// to the light, less 2^-10 of it for the length of d'. That step separates a cell from triangles that touch it at an
// edge or lie in its plane: ray_epsilon * sine of the light's height over the plane must exceed the margins.
#pragma once
#include "core/lights/light.h"
#include "core/shadows/proof_scalar.h"
#include "core/surfaces/triangle_tree.h"

namespace wisp {

constexpr int finest_cell = 256; // cells are halved up to eight times

// A cell: one of the quarters into which a triangle is divided again and again. Its corners have the weights (u, v),
// (u + size, v), (u, v + size) / finest_cell of the triangle's corners 1 and 2. The middle quarter is turned, and its
// size is negative.
struct CellPlace {
    int u, v, size;
};

namespace WISP_ARITH {

using Position = detail::Triple<ProofScalar>;

struct TriangleShaft {
    bool provable;         // false: it reaches beyond the range of proofs
    Position origin;       // the cell's first corner; all other positions are relative to it
    Position corner[3];    // of the cell
    Position begin[3];     // the corners at t = ray_epsilon, from which on hits count
    Position light[3];     // the ends of the shaft's edges
    bool parallel;         // false: the three ends are one point
    ProofScalar margin;    // without the part 15 e M
    ProofScalar width;     // M is at most a triangle's largest coordinate plus this
    ProofScalar begin_max; // an upper bound of ray_epsilon with its roundings
    struct Face {
        Position outward;
        ProofScalar support; // of the shaft: outward . x is not more in it
        ProofScalar limit;   // the same for whatever may hold a triangle that blocks a ray
    } faces[4];
    Position low, high; // a box around whatever may hold a triangle that blocks a ray
};

TriangleShaft make_triangle_shaft(const TriangleTree &tree, const Vec3 (&receiver)[3], const CellPlace &cell,
                                  const Light &light, Real ray_epsilon);

// True: no opaque triangle of the tree but `ignore_triangle` blocks any ray of the shaft.
bool is_shaft_lit(const TriangleTree &tree, const TriangleShaft &shaft, uint32_t ignore_triangle, TreeCounts &counts);

// True: this triangle, which is opaque and has an area, blocks all rays of the shaft.
bool is_shaft_shadowed(const TriangleShaft &shaft, const Vec3 (&occluder)[3]);

} // namespace WISP_ARITH
} // namespace wisp
