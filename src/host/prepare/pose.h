// The triangles of a scene graph, in the units of the file: static ones in the space of the world, those of each
// instance in its own space, and the deforming ones; and the places of instances and deforming triangles at a time.
#pragma once
#include "host/prepare/core_units.h"
#include "host/scene/scene_graph.h"

namespace wisp {

struct Shapes {
    // Static triangles, then those of one instance after the other, then one for each DeformingTriangle.
    std::vector<Triangle> triangles;
    uint32_t static_count, instance_triangle_count, deforming_count;
    std::vector<Instance> instances;
    std::vector<int32_t> instance_nodes; // of each instance: the moving node whose space it has
};

// Makes the static and the instances' triangles, and room for the rest. A node moves if its name has a motion with any
// key. A moving node is an instance if it contains triangles outside of moving nodes within it. Triangles without area
// stay, with equal or collinear corners. Normals are 0 for all of a triangle's corners or for none; they are 0 where
// the file, or a transform with a scale of 0, leaves one of them without direction.
//
// Both functions throw InputError at the scene `name` if there are too many triangles for the core's 4-byte counts, or
// if a corner is beyond +-1e100.
Shapes make_shapes(const std::string &name, const SceneGraph &graph);

// Sets the instances' matrices and visibility, and the deforming triangles. An instance whose matrix has no inverse has
// no volume and is not visible. A deforming triangle that is not visible has all its corners at the first one.
void pose_shapes(const std::string &name, const SceneGraph &graph, double time, Shapes &shapes);

// A box around all instances and deforming triangles, while they are visible, at the times `start` and `end` and at all
// keys in between of what can take them far: all but rotations.
Extent extent_at_keys(const SceneGraph &graph, const Shapes &shapes, double start, double end);

} // namespace wisp
