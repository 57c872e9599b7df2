#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/base/memory.h"
#include "host/prepare/core_units.h"
#include "host/prepare/motion.h"
#include "host/prepare/pose.h"
#include <algorithm>
#include <limits>

namespace wisp {

namespace {

// The motion that moves or hides the node; nullptr for none.
const Motion *motion_of(const SceneGraph &graph, const Node &node) {
    const Motion *m = find_motion(graph, node.name);
    const bool any = m && !(m->translation.empty() && m->rotation.empty() && m->scale.empty() && m->visibility.empty());
    return any ? m : nullptr;
}

// The index of a node in arrays whose first element is the world's.
size_t index_of(int32_t node) { return static_cast<size_t>(node + 1); }

// From the space of a node to that of the nearest moving node around it (the mover), or to that of the world.
struct Frame {
    int32_t mover = -1;
    Matrix matrix;
};

std::vector<Frame> static_frames(const SceneGraph &graph) {
    std::vector<Frame> frames(1);
    for (size_t i = 0; i < graph.nodes.size(); ++i) {
        const Node &node = graph.nodes[i];
        Frame frame = frames[index_of(node.parent)];
        if (motion_of(graph, node))
            frame = {static_cast<int32_t>(i), Matrix()};
        else
            frame.matrix = frame.matrix * placement_matrix(node.placement);
        frames.push_back(frame);
    }
    return frames;
}

// From the space of a node to that of the world.
struct Pose {
    Matrix matrix;
    bool visible = true;
};

std::vector<Pose> poses_at(const SceneGraph &graph, double time) {
    std::vector<Pose> poses(1);
    for (const Node &node : graph.nodes) {
        Pose pose = poses[index_of(node.parent)];
        if (const Motion *motion = motion_of(graph, node)) {
            pose.matrix = pose.matrix * motion_matrix(*motion, time);
            pose.visible = pose.visible && is_visible(*motion, time);
        } else {
            pose.matrix = pose.matrix * placement_matrix(node.placement);
        }
        poses.push_back(pose);
    }
    return poses;
}

// What a matrix does to the planes of triangles.
struct PlaneMap {
    // The inverse transpose of the matrix times a factor above 0: the matrix of cofactors, which exists without an
    // inverse too, and maps the normal of a plane.
    Matrix to_normals;
    bool mirrors; // the matrix changes the orientation of triangles
};

PlaneMap plane_map(const Matrix &m) {
    const double size = std::max({largest_component(m.axis[0]), largest_component(m.axis[1]),
                                  largest_component(m.axis[2]), std::numeric_limits<double>::min()});
    const Double3 a = m.axis[0] * (1 / size), b = m.axis[1] * (1 / size), c = m.axis[2] * (1 / size);
    const bool mirrors = dot(a, cross(b, c)) < 0;
    const double sign = mirrors ? -1 : 1;
    return {{{cross(b, c) * sign, cross(c, a) * sign, cross(a, b) * sign}, {0, 0, 0}}, mirrors};
}

// Gives the mirror image of a triangle its orientation back: the outside of the image is the image of the outside. With
// normals they tell the outside.
void turn_round(Triangle &t) {
    if (largest_component(t.normal[0]) > 0) return;
    std::swap(t.corner[1], t.corner[2]);
    std::swap(t.texel[1], t.texel[2]);
}

void check_range(const std::string &name, const Double3 &p) {
    for (double x : {p.x, p.y, p.z})
        if (!(std::fabs(x) <= 1e100))
            throw InputError(name + ":1",
                             "the transforms of a scene enlarge it beyond +-1e100, expected smaller scales");
}

// Transforms a mesh into the triangles from `triangle` on.
void bake(const std::string &name, const Mesh &mesh, const Matrix &matrix, Triangle *triangle) {
    std::vector<Double3> positions, normals;
    for (const Double3 &p : mesh.positions) {
        positions.push_back(transform_point(matrix, p));
        check_range(name, positions.back());
    }
    const PlaneMap map = plane_map(matrix);
    for (const Double3 &n : mesh.normals) normals.push_back(transform_vector(map.to_normals, n));
    for (const Mesh::Row &row : mesh.rows) {
        Triangle &t = *triangle++;
        t = {};
        t.material = mesh.material;
        t.texture = mesh.texture;
        for (size_t i = 0; i < 3; ++i) {
            t.corner[i] = positions[row.corner[i]];
            if (!mesh.texels.empty()) std::copy_n(mesh.texels[row.texel[i]].begin(), 2, t.texel[i]);
        }
        if (!normals.empty()) {
            const Double3 of_corners[] = {normals[row.normal[0]], normals[row.normal[1]], normals[row.normal[2]]};
            set_normals(t, of_corners);
        }
        if (map.mirrors) turn_round(t);
    }
}

// A deforming triangle at a time, in the space of its node.
DeformingTriangle::Keyframe shape_at(const DeformingTriangle &deforming, double time) {
    const std::vector<DeformingTriangle::Keyframe> &keys = deforming.keyframes;
    if (time <= keys.front().time) return keys.front();
    if (time >= keys.back().time) return keys.back();
    size_t next = 1;
    while (time >= keys[next].time) ++next;
    const DeformingTriangle::Keyframe &a = keys[next - 1], &b = keys[next];
    const double u = (time - a.time) / (b.time - a.time);
    DeformingTriangle::Keyframe shape = {time, {}, {}};
    for (size_t i = 0; i < 3; ++i) {
        shape.corners[i] = a.corners[i] * (1 - u) + b.corners[i] * u;
        shape.normals[i] = a.normals[i] * (1 - u) + b.normals[i] * u;
    }
    return shape;
}

} // namespace

Extent extent_at_keys(const SceneGraph &graph, const Shapes &shapes, double start, double end) {
    std::vector<double> times = {start, end};
    const auto add = [&](double time) {
        if (time > start && time < end) times.push_back(time);
    };
    for (const auto &entry : graph.motions) {
        for (const auto *track : {&entry.second.translation, &entry.second.scale})
            for (const Key &key : *track) add(key.time);
        for (const Motion::Switch &key : entry.second.visibility) add(key.time);
    }
    for (const DeformingTriangle &deforming : graph.deforming)
        for (const DeformingTriangle::Keyframe &key : deforming.keyframes) add(key.time);
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());

