// Camera rays: where they pass through the picture is the same in every pixel, whatever renders it.
#pragma once
#include "wisp/ray.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

struct View {
    explicit View(const Camera &camera)
        : origin(vec_of(camera.origin)), corner(vec_of(camera.corner)), right(vec_of(camera.right)),
          down(vec_of(camera.down)) {}
    Ray ray_through(Real column, Real row) const { return {origin, normalize(corner + right * column + down * row)}; }

    Vec3 origin, corner, right, down;
};

// Where the rays of a pixel pass: the centres of a k x k grid when their number is k^2, else the first points of the R2
// sequence (multiples of 1/p and 1/p^2 modulo 1, p^3 = p + 1).
struct Pattern {
    explicit Pattern(uint32_t samples) {
        while (root * root < samples) ++root;
        square = root * root == samples;
    }
    Real u(uint32_t i) const { return square ? center(i % root) : unit_half_open<Real>(half + i * first); }
    Real v(uint32_t i) const { return square ? center(i / root) : unit_half_open<Real>(half + i * second); }

  private:
    Real center(uint32_t k) const {
        return (Real(static_cast<int32_t>(k)) + Real(0.5)) / Real(static_cast<int32_t>(root));
    }
    static constexpr uint32_t half = 0x80000000u, first = 3242174889u, second = 2447445414u; // 2^32 / 2, / p, / p^2
    uint32_t root = 1;
    bool square;
};

} // namespace wisp::WISP_ARITH
