// Spheres, cones and polygons of a file as triangles. The meshes lie in the world, with material 0 and no texture.
// Coordinates and radii are finite.
#pragma once
#include "host/scene/scene_graph.h"

namespace wisp {

// 720 triangles with the volume of the sphere, so that the mean error is about 0: corners lie 0.51 % of the radius
// outside, middles 0.24 % inside at most. Of one that is not fine 180, with four times the error. Normals are the
// sphere's own. The radius is not 0; its sign means nothing.
Mesh sphere_mesh(const Double3 &center, double radius, bool fine);
constexpr size_t sphere_triangles(bool fine) { return fine ? 720 : 180; }

// An open cone without caps, a cylinder where the radii are equal; one may be 0, their signs mean nothing. 32 sides
// with the area of the circle: corners lie 0.33 % of the radius outside, middles 0.17 % inside. Normals are the cone's
// own; at a tip each side has that of its middle. Without height, or with radii of 0, there are no rows.
Mesh cone_mesh(const Double3 &base, double base_radius, const Double3 &apex, double apex_radius);

// A polygon, planar up to rounding, possibly concave; normals: none, or one a point. The triangles are exactly the
// polygon, turn as its outline does and use all points but repeated ones and spikes. An outline that crosses itself
// gives some triangles, one without area no rows. Time grows with the square of the points: throws
// std::invalid_argument above max_polygon_points.
Mesh polygon_mesh(const std::vector<Double3> &points, const std::vector<Double3> &normals);
constexpr size_t max_polygon_points = 16384;

} // namespace wisp
