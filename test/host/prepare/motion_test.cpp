// Key frames against published samples, closed forms, and a second implementation written out differently.
#include "host/base/double3_algebra.h"
#include "host/prepare/motion.h"
#include "support/data.h"
#include "support/random_input.h"
#include "support/worst.h"
#include <complex>
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <sstream>

using namespace wisp;

namespace {

constexpr double pi = 3.14159265358979323846;

using Track = std::vector<Key>;

Key at(double time, const Double3 &value) { return {time, value, 0, 0, 0, 0}; }
Key turn(double time, double degrees, const Double3 &axis = {0, 0, 1}) { return {time, axis, degrees, 0, 0, 0}; }

double distance(const Double3 &a, const Double3 &b) { return length(a - b); }
double distance(const Matrix &a, const Matrix &b) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += distance(a.axis[i], b.axis[i]);
    return sum + distance(a.origin, b.origin);
}

Matrix rotation_of(const Key &key) {
    Placement p;
    p.axis = key.value;
    p.degrees = key.degrees;
    return placement_matrix(p);
}

// How far a matrix is from a rotation: axes of unit length, at right angles, right-handed. NaN if it has any.
double not_a_rotation(const Matrix &m) {
    double sum = distance(cross(m.axis[0], m.axis[1]), m.axis[2]);
    for (int i = 0; i < 3; ++i)
        sum += std::fabs(dot(m.axis[i], m.axis[i]) - 1) + std::fabs(dot(m.axis[i], m.axis[(i + 1) % 3]));
    return sum;
}
double from_identity(const Matrix &m) { return distance(m, Matrix()); }

Double3 random_axis(Random &random) {
    return unit({random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)});
}

// Keys at uneven, ascending times.
Track random_track(Random &random, size_t keys, double shape) {
    Track track;
    double time = random.between(-5, 5);
    for (size_t i = 0; i < keys; ++i) {
        time += random.between(0.1, 3);
        track.push_back({time,
                         {random.between(-9, 9), random.between(-9, 9), random.between(-9, 9)},
                         0,
                         random.between(-shape, shape),
                         random.between(-shape, shape),
                         random.between(-shape, shape)});
    }
    return track;
}
Track random_turns(Random &random, size_t keys, double shape) {
    Track track = random_track(random, keys, shape);
    for (Key &key : track) {
        key.value = random_axis(random);
        key.degrees = random.between(-800, 800);
    }
    return track;
}

// ---- The second implementation: derivatives by time, Bezier points and de Casteljau's lines; unitary 2 x 2 matrices.

size_t second_segment(const Track &track, double &time) {
    const size_t n = track.size();
    time = std::min(std::max(time, track[1].time), track[n - 2].time);
    size_t i = 1;
    while (i + 3 < n && track[i + 1].time <= time) ++i;
    return i;
}

// How much of the slopes before and behind key i is in the velocity at its departure (arrival: continuity the other
// way round), for uneven times.
struct Share {
    double before, behind;
};
Share second_share(const Track &track, size_t i, bool arrival) {
    const double tension = 1 - track[i].tension, c = arrival ? -track[i].continuity : track[i].continuity;
    const double whole = track[i + 1].time - track[i - 1].time;
    return {tension * (1 + c) * (1 + track[i].bias) / whole, tension * (1 - c) * (1 - track[i].bias) / whole};
}

Double3 second_value(const Track &track, double time) {
    const size_t i = second_segment(track, time);
    const double width = track[i + 1].time - track[i].time;
    const auto step = [&track](size_t k) { return track[k + 1].value - track[k].value; };
    const Share s0 = second_share(track, i, false), s1 = second_share(track, i + 1, true);
    Double3 p[4] = {track[i].value, track[i].value + (step(i - 1) * s0.before + step(i) * s0.behind) * (width / 3),
                    track[i + 1].value - (step(i) * s1.before + step(i + 1) * s1.behind) * (width / 3),
                    track[i + 1].value};
    const double u = (time - track[i].time) / width;
    for (int left = 3; left > 0; --left)
        for (int k = 0; k < left; ++k) p[k] = p[k] * (1 - u) + p[k + 1] * u;
    return p[0];
}

