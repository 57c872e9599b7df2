// Surfaces in the units of the core, against the shapes of the file at the same time.
#include "host/base/double3_algebra.h"
#include "host/prepare/motion.h"
#include "host/prepare/prepare.h"
#include "host/scene/scene_file.h"
#include <doctest/doctest.h>

using namespace wisp;

namespace {

const std::string view = "v from 0 2 9 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 8 6\n";
const std::string triangle = "p 3 0 0 0 1 0 0 0 1 0.5\n";
const std::string floor_of_six = "p 4 -3 0 3 3 0 3 3 0 -3 -3 0 -3\n";
const std::string mover = "x a { xs 0.001 0.001 0.001 0 1 0 20 0.003 0.001 0.002 { " + triangle +
                          "} }\n"
                          "k a { transl 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 8 1 2 3 0 0 0 8 1 2 3 0 0 0\n"
                          "rot 4 0 0 0 1 0 0 0 0 0 0 0 1 0 0 0 0 8 1 1 0 200 0 0 0 8 1 1 0 200 0 0 0\n"
                          "scale 4 0 100 100 300 0 0 0 0 100 100 300 0 0 0 8 200 50 100 0 0 0 8 200 50 100 0 0 0 }\n";

SceneFile scene_of(const std::string &text) { return parse_scene("s.aff", view + text); }

Double3 in_world(const Instance &instance, const Double3 &p) {
    return instance.axis[0] * p.x + instance.axis[1] * p.y + instance.axis[2] * p.z + instance.origin;
}

double distance(const Double3 &a, const Double3 &b) { return length(a - b); }

std::string refused(const std::string &text, const Options &options = {}, int64_t frame = 0) try {
    PreparedScene prepared;
    prepare_scene("s.aff", scene_of(text), options, frame, prepared);
    return "no error";
} catch (const std::exception &error) {
    return error.what();
}

} // namespace

TEST_CASE("prepared surfaces: still triangles reach to 1024 to 2048 by a power of two, and all else goes with them") {
    const SceneFile file = scene_of("a 0 8 5\nlp 3 4 5 1 1 1\nla lamp 0 1 0\n" + floor_of_six + mover +
                                    "tpa 2 0 0 0 1 0 0 1 1 0 1 0 0 1 0 1 1 0 0 1\n"
                                    "8 0 0 2 0 0 1 1 0 2 0 0 1 0 1 2 0 0 1\n"
                                    "k lamp { transl 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 8 2 0 0 0 0 0 8 2 0 0 0 0 0 }\n");
    PreparedScene kept;
    for (const int64_t frame : {int64_t{0}, int64_t{3}, int64_t{4}, int64_t{1}}) {
        CAPTURE(frame);
        prepare_scene("s.aff", file, {}, frame, kept);
        const Scene &scene = kept.scene;
        REQUIRE(scene.static_count == 2);
        REQUIRE(scene.instance_triangle_count == 1);
        REQUIRE(scene.deforming_count == 1);
        double farthest = 0;
        for (uint32_t i = 0; i < 2; ++i)
            for (const Double3 &corner : scene.triangles[i].corner)
                farthest = std::max(farthest, largest_component(corner));
        CHECK(farthest == 1536); // 3 * 512
        CHECK(scene.ray_epsilon == doctest::Approx(2e-6 * std::sqrt(2.0) * 1536).epsilon(1e-12));

        // Where the shapes of the file are at this time.
        const double time = time_of(file, {}, frame), scale = 512;
        CHECK(time == 2.0 * static_cast<double>(frame));
        Shapes shapes = make_shapes("s.aff", file.graph);
        pose_shapes("s.aff", file.graph, time, shapes);
        const Instance &instance = scene.instances[0], &expected = shapes.instances[0];
        for (int i = 0; i < 3; ++i)
            CHECK(distance(in_world(instance, scene.triangles[2].corner[i]) * (1 / scale),
                           in_world(expected, shapes.triangles[2].corner[i])) < 1e-12);
        // Its own space is about as large as the world's: fixed point keeps its digits.
        double size = 0;
        for (const Double3 &axis : instance.axis) size = std::max(size, length(axis));
        CHECK(size > 0.24);
        CHECK(size < 4);
        for (const Double3 &p : {Double3{1, 0, 0}, Double3{0, 1, 0}, Double3{0.3, -2, 7}}) {
            const Double3 moved = instance.axis[0] * p.x + instance.axis[1] * p.y + instance.axis[2] * p.z;
            const Double3 back =
                instance.inverse[0] * moved.x + instance.inverse[1] * moved.y + instance.inverse[2] * moved.z;
            CHECK(distance(back, p) < 1e-13);
        }
        CHECK(scene.triangles[3].corner[0].z == doctest::Approx((1 + time / 8) * scale).epsilon(1e-12));
        CHECK(scene.lights[1].position.x == doctest::Approx(time / 4 * scale).epsilon(1e-12));
        CHECK(scene.camera.origin.z == 9 * scale);

        PreparedScene alone;
        prepare_scene("s.aff", file, {}, frame, alone);
        for (uint32_t i = 0; i < scene.triangle_count(); ++i)
            for (int k = 0; k < 3; ++k)
                CHECK(distance(scene.triangles[i].corner[k], alone.scene.triangles[i].corner[k]) == 0);
        CHECK(distance(instance.origin, alone.scene.instances[0].origin) == 0);
        CHECK(scene.radiance_exponent == alone.scene.radiance_exponent);
    }
}

