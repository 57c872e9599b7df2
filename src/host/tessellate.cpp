#include "host/tessellate.h"
#include "host/double3.h"
#include <stdexcept>

namespace wisp {

namespace {

Mesh empty_mesh() { return {0, 0, -1, {}, {}, {}, {}}; }

} // namespace

Mesh sphere_mesh(const Double3 &center, double radius) {
    Mesh mesh = empty_mesh();
    const Double3 corners[6] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (const Double3 &c : corners) {
        mesh.positions.push_back(center + c * std::fabs(radius));
        mesh.normals.push_back(c);
    }
    for (uint32_t x : {0u, 1u})
        for (uint32_t y : {2u, 3u})
            for (uint32_t z : {4u, 5u}) mesh.rows.push_back({{x, y, z}, {x, y, z}, {0, 0, 0}});
    return mesh;
}

Mesh cone_mesh(const Double3 &base, double base_radius, const Double3 &apex, double apex_radius) {
    Mesh mesh = empty_mesh();
    const Double3 corners[4] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    for (const Double3 &c : corners) mesh.positions.push_back(base + c * base_radius);
    for (const Double3 &c : corners) mesh.positions.push_back(apex + c * apex_radius);
    for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t next = (i + 1) % 4;
        mesh.rows.push_back({{i, next, next + 4}, {0, 0, 0}, {0, 0, 0}});
        mesh.rows.push_back({{i, next + 4, i + 4}, {0, 0, 0}, {0, 0, 0}});
    }
    return mesh;
}

Mesh polygon_mesh(const std::vector<Double3> &points, const std::vector<Double3> &normals) {
    if (points.size() < 3) throw std::invalid_argument("a polygon needs 3 points");
    Mesh mesh = empty_mesh();
    mesh.positions = points;
    mesh.normals = normals;
    for (uint32_t i = 2; i < points.size(); ++i) mesh.rows.push_back({{0, i - 1, i}, {0, i - 1, i}, {0, 0, 0}});
    return mesh;
}

} // namespace wisp