// A quaternion w x y z as a matrix with the rows (a, b), (-conj b, conj a): a = w + iz, b = -y + ix.
struct Unitary {
    std::complex<double> a, b;
};
Unitary operator*(const Unitary &l, const Unitary &r) {
    return {l.a * r.a - l.b * std::conj(r.b), l.a * r.b + l.b * std::conj(r.a)};
}
Unitary inverse(const Unitary &u) { return {std::conj(u.a), -u.b}; }
Unitary negative(const Unitary &u) { return {-u.a, -u.b}; }
double half_trace(const Unitary &u) { return u.a.real(); }
Double3 second_log(const Unitary &u) {
    const Double3 v = {u.b.imag(), -u.b.real(), u.a.imag()};
    const double angle = std::atan2(std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z), u.a.real());
    return std::sin(angle) < 1e-3 ? v : v * (angle / std::sin(angle));
}
Unitary second_exp(const Double3 &v) {
    const double angle = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
    const double s = angle > 0 ? std::sin(angle) / angle : 1;
    return {{std::cos(angle), s * v.z}, {-s * v.y, s * v.x}};
}
Unitary second_between(double t, const Unitary &from, const Unitary &to) {
    const Unitary way = inverse(from) * to;
    return std::sin(std::acos(half_trace(way))) < 1e-3 ? from : from * second_exp(second_log(way) * t);
}

Matrix second_rotation(const Track &track, double time) {
    const size_t i = second_segment(track, time);
    std::vector<Unitary> raw, q;
    for (const Key &key : track) raw.push_back(second_exp(key.value * (key.degrees * (pi / 360))));
    q = raw;
    for (size_t k = 2; k <= i + 1; ++k)
        if (half_trace(inverse(q[k - 1]) * q[k]) < 0) q[k] = negative(q[k]);
    const double width = track[i + 1].time - track[i].time, u = (time - track[i].time) / width;
    const Share s0 = second_share(track, i, false), s1 = second_share(track, i + 1, true);
    const Double3 before = second_log(inverse(q[i - 1]) * q[i]), along = second_log(inverse(q[i]) * q[i + 1]),
                  behind = second_log(inverse(q[i + 1]) * raw[i + 2]);
    const Double3 out = (before * s0.before + along * s0.behind) * width,
                  in = (along * s1.before + behind * s1.behind) * width;
    const Unitary chord = second_between(u, q[i], q[i + 1]),
                  arc = second_between(u, q[i] * second_exp((out - along) * 0.5),
                                       q[i + 1] * second_exp((along - in) * 0.5));
    const Unitary r = second_between(2 * u * (1 - u), chord, arc);
    // How it turns the axes: u -> r u r^-1 of the matrices without trace.
    Matrix m;
    for (int k = 0; k < 3; ++k) {
        const Unitary axis = {{0, double(k == 2)}, {-double(k == 1), double(k == 0)}}, turned = r * axis * inverse(r);
        m.axis[k] = {turned.b.imag(), -turned.b.real(), turned.a.imag()};
    }
    return m;
}

// ---- Files of others

// All `k NAME { ... }` in the files of a folder. The samples were made from angles of nine digits: of 10,000 degrees in
// the file the last one or two are lost.
std::map<std::string, Motion> motions_in(const std::filesystem::path &folder) {
    std::map<std::string, Motion> motions;
    for (const auto &entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".aff") continue;
        std::ifstream file(entry.path());
        std::stringstream words;
        for (std::string line; std::getline(file, line);) words << line.substr(0, line.find_first_of("#%")) << '\n';
        for (std::string word; words >> word;) {
            if (word != "k") continue;
            std::string name, kind;
            words >> name >> kind; // kind: `{`
            Motion &motion = motions[name] = Motion();
            while (words >> kind && kind != "}") {
                REQUIRE((kind == "transl" || kind == "rot" || kind == "scale"));
                Track &track = kind == "transl" ? motion.translation : kind == "rot" ? motion.rotation : motion.scale;
                size_t keys = 0;
                words >> keys;
                for (Key key = {}; keys > 0; --keys) {
                    words >> key.time >> key.value.x >> key.value.y >> key.value.z;
                    if (kind == "rot") {
                        words >> key.degrees;
                        char digits[32];
                        std::snprintf(digits, sizeof digits, "%.9g", key.degrees);
                        key.degrees = std::atof(digits);
                        key.value = unit(key.value);
                    }
                    words >> key.tension >> key.continuity >> key.bias;
                    track.push_back(key);
                }
            }
        }
    }
    return motions;
}

} // namespace

