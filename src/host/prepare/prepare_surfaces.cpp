#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/prepare/motion.h"
#include "host/prepare/prepare_surfaces.h"

namespace wisp {

namespace {

// The static triangles reach 2^10 to 2^11 from their centre. Where lights or the camera are more than four times as far
// away, the triangles reach less, down to 2^4.
constexpr int size_exponent = 10, least_exponent = 4, reach_exponent = 12;

struct Extent {
    Double3 low = {1e300, 1e300, 1e300}, high = {-1e300, -1e300, -1e300};

    void add(const Double3 &p) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    void add(const Triangle *triangles, uint32_t count) {
        for (uint32_t i = 0; i < count; ++i)
            for (const Double3 &corner : triangles[i].corner) add(corner);
    }
    bool any() const { return low.x <= high.x; }
    Double3 middle() const { return (low + high) * 0.5; }
};

// The largest distance (of a component) of lights and the camera from a point, at any of their key frames.
double farthest_from(const Double3 &center, const SceneFile &file) {
    double farthest = 0;
    const auto add = [&](const Double3 &p, const std::string &name) {
        farthest = std::max(farthest, largest_component(p - center));
        const auto motion = file.graph.motions.find(name);
        if (name.empty() || motion == file.graph.motions.end()) return;
        const Double3 from = name == "camera" ? Double3{0, 0, 0} : p;
        for (const Key &key : motion->second.translation)
            farthest = std::max(farthest, largest_component(from + key.value - center));
    };
    add(file.view->from, "camera");
    for (const SceneFile::Light &light : file.lights)
        if (light.kind != LightKind::parallel) add(light.position, light.name);
    return farthest;
}

Matrix matrix_of(const Instance &instance) {
    return {{instance.axis[0], instance.axis[1], instance.axis[2]}, instance.origin};
}

} // namespace

PreparedSurfaces::PreparedSurfaces(const std::string &name, const SceneFile &file, double start) {
    const SceneGraph &graph = file.graph;
    shapes_ = make_shapes(name, graph);
    pose_shapes(name, graph, start, shapes_);
    // The size of the scene is that of its static triangles. Without any it is that of instances and deforming
    // triangles at the start.
    Extent extent;
    extent.add(shapes_.triangles.data(), shapes_.static_count);
    if (!extent.any()) {
        for (const Instance &instance : shapes_.instances)
            for (uint32_t i = instance.first; i < instance.first + instance.count; ++i)
                for (const Double3 &corner : shapes_.triangles[i].corner)
                    extent.add(transform_point(matrix_of(instance), corner));
        extent.add(shapes_.triangles.data() + shapes_.static_count + shapes_.instance_triangle_count,
                   shapes_.deforming_count);
    }
    const Double3 half = (extent.high - extent.low) * 0.5;
    reach_ = largest(half);
    radius_ = length(half);
    own_ = {extent.middle(), 1};
    if (reach_ > 0) {
        const int size = exponent_of(reach_), reach = exponent_of(std::max(farthest_from(own_.center, file), reach_));
        own_.scale =
            std::ldexp(1.0, std::max(std::min(size_exponent, reach_exponent - reach + size), least_exponent) - size);
    }
    unit_ = own_;

    for (uint32_t i = 0; i < shapes_.static_count; ++i) normalize(shapes_.triangles[i], unit_);
    for (const Instance &instance : shapes_.instances) {
        Extent own;
        own.add(shapes_.triangles.data() + instance.first, instance.count);
        double size = 0; // of the instance's unit of length, in the world
        for (const Double3 &axis : instance.axis) size = std::max(size, length(axis));
        Unit space = {own.middle(), size > 0 ? unit_.scale * std::ldexp(1.0, exponent_of(size)) : unit_.scale};
        // An instance that is flattened may be far larger in its own space than in the world.
        const double reach = largest_component(own.high - space.center);
        if (reach * space.scale > coordinate_limit)
            space.scale = std::ldexp(1.0, exponent_of(coordinate_limit) - 1 - exponent_of(reach));
        for (uint32_t i = instance.first; i < instance.first + instance.count; ++i)
            normalize(shapes_.triangles[i], space);
        spaces_.push_back(space);
    }
    for (const std::string &path : graph.textures) images_.push_back(read_texture(path));
    for (const TexturePyramid &image : images_) textures_.push_back(image.view());
}

void PreparedSurfaces::normalize(Triangle &triangle, const Unit &space) const {
    for (Double3 &corner : triangle.corner) corner = (corner - space.center) * space.scale;
}

void PreparedSurfaces::change_unit(const Unit &unit) {
    const double factor = unit.scale / unit_.scale; // a power of two: nothing is rounded
    if (factor == 1) return;
    unit_.scale = unit.scale;
    for (Unit &space : spaces_) space.scale *= factor;
    for (uint32_t i = 0; i < shapes_.static_count + shapes_.instance_triangle_count; ++i)
        for (Double3 &corner : shapes_.triangles[i].corner) corner = corner * factor;
}

void PreparedSurfaces::pose(const std::string &name, const SceneFile &file, double time) {
    const auto check = [&name](double largest) {
        if (!(largest <= coordinate_limit))
            throw InputError(name + ":1",
                             "something moves more than four times as far as what is still reaches, expected "
                             "a scene that fits");
    };
    pose_shapes(name, file.graph, time, shapes_);
    for (uint32_t i = shapes_.static_count + shapes_.instance_triangle_count; i < shapes_.triangles.size(); ++i) {
        normalize(shapes_.triangles[i], unit_);
        for (const Double3 &corner : shapes_.triangles[i].corner) check(largest_component(corner));
    }
    instances_ = shapes_.instances;
    for (size_t b = 0; b < instances_.size(); ++b) {
        Instance &instance = instances_[b];
        const Unit &space = spaces_[b];
        if (!instance.visible) continue;
        instance.origin = (transform_point(matrix_of(instance), space.center) - unit_.center) * unit_.scale;
        for (Double3 &axis : instance.axis) axis = axis * (unit_.scale / space.scale);
        const Double3 *a = instance.axis, yz = cross(a[1], a[2]), zx = cross(a[2], a[0]), xy = cross(a[0], a[1]);
        const double volume = dot(a[0], yz);
        // The rows of the inverse are x, y and z; Instance has its columns.
        const Double3 x = yz * (1 / volume), y = zx * (1 / volume), z = xy * (1 / volume);
        instance.inverse[0] = {x.x, y.x, z.x};
        instance.inverse[1] = {x.y, y.y, z.y};
        instance.inverse[2] = {x.z, y.z, z.z};
        for (uint32_t i = instance.first; i < instance.first + instance.count; ++i)
            for (const Double3 &corner : shapes_.triangles[i].corner)
                check(largest_component(transform_point(matrix_of(instance), corner)));
    }
}

void PreparedSurfaces::show(Scene &scene, const SceneFile &file, double dim) {
    materials_.clear();
    for (const FileMaterial &m : file.graph.materials) {
        const Double3 &a = m.ambient, &am = file.ambient;
        materials_.push_back({Double3{a.x * am.x, a.y * am.y, a.z * am.z} * dim, m.diffuse, m.specular, m.shininess,
                              m.transmission, m.index > 0 ? m.index : 1});
    }
    scene.triangles = shapes_.triangles.data();
    scene.static_count = shapes_.static_count;
    scene.instance_triangle_count = shapes_.instance_triangle_count;
    scene.deforming_count = shapes_.deforming_count;
    scene.instances = instances_.data();
    scene.instance_count = static_cast<uint32_t>(instances_.size());
    scene.materials = materials_.data();
    scene.material_count = static_cast<uint32_t>(materials_.size());
    scene.textures = textures_.data();
    scene.texture_count = static_cast<uint32_t>(textures_.size());
    scene.ray_epsilon = 2 * radius() * 1e-6;
}

} // namespace wisp
