// Camera rays: where they pass through the picture is the same in every pixel, whatever renders it.
#pragma once
#include "core/geometry/ray.h"
#include "wisp/scene.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

struct View {
    explicit View(const Camera &camera)
        : origin(vec_of(camera.origin)), corner(vec_of(camera.corner)), right(vec_of(camera.right)),
          down(vec_of(camera.down)) {}
    Ray ray_through(Real column, Real row) const { return {origin, normalize(corner + right * column + down * row)}; }

    Vec3 origin, corner, right, down;
};

// What the rays of a crop may pass: the four planes through the eye and its sides.
struct ViewBounds {
    ViewBounds() : origin(Real(0)) { // all that there is
        for (Vec3 &n : normal) n = Vec3(Real(0));
    }
    ViewBounds(const View &view, const Crop &crop) : origin(view.origin) {
        const auto along = [&](int32_t x, int32_t y) {
            return view.corner + view.right * Real(x) + view.down * Real(y);
        };
        const Vec3 corner[4] = {along(crop.x0, crop.y0), along(crop.x1, crop.y0), along(crop.x1, crop.y1),
                                along(crop.x0, crop.y1)};
        const Vec3 middle = corner[0] + corner[2];
        for (int i = 0; i < 4; ++i) {
            normal[i] = normalize(cross(normalize(corner[i]), normalize(corner[(i + 1) % 4])));
            if (dot(normal[i], middle) < Real(0)) normal[i] = -normal[i];
        }
    }
    // False: no ray passes the box, whatever is rounded.
    bool may_see(const Box &box) const {
        const Vec3 middle = (box.low + box.high) * Real(0.5) - origin, half = (box.high - box.low) * Real(0.5);
        for (const Vec3 &n : normal) {
            const Real reach = abs(n.x) * half.x + abs(n.y) * half.y + abs(n.z) * half.z;
            const Real slack = (abs(middle.x) + abs(middle.y) + abs(middle.z)) * Real(0x1p-16);
            if (dot(n, middle) + reach + slack < Real(0)) return false;
        }
        return true;
    }

    Vec3 origin, normal[4]; // inwards
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