TEST_CASE("motion: every published sample of a real scene's key frames") {
    WISP_NEEDS_DATA("../reference/keyframes_kitchen.txt");
    WISP_NEEDS_DATA("bart/kitchen");
    const std::filesystem::path samples = data_path("../reference/keyframes_kitchen.txt"),
                                scene = data_path("bart/kitchen");
    std::map<std::string, Motion> motions = motions_in(scene);
    std::ifstream file(samples);
    size_t count = 0;
    double largest_error = 0;
    for (std::string line; std::getline(file, line); ++count) {
        std::istringstream words(line);
        std::string name, kind;
        double printed, expected[9];
        words >> name >> kind >> printed;
        const Motion &motion = motions.at(name);
        // 800 frames of `a 0 20 800`, whose times are printed with six digits.
        const double time = time_of_frame(0, 20, 800, static_cast<int64_t>(count % 800));
        REQUIRE(std::fabs(time - printed) < 1e-6);
        std::vector<double> found;
        if (kind == "rot") {
            const Matrix m = rotation_at(motion.rotation, time);
            for (const double Double3::*row : {&Double3::x, &Double3::y, &Double3::z})
                for (const Double3 &axis : m.axis) found.push_back(axis.*row);
        } else {
            const Double3 v = value_at(kind == "transl" ? motion.translation : motion.scale, time);
            found = {v.x, v.y, v.z};
        }
        for (size_t i = 0; i < found.size(); ++i) {
            REQUIRE((words >> expected[i]));
            largest_error = worst_of(largest_error, std::fabs(found[i] - expected[i]));
        }
    }
    CHECK(count == 7200);
    CHECK(largest_error < 6e-9); // printed with nine digits, below 10
}

TEST_CASE("motion: a real scene's traps of time, by both implementations") {
    WISP_NEEDS_DATA("bart/robots");
    const std::filesystem::path scene = data_path("bart/robots");
    size_t tracks = 0;
    double value_error = 0, rotation_error = 0;
    for (const auto &[name, motion] : motions_in(scene)) {
        tracks += !motion.rotation.empty() + !motion.translation.empty();
        for (int64_t frame = 0; frame < 800; ++frame) {
            const double time = time_of_frame(0, 50, 800, frame);
            if (!motion.translation.empty())
                value_error = worst_of(
                    value_error, distance(value_at(motion.translation, time), second_value(motion.translation, time)));
            if (!motion.rotation.empty()) {
                REQUIRE(not_a_rotation(rotation_at(motion.rotation, time)) < 1e-12);
                rotation_error = worst_of(rotation_error, distance(rotation_at(motion.rotation, time),
                                                                   second_rotation(motion.rotation, time)));
            }
        }
    }
    CHECK(tracks == 189);
    CHECK(value_error < 1e-11);
    CHECK(rotation_error < 1e-10);
}

TEST_CASE("motion: a second implementation on random tracks") {
    Random random;
    double value_error = 0, rotation_error = 0;
    for (int round = 0; round < 300; ++round) {
        const size_t keys = 4 + random.bits() % 8;
        const Track track = random_track(random, keys, 1.5), turns = random_turns(random, keys, 1.5);
        for (int sample = 0; sample < 40; ++sample) {
            const double a = random.between(track[0].time - 1, track.back().time + 1),
                         b = random.between(turns[0].time - 1, turns.back().time + 1);
            value_error = worst_of(value_error, distance(value_at(track, a), second_value(track, a)));
            rotation_error = worst_of(rotation_error, distance(rotation_at(turns, b), second_rotation(turns, b)));
        }
    }
    // Values up to 100 with some 20 roundings; the shortest arc that is divided by its sine, 1e-3, costs three digits.
    CHECK(value_error < 1e-12);
    CHECK(rotation_error < 1e-11);
}

