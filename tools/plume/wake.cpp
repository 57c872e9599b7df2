// wake: smoke that rises around moving balls, for fixtures/wake.aff.
//
//   wake SCENE -o FILE_%04d.vtk     one file a frame of the scene's animation
//
// The balls are the scene's bodies `ball`, `ball2`, ... that key frames move; each has the radius of BALLS below.
// The air rises evenly, swirls, and flows around each ball as an ideal fluid does (a dipole), so that no particle
// enters one. Particles are born on the floor in a small disc, `rate` of them a step. Double, + - * / sqrt and the
// project's own sine alone: the same options give the same bytes on every machine.
#include "core/numbers/elementary.h"
#include "core/numbers/random.h"
#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/prepare/motion.h"
#include "host/prepare/prepare.h"
#include "host/base/messages.h"
#include "host/base/text.h"
#include "vtk_writer.h"
#include <cstdio>
#include <string>
#include <vector>

namespace wisp {
namespace {

struct Ball {
    const char *name;
    double radius;
    Double3 center, velocity;
};
Ball balls[] = {{"ball", 0.45, {}, {}}, {"ball2", 0.36, {}, {}}};

constexpr double step = 1.0 / 48, warm_up = 5; // seconds
constexpr int rate = 28;                       // particles a step
constexpr double rise = 0.6, swirl = 0.42, life = 4.6;

struct Particle {
    Double3 at;
    double age;
};

double sine(double turns) {
    double s, c;
    sincos_turns(turns, s, c);
    return s;
}

// A divergence-free eddy: each component depends on the other coordinates alone.
Double3 eddies(const Double3 &p, double time) {
    const auto wave = [time](double a, double b, double speed) {
        return sine(0.55 * a + 0.31 * speed * time) * sine(0.47 * b - 0.23 * speed * time + 0.17) +
               0.5 * sine(1.3 * a - 0.41 * time) * sine(1.1 * b + 0.37 * speed * time);
    };
    return {wave(p.y, p.z, 1), 0.5 * wave(p.z, p.x, 0.7), wave(p.x, p.y, 1.3)};
}

Double3 air_at(const Double3 &p, double time) {
    const double calm = p.y < 0.6 ? p.y / 0.6 : 1; // near the floor
    Double3 v = Double3{0, rise, 0} + eddies(p, time) * (swirl * calm);
    for (const Ball &ball : balls) {
        const Double3 way = p - ball.center, past = v - ball.velocity;
        const double r = std::max(length(way), ball.radius);
        const Double3 n = way * (1 / std::max(length(way), 1e-9));
        const double share = ball.radius * ball.radius * ball.radius / (r * r * r);
        v = v + (past - n * (3 * dot(past, n))) * (0.5 * share);
    }
    return v;
}

Bytes vtk_bytes(const std::vector<Particle> &smoke) {
    Bytes bytes = vtk_head("wisp wake", smoke.size());
    for (const Particle &particle : smoke) append_position(bytes, particle.at);
    append(bytes, std::string("\n"));
    return bytes;
}

void simulate(const std::string &scene, const std::string &output) {
    const SceneFile file = read_scene(scene);
    if (!file.animation)
        throw InputError(scene + ":1", "there is no animation, expected a statement 'a START END FRAMES'");
    for (const Ball &ball : balls)
        if (!find_motion(file.graph, ball.name))
            throw InputError(scene + ":1", std::string("nothing moves '") + ball.name + "', expected key frames for it");
    const Options options;
    Mt19937 random(1, 0, 0, 0);
    const auto number = [&random] { return random() * 0x1p-32; };
    std::vector<Particle> smoke;
    double time = file.animation->start - warm_up;
    for (int64_t frame = 0; frame < frame_count_of(file, options); ++frame)
        for (const double until = time_of(file, options, frame);; time += step) {
            if (!(time < until - 0.5 * step)) {
                write_file(numbered(output, frame), vtk_bytes(smoke));
                break;
            }
            for (Ball &ball : balls) {
                const Motion &motion = *find_motion(file.graph, ball.name);
                ball.center = value_at(motion.translation, time);
                ball.velocity = (value_at(motion.translation, time + step) - ball.center) * (1 / step);
            }
            for (int i = 0; i < rate;) {
                const double x = 2 * number() - 1, z = 2 * number() - 1, later = number();
                if (x * x + z * z > 1) continue;
                smoke.push_back({{0.24 * x, 0.02 + rise * step * later, 0.24 * z}, 0});
                ++i;
            }
            std::vector<Particle> alive;
            for (const Particle &particle : smoke) {
                const Double3 half = particle.at + air_at(particle.at, time) * (0.5 * step);
                Double3 next = particle.at + air_at(half, time + 0.5 * step) * step;
                for (const Ball &ball : balls) { // rounding of the steps
                    const Double3 way = next - ball.center;
                    const double r = length(way);
                    if (r < ball.radius * 1.02 && r > 0) next = ball.center + way * (ball.radius * 1.02 / r);
                }
                if (particle.age + step < life) alive.push_back({next, particle.age + step});
            }
            smoke.swap(alive);
        }
}

} // namespace
} // namespace wisp

int main(int count, char **words) {
    try {
        if (count != 4 || std::string(words[2]) != "-o")
            throw wisp::Error(wisp::exit_usage, "expected: wake SCENE -o FILE_%04d.vtk");
        wisp::simulate(words[1], words[3]);
        return wisp::exit_done;
    } catch (const wisp::Error &error) {
        wisp::print_error(error, "wake");
        return error.status;
    }
}
