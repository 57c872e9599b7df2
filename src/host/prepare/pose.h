// The triangles of a scene graph: what never moves, in the space of the world; what moves as a whole, in a space of its
// own; and at a time, where that is and what the morphs are. All in the units of the file.
#pragma once
#include "host/scene/scene_graph.h"

namespace wisp {

struct Shapes {
    // Those that never move, then those of one body after the other, then one of each morph.
    std::vector<Triangle> triangles;
    uint32_t static_count, instance_triangle_count, deforming_count;
    std::vector<Instance> instances;
    std::vector<int32_t> instance_nodes; // the moving node whose space a body's is
};

// The still and the bodies' triangles; the rest has the size that pose_shapes needs. A node moves where its name has
// a motion with any key, and is a body if triangles are in it and not in a moving node further in. Triangles without
// area stay, with equal or collinear corners. Normals are 0 for all of a triangle's corners or for none; they are 0
// where the file or a transform (a scale of 0) leaves one of them without direction.
//
// Both throw InputError at the scene `name` if there are too many triangles for the core's 4-byte counts, or transforms
// throw any beyond +-1e100.
Shapes make_shapes(const std::string &name, const SceneGraph &graph);

// Fills in the bodies' matrices, whether they are visible, and the morphs' triangles. A body whose matrix has no
// inverse, which has no volume, is not visible; a morph that is not visible has all corners at its first one.
void pose_shapes(const std::string &name, const SceneGraph &graph, double time, Shapes &shapes);

} // namespace wisp
