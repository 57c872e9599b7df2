// Points and directions from the space of a node to the world, for nodes that are all `xs`. prepare/motion.h has the
// moving ones.
#pragma once
#include "host/base/double3_algebra.h"
#include "host/scene/scene_graph.h"

namespace wisp {

// Rotates a direction; scales do not apply.
inline Double3 turned_in_world(const std::vector<Node> &nodes, int32_t node, Double3 direction) {
    for (; node >= 0; node = nodes[static_cast<size_t>(node)].parent) {
        const Placement &place = nodes[static_cast<size_t>(node)].placement;
        direction = rotate(direction, place.axis, place.degrees);
    }
    return direction;
}

inline Double3 placed_in_world(const std::vector<Node> &nodes, int32_t node, Double3 p) {
    for (; node >= 0; node = nodes[static_cast<size_t>(node)].parent) {
        const Placement &place = nodes[static_cast<size_t>(node)].placement;
        const Double3 scaled = {p.x * place.scale.x, p.y * place.scale.y, p.z * place.scale.z};
        p = rotate(scaled, place.axis, place.degrees) + place.translation;
    }
    return p;
}

// The factor of lengths; all scales are uniform and above 0.
inline double scale_in_world(const std::vector<Node> &nodes, int32_t node) {
    double scale = 1;
    for (; node >= 0; node = nodes[static_cast<size_t>(node)].parent)
        scale *= nodes[static_cast<size_t>(node)].placement.scale.x;
    return scale;
}

} // namespace wisp
