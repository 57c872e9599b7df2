// Triangles for the tests of tree and test: what is random, and what is degenerate.
#pragma once
#include "core/numbers/random.h"
#include "core/surfaces/triangle_queries.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>
#include <string>
#include <vector>

namespace wisp::WISP_ARITH {

using Triangles = std::vector<Triangle>;

constexpr uint32_t opaque = 0, clear = 1; // materials
inline const Material materials[2] = {{{}, {}, {}, 0, 0, 1}, {{}, {}, {}, 0, 0.5, 1}};

inline double unit(Mt19937 &random) { return random() * 0x1p-32; }
inline double within(Mt19937 &random, double limit) { return (2 * unit(random) - 1) * limit; }
inline Double3 point_within(Mt19937 &random, double limit) {
    const double x = within(random, limit), y = within(random, limit), z = within(random, limit);
    return {x, y, z};
}
inline Double3 moved(const Double3 &p, const Double3 &by) { return {p.x + by.x, p.y + by.y, p.z + by.z}; }

inline Triangle triangle_of(const Double3 &a, const Double3 &b, const Double3 &c, uint32_t material = opaque) {
    Triangle triangle = {};
    triangle.corner[0] = a, triangle.corner[1] = b, triangle.corner[2] = c;
    triangle.material = material;
    triangle.texture = -1;
    return triangle;
}
inline Vec3 corner(const Triangle &triangle, int i) { return vec_of(triangle.corner[i]); }
inline bool has_area(const Triangle &t) { return has_area(corner(t, 0), corner(t, 1), corner(t, 2)); }
inline bool intersect(const TriangleRay &ray, const Triangle &t, TriangleHit &hit) {
    return intersect(ray, corner(t, 0), corner(t, 1), corner(t, 2), hit);
}

// Runs a test case once for each kind of tree.
inline TreeKind each_kind_of_tree() {
    TreeKind kind = TreeKind::bvh;
    SUBCASE("boxes") { kind = TreeKind::bvh; }
    SUBCASE("planes") { kind = TreeKind::kd; }
    return kind;
}

// Owns the memory of one tree.
struct Planted {
    std::vector<unsigned char> memory;
    Arena arena;
    TriangleTree tree;

    Planted(const Triangles &triangles, TreeKind kind)
        : memory(static_cast<size_t>(triangle_tree_bytes(kind, static_cast<uint32_t>(triangles.size())))),
          arena(memory.data(), memory.size()),
          tree(make_triangle_tree(kind, triangles.data(), static_cast<uint32_t>(triangles.size()), materials, arena)) {
        REQUIRE(tree.ready);
        REQUIRE(arena.peak() <= memory.size());
    }
};

} // namespace wisp::WISP_ARITH
