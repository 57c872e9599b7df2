// Hard cases E: rays and boxes, the camera, the steps of the march, lights near them. (E1 to E6 and E14 are in
// test/core.)
#include "core/lights/light.h"
#include "host/base/error.h"
#include "support/built_smoke.h"
#include "support/prepared_smoke.h"
#include "support/refusal.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <functional>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// The picture of one pixel: radiance along one ray, whose direction may have any length.
struct Seen {
    double red;
    Statistics statistics;
};
Seen look(Scene scene, const Double3 &from, const Double3 &along, Settings settings = small_settings(1)) {
    scene.camera = {from, along, {0, 0, 0}, {0, 0, 0}};
    const Rendered picture = render_in_memory(scene, settings);
    REQUIRE(picture.status == Status::done);
    for (float value : picture.rgb) REQUIRE((std::isfinite(value) && value >= 0));
    return {picture.rgb[0], picture.statistics};
}

Settings with_step(double step) {
    Settings settings = small_settings(1);
    settings.step = step;
    return settings;
}

// One particle at the origin, h = 1: density 15 / (64 pi) area (2 - r)^3, in a box of +-2.
const std::vector<Particle> at_origin = {{{0, 0, 0}, 1, 1}};
double density_at(double r) { return r < 2 ? 15 / (64 * pi_) * std::pow(2 - r, 3) : 0; }

const LightSource lamp = {LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {1, 1, 1}};

std::string error_of(const std::string &text) {
    return refusal_of([&] { parse_scene("s.aff", text); });
}
const std::string ball = "\nsmoke p.vtk { radius 0.2 mass 1 extinction 0.02 }\n";

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case E7: a ray in a face of a box is inside, whatever the sign of its zeros") {
    const Box box = {vec(-1, -1, -1), vec(1, 1, 1)};
    const auto inside = [&](const Vec3 &origin, const Vec3 &direction) {
        Real begin = Real(0), end = Real(100);
        return clip(box, {origin, direction}, begin, end) ? at(end - begin) : 0.0;
    };
    const Real zeros[] = {Real(0), -Real(0)};
    for (int axis = 0; axis < 3; ++axis)
        for (double side : {-1.0, 1.0})
            for (double wall : {-1.0, 0.0, 1.0})
                for (double other : {-1.0, 0.5, 1.0})
                    for (Real zero : zeros)
                        for (Real other_zero : zeros) {
                            Vec3 origin, direction;
                            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                            direction[axis] = real(side), direction[u] = zero, direction[v] = other_zero;
                            origin[axis] = real(-5 * side), origin[u] = real(wall), origin[v] = real(other);
                            CHECK(inside(origin, direction) == 2); // from outside
                            origin[axis] = real(-side);
                            CHECK(inside(origin, direction) == 2); // from the face that it enters by
                            origin[axis] = Real(0);
                            CHECK(inside(origin, direction) == 1); // from within
                            origin[axis] = real(side);
                            CHECK(inside(origin, direction) == 0); // from the face that it leaves by
                            origin[axis] = real(-5 * side), origin[u] = real(1.01);
                            CHECK(inside(origin, direction) == 0); // beside the face
                        }
    CHECK(inside(vec(5, 5, 5), normalize(vec(-1, -1, -1))) == doctest::Approx(2 * std::sqrt(3.0)));

    // The same in smoke: the particles lie in the ray's planes.
    const std::vector<Particle> flat = {{{-1, 0, 0}, 1, 1}, {{0, 0, 0}, 1, 1}, {{1, 1, 0}, 1, 1}};
    const BuiltField built(smoke_of(flat));
    for (double x : {0.0, 1.0, -3.0, 3.0}) { // 3: on the box's face
        const Real plus = optical_depth(built.field, {vec(x, 0, -5), Vec3(Real(0), Real(0), Real(1))}, Real(10));
        const Real minus = optical_depth(built.field, {vec(x, 0, -5), Vec3(-Real(0), -Real(0), Real(1))}, Real(10));
        CHECK(plus == minus);
        CHECK((plus > Real(0)) == (std::fabs(x) < 3));
        CHECK(at(plus) < 10);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E8: rays that graze the box or leave it behind see the background") {
    const SmokeDescription smoke = smoke_of(at_origin);
    const std::vector<LightSource> lights = {{LightKind::point, {3, 3, 3}, {0, 0, 1}, 2, {9, 9, 9}}};
    Scene scene = scene_of(smoke, lights);
    scene.background = {0.625, 0, 0};
    const struct {
        Double3 from, along;
        bool no_sample;
    } rays[] = {
        {{0, 0, 4}, {1, 0, -1}, true},    // an edge: enters and leaves at the same distance
        {{0, 4, 0}, {0, -1, 1}, true},    //
        {{4, 0, -2}, {-2, 2, 0}, true},   // an edge, along a face
        {{2, 0, 8}, {0, 0, -1}, false},   // a face
        {{2, 2, 8}, {0, 0, -1}, false},   // an edge's whole length
        {{0, 0, 2}, {1, 0, 0}, false},    // starts on a face, along it
        {{0, 0, 2}, {0, 0, 1}, true},     // starts on a face, away from the box
        {{0, 0, 8}, {0, 0, 1}, true},     // the box is behind
        {{0, -100, 1}, {0, -1, 0}, true}, //
        {{2.5, 0, 0}, {0, 1, 1}, true},   // beside
    };
    for (const auto &ray : rays)
        for (double step : {0.5, 100.0}) {
            const Seen seen = look(scene, ray.from, ray.along, with_step(step));
            CAPTURE(ray.from.x);
            CAPTURE(ray.from.z);
            CHECK(seen.red == 0.625);
            if (ray.no_sample) CHECK(seen.statistics.smoke.march_samples == 0);
        }
    const BuiltField built(smoke);
    CHECK(optical_depth(built.field, {vec(0, 0, 4), normalize(vec(1, 0, -1))}, Real(10)) == Real(0));
    CHECK(optical_depth(built.field, {vec(0, 0, 8), vec(0, 0, 1)}, Real(10)) == Real(0));
    CHECK(optical_depth(built.field, {vec(2, 0, 8), vec(0, 0, -1)}, Real(20)) == Real(0));
    CHECK(optical_depth(built.field, {vec(0, 0, 8), vec(0, 0, -1)}, Real(0)) == Real(0));
    CHECK(!first_collision(built.field, {vec(0, 0, 8), vec(0, 0, 1)}, Real(10), photon_event(1, 1)).found);
    CHECK(!first_collision(built.field, {vec(0, 0, 0), vec(0, 0, 1)}, Real(0), photon_event(1, 1)).found);
}

