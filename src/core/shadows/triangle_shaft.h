// Proofs that nothing still stands between any point of a cell of a triangle and a light, or that one triangle stands
// between all of them: true of every shadow ray as it is rounded, so that none need be sent.
//
// A shadow ray leaves x' for a point x of the cell, along d' for the direction to the light, and meets a triangle when
// `meet` (triangle.h) says so, at a distance t in (skin, end). What is rounded, in each coordinate, with e = 2^-24 and
// 2^-53 for float and double; E and L are the largest coordinates of the receiver's edges and corners, R that of
// light - x, M that of the triangle's corners - x':
//
//   x' - x                 4 e E + 2 e L   edges (e each, twice), products (e), two sums; u + v may exceed 1 by e
//   t d' - (its share of light - x)  5 e R  differences, quotients (e each), the square root (the scale of t alone)
//   what is met - (x' + t d')       14 e M  triangle.h; the triangle's corners as sheared are 6 e M off
//   end                             e R     less than half a last place of the distance
//
// So of a hit there is a point of the triangle that is at most `margin` + 15 e M in each coordinate from a point of the
// segment from x to the light, where margin >= max(5 e E + 3 e L, 8 e R), as the first error fades towards the light
// and the second towards x. A parallel light's d' is its direction itself. The proofs reckon in double, to 2^-48 of the
// largest coordinate, which is added.
//
// In Fixed there are errors of some units of 2^-32 each, times lengths of up to 2^14 where they are of weights and
// directions: below 3 units of 2^-18 in all. Proofs reckon in 64-bit integers of that unit, and lose less than 5 by
// rounding corners, those of cells and those of shafts.
//
// The segments begin at t = skin, and so does the shaft that holds them: the hull of the cell's corners, moved towards
// the light by the share of the skin in the longest of the ways to it (by 2^-10 less, for the length of d'), and the
// light. Where triangles touch at an edge or lie in a plane, that step is what comes between them: skin * sine of the
// light's height over the plane, against the margins.
#pragma once
#include "core/lights/light.h"
#include "core/shadows/proof_scalar.h"
#include "core/surfaces/triangle_kdtree.h"

namespace wisp {

constexpr int finest_cell = 256; // cells are halved up to eight times

// A quarter of a quarter ... of a triangle: corners at the weights (u, v), (u + size, v), (u, v + size) / finest_cell
// of its corners 1 and 2; the middle ones are turned, and their size is negative.
struct CellPlace {
    int u, v, size;
};

namespace WISP_ARITH {

using Position = detail::Triple<ProofScalar>;

struct TriangleShaft {
    bool provable;       // false: it reaches beyond the range of proofs
    Position origin;     // the cell's first corner; all others are relative to it
    Position corner[3];  // of the cell
    Position begin[3];   // where rays begin to be stopped
    Position light[3];   // where they go
    bool parallel;       // otherwise those are one
    ProofScalar margin;     // but for 15 e M
    ProofScalar width;      // M is not more than a triangle's largest coordinate and this
    ProofScalar begin_most; // the skin, and what is rounded
    struct Face {
        Position outward;
        ProofScalar support; // of the shaft: outward . x is not more in it
        ProofScalar limit;   // the same for what may hide a triangle
    } faces[4];
    Position low, high; // its box, for what may hide a triangle
};

TriangleShaft make_triangle_shaft(const TriangleTree &tree, const Vec3 (&receiver)[3], const CellPlace &cell,
                              const Light &light, Real ray_epsilon);

// Whether no opaque triangle of the tree but `skip` stops a ray of the shaft.
bool is_shaft_free(const TriangleTree &tree, const TriangleShaft &shaft, uint32_t skip, TreeCounts &counts);

// Whether this triangle, which is opaque and has an area, stops all rays of the shaft.
bool is_shaft_blocked(const TriangleShaft &shaft, const Vec3 (&occluder)[3]);

} // namespace WISP_ARITH
} // namespace wisp
