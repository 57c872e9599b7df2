// Surfaces as in NFF and AFF files: shapes in a tree of transforms, materials, key frames. Everything is in the units
// of the file. prepare/motion.h evaluates it at a time.
#pragma once
#include "host/base/messages.h"
#include "wisp/scene.h"
#include <array>
#include <map>
#include <string>
#include <vector>

namespace wisp {

// One key of a track. `value` is a position, a scale, or an axis of unit length; `degrees` is of a rotation alone.
struct Key {
    double time;
    Double3 value;
    double degrees;
    double tension, continuity, bias;
};

// `k NAME`: tracks are empty or have at least 4 keys, `visibility` any number.
struct Motion {
    struct Switch {
        double time;
        bool visible;
    };
    std::vector<Key> translation, rotation, scale;
    std::vector<Switch> visibility;
};

// p' = T R S p. The axis has unit length, or there is no rotation (0 degrees).
struct Placement {
    Double3 scale = {1, 1, 1}, axis = {0, 0, 1};
    double degrees = 0;
    Double3 translation = {0, 0, 0};
};

// A block `xs` (a placement) or `x NAME` (a name, to be looked up in SceneGraph::motions; no motion: identity).
struct Node {
    int32_t parent;   // index of the node around it; -1: the world. Parents stand before their children.
    std::string name; // empty for `xs`
    Placement placement;
};

// The material of a statement `fm`; a statement `f` is converted to it. An `index` of 0 or below means 1.
struct FileMaterial {
    Double3 ambient, diffuse, specular;
    double shininess, transmission, index;
};

// Triangles in the space of `node` (-1: the world). All indices are within their arrays.
struct Mesh {
    struct Row {
        std::array<uint32_t, 3> corner, normal, texel; // normal and texel only where there are such arrays
    };
    int32_t node;
    uint32_t material;
    int32_t texture;                           // index into SceneGraph::textures; -1: none
    std::vector<Double3> positions, normals;   // normals: none, or of any length; 0 0 0: the plane's normal
    std::vector<std::array<double, 2>> texels; // u, v; empty without texture
    std::vector<Row> rows;
};

// `tpa`: a triangle whose corners and normals are linear between its times. There is at least one time, and times do
// not descend.
struct DeformingTriangle {
    struct Keyframe {
        double time;
        std::array<Double3, 3> corners, normals;
    };
    int32_t node;
    uint32_t material;
    std::vector<Keyframe> keyframes;
};

struct SceneGraph {
    std::vector<Node> nodes;
    std::vector<FileMaterial> materials;
    struct TextureFile {
        std::string path, where; // as found from the working directory; the first statement that names it, `FILE:LINE`
    };
    std::vector<TextureFile> textures; // each once
    std::vector<Mesh> meshes;          // spheres, cones and polygons too, as triangles
    std::vector<DeformingTriangle> deforming;
    std::map<std::string, Motion> motions; // by name; `camera` moves the camera
    std::vector<Warning> warnings;         // of statements that do not do what they seem to

    bool has_surfaces() const { return !meshes.empty() || !deforming.empty(); }
};

} // namespace wisp
