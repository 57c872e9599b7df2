#include "host/commands/projection.h"
#include "host/prepare/core_units.h"

namespace wisp {

Projection::Projection(const Camera &camera, const Crop &crop)
    : camera_(camera), crop_(crop), axis_(cross(camera.right, camera.down)), to_plane_(dot(camera.corner, axis_)) {}

PicturePoint Projection::place(const Double3 &point) const {
    const Double3 on_plane = (point - camera_.origin) * (1 / depth(point)) - camera_.corner;
    const double squared = dot(axis_, axis_);
    return {dot(cross(on_plane, camera_.down), axis_) / squared - crop_.x0,
            dot(cross(camera_.right, on_plane), axis_) / squared - crop_.y0};
}

std::vector<Double3> Projection::plane(double depth) const {
    std::vector<Double3> points;
    for (int y = crop_.y0; y < crop_.y1; ++y)
        for (int x = crop_.x0; x < crop_.x1; ++x)
            points.push_back(camera_.origin +
                             (camera_.corner + camera_.right * (x + 0.5) + camera_.down * (y + 0.5)) * depth);
    return points;
}

Section::Section(const Camera &camera, int row) : eye_(camera.origin), right_(unit(camera.right)) {
    const Double3 along = camera.corner + camera.down * (row + 0.5);
    normal_ = unit(cross(right_, along));
    ahead_ = unit(cross(normal_, right_));
    if (dot(ahead_, along) < 0) ahead_ = ahead_ * -1;
}

bool Section::fit(const Scene &scene, int width, int height, const Crop &crop) {
    add_triangles(scene);
    if (segments_.empty()) return false;
    PicturePoint low = segments_[0].from, high = low;
    for (const Segment &segment : segments_)
        for (const PicturePoint &end : {segment.from, segment.to}) {
            low = {std::min(low.x, end.x), std::min(low.y, end.y)};
            high = {std::max(high.x, end.x), std::max(high.y, end.y)};
        }
    pixel_ = 1.06 * std::max((high.x - low.x) / width, (high.y - low.y) / height);
    corner_ = {(low.x + high.x - pixel_ * width) / 2 + pixel_ * crop.x0,
               (low.y + high.y - pixel_ * height) / 2 + pixel_ * crop.y0};
    for (Segment &segment : segments_)
        for (PicturePoint *end : {&segment.from, &segment.to})
            *end = {(end->x - corner_.x) / pixel_, (end->y - corner_.y) / pixel_};
    return true;
}

std::vector<Double3> Section::points(const Crop &crop) const {
    std::vector<Double3> points;
    for (int y = 0; y < crop.height(); ++y)
        for (int x = 0; x < crop.width(); ++x)
            points.push_back(eye_ + right_ * (corner_.x + pixel_ * (x + 0.5)) -
                             ahead_ * (corner_.y + pixel_ * (y + 0.5)));
    return points;
}

void Section::add_triangle(const Double3 (&corner)[3]) {
    PicturePoint met[2];
    int count = 0;
    for (int i = 0; i < 3; ++i) {
        const Double3 a = corner[i] - eye_, b = corner[(i + 1) % 3] - eye_;
        const double of_a = dot(a, normal_), of_b = dot(b, normal_);
        if ((of_a < 0) == (of_b < 0)) continue; // two edges of a triangle that is met differ, no more
        const Double3 at = a + (b - a) * (of_a / (of_a - of_b));
        met[count++] = {dot(at, right_), -dot(at, ahead_)};
    }
    if (count == 2) segments_.push_back({met[0], met[1]});
}

void Section::add_triangles(const Scene &scene) {
    const auto add = [&](uint32_t first, uint32_t count, auto &&placed) {
        for (uint32_t i = first; i < first + count; ++i) {
            const Double3 *corner = scene.triangles[i].corner;
            add_triangle({placed(corner[0]), placed(corner[1]), placed(corner[2])});
        }
    };
    const auto as_it_is = [](const Double3 &p) { return p; };
    add(0, scene.static_count, as_it_is);
    for (uint32_t k = 0; k < scene.instance_count; ++k) {
        const Instance &instance = scene.instances[k];
        if (instance.visible)
            add(instance.first, instance.count, [&](const Double3 &p) { return transformed_point(instance, p); });
    }
    add(scene.static_count + scene.instance_triangle_count, scene.deforming_count, as_it_is);
}

} // namespace wisp
