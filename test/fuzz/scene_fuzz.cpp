// Any bytes read as a scene file give a scene or an error of one line. The input is the scene `name`; each 0 byte ends
// a file, and the next one is a file that the scene may include: `1`, `2`, ...
#include "host/base/error.h"
#include "host/scene/options.h"
#include "host/scene/scene_file.h"
#include <cmath>
#include <cstdlib>

namespace {

using namespace wisp;

void promise(bool holds) {
    if (!holds) std::abort();
}

bool is_finite(const Double3 &v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool is_unit(const Double3 &v) { return std::fabs(v.x * v.x + v.y * v.y + v.z * v.z - 1) < 1e-12; }
bool is_color(const Double3 &v) { return is_finite(v) && v.x >= 0 && v.y >= 0 && v.z >= 0; }
bool is_node(int32_t node, const SceneGraph &graph) {
    return node >= -1 && node < static_cast<int64_t>(graph.nodes.size());
}

void check_graph(const SceneGraph &graph) {
    for (size_t i = 0; i < graph.nodes.size(); ++i) {
        const Node &node = graph.nodes[i];
        const Placement &place = node.placement;
        promise(node.parent >= -1 && node.parent < static_cast<int64_t>(i));
        promise(is_unit(place.axis) && is_finite(place.translation) && is_finite(place.scale));
        promise(place.scale.x != 0 && place.scale.y != 0 && place.scale.z != 0 && std::isfinite(place.degrees));
    }
    for (const FileMaterial &m : graph.materials) {
        promise(is_color(m.ambient) && is_color(m.diffuse) && is_color(m.specular));
        promise(m.shininess >= 0 && m.transmission >= 0 && m.transmission <= 1 && std::isfinite(m.index));
    }
    for (const Mesh &mesh : graph.meshes) {
        promise(is_node(mesh.node, graph) && mesh.material < graph.materials.size());
        promise(mesh.texture >= -1 && mesh.texture < static_cast<int64_t>(graph.textures.size()));
        promise((mesh.texture < 0) == mesh.texels.empty());
        promise(!mesh.rows.empty());
        for (const Double3 &p : mesh.positions) promise(is_finite(p));
        for (const Double3 &n : mesh.normals) promise(is_finite(n));
        for (const auto &t : mesh.texels) promise(std::isfinite(t[0]) && std::isfinite(t[1]));
        for (const Mesh::Row &row : mesh.rows)
            for (size_t k = 0; k < 3; ++k) {
                promise(row.corner[k] < mesh.positions.size());
                promise(mesh.normals.empty() || row.normal[k] < mesh.normals.size());
                promise(mesh.texels.empty() || row.texel[k] < mesh.texels.size());
            }
    }
    for (const DeformingTriangle &triangle : graph.deforming) {
        promise(is_node(triangle.node, graph) && triangle.material < graph.materials.size() &&
                !triangle.keyframes.empty());
        for (size_t i = 0; i < triangle.keyframes.size(); ++i) {
            promise(std::isfinite(triangle.keyframes[i].time) &&
                    (i == 0 || triangle.keyframes[i].time >= triangle.keyframes[i - 1].time));
            for (const Double3 &p : triangle.keyframes[i].corners) promise(is_finite(p));
            for (const Double3 &n : triangle.keyframes[i].normals) promise(is_finite(n));
        }
    }
    for (const auto &[name, motion] : graph.motions) {
        for (const auto *track : {&motion.translation, &motion.rotation, &motion.scale}) {
            promise(track->empty() || track->size() >= 4);
            for (const Key &key : *track) {
                promise(std::isfinite(key.time) && is_finite(key.value) && std::isfinite(key.degrees));
                promise(std::isfinite(key.tension) && std::isfinite(key.continuity) && std::isfinite(key.bias));
                promise(track != &motion.rotation || is_unit(key.value));
            }
        }
        for (const auto &key : motion.visibility) promise(std::isfinite(key.time));
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    std::vector<std::string> files(1);
    for (size_t i = 0; i < size; ++i)
        if (data[i] == 0)
            files.emplace_back();
        else
            files.back() += static_cast<char>(data[i]);
    const FileReader read = [&files](const std::string &path) {
        const auto number = to_integer(path);
        if (!number || *number < 1 || *number >= static_cast<int64_t>(files.size()))
            throw InputError(path, "cannot be opened: there is no such file");
        const std::string &text = files[static_cast<size_t>(*number)];
        return Bytes(text.begin(), text.end());
    };
    SceneLimits limits;
    limits.includes = 1000;
    limits.words = limits.triangles = 1 << 16;
    try {
        const SceneFile scene = parse_scene("name", files[0], read, limits);
        check_graph(scene.graph);
        for (const auto &smoke : scene.smokes) {
            promise(smoke.phase > -1 && smoke.phase < 1);
            promise(smoke.extinction.value_or(1) >= 0 && smoke.albedo.x >= 0 && smoke.albedo.x <= 1);
            promise(!smoke.radius || *smoke.radius > 0);
            promise(is_node(smoke.node, scene.graph));
            for (int32_t i = smoke.node; i >= 0; i = scene.graph.nodes[static_cast<size_t>(i)].parent) {
                const Node &node = scene.graph.nodes[static_cast<size_t>(i)];
                const Double3 &scale = node.placement.scale;
                promise(node.name.empty() && scale.x > 0 && scale.x == scale.y && scale.y == scale.z);
            }
            numbered(smoke.file, 7);
        }
        for (const auto &light : scene.lights)
            promise(is_color(light.color) && is_finite(light.position) && is_finite(light.direction));
        promise(is_color(scene.ambient) && is_color(scene.background));
        if (scene.animation) promise(std::isfinite(scene.animation->start) && scene.animation->frames >= 1);
        if (scene.view) promise(scene.view->width >= 1 && scene.view->height >= 1);
        Options options;
        for (const auto &setting : scene.defaults) set_option(options, setting.option, setting.value, setting.where);
    } catch (const Error &error) {
        // An error begins with a file of the input and a line.
        const std::string line = error.what();
        const size_t colon = line.find(':');
        const auto file = to_integer(line.substr(0, colon));
        promise(line.rfind("name:", 0) == 0 || (file && *file >= 1 && *file < static_cast<int64_t>(files.size())));
        promise(to_integer(line.substr(colon + 1, line.find(':', colon + 1) - colon - 1)) >= 1);
        promise(line.find('\n') == std::string::npos);
    }
    return 0;
}
