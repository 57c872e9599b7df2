// What stands in blocks `xs`, in the space of the world. Of what moves, motion.h knows the place.
#pragma once
#include "host/base/double3.h"
#include "host/scene/scene_graph.h"

namespace wisp {

// The direction alone, of the same length: scales are left out.
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

// By how much lengths grow; all scales are uniform and above 0.
inline double scale_in_world(const std::vector<Node> &nodes, int32_t node) {
    double scale = 1;
    for (; node >= 0; node = nodes[static_cast<size_t>(node)].parent)
        scale *= nodes[static_cast<size_t>(node)].placement.scale.x;
    return scale;
}

} // namespace wisp
