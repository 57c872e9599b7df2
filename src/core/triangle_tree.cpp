// The kd-tree over triangles: building by the surface area heuristic, and rays through it.
#include "wisp/triangle_tree.h"
#include "wisp/point_tree.h" // WISP_LANES, WISP_VISITOR
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

// ---- the lattice that planes lie on ----

constexpr int lattice_bits = 23;     // coordinates are below 2^23 steps
constexpr int fine_bits = 7;         // corners are cut off at cells in units of 2^-7 steps
constexpr int64_t fine_slack = 8;    // of them cover the rounding of a corner and of six cuts

// Costs of the heuristic: of going through a node, and of testing a triangle.
constexpr uint64_t node_cost = 2, triangle_cost = 1;
constexpr uint32_t few = 64;      // so many triangles are sorted as they are
constexpr uint32_t bins = 256;    // more are counted in bins first
constexpr uint32_t leaf_axis = 3;

struct LatticeBox {
    int32_t low[3], high[3];
};

// A triangle in a node: the part of it in the node's cell lies in the box.
struct Item {
    uint32_t triangle;
    LatticeBox box;
};

// The plan: every list has a fixed room, and what would not fit is not split.
struct Rooms {
    uint64_t groups, splits, items;
};
constexpr Rooms rooms_for(uint32_t count) { return {uint64_t{2} * count + 8, uint64_t{4} * count + 8, uint64_t{4} * count + 8}; }

constexpr uint32_t groups_for(uint32_t triangles) { return (triangles + group_triangles - 1) / group_triangles; }

int step_exponent_for(Real largest) {
    constexpr int finest = sizeof(Real) == 4 ? -100 : -32; // in Fixed steps are units or more
    int exponent = finest;
    while (!(scale_pow2(largest, -lattice_bits - exponent) < Real(1))) ++exponent;
    return exponent;
}

} // namespace

} // namespace wisp::WISP_ARITH