TEST_CASE("motion: one segment worked out by hand") {
    // Segment of length 2 between ones of 1 and 3: adj0 = 4/3, adj1 = 4/5. Differences 1, 6, 2.
    Track track = {at(0, {0, 0, 0}), at(1, {1, 0, 0}), at(3, {7, 0, 0}), at(6, {9, 0, 0})};
    // Tout = 2/3 (6 + 1) = 14/3, Tin = 2/5 (2 + 6) = 16/5; in the middle 4 + (Tout - Tin) / 8.
    CHECK(value_at(track, 2).x == doctest::Approx(4 + (14.0 / 3 - 16.0 / 5) / 8).epsilon(1e-15));
    track[1].tension = 0.5; // halves Tout
    CHECK(value_at(track, 2).x == doctest::Approx(4 + (7.0 / 3 - 16.0 / 5) / 8).epsilon(1e-15));
    track[1].tension = 0;
    track[1].bias = 0.5; // 1/2 of what is behind, 3/2 of what is before
    CHECK(value_at(track, 2).x == doctest::Approx(4 + (2.0 / 3 * (3 + 1.5) - 16.0 / 5) / 8).epsilon(1e-15));
    track[1].bias = 0;
    track[2].continuity = 0.5; // 3/2 of what is behind, 1/2 of what is before
    CHECK(value_at(track, 2).x == doctest::Approx(4 + (14.0 / 3 - 2.0 / 5 * (3 + 3)) / 8).epsilon(1e-15));
}

TEST_CASE("motion: steady motion stays steady at uneven times") {
    Track track, turns;
    const Double3 axis = unit({1, -2, 0.5});
    for (double t : {-1.0, 0.0, 0.25, 1.5, 2.0, 4.5, 5.0}) {
        track.push_back(at(t, {3 * t - 1, -t, 0}));
        turns.push_back(turn(t, 50 * t + 7, axis));
    }
    for (double t = 0; t <= 4.5; t += 0.0625) {
        CHECK(distance(value_at(track, t), {3 * t - 1, -t, 0}) < 1e-14);
        CHECK(distance(rotation_at(turns, t), rotation_of(turn(t, 50 * t + 7, axis))) < 1e-12);
    }
}

TEST_CASE("motion: keys are met, curves are smooth there, and end where they are clamped") {
    Random random;
    for (int round = 0; round < 100; ++round) {
        const size_t keys = 4 + random.bits() % 6;
        const Track track = random_track(random, keys, 0), turns = random_turns(random, keys, 0),
                    shaped = random_track(random, keys, 1), shaped_turns = random_turns(random, keys, 1);
        for (size_t i = 1; i + 1 < keys; ++i) {
            CHECK(distance(value_at(track, track[i].time), track[i].value) < 1e-14);
            CHECK(distance(value_at(shaped, shaped[i].time), shaped[i].value) < 1e-14);
            CHECK(distance(rotation_at(turns, turns[i].time), rotation_of(turns[i])) < 1e-12);
            CHECK(distance(rotation_at(shaped_turns, shaped_turns[i].time), rotation_of(shaped_turns[i])) < 1e-12);
        }
        for (size_t i = 2; i + 2 < keys; ++i) {
            // Continuous whatever the shape: speeds are below 1e4 a unit of time.
            const double h = 1e-7, t = shaped_turns[i].time;
            CHECK(distance(value_at(shaped, shaped[i].time - h), shaped[i].value) < 1e4 * h);
            CHECK(distance(rotation_at(shaped_turns, t - h), rotation_of(shaped_turns[i])) < 1e4 * h);
            // Without continuity or bias the velocities before and behind are equal, up to h times the acceleration.
            const double time = track[i].time;
            const Double3 before = (track[i].value - value_at(track, time - h)) * (1 / h),
                          behind = (value_at(track, time + h) - track[i].value) * (1 / h);
            CHECK(distance(before, behind) < 1e-2);
        }
        for (double beyond : {0.0, 1e-9, 1.0, 1e30}) {
            CHECK(distance(value_at(shaped, shaped[1].time - beyond), shaped[1].value) < 1e-14);
            CHECK(distance(value_at(shaped, shaped[keys - 2].time + beyond), shaped[keys - 2].value) < 1e-14);
            CHECK(distance(rotation_at(shaped_turns, shaped_turns[1].time - beyond), rotation_of(shaped_turns[1])) <
                  1e-12);
            CHECK(distance(rotation_at(shaped_turns, shaped_turns[keys - 2].time + beyond),
                           rotation_of(shaped_turns[keys - 2])) < 1e-12);
        }
    }
}

