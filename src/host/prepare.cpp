// Lengths are divided by a power of two and radiances by another, so that nothing is rounded here but the distance to
// the middle of the smoke, in double; decisions that depend on the arithmetic are the core's.
#include "host/prepare.h"
#include "host/error.h"
#include "host/particles.h"
#include "wisp/elementary.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace wisp {

namespace {

Double3 operator+(const Double3 &a, const Double3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Double3 operator-(const Double3 &a, const Double3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Double3 operator*(const Double3 &a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(const Double3 &a, const Double3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Double3 cross(const Double3 &a, const Double3 &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double largest(const Double3 &a) { return std::max({a.x, a.y, a.z}); }
// a / |a| for any a but 0: its largest component is made 1 first, so that no square underflows.
Double3 unit(const Double3 &a) {
    const double size = std::max({std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)});
    const Double3 b = {a.x / size, a.y / size, a.z / size};
    return b * (1 / std::sqrt(dot(b, b)));
}

// The exponent e with 2^e <= x < 2^(e+1), x > 0.
int exponent_of(double x) {
    int e;
    std::frexp(x, &e);
    return e - 1;
}

// Rodrigues' rotation of p about the axis, then scale and translation: p' = T R S p.
Double3 apply(const SceneFile::Transform &t, const Double3 &p) {
    double sine, cosine;
    sincos_turns(t.degrees / 360, sine, cosine);
    const Double3 scaled = p * t.scale;
    if (t.degrees == 0) return scaled + t.translation;
    const Double3 k = unit(t.axis);
    return scaled * cosine + cross(k, scaled) * sine + k * (dot(k, scaled) * (1 - cosine)) + t.translation;
}

// The particles of one block in the units of the scene, in canonical order.
std::vector<Particle> load(const SceneFile::Smoke &smoke, int64_t frame, std::vector<std::string> &notes) {
    const std::string path = numbered(smoke.file, smoke.first_frame + frame * smoke.frame_step);
    const Particles table = read_particles(path);
    if (table.has_particle_radius)
        notes.push_back(path + ": its particle radii are not smoothing lengths and are not used");
    if (!smoke.radius && table.smoothing_length.empty() && !table.position.empty())
        throw InputError(smoke.where + "no smoothing length, expected a line 'radius H' or an attribute 'h' in " +
                         path);
    if (!smoke.mass && table.mass.empty() && !table.position.empty())
        throw InputError(smoke.where + "no mass, expected a line 'mass M' or an attribute 'mass' in " + path);

    const SceneFile::Transform place = smoke.transform.value_or(SceneFile::Transform());
    std::vector<Particle> particles(table.position.size());
    double farthest = 0, smallest_h = 1e300;
    for (size_t i = 0; i < particles.size(); ++i) {
        const Double3 p = {table.position[i][0], table.position[i][1], table.position[i][2]};
        Particle &particle = particles[i];
        particle.position = smoke.transform ? apply(place, p) : p;
        particle.h = (smoke.radius ? *smoke.radius : table.smoothing_length[i]) * place.scale;
        if (!(particle.h >= 1e-100 && particle.h <= 1e100))
            throw InputError(smoke.where + "a smoothing length is outside 1e-100 to 1e100, expected one within");
        particle.area = smoke.extinction * (smoke.mass ? *smoke.mass : table.mass[i]);
        for (double x : {p.x, p.y, p.z}) farthest = std::max(farthest, std::fabs(x));
        smallest_h = std::min(smallest_h, particle.h);
    }
    // Formats hold float32: positions far from 0 may be coarser than the smoke.
    if (!particles.empty() && farthest * place.scale * 0x1p-24 > 0.01 * smallest_h)
        notes.push_back(path +
                        ": as 32-bit numbers its positions are coarser than a hundredth of the smoothing length");
    std::sort(particles.begin(), particles.end(), [](const Particle &a, const Particle &b) {
        return std::make_tuple(a.position.x, a.position.y, a.position.z, a.h, a.area) <
               std::make_tuple(b.position.x, b.position.y, b.position.z, b.h, b.area);
    });
    return particles;
}

struct Extent {
    Double3 low = {0, 0, 0}, high = {0, 0, 0};
    double smallest_h = 0, largest_h = 0;
    bool any = false;
};

Extent extent_of(const std::vector<std::vector<Particle>> &smokes) {
    Extent e;
    for (const auto &particles : smokes)
        for (const Particle &p : particles) {
            const Double3 &x = p.position;
            e.low = e.any ? Double3{std::min(e.low.x, x.x), std::min(e.low.y, x.y), std::min(e.low.z, x.z)} : x;
            e.high = e.any ? Double3{std::max(e.high.x, x.x), std::max(e.high.y, x.y), std::max(e.high.z, x.z)} : x;
            e.smallest_h = e.any ? std::min(e.smallest_h, p.h) : p.h;
            e.largest_h = std::max(e.largest_h, p.h);
            e.any = true;
        }
    return e;
}

Camera make_camera(const SceneFile::View &view, int width, int height, const Double3 &center, double scale) {
    double sine, cosine;
    sincos_turns(view.angle / 720, sine, cosine);
    // The angle spans the centres of the first and the last row; with one row, the row.
    const double pixel = 2 * sine / cosine / std::max(height - 1, 1);
    const Double3 forward = unit(view.at - view.from), right = unit(cross(forward, view.up)),
                  up = cross(right, forward);
    Camera camera;
    camera.origin = (view.from - center) * scale;
    camera.right = right * pixel;
    camera.down = up * -pixel;
    camera.corner = forward - camera.right * (0.5 * width) - camera.down * (0.5 * height);
    return camera;
}

// The largest irradiance that the light gives to the smoke, or to a point in its middle.
double brightness(const LightSource &light, const Double3 &middle, double radius) {
    const double color = largest(light.color);
    if (light.kind == LightKind::parallel || light.kind == LightKind::constant) return color;
    const Double3 way = light.position - middle;
    const double distance = std::max(std::sqrt(dot(way, way)) - radius, std::max(radius, 1.0) * 0.5);
    return color / (distance * distance);
}

// Refuses what leaves the range of the arithmetic: of float, and of fixed-point numbers, which end at 2^31.
void check_range(const std::string &name, const SceneFile &file, const PreparedScene &prepared, const Extent &extent,
                 const Options &options) {
    if (!extent.any) return;
    const auto refuse = [](const std::string &where, const std::string &what) {
        throw InputError(where + what + ", expected a scene that fits");
    };
    const std::string scene_line = name + ":1: ";
    const bool fixed = options.arithmetic == Arithmetic::fixed;
    const auto distance = [](const Double3 &p) { return std::sqrt(dot(p, p)); };
    double radius = 0, power = 0;
    for (size_t i = 0; i < prepared.smokes.size(); ++i) {
        const std::string &where = file.smokes[i].where;
        for (const Particle &p : prepared.particles[i]) {
            for (double x : {p.position.x, p.position.y, p.position.z})
                if (!(std::fabs(x) <= coordinate_limit))
                    refuse(where, "the smoke is more than " + std::to_string(static_cast<int>(2 * coordinate_limit)) +
                                      " smoothing lengths wide");
            radius = std::max(radius, distance(p.position) + 2 * p.h);
            if (!(p.area <= (fixed ? 0x1p20 : 1e30) * p.h * p.h))
                refuse(where, "a particle's optical depth is too large for this arithmetic");
        }
        const SmokeSource &smoke = prepared.smokes[i];
        power += 4 * 3.15 * largest(smoke.emission) * smoke.total_area;
        if (fixed && smoke.total_area > 0x1p26) refuse(where, "the smoke's cross-section is too large for fixed point");
        if (fixed && smoke.largest_h * options.gather_radius > 0x1p14)
            refuse(where, "the gather radius is too large for fixed point");
    }
    if (distance(prepared.scene.camera.origin) > 0x1p18)
        refuse(scene_line, "the camera is more than 262144 smoothing lengths from the smoke");
    if (fixed && extent.largest_h > 4096 * extent.smallest_h)
        refuse(scene_line, "smoothing lengths differ by more than 4096, too much for fixed point");
    for (const LightSource &light : prepared.lights) {
        const double color = largest(light.color), d = distance(light.position) + radius;
        const bool somewhere = light.kind != LightKind::parallel;
        if (somewhere && d > (fixed ? 0x1p14 : 0x1p18))
            refuse(scene_line, "a light is more than " + std::to_string(fixed ? 16384 : 262144) +
                                   " smoothing lengths from the smoke, too far for this arithmetic");
        power += color * 4 * 3.15 *
                 (light.kind == LightKind::parallel   ? radius * radius
                  : light.kind == LightKind::constant ? d * d
                                                      : 1);
        if (fixed && color > 0x1p30) refuse(scene_line, "a light is too strong for fixed point");
    }
    if (fixed && power > 0x1p30) refuse(scene_line, "the lights' power is too large for fixed point");
}

} // namespace

void prepare_scene(const std::string &name, const SceneFile &file, const Options &options, int64_t frame,
                   PreparedScene &prepared) {
    if (!file.view) throw InputError(name + ":1: there is no view, expected a statement 'v from ...'");
    prepared.width = options.width.value_or(file.view->width);
    prepared.height = options.height.value_or(file.view->height);

    for (const SceneFile::Smoke &smoke : file.smokes) prepared.particles.push_back(load(smoke, frame, prepared.notes));
    const Extent extent = extent_of(prepared.particles);
    const Double3 center = extent.any ? (extent.low + extent.high) * 0.5 : file.view->from;
    const double scale = extent.any ? std::ldexp(1.0, -exponent_of(extent.smallest_h)) : 1;
    const Double3 diagonal = extent.high - extent.low;
    const double radius = (0.5 * std::sqrt(dot(diagonal, diagonal)) + 2 * extent.largest_h) * scale;

    for (size_t i = 0; i < file.smokes.size(); ++i) {
        const SceneFile::Smoke &smoke = file.smokes[i];
        SmokeSource source = {};
        for (Particle &p : prepared.particles[i]) {
            p.position = (p.position - center) * scale;
            p.h *= scale;
            p.area *= scale * scale;
            source.smallest_h = source.largest_h == 0 ? p.h : std::min(source.smallest_h, p.h);
            source.largest_h = std::max(source.largest_h, p.h);
            source.total_area += p.area;
        }
        source.particles = prepared.particles[i].data();
        source.count = static_cast<uint32_t>(prepared.particles[i].size());
        source.kernel = smoke.kernel;
        source.albedo = smoke.albedo;
        source.asymmetry = smoke.phase;
        source.emission = smoke.emission;
        prepared.smokes.push_back(source);
    }

    double brightest = std::max(largest(file.background), 0.0);
    for (const SceneFile::Smoke &smoke : file.smokes) brightest = std::max(brightest, largest(smoke.emission));
    for (const SceneFile::Light &light : file.lights) {
        LightSource source = {light.kind, (light.position - center) * scale, {0, 0, 1}, 2, light.color};
        if (light.kind == LightKind::spot || light.kind == LightKind::parallel)
            source.direction = unit(light.direction);
        if (light.kind == LightKind::spot) {
            double sine, cosine; // 1 - cos x = 2 sin^2(x / 2), x half of the cone's angle
            sincos_turns(light.degrees / 1440, sine, cosine);
            source.one_minus_cosine = 2 * sine * sine;
        }
        if (light.kind == LightKind::point || light.kind == LightKind::spot)
            source.color = light.color * (scale * scale);
        prepared.lights.push_back(source);
        brightest = std::max(brightest, brightness(source, {0, 0, 0}, radius));
    }

    Scene &scene = prepared.scene;
    scene.camera = make_camera(*file.view, prepared.width, prepared.height, center, scale);
    scene.radiance_exponent = brightest > 0 ? exponent_of(brightest) + 1 : 0;
    const double dim = std::ldexp(1.0, -scene.radiance_exponent);
    scene.background = file.background * dim;
    for (SmokeSource &smoke : prepared.smokes) smoke.emission = smoke.emission * dim;
    for (LightSource &light : prepared.lights) light.color = light.color * dim;
    scene.lights = prepared.lights.data();
    scene.light_count = static_cast<uint32_t>(prepared.lights.size());
    scene.smokes = prepared.smokes.data();
    scene.smoke_count = static_cast<uint32_t>(prepared.smokes.size());
    check_range(name, file, prepared, extent, options);
}

} // namespace wisp
