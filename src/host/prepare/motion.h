// Positions at a time: key frames, placements, the camera, lights. Times and lengths are those of the file.
#pragma once
#include "host/scene/scene_file.h"
#include "host/scene/scene_graph.h"

namespace wisp {

// p' = axis[0] p.x + axis[1] p.y + axis[2] p.z + origin.
struct Matrix {
    Double3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, origin = {0, 0, 0};
};
Matrix operator*(const Matrix &a, const Matrix &b); // b first
Double3 transform_point(const Matrix &m, const Double3 &p);
Double3 transform_vector(const Matrix &m, const Double3 &v);

// The position or scale of a track that has keys. The curve runs from the second key to the last but one; before and
// after, it is constant.
Double3 value_at(const std::vector<Key> &track, double time);
// The rotation of a track, likewise.
Matrix rotation_at(const std::vector<Key> &track, double time);

// The first key of a rotation that is half a turn or more from the key before it, as they are written: from there the
// rotation is the other way round, the shorter one, and uneven. 0: there is none.
size_t key_after_half_turn(const std::vector<Key> &track);

Matrix placement_matrix(const Placement &placement);
Matrix motion_matrix(const Motion &motion, double time);
// Whether the motion shows its node; a node around it may hide it.
bool is_visible(const Motion &motion, double time);

// `k NAME`, or nullptr.
const Motion *find_motion(const SceneGraph &graph, const std::string &name);

// The view moved by the motion `camera`, where there is one. Its `at` is then one unit before the eye, or at the
// distance of view.at if the motion has no rotation.
SceneFile::View view_at(const SceneFile::View &view, const SceneGraph &graph, double time);
// The position of a light that the motion `name` moves, and that is at `position` without it.
Double3 light_position_at(const Double3 &position, const std::string &name, const SceneGraph &graph, double time);

// The time of a frame, 0 <= frame < count; of a single frame it is `start`.
double time_of_frame(double start, double end, int64_t count, int64_t frame);

} // namespace wisp