TEST_CASE("prepared surfaces: without still ones, those that move give the size") {
    for (const char *flat : {"1 1 1", "1 0 1"}) { // a body that begins without volume is not there, and may be later
        const std::string text = "a 0 8 2\nx a { " + triangle + " }\nk a { scale 4 0 " + flat + " 0 0 0 0 " + flat +
                                 " 0 0 0 8 1 1 1 0 0 0 8 1 1 1 0 0 0 }";
        PreparedScene prepared;
        prepare_scene("s.aff", scene_of(text), {}, 1, prepared);
        REQUIRE(prepared.scene.instance_count == 1);
        CHECK(prepared.scene.instances[0].visible);
        CHECK(prepared.scene.ray_epsilon > 0);
        for (const Double3 &corner : prepared.scene.triangles[0].corner) CHECK(largest_component(corner) <= 2048);
    }
}

TEST_CASE("prepared surfaces: what is needed of a material, ambient light and light in it") {
    PreparedScene prepared;
    prepare_scene("s.aff", scene_of("am 2 4 8\nfm 0.5 0.25 0.125 0.1 0.2 0.3 0.4 0.5 0.6 7 0.5 0\n" + floor_of_six), {},
                  0, prepared);
    REQUIRE(prepared.scene.material_count == 1);
    const Material &m = prepared.scene.materials[0];
    const double unit = std::ldexp(1.0, -prepared.scene.radiance_exponent);
    CHECK(m.ambient.x == unit);
    CHECK(m.ambient.y == unit);
    CHECK(m.ambient.z == unit);
    CHECK(m.specular.z == 0.6);
    CHECK(m.shininess == 7);
    CHECK(m.transmission == 0.5);
    CHECK(m.index == 1);
}