TEST_CASE("motion: four keys have one segment, and the outer ones shape it only") {
    Track track = {at(0, {5, 0, 0}), at(1, {1, 2, 3}), at(2, {4, 5, 6}), at(3, {-7, 0, 0})};
    CHECK(distance(value_at(track, 0), {1, 2, 3}) == 0);
    CHECK(distance(value_at(track, 3), {4, 5, 6}) == 0);
    const Double3 middle = value_at(track, 1.5);
    track[0].value.x += 8; // Tout.x changes by -8 / 2, u (1 - u)^2 = 1/8
    CHECK(value_at(track, 1.5).x == doctest::Approx(middle.x - 0.5).epsilon(1e-14));
    CHECK(value_at(track, 1.5).y == middle.y);
}

TEST_CASE("motion: whole turns between keys vanish") {
    const Double3 axis = unit({1, 2, 3});
    const Track still = {turn(0, 0, axis), turn(1, 0, axis), turn(2, 8640, axis), turn(3, 8640, axis)},
                quarter = {turn(0, 0, axis), turn(1, 0, axis), turn(2, 90, axis), turn(3, 180, axis)};
    Track once = quarter, often = quarter;
    once[2].degrees += 360;
    for (size_t i : {1, 2, 3}) often[i].degrees += 720000 * static_cast<double>(i);
    for (double t = -1; t < 4; t += 0.03125) {
        CHECK(from_identity(rotation_at(still, t)) < 1e-12);
        CHECK(distance(rotation_at(once, t), rotation_at(quarter, t)) < 1e-12);
        CHECK(distance(rotation_at(often, t), rotation_at(quarter, t)) < 1e-10); // 1e6 degrees have ten digits behind
    }
    // A quarter turn, not three quarters of one: the shorter way.
    const Track back = {turn(0, 0), turn(1, 0), turn(2, 300), turn(3, 300)};
    CHECK(distance(rotation_at(back, 1.5), rotation_of(turn(0, -30))) < 1e-12);
}

TEST_CASE("motion: rotations are rotations at any time") {
    Random random;
    double largest_error = 0;
    for (int round = 0; round < 200; ++round) {
        Track track = random_turns(random, 4 + random.bits() % 9, 3);
        for (Key &key : track)
            if (random.bits() % 3 == 0) key.degrees = random.with_exponent(-40, 60);
        for (int sample = 0; sample < 50; ++sample)
            largest_error = worst_of(
                largest_error, not_a_rotation(rotation_at(track, random.between(track[0].time, track.back().time))));
    }
    CHECK(largest_error < 1e-12);
}

TEST_CASE("motion: keys that share times are passed over") {
    // Equal first, interior and last times, with values on either side that must not be mixed.
    const Track track = {at(0, {9, 0, 0}), at(0, {0, 0, 0}), at(1, {1, 0, 0}), at(1, {5, 0, 0}),
                         at(1, {6, 0, 0}), at(2, {7, 0, 0}), at(2, {-9, 0, 0})};
    CHECK(value_at(track, -1).x == 0);
    CHECK(value_at(track, 0).x == 0);
    CHECK(value_at(track, 1 - 1e-12).x == doctest::Approx(1).epsilon(1e-9));
    CHECK(value_at(track, 1).x == 6);
    CHECK(value_at(track, 2).x == 7);
    CHECK(value_at(track, 3).x == 7);
    // All at the same time: what is before wins.
    const Track instant = {at(1, {1, 0, 0}), at(1, {2, 0, 0}), at(1, {3, 0, 0}), at(1, {4, 0, 0})};
    for (double t : {0.0, 1.0}) CHECK(value_at(instant, t).x == 2);
    CHECK(value_at(instant, 2).x == 3);
    const Track instant_turn = {turn(1, 10), turn(1, 20), turn(1, 30), turn(1, 40)};
    CHECK(distance(rotation_at(instant_turn, 1), rotation_of(turn(0, 20))) < 1e-12);
    CHECK(distance(rotation_at(instant_turn, 2), rotation_of(turn(0, 30))) < 1e-12);
    // A motion that begins with a key twice, at one time: the tangent is that of the segment alone.
    const Track begin = {at(0, {0, 0, 0}), at(0, {0, 0, 0}), at(2, {4, 0, 0}), at(4, {4, 0, 0})};
    // adj0 = 2, Tout = 4; adj1 = 1, Tin = 2; in the middle 2 + (4 - 2) / 8.
    CHECK(value_at(begin, 1).x == doctest::Approx(2.25).epsilon(1e-15));
}

