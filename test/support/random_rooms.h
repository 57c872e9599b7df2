// Rooms of random triangles, most of them degenerate: slivers, twins, touching, coplanar, without an area; instances,
// deforming triangles, textures, lights of all kinds.
#pragma once
#include "host/base/double3_algebra.h"
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

constexpr int room_pixels = 16;

class RandomRoom : public Room {
  public:
    // `size`: half the edge of the box that holds most of it.
    RandomRoom(uint64_t seed, double size_) : size(size_), next_{seed * 977 + 5} {
        scene.ray_epsilon = size * 4e-6;
        scene.background = {0.125, 0.25, 0.5};
        depth = static_cast<uint32_t>(pick(6));
        spread = pick(2) ? 0.01 : 0;
        for (int i = 0; i < 6; ++i) material(random_material());
        paint();
        const int static_count = 10 + pick(100), moving = pick(5), deforming = pick(2) * pick(10);
        for (int i = 0; i < static_count; ++i) triangles.push_back(random_triangle(0));
        scene.static_count = static_cast<uint32_t>(static_count);
        for (int b = 0; b < moving; ++b) add_instance();
        scene.instance_triangle_count = static_cast<uint32_t>(triangles.size()) - scene.static_count;
        const size_t first_deforming = triangles.size();
        for (int i = 0; i < deforming; ++i)
            triangles.push_back(pick(4) ? random_triangle(first_deforming) : triangles[below(scene.static_count)]);
        scene.deforming_count = static_cast<uint32_t>(deforming);
        for (const LightKind kind : {LightKind::constant, LightKind::point, LightKind::spot, LightKind::parallel})
            for (int i = pick(3); i > 0; --i) add_light(kind);
        const Double3 eye = pick(3) ? point(2) : point(0.5);
        look_from(eye, pick(4) == 0);
        build();
    }

    double size;

  private:
    double unit_number() { return next_(); }
    double within(double limit) { return (2 * next_() - 1) * limit; }
    int pick(int count) { return static_cast<int>(next_() * count); }
    size_t below(size_t count) { return static_cast<size_t>(next_() * static_cast<double>(count)); }
    Double3 vector(double limit) {
        const double x = within(limit), y = within(limit), z = within(limit);
        return {x, y, z};
    }
    Double3 point(double part) { return vector(part * size); }
    Double3 direction() {
        Double3 v = vector(1);
        while (length(v) < 0.1) v = vector(1);
        return unit(v);
    }
    Double3 color() {
        const double r = next_(), g = next_(), b = next_();
        return {r, g, b};
    }

