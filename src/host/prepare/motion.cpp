// Curves through keys at uneven times. Positions and scales: the cubics of Kochanek and Bartels, "Interpolating Splines
// with Local Tension, Continuity, and Bias Control", SIGGRAPH 1984. Rotations: squad (Shoemake), with control
// quaternions that give the same tangents. A quaternion does not count whole turns, so a whole turn between two keys is
// no rotation.
#include "host/base/double3_algebra.h"
#include "host/prepare/motion.h"

namespace wisp {

namespace {

constexpr double pi = 3.14159265358979323846;
// Quaternions whose angle has a smaller sine count as equal, and slerp() returns the first.
constexpr double smallest_sine = 1e-3;

// A time within a track: the fraction u from key first + 1 to key first + 2.
struct Segment {
    size_t first;
    double u;
};

// The first segment that ends after the time. This skips segments without length, and those backwards in time.
Segment segment_at(const std::vector<Key> &track, double time) {
    const size_t last = track.size() - 4;
    if (time <= track[1].time) return {0, 0};
    if (time >= track[last + 2].time) return {last, 1};
    size_t i = 0;
    while (time >= track[i + 2].time) ++i;
    const double start = track[i + 1].time;
    return {i, (time - start) / (track[i + 2].time - start)};
}

// The length of the segment on one side of a key over the mean of both sides, which scales the key's tangent: 0 to 2
// where times ascend. Where times do not ascend, it is 2 at most.
double adjustment(double segment, double both) { return std::fabs(segment) < std::fabs(both) ? 2 * segment / both : 2; }

struct Tangents {
    Double3 out, in; // at the start of the segment, and at its end
};

// Tangents of the segment between the second and the third of four keys, from the differences of each key to the next.
Tangents tangents(const Key *k, const Double3 &before, const Double3 &along, const Double3 &behind) {
    const double span = k[2].time - k[1].time;
    const double out = 0.5 * adjustment(span, k[2].time - k[0].time) * (1 - k[1].tension);
    const double in = 0.5 * adjustment(span, k[3].time - k[1].time) * (1 - k[2].tension);
    const double c1 = k[1].continuity, b1 = k[1].bias, c2 = k[2].continuity, b2 = k[2].bias;
    return {along * (out * (1 - c1) * (1 - b1)) + before * (out * (1 + c1) * (1 + b1)),
            behind * (in * (1 + c2) * (1 - b2)) + along * (in * (1 - c2) * (1 + b2))};
}

struct Quaternion {
    double w;
    Double3 v;
};

Quaternion operator*(const Quaternion &a, const Quaternion &b) {
    return {a.w * b.w - dot(a.v, b.v), b.v * a.w + a.v * b.w + cross(a.v, b.v)};
}
Quaternion operator*(const Quaternion &a, double s) { return {a.w * s, a.v * s}; }
Quaternion operator+(const Quaternion &a, const Quaternion &b) { return {a.w + b.w, a.v + b.v}; }
double dot(const Quaternion &a, const Quaternion &b) { return a.w * b.w + dot(a.v, b.v); }

Quaternion quaternion_of(const Key &key) {
    Quaternion q;
    double sine;
    sincos_turns(key.degrees / 720, sine, q.w);
    q.v = key.value * sine;
    return q;
}

// The logarithm of the rotation from a to b, unit quaternions; 0 for a whole turn.
Double3 log_between(const Quaternion &a, const Quaternion &b) {
    const Quaternion q = Quaternion{a.w, a.v * -1} * b;
    const double sine = length(q.v);
    return sine < smallest_sine ? q.v : q.v * (angle_between(sine, q.w) / sine);
}

Quaternion exp(const Double3 &v) {
    const double angle = length(v);
    if (angle == 0) return {1, {0, 0, 0}};
    Quaternion q;
    double sine;
    sincos_turns(angle / (2 * pi), sine, q.w);
    q.v = v * (sine / angle);
    return q;
}

// From a to b without a change of sign, so perhaps along the longer arc.
Quaternion slerp(double t, const Quaternion &a, const Quaternion &b) {
    const double turns = acos(dot(a, b)) / (2 * pi);
    double all, to_a, to_b, unused;
    sincos_turns(turns, all, unused);
    if (all < smallest_sine) return a;
    sincos_turns((1 - t) * turns, to_b, unused);
    sincos_turns(t * turns, to_a, unused);
    return a * (to_b / all) + b * (to_a / all);
}

Matrix matrix_of(Quaternion q) {
    q = q * (1 / std::sqrt(dot(q, q)));
    const double w = q.w, x = q.v.x, y = q.v.y, z = q.v.z;
    Matrix m;
    m.axis[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    m.axis[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    m.axis[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    return m;
}

Matrix compose(const Double3 &translation, const Matrix &rotation, const Double3 &scale) {
    return {{rotation.axis[0] * scale.x, rotation.axis[1] * scale.y, rotation.axis[2] * scale.z}, translation};
}

} // namespace

const Motion *find_motion(const SceneGraph &graph, const std::string &name) {
    const auto found = graph.motions.find(name);
    return found == graph.motions.end() ? nullptr : &found->second;
}

Matrix operator*(const Matrix &a, const Matrix &b) {
    return {{transform_vector(a, b.axis[0]), transform_vector(a, b.axis[1]), transform_vector(a, b.axis[2])},
            transform_point(a, b.origin)};
}

Double3 transform_point(const Matrix &m, const Double3 &p) { return transform_vector(m, p) + m.origin; }

Double3 transform_vector(const Matrix &m, const Double3 &v) {
    return m.axis[0] * v.x + m.axis[1] * v.y + m.axis[2] * v.z;
}

Double3 value_at(const std::vector<Key> &track, double time) {
    const auto [first, u] = segment_at(track, time);
    const Key *k = &track[first];
    const Double3 along = k[2].value - k[1].value;
    const Tangents t = tangents(k, k[1].value - k[0].value, along, k[3].value - k[2].value);
    // Hermite's polynomials as products: tangents of any size leave the keys exact.
    const double v = 1 - u;
    return k[1].value + along * (u * u * (3 - 2 * u)) + t.out * (u * v * v) - t.in * (u * u * v);
}

Matrix rotation_at(const std::vector<Key> &track, double time) {
    const auto [first, u] = segment_at(track, time);
    // Each key from the third on gets the sign that is nearer to the key before it, as in the code of BART. That leaves
    // q3 as it is written, so a segment beside a turn of half a circle has another tangent than its neighbour.
    Quaternion q0 = {}, q1 = quaternion_of(track[0]), q2 = quaternion_of(track[1]);
    for (size_t i = 0; i <= first; ++i) {
        q0 = q1;
        q1 = q2;
        q2 = quaternion_of(track[i + 2]);
        if (dot(q1, q2) < 0) q2 = q2 * -1;
    }
    const Quaternion q3 = quaternion_of(track[first + 3]);
    const Double3 along = log_between(q1, q2);
    const Tangents t = tangents(&track[first], log_between(q0, q1), along, log_between(q2, q3));
    const Quaternion a = q1 * exp((t.out - along) * 0.5), b = q2 * exp((along - t.in) * 0.5);
    return matrix_of(slerp(2 * u * (1 - u), slerp(u, q1, q2), slerp(u, a, b)));
}

size_t key_after_half_turn(const std::vector<Key> &track) {
    for (size_t i = 1; i < track.size(); ++i)
        if (dot(quaternion_of(track[i - 1]), quaternion_of(track[i])) < smallest_sine) return i;
    return 0;
}

Matrix placement_matrix(const Placement &placement) {
    Matrix rotation;
    for (Double3 &axis : rotation.axis) axis = rotate(axis, placement.axis, placement.degrees);
    return compose(placement.translation, rotation, placement.scale);
}

Matrix motion_matrix(const Motion &motion, double time) {
    return compose(motion.translation.empty() ? Double3{0, 0, 0} : value_at(motion.translation, time),
                   motion.rotation.empty() ? Matrix() : rotation_at(motion.rotation, time),
                   motion.scale.empty() ? Double3{1, 1, 1} : value_at(motion.scale, time));
}

bool is_visible(const Motion &motion, double time) {
    bool visible = true;
    for (const Motion::Switch &s : motion.visibility)
        if (s.time <= time) visible = s.visible;
    return visible;
}

SceneFile::View view_at(const SceneFile::View &view, const SceneGraph &graph, double time) {
    const Motion *motion = find_motion(graph, "camera");
    if (!motion) return view;
    SceneFile::View moved = view;
    Double3 forward = view.at - view.from;
    if (!motion->translation.empty()) moved.from = value_at(motion->translation, time);
    if (!motion->rotation.empty()) {
        const Matrix rotation = rotation_at(motion->rotation, time);
        forward = rotation.axis[2] * -1;
        moved.up = rotation.axis[1];
    }
    moved.at = moved.from + forward;
    return moved;
}

Double3 light_position_at(const Double3 &position, const std::string &name, const SceneGraph &graph, double time) {
    const Motion *motion = find_motion(graph, name);
    return motion && !motion->translation.empty() ? position + value_at(motion->translation, time) : position;
}

double time_of_frame(double start, double end, int64_t count, int64_t frame) {
    if (count == 1) return start;
    return start + static_cast<double>(frame) * (end - start) / static_cast<double>(count - 1);
}

} // namespace wisp