TEST_CASE("motion: a segment backwards in time is passed over") {
    const Track track = {at(0, {0, 0, 0}),    at(1, {1, 0, 0}),    at(3, {3, 0, 0}),  at(2, {30, 0, 0}),
                         at(2.5, {40, 0, 0}), at(3.5, {50, 0, 0}), at(4, {60, 0, 0}), at(5, {70, 0, 0})};
    CHECK(value_at(track, 1).x == 1);
    CHECK(value_at(track, 3 - 1e-12).x == doctest::Approx(3).epsilon(1e-9));
    // At 3 the segment from 2.5 to 3.5 is the first that ends later; its keys before and behind are at 2 and 4.
    const Track alone = {track[3], track[4], track[5], track[6]};
    for (double t : {3.0, 3.25, 3.4999}) CHECK(distance(value_at(track, t), value_at(alone, t)) < 1e-13);
    CHECK(value_at(track, 4).x == 60);
    // Neighbours of a segment at one time: there is no ratio of times, and the tangent stays finite.
    const Track loop = {at(2, {0, 0, 0}), at(1, {1, 0, 0}), at(2, {2, 0, 0}), at(1, {3, 0, 0})};
    for (double t = 0; t < 3; t += 0.125) CHECK(std::fabs(value_at(loop, t).x) < 10);
}

TEST_CASE("motion: whatever the keys, values are finite and rotations are rotations") {
    Random random;
    const double times[] = {-1e30, -1, 0, 0, 1, 1, 1 + 0x1p-52, 2, 1e-30, 1e30};
    const double numbers[] = {0, 0, 1, -1, 0.5, 1e30, -1e30, 1e-30};
    const double angles[] = {0, 180, 360, -360, 8640, 359.9999, 180.0001, 1e30, 1e-30, 90};
    const auto any = [&random](const auto &list) { return list[random.bits() % std::size(list)]; };
    for (int round = 0; round < 20000; ++round) {
        Track track(4 + random.bits() % 4);
        for (Key &key : track)
            key = {any(times), {any(numbers), any(numbers), any(numbers)}, 0, any(numbers), any(numbers), any(numbers)};
        const double t = round % 2 ? any(times) : random.between(-1, 3);
        const Double3 v = value_at(track, t);
        REQUIRE(std::isfinite(v.x + v.y + v.z));
        for (Key &key : track) {
            key.value = round % 3 ? Double3{0, 0, 1} : random_axis(random);
            key.degrees = any(angles);
        }
        REQUIRE(not_a_rotation(rotation_at(track, t)) < 1e-12);
    }
}

TEST_CASE("motion: placements scale, then turn, then move") {
    Placement p;
    p.scale = {2, 3, 4};
    p.axis = {0, 0, 1};
    p.degrees = 90;
    p.translation = {10, 20, 30};
    const Matrix m = placement_matrix(p);
    CHECK(distance(transform_point(m, {1, 0, 0}), {10, 22, 30}) < 1e-14);
    CHECK(distance(transform_point(m, {0, 1, 0}), {7, 20, 30}) < 1e-14);
    CHECK(distance(transform_point(m, {0, 0, 1}), {10, 20, 34}) < 1e-14);
    CHECK(distance(transform_vector(m, {1, 0, 0}), {0, 2, 0}) < 1e-15);
    p.axis = {0, 0, 0}; // none is needed for no turn
    p.degrees = 0;
    CHECK(distance(transform_point(placement_matrix(p), {1, 1, 1}), {12, 23, 34}) == 0);
    // A third of a turn about the diagonal takes x to y to z.
    Placement third;
    third.axis = unit({1, 1, 1});
    third.degrees = 120;
    CHECK(distance(transform_point(placement_matrix(third), {1, 2, 3}), {3, 1, 2}) < 1e-14);
}

