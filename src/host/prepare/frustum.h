// What a camera sees, and what a ray meets.
#pragma once
#include "host/base/double3_algebra.h"
#include <initializer_list>
#include <iterator>

namespace wisp {

// Whether the points origin + t * direction, t from 0 to `farthest`, meet the box.
inline bool meets_box(const Double3 &low, const Double3 &high, const Double3 &origin, const Double3 &direction,
                      double farthest) {
    double begin = 0, end = farthest;
    for (int axis = 0; axis < 3; ++axis) {
        const double from = component(low, axis) - component(origin, axis),
                     to = component(high, axis) - component(origin, axis), d = component(direction, axis);
        if (d == 0) {
            if (from > 0 || to < 0) return false;
            continue;
        }
        begin = std::max(begin, std::min(from / d, to / d));
        end = std::min(end, std::max(from / d, to / d));
    }
    return begin <= end;
}

// The four planes through the eye and the edges of the picture.
class Frustum {
  public:
    Frustum(const Camera &camera, int width, int height) : eye_(camera.origin) {
        const Double3 across = camera.right * width, down = camera.down * height,
                      corners[] = {camera.corner, camera.corner + across, camera.corner + across + down,
                                   camera.corner + down};
        const Double3 middle = camera.corner + across * 0.5 + down * 0.5;
        for (int i = 0; i < 4; ++i) {
            const Double3 normal = unit(cross(corners[i], corners[(i + 1) % 4]));
            inward_[i] = dot(normal, middle) < 0 ? normal * -1.0 : normal;
        }
    }

    // Whether all balls about the points are outside one of the planes: then they are not in view.
    bool misses(std::initializer_list<Double3> points, double radius = 0) const {
        return std::any_of(std::begin(inward_), std::end(inward_), [&](const Double3 &normal) {
            return std::all_of(points.begin(), points.end(),
                               [&](const Double3 &point) { return dot(normal, point - eye_) < -radius; });
        });
    }

  private:
    Double3 eye_, inward_[4];
};

} // namespace wisp
