// Spheres, cones and polygons as triangles. The meshes are in the space of the world (node -1), with material 0 and no
// texture. Coordinates and radii are finite.
#pragma once
#include "host/scene/scene_graph.h"

namespace wisp {

// A fine sphere: 720 triangles with the volume of the sphere, so that the mean error is about 0. Corners lie 0.51 % of
// the radius outside, centres of triangles at most 0.24 % inside. A coarse sphere: 180 triangles, with four times the
// error. Normals are the sphere's own. The radius is not 0; its sign is ignored.
Mesh sphere_mesh(const Double3 &center, double radius, bool fine);
// How far the triangles of a sphere of radius 1 reach into it and out of it.
struct SphereError {
    double inside, outside;
};
SphereError sphere_error(bool fine);
constexpr size_t sphere_triangles(bool fine) { return fine ? 720 : 180; }

// A cone without caps; a cylinder where the radii are equal. One radius may be 0; signs are ignored. Its cross-section
// is a polygon of 32 sides with the area of the circle: corners lie 0.33 % of the radius outside, centres of sides 0.17
// % inside. Normals are the cone's own; at the tip each side has the normal of its centre. A cone without height, or
// with two radii of 0, has no rows.
Mesh cone_mesh(const Double3 &base, double base_radius, const Double3 &apex, double apex_radius);

// A polygon, planar up to rounding, possibly concave. `normals`: none, or one for each point. The triangles cover
// exactly the polygon, have its orientation, and use all points but repeated ones and spikes. An outline that crosses
// itself gives some triangles; an outline without area gives none. The time grows with the square of the number of
// points: throws std::invalid_argument above max_polygon_points.
Mesh polygon_mesh(const std::vector<Double3> &points, const std::vector<Double3> &normals);

// Whether edges of the outline of a polygon with an area cross by more than 2^-16 of its size. By less they may cross
// where an outline touches itself, and its points are rounded to the digits of a file.
bool crosses_itself(const std::vector<Double3> &points);
constexpr size_t max_polygon_points = 16384;

} // namespace wisp