TEST_CASE("motion: T R S of the tracks, each of which may be missing") {
    const auto constant = [](const Double3 &v) { return Track{at(0, v), at(1, v), at(2, v), at(3, v)}; };
    Motion motion;
    CHECK(from_identity(motion_matrix(motion, 1)) == 0);
    motion.scale = constant({2, 3, 4});
    CHECK(distance(transform_point(motion_matrix(motion, 1), {1, 1, 1}), {2, 3, 4}) == 0);
    motion.rotation = {turn(0, 90), turn(1, 90), turn(2, 90), turn(3, 90)};
    CHECK(distance(transform_point(motion_matrix(motion, 1), {1, 1, 1}), {-3, 2, 4}) < 1e-14);
    motion.translation = constant({10, 20, 30});
    CHECK(distance(transform_point(motion_matrix(motion, 1), {1, 1, 1}), {7, 22, 34}) < 1e-14);
}

TEST_CASE("motion: visibility is the last flag so far, and visible before the first") {
    Motion motion;
    CHECK(is_visible(motion, 0));
    motion.visibility = {{1, false}, {2, true}, {2, false}, {3, true}};
    CHECK(is_visible(motion, 0.999));
    CHECK(!is_visible(motion, 1));
    CHECK(!is_visible(motion, 2));
    CHECK(!is_visible(motion, 2.999));
    CHECK(is_visible(motion, 3));
    CHECK(is_visible(motion, 1e30));
}

TEST_CASE("motion: the camera's missing tracks come from the view") {
    SceneFile::View view = {{1, 2, 3}, {1, 2, -7}, {0, 1, 1}, 40, 320, 200};
    SceneGraph graph;
    const auto same = [](const SceneFile::View &a, const SceneFile::View &b) {
        return distance(a.from, b.from) + distance(a.at, b.at) + distance(a.up, b.up);
    };
    CHECK(same(view_at(view, graph, 1.5), view) == 0);
    Motion &camera = graph.motions["camera"];
    CHECK(same(view_at(view, graph, 1.5), view) == 0);

    camera.translation = {at(0, {0, 0, 0}), at(1, {0, 0, 0}), at(2, {10, 0, 0}), at(3, {10, 0, 0})};
    SceneFile::View expected = view;
    expected.from = {5, 0, 0};
    expected.at = {5, 0, -10};
    CHECK(same(view_at(view, graph, 1.5), expected) < 1e-14);

    // A quarter turn about y takes the direction -z to -x, and about x then up to z.
    camera.rotation = {turn(0, 90, {0, 1, 0}), turn(1, 90, {0, 1, 0}), turn(2, 90, {0, 1, 0}), turn(3, 90, {0, 1, 0})};
    expected.at = {4, 0, 0};
    expected.up = {0, 1, 0};
    CHECK(same(view_at(view, graph, 1.5), expected) < 1e-14);
    camera.translation.clear();
    for (Key &key : camera.rotation) key.value = {1, 0, 0};
    expected.from = view.from;
    expected.at = {1, 3, 3};
    expected.up = {0, 0, 1};
    CHECK(same(view_at(view, graph, 1.5), expected) < 1e-14);
    CHECK(view_at(view, graph, 1.5).angle == 40);
    CHECK(view_at(view, graph, 1.5).width == 320);
}

TEST_CASE("motion: a named light is moved by the translation alone") {
    SceneGraph graph;
    CHECK(distance(light_position_at({1, 2, 3}, "lamp", graph, 1.5), {1, 2, 3}) == 0);
    Motion &motion = graph.motions["lamp"];
    motion.rotation = {turn(0, 90), turn(1, 90), turn(2, 90), turn(3, 90)};
    CHECK(distance(light_position_at({1, 2, 3}, "lamp", graph, 1.5), {1, 2, 3}) == 0);
    motion.translation = {at(0, {0, 0, 0}), at(1, {0, 0, 0}), at(2, {10, 0, 0}), at(3, {10, 0, 0})};
    CHECK(distance(light_position_at({1, 2, 3}, "lamp", graph, 1.5), {6, 2, 3}) < 1e-14);
    CHECK(distance(light_position_at({1, 2, 3}, "lamb", graph, 1.5), {1, 2, 3}) == 0);
}

TEST_CASE("motion: frames span the time from the first to the last") {
    CHECK(time_of_frame(-1, 5, 300, 0) == -1);
    CHECK(time_of_frame(-1, 5, 300, 299) == 5);
    CHECK(time_of_frame(-1, 5, 4, 1) == 1);
    CHECK(time_of_frame(-1, 5, 1, 0) == -1);
    CHECK(time_of_frame(3, 3, 7, 5) == 3);
}
