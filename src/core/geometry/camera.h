// The camera's rays, and the pyramid that holds the rays of a crop.
#pragma once
#include "core/geometry/ray.h"
#include "wisp/scene.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

struct View {
    explicit View(const Camera &camera)
        : origin(vec_of(camera.origin)), corner(vec_of(camera.corner)), right(vec_of(camera.right)),
          down(vec_of(camera.down)) {}
    // The ray through a position of the picture, in pixels from the top left corner.
    Ray ray_through(Real column, Real row) const { return {origin, normalize(corner + right * column + down * row)}; }

    Vec3 origin, corner, right, down;
};

// The pyramid of a crop's rays: four planes through the eye and the sides of the crop.
struct ViewBounds {
    // Without bounds: may_see() is true for every box.
    ViewBounds() : origin(Real(0)) {
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
    // False: no ray of the crop crosses the box. The test is conservative: `slack` covers the rounding.
    bool may_see(const Box &box) const {
        const Vec3 middle = (box.low + box.high) * Real(0.5) - origin, half = (box.high - box.low) * Real(0.5);
        for (const Vec3 &n : normal) {
            const Real reach = abs(n.x) * half.x + abs(n.y) * half.y + abs(n.z) * half.z;
            const Real slack = (abs(middle.x) + abs(middle.y) + abs(middle.z)) * Real(0x1p-16);
            if (dot(n, middle) + reach + slack < Real(0)) return false;
        }
        return true;
    }

    Vec3 origin, normal[4]; // the normals point into the pyramid
};

} // namespace wisp::WISP_ARITH
