#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/prepare/motion.h"
#include "host/prepare/prepare_surfaces.h"

namespace wisp {

namespace {

// The largest distance (of a component) of lights, of the camera and of what moves from a point, at any key frame.
// `moving`: extent_at_keys().
double farthest_from(const Double3 &center, const SceneFile &file, const Extent &moving) {
    double farthest = moving.any() ? reach_of(moving, center) : 0;
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
                    extent.add(transformed_point(instance, corner));
        extent.add(shapes_.triangles.data() + shapes_.static_count + shapes_.instance_triangle_count,
                   shapes_.deforming_count);
    }
    const Double3 half = (extent.high - extent.low) * 0.5;
    reach_ = largest(half);
    radius_ = length(half);
    own_ = unit_of_surfaces(
        extent.middle(), reach_,
        farthest_from(extent.middle(), file,
                      extent_at_keys(graph, shapes_, start, file.animation ? file.animation->end : start)));
    unit_ = own_;

    for (uint32_t i = 0; i < shapes_.static_count; ++i) normalize(shapes_.triangles[i], unit_);
    for (const Instance &instance : shapes_.instances) {
        Extent own;
        own.add(shapes_.triangles.data() + instance.first, instance.count);
        const Unit space = space_of(instance, own, unit_);
        for (uint32_t i = instance.first; i < instance.first + instance.count; ++i)
            normalize(shapes_.triangles[i], space);
        spaces_.push_back(space);
    }
    for (const auto &[path, where] : graph.textures)
        images_.push_back(named_at(where, [&path = path] { return read_texture(path); }));
    for (const TexturePyramid &image : images_) textures_.push_back(image.view());
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
                             "something moves more than four times as far between its keys as at them, or 512 times as "
                             "far as what is still reaches, expected a scene that fits");
    };
    pose_shapes(name, file.graph, time, shapes_);
    for (uint32_t i = shapes_.static_count + shapes_.instance_triangle_count; i < shapes_.triangles.size(); ++i) {
        normalize(shapes_.triangles[i], unit_);
        for (const Double3 &corner : shapes_.triangles[i].corner) check(largest_component(corner));
    }
    instances_ = shapes_.instances;
    for (size_t b = 0; b < instances_.size(); ++b) {
        Instance &instance = instances_[b];
        if (!instance.visible) continue;
        normalize(instance, spaces_[b], unit_);
        for (uint32_t i = instance.first; i < instance.first + instance.count; ++i)
            for (const Double3 &corner : shapes_.triangles[i].corner)
                check(largest_component(transformed_point(instance, corner)));
    }
}

void PreparedSurfaces::show(Scene &scene, const SceneFile &file, double dim) {
    materials_.clear();
    for (const FileMaterial &m : file.graph.materials)
        materials_.push_back(
            make_material({m.ambient, m.diffuse, m.specular, m.shininess, m.transmission, m.index}, file.ambient, dim));
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
    scene.ray_epsilon = ray_epsilon_of(radius());
}

} // namespace wisp