    std::vector<Extent> own(shapes.instances.size()); // of each instance, in its own space
    for (size_t i = 0; i < own.size(); ++i)
        own[i].add(shapes.triangles.data() + shapes.instances[i].first, shapes.instances[i].count);
    Extent all;
    for (const double time : times) {
        const std::vector<Pose> poses = poses_at(graph, time);
        for (size_t i = 0; i < own.size(); ++i) {
            const Pose &pose = poses[index_of(shapes.instance_nodes[i])];
            for (int corner = 0; pose.visible && corner < 8; ++corner)
                all.add(transform_point(pose.matrix, corner_of_box(own[i].low, own[i].high, corner)));
        }
        for (const DeformingTriangle &deforming : graph.deforming) {
            const Pose &pose = poses[index_of(deforming.node)];
            if (!pose.visible) continue;
            for (const Double3 &corner : shape_at(deforming, time).corners)
                all.add(transform_point(pose.matrix, corner));
        }
    }
    return all;
}

Shapes make_shapes(const std::string &name, const SceneGraph &graph) {
    const std::vector<Frame> frames = static_frames(graph);
    // Where the triangles of each mover begin; the world is the first mover.
    std::vector<uint64_t> begin(graph.nodes.size() + 2);
    for (const Mesh &mesh : graph.meshes) begin[index_of(frames[index_of(mesh.node)].mover) + 1] += mesh.rows.size();
    for (size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    const uint64_t all = begin.back() + graph.deforming.size();
    if (all > std::numeric_limits<uint32_t>::max())
        throw InputError(name + ":1",
                         "there are " + std::to_string(all) + " triangles, expected fewer than 4294967296");

    require_memory(name, std::to_string(all) + " triangles", all * sizeof(Triangle));
    Shapes shapes = {};
    shapes.triangles.resize(all);
    shapes.static_count = static_cast<uint32_t>(begin[1]);
    shapes.instance_triangle_count = static_cast<uint32_t>(begin.back() - begin[1]);
    shapes.deforming_count = static_cast<uint32_t>(graph.deforming.size());
    for (size_t i = 0; i < graph.nodes.size(); ++i) {
        if (begin[i + 1] == begin[i + 2]) continue;
        Instance instance = {};
        instance.first = static_cast<uint32_t>(begin[i + 1]);
        instance.count = static_cast<uint32_t>(begin[i + 2] - begin[i + 1]);
        shapes.instances.push_back(instance);
        shapes.instance_nodes.push_back(static_cast<int32_t>(i));
    }
    for (const Mesh &mesh : graph.meshes) {
        const Frame &frame = frames[index_of(mesh.node)];
        uint64_t &next = begin[index_of(frame.mover)];
        bake(name, mesh, frame.matrix, shapes.triangles.data() + next);
        next += mesh.rows.size();
    }
    return shapes;
}

void pose_shapes(const std::string &name, const SceneGraph &graph, double time, Shapes &shapes) {
    const std::vector<Pose> poses = poses_at(graph, time);
    for (size_t i = 0; i < shapes.instances.size(); ++i) {
        Instance &instance = shapes.instances[i];
        const Pose &pose = poses[index_of(shapes.instance_nodes[i])];
        std::copy_n(pose.matrix.axis, 3, instance.axis);
        instance.origin = pose.matrix.origin;
        instance.visible = pose.visible && has_inverse(pose.matrix.axis);
        for (const Double3 &v : {instance.axis[0], instance.axis[1], instance.axis[2], instance.origin})
            check_range(name, v);
    }
    Triangle *triangle = shapes.triangles.data() + shapes.static_count + shapes.instance_triangle_count;
    for (const DeformingTriangle &deforming : graph.deforming) {
        const Pose &pose = poses[index_of(deforming.node)];
        const DeformingTriangle::Keyframe shape = shape_at(deforming, time);
        const PlaneMap map = plane_map(pose.matrix);
        Triangle &t = *triangle++;
        t = {};
        t.material = deforming.material;
        t.texture = -1;
        Double3 normals[3];
        for (size_t i = 0; i < 3; ++i) {
            t.corner[i] = transform_point(pose.matrix, shape.corners[i]);
            check_range(name, t.corner[i]);
            normals[i] = transform_vector(map.to_normals, shape.normals[i]);
        }
        set_normals(t, normals);
        if (map.mirrors) turn_round(t);
        if (!pose.visible) t.corner[1] = t.corner[2] = t.corner[0];
    }
}

} // namespace wisp