TEST_CASE("prepared surfaces: what does not fit is refused with the reason") {
    Options fixed;
    fixed.arithmetic = Arithmetic::fixed;
    CHECK(refused("a 0 8 2\n" + floor_of_six + mover) == "no error");
    const std::string flies = "a 0 8 2\n" + floor_of_six + "x a { " + triangle +
                              " }\nk a { transl 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 8 99 0 0 0 0 0 8 99 0 0 0 0 0 }";
    CHECK(refused(flies) == "no error");
    CHECK(refused(flies, {}, 1) == "no error");
    std::string too_far = flies;
    for (size_t at; (at = too_far.find(" 99 ")) != std::string::npos;) too_far.replace(at, 4, " 1e6 ");
    CHECK(
        refused(too_far, {}, 1) ==
        "s.aff:1: something moves more than four times as far between its keys as at them, or 512 times as far as what "
        "is still reaches, expected a scene that fits");
    CHECK(
        refused("lp 1e9 0 0 1 1 1\n" + floor_of_six) ==
        "s.aff:1: a light is too far from the surfaces; a parallel light has no distance, expected a scene that fits");
    CHECK(refused("lp 9999 0 0 1 1 1\n" + floor_of_six) == "no error");
    CHECK(refused("lp 9999 0 0 1 1 1\n" + floor_of_six, fixed) ==
          "s.aff:1: a light is too far from the surfaces for fixed point; f32 has room for 32 times as far, expected a "
          "scene that fits");
    CHECK(refused("lp 99 0 0 1 1 1\n" + floor_of_six, fixed) == "no error"); // in smaller units
    CHECK(refused("tt nowhere.ppm 0 0 0 0 0 1 0 0 1 0 0 1 0 0 1") ==
          "s.aff:2: nowhere.ppm: cannot be opened: No such file or directory");
}

TEST_CASE("prepared surfaces: smoke beside them is in their units, in fixed point neither fine nor coarse") {
    Options fixed;
    fixed.arithmetic = Arithmetic::fixed;
    PreparedScene prepared;
    prepare_scene("s.aff", scene_of("smoke box 0 1 0 1 2 2 3 {}\n" + floor_of_six), {}, 0, prepared);
    REQUIRE(prepared.scene.smoke_count == 1);
    REQUIRE(prepared.scene.static_count == 2);
    const SmokeDescription &smoke = prepared.scene.smokes[0];
    constexpr double scale = 32; // the smoothing length is 1.6
    CHECK(prepared.scene.camera.origin.z == 9 * scale);
    CHECK(smoke.grid.half.x == 0.5 * scale);
    CHECK(smoke.grid.half.z == scale);
    CHECK(smoke.grid.extinction == doctest::Approx(3 / scale).epsilon(1e-12));
    CHECK(smoke.smallest_h == doctest::Approx(scale / 20).epsilon(1e-12));
    const Double3 seen = (smoke.grid.center - prepared.scene.camera.origin) * (1 / scale);
    CHECK(distance(seen, Double3{0.5, 1.5, 1} - Double3{0, 2, 9}) < 1e-12);

    const auto cube = [](double edge) {
        const std::string far = std::to_string(edge);
        return "smoke box 0 0 0 " + far + " " + far + " " + far + " 1 {}\n";
    };
    // A twentieth of the edge, times 512, is from 1/16 on. Above 128 the unit is smaller.
    for (const char *edge : {"0.00245", "1", "4.99", "5.01", "500"})
        CHECK(refused(cube(std::stod(edge)) + floor_of_six, fixed) == "no error");
    CHECK(
        refused(cube(0.00243) + floor_of_six, fixed) ==
        "s.aff:2: a smoothing length of 0.00012 is too fine for fixed point beside surfaces that reach 3, expected at "
        "least 0.00012, or --arith f32");
    CHECK(refused(cube(0.02) + cube(40) + floor_of_six, fixed) == "no error"); // smoothing lengths of 1/16 and 128
    CHECK(refused(cube(0.02) + cube(50) + floor_of_six, fixed) ==
          "s.aff:3: a smoothing length of 2.5 is too coarse for fixed point beside surfaces that reach 3, expected at "
          "most 2, or --arith f32");
    CHECK(refused(cube(0.02) + cube(2000) + floor_of_six, fixed) ==
          "s.aff:3: the smoke reaches 2e+03 from the middle, too far beside a smoothing length of 0.001, expected at "
          "most 1.3e+02, or --arith f32");
    for (const double edge : {0.00243, 5.01, 50000.0}) CHECK(refused(cube(edge) + floor_of_six) == "no error");
    CHECK(refused(cube(1e6) + floor_of_six) == "s.aff:2: the smoke reaches 1e+06 from the middle, too far beside "
                                               "surfaces of 3, expected at most 2.6e+05");
}