TEST_CASE(WISP_ARITH_NAME ": hard case E9: radiance at a camera inside the smoke is finite and continuous") {
    const auto particles = cloud(300, 3, 1, 0.3);
    const SmokeDescription smoke = smoke_of(particles);
    SmokeDescription black = smoke;
    black.albedo = {0, 0, 0};
    const std::vector<LightSource> lights = {{LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {5, 4, 3}}}, // inside too
        outside = {{LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}}}, none;
    Scene lit = scene_of(smoke, lights), from_outside = scene_of(smoke, outside), dark = scene_of(black, none);
    lit.background = from_outside.background = dark.background = {1, 0.5, 0.25};
    const Double3 particle = particles[150].position;
    const BuiltField built(black);
    for (const Double3 &eye : {Double3{0, 0, 0}, particle, Double3{0.5, 0.25, 1}, Double3{-2.5, 2.5, -2.5}})
        for (const Double3 &along : {Double3{0, 0, -1}, Double3{0, 0, 1}, Double3{1, 2, -2}}) {
            // The march starts at t = 0: the closed depth from there on. The error of the march is below 2e-4.
            const Ray ray = {vec(eye.x, eye.y, eye.z), normalize(vec(along.x, along.y, along.z))};
            const double through = std::exp(-at(optical_depth(built.field, ray, Real(100))));
            CHECK(std::fabs(look(dark, eye, along, with_step(0.0625)).red - through) < 2e-4);
            // The radiance, and that of a camera moved by 1e-6. Per unit of length it changes by less than the
            // extinction and, to the side, the integral of the density's gradient: some 10 together.
            Settings settings = small_settings(1);
            settings.photons = 2000;
            CHECK(std::isfinite(look(lit, eye, along, settings).red));
            const double seen = look(from_outside, eye, along, settings).red;
            CHECK(seen > 0);
            for (const Double3 &moved : {Double3{eye.x + 1e-6, eye.y, eye.z}, Double3{eye.x, eye.y - 1e-6, eye.z},
                                         Double3{eye.x, eye.y, eye.z + 1e-6}})
                CHECK(std::fabs(look(from_outside, moved, along, settings).red - seen) < 1e-5 + 40 * unit_error);
        }
    // Behind the box, and looking away.
    CHECK(look(lit, {0, 0, -40}, {0, 0, -1}).red == 1);
    CHECK(look(lit, {0, 0, 40}, {0.01, 0, 1}).red == 1);
    CHECK(look(lit, {0, 0, -40}, {0, 0, 1}).red != 1);
}

