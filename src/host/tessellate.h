// Spheres, cones and polygons as triangles. They leave node, material and texture to the caller: 0, 0, -1.
#pragma once
#include "host/scene_graph.h"

namespace wisp {

Mesh sphere_mesh(const Double3 &center, double radius); // radius != 0; its sign is ignored
Mesh cone_mesh(const Double3 &base, double base_radius, const Double3 &apex, double apex_radius);
// Normals: none, or one a point. Throws std::invalid_argument for fewer than 3 points; a polygon of no area gives no
// rows.
Mesh polygon_mesh(const std::vector<Double3> &points, const std::vector<Double3> &normals);

} // namespace wisp