    Material random_material() {
        Material m = {color() * 0.5, color(), {0, 0, 0}, 1, 0, 1};
        if (pick(2)) m.specular = color() * 0.6;
        const double shininess[] = {0, 1, 7, 60}, index[] = {1, 1.5, 0.7, 1.3};
        m.shininess = shininess[pick(4)];
        if (pick(3) == 0) m.transmission = 0.3 + 0.6 * next_();
        m.index = index[pick(4)];
        return m;
    }
    void paint() {
        const int widths[] = {8, 5}, heights[] = {4, 3};
        for (size_t i = 0; i < 2; ++i) {
            Texture texture = {widths[i], heights[i], 1, nullptr};
            size_t count = 0;
            for (int w = texture.width, h = texture.height;; w = std::max(w / 2, 1), h = std::max(h / 2, 1)) {
                count += static_cast<size_t>(w * h);
                if (w == 1 && h == 1) break;
                ++texture.levels;
            }
            for (size_t t = 0; t < 3 * count; ++t) texels_[i].push_back(static_cast<uint16_t>(next_() * 65536));
            texture.texels = texels_[i].data();
            textures.push_back(texture);
        }
    }
    // Like one of `first` and behind, or new.
    Triangle random_triangle(size_t first) {
        Triangle t = triangle(point(1), point(1), point(1), static_cast<uint32_t>(pick(6)));
        Double3 *c = t.corner;
        const bool others = triangles.size() > first;
        const Triangle other = others ? triangles[first + below(triangles.size() - first)] : t;
        switch (pick(9)) {
        case 0: // small
            c[1] = c[0] + point(0.1);
            c[2] = c[0] + point(0.1);
            break;
        case 1: // a sliver
            c[2] = c[0] + (c[1] - c[0]) * next_() + point(pick(2) ? 1e-3 : 1e-6);
            return t;
        case 2: { // in a plane along the axes; many share it
            const double plane = (pick(4) - 2) * 0.375 * size;
            const int axis = pick(3);
            for (int i = 0; i < 3; ++i) (axis == 0 ? c[i].x : axis == 1 ? c[i].y : c[i].z) = plane;
            break;
        }
        case 3: // a twin
            for (int i = 0; i < 3; ++i) c[i] = other.corner[i];
            break;
        case 4: // at an edge
            c[0] = other.corner[1];
            c[1] = other.corner[0];
            break;
        case 5: // without an area
            if (pick(2))
                c[2] = c[0];
            else
                c[0] = c[1] = c[2];
            return t;
        default: break;
        }
        const Double3 plane = cross(c[1] - c[0], c[2] - c[0]);
        if (pick(2) && length(plane) > 1e-3 * size * size) { // normals to either side, a little apart
            const Double3 side = unit(plane) * (pick(2) ? 1.0 : -1.0);
            for (Double3 &n : t.normal) n = unit(side + vector(0.4));
        }
        if (pick(3) == 0) {
            t.texture = pick(2);
            for (auto &texel : t.texel)
                for (double &x : texel) x = within(3);
        }
        return t;
    }
    void add_instance() {
        const size_t first = triangles.size();
        Instance instance = {};
        instance.first = static_cast<uint32_t>(first);
        instance.count = 1 + static_cast<uint32_t>(pick(20));
        instance.visible = pick(5) > 0;
        if (pick(3) == 0) { // where it is, it coincides with static triangles
            instance.axis[0].x = instance.axis[1].y = instance.axis[2].z = 1;
            instance.inverse[0].x = instance.inverse[1].y = instance.inverse[2].z = 1;
            for (uint32_t i = 0; i < instance.count; ++i)
                triangles.push_back(pick(2) ? triangles[below(first)] : random_triangle(first));
        } else {
            for (uint32_t i = 0; i < instance.count; ++i) triangles.push_back(random_triangle(first));
            const Double3 turn = direction();
            const double degrees = pick(3) * 90 + pick(2) * within(90);
            const double scale[3] = {0.2 + next_(), 0.2 + next_(), pick(4) ? 0.2 + next_() : -0.5};
            for (int k = 0; k < 3; ++k) {
                const Double3 axis = rotate({double(k == 0), double(k == 1), double(k == 2)}, turn, degrees);
                instance.axis[k] = axis * scale[k];
                // The inverse of turn times scale is the transposed turn, then 1 / scale.
                const Double3 row = axis * (1 / scale[k]);
                for (int j = 0; j < 3; ++j) {
                    Double3 &column = instance.inverse[j];
                    (k == 0 ? column.x : k == 1 ? column.y : column.z) = j == 0 ? row.x : j == 1 ? row.y : row.z;
                }
            }
            instance.mirrored = scale[2] < 0;
            instance.origin = point(0.7);
        }
        instances.push_back(instance);
    }
    void add_light(LightKind kind) {
        const bool strong = kind == LightKind::point || kind == LightKind::spot;
        const Double3 where = pick(8) ? point(1.5) : triangles[below(triangles.size())].corner[0];
        light(kind, where, color() * (strong ? size * size : 1), direction());
        lights.back().one_minus_cosine = 0.05 + next_();
    }
    void look_from(const Double3 &eye, bool along_axis) {
        const Double3 forward = along_axis ? Double3{0, 0, eye.z > 0 ? -1.0 : 1.0} : unit(point(0.5) - eye);
        const Double3 right = along_axis ? Double3{1, 0, 0} : unit(cross(forward, direction()));
        const double pixel = along_axis ? 0.125 : 0.02 + 0.1 * next_();
        // Half a pixel off the middle, so that one ray is along the axis.
        const double half = room_pixels / 2 - 0.5;
        scene.camera.origin = eye;
        scene.camera.right = right * pixel;
        scene.camera.down = cross(forward, right) * pixel;
        scene.camera.corner = forward - scene.camera.right * (half + 1) - scene.camera.down * (half + 1);
    }

    Sequence next_;
    std::vector<uint16_t> texels_[2];
};

} // namespace wisp::WISP_ARITH