TEST_CASE(WISP_ARITH_NAME ": hard case E10: a light inside the smoke, at a particle, at a sample of the march") {
    // The airlight past a light at a distance of 0.1: the published value.
    double airlight = 0;
    const int n = 400;
    const Light light = make_light(lamp);
    for (int i = 0; i < n; ++i) {
        const double from = 2.0 * i / n - 1, to = 2.0 * (i + 1) / n - 1, t = (from + to) / 2;
        const Illumination there = illuminate(light, vec(t, 0.1, 0), vec(from, 0.1, 0), vec(to, 0.1, 0));
        airlight += at(there.irradiance.x) * std::exp(-(t + 1 + at(there.distance))) * (to - from);
    }
    // The midpoint rule is off by less than 1e-5 here; in f32 segments of 0.005 have five digits, with random errors.
    CHECK(airlight == doctest::Approx(9.1192720747).epsilon(2e-5));

    // At a particle and at the middle of a step (distance 0): along z from 1.25 in steps of 0.5 the third middle is 0.
    // Steps that are longer than they are far from the light are halved, down to 1/16.
    const SmokeDescription smoke = smoke_of(at_origin);
    const std::vector<LightSource> lights = {lamp};
    const Scene scene = scene_of(smoke, lights);
    const BuiltField built(smoke);
    double least = 0, most = 0, depth = 0;
    const std::function<void(double, double)> add = [&](double a, double b) {
        const double z = (a + b) / 2, dx = a - b, distance = a * b < 0 ? 0 : std::min(std::fabs(a), std::fabs(b));
        if (distance < dx && dx > 1.0 / 16) {
            add(a, z);
            add(z, b);
            return;
        }
        const double s = density_at(std::fabs(z)) * dx, sign = z > 0 ? -1 : 1;
        const double shadow =
            std::exp(-at(optical_depth(built.field, {vec(0, 0, z), vec(0, 0, sign)}, real(std::fabs(z)))));
        const double scattered = 0.9 / (4 * pi_) * shadow * std::exp(-depth) * (1 - std::exp(-s));
        // The mean of 1 / z^2 over the step. A step that ends at the light is taken at the smallest distance of 2^-10:
        // the light sees it under an angle between that of `least` and a quarter turn.
        const bool ends = distance == 0;
        least += scattered * (ends ? std::atan(dx * 1024) * 1024 / dx : 1 / (a * b));
        most += scattered * (ends ? pi_ / 2 * 1024 / dx : 1 / (a * b));
        depth += s;
    };
    for (int i = 0; i < 7; ++i) add(1.25 - 0.5 * i, std::max(0.75 - 0.5 * i, -2.0));
    const double seen = look(scene, {0, 0, 1.25}, {0, 0, -1}).red;
    CHECK(seen > least * (1 - 1e-5));
    CHECK(seen < most * (1 + 1e-5));

    // Neighbouring pixels: from the smallest distance on radiance falls about as 1 / distance from the light. The light
    // lies in the middle of a step or at the end of one.
    for (double eye : {8.0, 8.25}) {
        const int pixels = 33;
        const double spacing = 1.0 / 128;
        double before = 0;
        for (int i = 0; i < pixels; ++i) {
            const double b = i * spacing;
            const double red = look(scene, {b, 0, eye}, {0, 0, -1}).red;
            CAPTURE(eye);
            CAPTURE(b);
            CHECK(std::isfinite(red));
            CHECK(red > 0);
            if (i > 0) {
                CHECK(red <= before);
                CHECK(before <= red * 1.05 * b / std::max(b - spacing, 0x1p-10));
            }
            CHECK(look(scene, {-b, 0, eye}, {0, 0, -1}).red == doctest::Approx(red).epsilon(1e-4));
            before = red;
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E11: a light at the camera gives finite radiance, that of a light beside it") {
    const SmokeDescription smoke = smoke_of(at_origin);
    for (const Double3 &eye : {Double3{0, 0, 0}, Double3{0, 0, 1.25}, Double3{0.5, 0.25, 1}, Double3{0, 0, 8}}) {
        const auto seen = [&](double aside) {
            LightSource light = lamp;
            light.position = {eye.x + aside, eye.y, eye.z};
            const std::vector<LightSource> lights = {light};
            return look(scene_of(smoke, lights), eye, {0, 0, -1}).red;
        };
        CAPTURE(eye.z);
        CHECK(std::isfinite(seen(0)));
        CHECK(seen(0) > 0);
        // Below the smallest distance of 2^-10 radiance changes only by the angle at which the light is seen.
        CHECK(seen(0) == doctest::Approx(seen(0x1p-14)).epsilon(0.01));
        CHECK(seen(0) == doctest::Approx(seen(0x1p-10)).epsilon(0.01));
    }
    // The irradiance of a segment that begins at the light, holds it, or ends there is that of segments beside it, a
    // little before and behind it.
    const Light light = make_light(lamp);
    const auto mean = [&](double x, double from) {
        const Vec3 a = vec(x, from, 0), b = vec(x, from + 0.5, 0);
        return at(illuminate(light, (a + b) * Real(0.5), a, b).irradiance.x);
    };
    for (double from : {0.0, -0.25, -0.5}) {
        CHECK(mean(0, from) > 0);
        CHECK(mean(0, from) == doctest::Approx(mean(0x1p-12, from)).epsilon(0.01));
        CHECK(mean(0, from) == doctest::Approx(mean(0x1p-10, from)).epsilon(0.01));
        CHECK(mean(0, from) == doctest::Approx(mean(0, from + 1e-6)).epsilon(0.01));
        CHECK(mean(0, from) == doctest::Approx(mean(0, from - 1e-6)).epsilon(0.01));
    }
    const Vec3 o = vec(0, 0, 0);
    CHECK(at(illuminate(light, o, o, o).irradiance.x) == 0x1p20); // the inverse square of the smallest distance
}

TEST_CASE(WISP_ARITH_NAME ": hard case E12: a million steps of 0.001 are 1000 long") {
    if (std::is_same_v<Real, float>) { // a sum of steps in float
        float t = 0, few = 0;
        for (int i = 0; i < 1000000; ++i) t += 1e-3f;
        for (int i = 0; i < 10000; ++i) few += 0.01f;
        CHECK(t == doctest::Approx(991.14).epsilon(1e-5));
        CHECK(few == doctest::Approx(100.00295).epsilon(1e-7));
    }
    // A particle of mass 0 near the camera, and a second particle 1000 behind it: were the steps longer or shorter, the
    // march would miss the second one.
    const std::vector<Particle> ends = {{{0, 0, -498}, 1, 1}, {{0, 0, 498}, 1, 0}};
    SmokeDescription smoke = smoke_of(ends);
    smoke.albedo = {0, 0, 0};
    const std::vector<LightSource> none;
    Scene scene = scene_of(smoke, none);
    scene.background = {1, 1, 1};
    const Seen seen = look(scene, {0, 0, 512}, {0, 0, -1}, with_step(1e-3));
    CHECK(seen.statistics.smoke.march_samples >= 1000000);
    CHECK(seen.statistics.smoke.march_samples <= 1000001); // the last one may be as short as rounding
    // Sums of 4000 steps; positions have seven digits in f32.
    CHECK(std::fabs(seen.red - std::exp(-0.5968310366)) < (std::is_same_v<Real, float> ? 2e-5 : 1e-6));
}

TEST_CASE(WISP_ARITH_NAME ": hard case E13: the last step is as long as the rest of the segment") {
    // The axis of one particle is 4 long: of steps of 1.2 the last is 0.4 long. A step has the density of its middle.
    // The particle is so thin that no step is divided.
    constexpr double thin = 0.1;
    std::vector<Particle> particle(at_origin.begin(), at_origin.end());
    for (Particle &p : particle) p.area *= thin;
    SmokeDescription smoke = smoke_of(particle);
    smoke.albedo = {0, 0, 0};
    const std::vector<LightSource> none;
    Scene scene = scene_of(smoke, none);
    for (double step : {0.3, 1.2, 1.5, 3.0, 3.9, 4.0, 7.0}) {
        double depth = 0;
        for (double from = 0; from < 4 - 1e-9; from += step) {
            const double length = std::min(step, 4 - from);
            depth += thin * density_at(std::fabs(from + length / 2 - 2)) * length;
        }
        CAPTURE(step);
        scene.background = {1, 1, 1};
        CHECK(std::fabs(look(scene, {0, 0, 8}, {0, 0, -1}, with_step(step)).red - std::exp(-depth)) < 1e-6);
        // Smoke that emits radiance 1 adds what it absorbs of background 1.
        smoke.emission = {1, 1, 1};
        scene.background = {0, 0, 0};
        CHECK(std::fabs(look(scene, {0, 0, 8}, {0, 0, -1}, with_step(step)).red - 1 + std::exp(-depth)) < 1e-6);
        smoke.emission = {0, 0, 0};
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E15: an empty scene, lights alone and smoke alone give valid pictures") {
    const std::vector<LightSource> none, lights = {lamp};
    const auto particles = cloud(50, 3, 1, 0.3);
    const SmokeDescription empty = smoke_of({}), smoke = smoke_of(particles);
    Settings settings = small_settings(8);
    settings.photons = 1000;
    const auto is_background = [](const Rendered &picture) {
        bool same = picture.status == Status::done;
        for (size_t i = 0; i < picture.rgb.size(); i += 3)
            same = same && picture.rgb[i] == 1 && picture.rgb[i + 1] == 0.5f && picture.rgb[i + 2] == 0.25f;
        return same;
    };
    Scene scene = scene_of(empty, none);
    scene.background = {1, 0.5, 0.25};
    CHECK(is_background(render_in_memory(scene, settings))); // a smoke without particles
    scene.smoke_count = 0;
    CHECK(is_background(render_in_memory(scene, settings))); // nothing
    scene.lights = lights.data();
    scene.light_count = 1;
    CHECK(is_background(render_in_memory(scene, settings))); // lights
    // Smoke without light: it absorbs the background.
    scene = scene_of(smoke, none);
    scene.background = {1, 0.5, 0.25};
    const Rendered picture = render_in_memory(scene, settings);
    REQUIRE(picture.status == Status::done);
    CHECK(picture.statistics.photons.emitted == 0);
    float least = 1;
    for (size_t i = 0; i < picture.rgb.size(); i += 3) {
        CHECK(picture.rgb[i] > 0);
        CHECK(picture.rgb[i] <= 1);
        CHECK(picture.rgb[i + 1] == doctest::Approx(0.5 * picture.rgb[i]).epsilon(1e-6));
        CHECK(picture.rgb[i + 2] == doctest::Approx(0.25 * picture.rgb[i]).epsilon(1e-6));
        least = std::min(least, picture.rgb[i]);
    }
    CHECK(least < 0.9f);
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case E16: a spot needs an angle above 0 and an axis; one of 180 degrees lights half of "
          "space") {
    CHECK(error_of("ls 0 0 0 0 0 1 0 1 1 1") == "s.aff:1: found cone angle 0, expected above 0, at most 360 degrees");
    CHECK(error_of("ls 0 0 0 0 0 1 -30 1 1 1").find("cone angle") != std::string::npos);
    CHECK(error_of("ls 0 0 0 0 0 0 30 1 1 1") == "s.aff:1: found 0 0 0, expected the light's direction of some length");
    CHECK(error_of("ld 0 0 0 1 1 1") == "s.aff:1: found 0 0 0, expected the light's direction of some length");

    const std::string view = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\n";
    const auto picture_of = [&](const std::string &light) {
        Settings settings = small_settings(4);
        settings.photons = 500;
        const Rendered picture = render_in_memory(PreparedSmoke(view + light + ball).scene(), settings);
        for (float value : picture.rgb) CHECK(std::isfinite(value));
        return picture;
    };
    // The light stands beside the smoke: its half of space holds all of the smoke or nothing.
    const Rendered towards = picture_of("ls 3 0 0  -1 0 0  180  9 9 9"),
                   away = picture_of("ls 3 0 0  1 0 0  180  9 9 9");
    const Rendered all_around = picture_of("ls 3 0 0  1 0 0  360  9 9 9"), point = picture_of("lp 3 0 0  9 9 9");
    CHECK(std::memcmp(towards.rgb.data(), point.rgb.data(), point.rgb.size() * sizeof(float)) == 0);
    CHECK(std::memcmp(all_around.rgb.data(), point.rgb.data(), point.rgb.size() * sizeof(float)) == 0);
    for (float value : away.rgb) CHECK(value == 0);
    CHECK(point.rgb[15] > 0);
    // The axis may have any length.
    const Rendered short_axis = picture_of("ls 3 0 0  -1e-30 0 0  180  9 9 9"),
                   long_axis = picture_of("ls 3 0 0  -1e30 0 0  180  9 9 9");
    CHECK(std::memcmp(towards.rgb.data(), short_axis.rgb.data(), point.rgb.size() * sizeof(float)) == 0);
    CHECK(std::memcmp(towards.rgb.data(), long_axis.rgb.data(), point.rgb.size() * sizeof(float)) == 0);

    // The light stands inside: half of space, and half of the power.
    LightSource half = lamp;
    half.kind = LightKind::spot;
    half.one_minus_cosine = 1;
    const Light light = make_light(half);
    const auto lit = [&](double x, double z) {
        const Vec3 p = vec(x, 0, z);
        return illuminate(light, p, p, p).irradiance.x > Real(0);
    };
    CHECK(lit(0, 1));
    CHECK(lit(5, 0.01));
    CHECK(!lit(5, -0.01));
    CHECK(!lit(0, -1));
    const Sphere around = {vec(0, 0, 0), Real(2)};
    const Emitter emitter = make_emitter(light, around);
    CHECK(at(emitter.power.x) == doctest::Approx(2 * pi_).epsilon(1e-6));
    for (uint64_t i = 0; i < 500; ++i) {
        const Photon photon = emit(emitter, around, photon_event(i, 0));
        CHECK(std::fabs(at(dot(photon.ray.direction, photon.ray.direction)) - 1) < 1e-6);
        if (photon.emitted) CHECK(at(photon.ray.direction.z) >= -1e-6);
    }
}

TEST_CASE(
    WISP_ARITH_NAME
    ": hard case E17: a view without an angle or an up direction is refused; pictures of one pixel are rendered") {
    const auto view = [](const std::string &up, const std::string &angle, const std::string &size) {
        return "v from 0 0 4 at 0 0 0 up " + up + " angle " + angle + " hither 1 resolution " + size;
    };
    for (const char *angle : {"0", "180", "-40", "200"})
        CHECK(error_of(view("0 1 0", angle, "4 4")) ==
              "s.aff:1: found angle " + std::string(angle) + ", expected above 0 and below 180 degrees");
    for (const char *up : {"0 0 1", "0 0 -2", "0 1e-12 1"})
        CHECK(error_of(view(up, "40", "4 4")) ==
              "s.aff:1: 'up' is parallel to the direction of view, expected another");
    CHECK(error_of(view("0 0 0", "40", "4 4")).find("of some length") != std::string::npos);
    CHECK(error_of(view("0 1 0", "40", "0 4")).find("expected a whole number from 1") != std::string::npos);
    CHECK(error_of("v from 1 2 3 at 1 2 3 up 0 1 0 angle 40 hither 1 resolution 4 4").find("same point") !=
          std::string::npos);

    const auto picture_of = [&](const std::string &up, const std::string &angle, int width, int height) {
        const std::string size = std::to_string(width) + " " + std::to_string(height);
        const PreparedSmoke prepared("b 0.5 0.5 0.5\nlp 3 3 3 40 40 40\n" + view(up, angle, size) + ball);
        Settings settings = small_settings(1);
        settings.crop = {0, 0, width, height};
        settings.photons = 300;
        const Rendered picture = render_in_memory(prepared.scene(), settings);
        REQUIRE(picture.status == Status::done);
        for (float value : picture.rgb) CHECK((std::isfinite(value) && value >= 0));
        return picture.rgb;
    };
    // The middle pixel of a picture of one pixel, row or column looks at `at`, whatever the angle of view.
    const std::vector<float> pixel = picture_of("0 1 0", "30", 1, 1), row = picture_of("0 1 0", "30", 5, 1),
                             column = picture_of("0 1 0", "30", 1, 5), wide = picture_of("0 1 0", "90", 1, 1);
    for (int c = 0; c < 3; ++c) {
        CHECK(pixel[c] == doctest::Approx(wide[c]).epsilon(1e-5));
        CHECK(pixel[c] == doctest::Approx(row[2 * 3 + c]).epsilon(1e-5));
        CHECK(pixel[c] == doctest::Approx(column[2 * 3 + c]).epsilon(1e-5));
    }
    CHECK(column[0] != column[6]);
    CHECK(row[0] != row[6]);
    // An up almost parallel to the view, angles almost 0 and almost 180.
    picture_of("0 1e-6 1", "30", 2, 2);
    picture_of("0 1 0", "1e-9", 2, 2);
    picture_of("0 1 0", "179.9", 2, 2);
    for (int pixels : {1, 3}) {
        const std::string refusal = refusal_of([&] { picture_of("0 1 0", "179.999", pixels, pixels); });
        CAPTURE(pixels);
        CHECK(refusal ==
              (std::is_same_v<Real, Fixed> ? "s.aff:1: the view is too wide for fixed point, expected a scene that fits"
                                           : "no error"));
    }
}
