// Scenes as they are written: statements, comments, defaults, and an error line for everything else.
#include "host/error.h"
#include "host/options.h"
#include "host/scene_file.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;

namespace {

const std::string view = "v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 20 10\n";

std::string error_of(const std::string &text) {
    try {
        parse_scene("s.aff", text);
    } catch (const InputError &error) {
        return error.what();
    }
    return "no error";
}

} // namespace

TEST_CASE("scene: every statement, over any lines, with comments") {
    const SceneFile s = parse_scene(
        "dir/s.aff", "# a scene\r\nv from 1 2 3\n at 4 5 6 up 0 1 0 % up\n angle 40. hither .1 resolution 20 10\n"
                     "b .1 .2 .3\nl 1 2 3\nl 1 2 3 4 5 6 lp 7 8 9 1 2 3\nls 0 0 9 0 0 -1 30 1 1 1\nld 0 -2 0 +1 1e0 1\n"
                     "smoke p_%04d.vtk{kernel poly6 radius 0.5 mass 2 extinction 3 albedo .9 .8 .7 phase -.5\n"
                     "emission 1 0 0 transform 2 2 2 0 0 1 90 1 2 3 frames 5 -1}\n"
                     "smoke /abs.ply { } render spp 9\nrender smoke direct");
    REQUIRE(s.view);
    CHECK(s.view->from.z == 3);
    CHECK(s.view->at.x == 4);
    CHECK(s.view->angle == 40);
    CHECK(s.view->width == 20);
    CHECK(s.view->height == 10);
    CHECK(s.background.y == 0.2);
    REQUIRE(s.lights.size() == 5);
    CHECK(s.lights[0].kind == LightKind::constant);
    CHECK(s.lights[0].color.x == 1);
    CHECK(s.lights[1].color.z == 6);
    CHECK(s.lights[2].kind == LightKind::point);
    CHECK(s.lights[3].kind == LightKind::spot);
    CHECK(s.lights[3].degrees == 30);
    CHECK(s.lights[4].kind == LightKind::parallel);
    CHECK(s.lights[4].direction.y == -2);
    REQUIRE(s.smokes.size() == 2);
    CHECK(s.smokes[0].file == "dir/p_%04d.vtk");
    CHECK(s.smokes[0].kernel == Kernel::poly6);
    CHECK(*s.smokes[0].radius == 0.5);
    CHECK(*s.smokes[0].mass == 2);
    CHECK(s.smokes[0].extinction == 3);
    CHECK(s.smokes[0].albedo.z == 0.7);
    CHECK(s.smokes[0].phase == -0.5);
    CHECK(s.smokes[0].emission.x == 1);
    CHECK(s.smokes[0].transform->scale == 2);
    CHECK(s.smokes[0].first_frame == 5);
    CHECK(s.smokes[0].frame_step == -1);
    CHECK(s.smokes[1].file == "/abs.ply");
    CHECK(s.smokes[1].albedo.x == 0.9);
    CHECK(!s.smokes[1].radius);
    REQUIRE(s.defaults.size() == 2);
    CHECK(s.defaults[0].option == "spp");
    CHECK(s.defaults[0].where == "dir/s.aff:12: ");
}

TEST_CASE("scene: lights of an .nff file without colour share the intensity that its text proposes") {
    const SceneFile s = parse_scene("a.nff", "l 1 1 1\nl 2 2 2\nl 3 3 3 .5 .5 .5\nl 4 4 4");
    CHECK(s.lights[0].color.x == doctest::Approx(std::sqrt(4.0) / 8));
    CHECK(s.lights[2].color.x == 0.5);
    CHECK(parse_scene("a.aff", "l 1 1 1\nl 2 2 2").lights[0].color.x == 1);
}

TEST_CASE("scene: smoke may be a box, or a file of that name") {
    const SceneFile s = parse_scene("dir/s.aff", "smoke box -1 -2 -3 1. +2 3e0 0.25 { extinction 3 albedo .9 .8 .7\n"
                                                 "phase -.5 emission 1 0 0 transform 2 2 2 0 0 1 90 1 2 3 }\n"
                                                 "smoke box { radius 1 kernel poly6 }\nsmoke ./box{}smoke box4{}\n"
                                                 "smoke grid.vol { extinction 2 }");
    REQUIRE(s.smokes.size() == 5);
    REQUIRE(s.smokes[0].box);
    CHECK(s.smokes[0].box->low.x == -1);
    CHECK(s.smokes[0].box->low.y == -2);
    CHECK(s.smokes[0].box->low.z == -3);
    CHECK(s.smokes[0].box->high.x == 1);
    CHECK(s.smokes[0].box->high.y == 2);
    CHECK(s.smokes[0].box->high.z == 3);
    CHECK(s.smokes[0].box->density == 0.25);
    CHECK(s.smokes[0].file.empty());
    CHECK(s.smokes[0].extinction == 3);
    CHECK(s.smokes[0].albedo.z == 0.7);
    CHECK(s.smokes[0].phase == -0.5);
    CHECK(s.smokes[0].emission.x == 1);
    CHECK(s.smokes[0].transform->degrees == 90);
    CHECK(s.smokes[0].where == "dir/s.aff:1: ");
    const char *files[] = {"", "dir/box", "dir/./box", "dir/box4", "dir/grid.vol"};
    for (size_t i = 1; i < 5; ++i) {
        CHECK(!s.smokes[i].box);
        CHECK(s.smokes[i].file == files[i]);
    }
    // What only particles have is remembered, with its line, until the file is known to be a grid.
    CHECK(s.smokes[1].of_particles == "dir/s.aff:3: found 'kernel'");
    CHECK(s.smokes[4].of_particles.empty());
}

TEST_CASE("scene: comments may begin like a frame number") {
    CHECK(parse_scene("a", "%draw the view\n%04d frames\nb 1 0 0 %d").background.x == 1);
    CHECK(parse_scene("a", "smoke %04d.vtk {}").smokes[0].file == "%04d.vtk");
}

TEST_CASE("scene: the first view counts") {
    CHECK(parse_scene("a", view + "v from 0 0 9 at 0 0 0 up 0 1 0 angle 50 hither 1 resolution 5 5").view->width == 20);
}

TEST_CASE("scene: errors name the file, the line, what is wrong and what was expected") {
    const struct {
        const char *text, *error;
    } cases[] = {
        {"xyz 1", "s.aff:1: there is no statement 'xyz', expected v b l lp ls ld smoke or render"},
        {"\n\nxs 1 1 1",
         "s.aff:3: statement 'xs' is not supported yet by this version, expected v b l lp ls ld smoke or render"},
        {"b 1 2", "s.aff:1: the file ends, expected blue of 0 or more of the background"},
        {"b 1 2 red", "s.aff:1: found 'red', expected a number: blue of 0 or more of the background"},
        {"b 1 2 -3", "s.aff:1: found -3, expected blue of 0 or more of the background"},
        {"lp 0 0 0 1 1 nan", "s.aff:1: found 'nan', expected a number: blue of 0 or more of the light"},
        {"lp 0 0 1e31 1 1 1", "s.aff:1: found '1e31', expected a number within +-1e30: z of the light's position"},
        {"ls 0 0 0 0 0 0 30 1 1 1", "s.aff:1: found 0 0 0, expected the light's direction of some length"},
        {"ls 0 0 0 0 0 1 0 1 1 1", "s.aff:1: found cone angle 0, expected above 0, at most 360 degrees"},
        {"v from 0 0 0 at 0 0 0", "s.aff:1: the file ends, expected 'up'"},
        {"v from 0 0 5 at 0 0 0 up 0 0 2 angle 40 hither 1 resolution 4 4",
         "s.aff:1: 'up' is parallel to the direction of view, expected another"},
        {"v from 0 0 5 at 0 0 5 up 0 1 0 angle 40 hither 1 resolution 4 4",
         "s.aff:1: 'from' and 'at' are the same point, expected two"},
        {"v from 0 0 5 at 0 0 0 up 0 1 0 angle 180 hither 1 resolution 4 4",
         "s.aff:1: found angle 180, expected above 0 and below 180 degrees"},
        {"v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 0 4",
         "s.aff:1: found '0', expected a whole number from 1 to 65536: the picture's width"},
        {"smoke", "s.aff:1: the file ends, expected a file of particles, a .vol or 'box'"},
        {"smoke a.vtk {\n radius 0 }", "s.aff:2: found 0, expected a smoothing length above 0"},
        {"smoke a.vtk {\n phase 1 }", "s.aff:2: found phase 1, expected above -1 and below 1"},
        {"smoke a.vtk {\n phase -1.5 }", "s.aff:2: found phase -1.5, expected above -1 and below 1"},
        {"smoke a.vtk {\n albedo 1 1 1.1 }", "s.aff:2: found 1.1, expected blue from 0 to 1 of the albedo"},
        {"smoke a.vtk {\n kernel gauss }", "s.aff:2: found 'gauss', expected spline or poly6"},
        {"smoke a.vtk {\n colour 1 }", "s.aff:2: there is no 'colour' in smoke, expected kernel radius mass extinction "
                                       "albedo phase emission transform frames or }"},
        {"smoke a.vtk { transform 1 2 1 0 0 1 0 0 0 0 }",
         "s.aff:1: the scales are not equal and above 0, expected a uniform scale"},
        {"smoke a.vtk { transform 1 1 1 0 0 0 9 0 0 0 }", "s.aff:1: found axis 0 0 0, expected some length"},
        {"smoke a.vtk {", "s.aff:1: the file ends, expected '}'"},
        {"smoke { }", "s.aff:1: found '{', expected a file of particles, a .vol or 'box'"},
        {"smoke\nbox\n0 0 0 1 1", "s.aff:3: the file ends, expected z of the box's upper corner"},
        {"smoke box 0 0 0\n1 1 {", "s.aff:2: found '{', expected a number: z of the box's upper corner"},
        {"smoke box 0 0 0 1 1 1 {", "s.aff:1: found '{', expected a number: a density of 0 or more"},
        {"smoke box 0 0 0 1 1 1\n-1 {}", "s.aff:2: found -1, expected a density of 0 or more"},
        {"smoke box 0 0 0 1 1 1 inf {}", "s.aff:1: found 'inf', expected a number: a density of 0 or more"},
        {"smoke box 0 0 0 1 1 1e31 1 {}",
         "s.aff:1: found '1e31', expected a number within +-1e30: z of the box's upper corner"},
        {"smoke box 0 0 0\n0 1 1 1 {}", "s.aff:2: the box has no volume, expected X0 < X1, Y0 < Y1 and Z0 < Z1"},
        {"smoke box 0 0 0\n1 -1 1 1 {}", "s.aff:2: the box has no volume, expected X0 < X1, Y0 < Y1 and Z0 < Z1"},
        {"smoke box 0 0 2\n1 1 1 1 {}", "s.aff:2: the box has no volume, expected X0 < X1, Y0 < Y1 and Z0 < Z1"},
        {"smoke box 0 0 0 1 1 1 1 1 {}", "s.aff:1: found '1', expected '{'"},
        {"smoke box 0 0 0 1 1 1 1 {\n albedo 0 0 0\n radius 1 }",
         "s.aff:3: found 'radius', expected none in a box: only particles have it"},
        {"smoke box 0 0 0 1 1 1 1 {\n mass 1 }",
         "s.aff:2: found 'mass', expected none in a box: only particles have it"},
        {"smoke box 0 0 0 1 1 1 1 {\n kernel spline }",
         "s.aff:2: found 'kernel', expected none in a box: only particles have it"},
        {"render spp", "s.aff:1: the file ends, expected a value for 'spp'"},
    };
    for (const auto &c : cases) {
        CAPTURE(c.text);
        CHECK(error_of(c.text) == c.error);
    }
}

TEST_CASE("options: names, forms and ranges") {
    const CommandLine line = parse_arguments({"a.aff", "--spp=9", "-o", "x.png", "--exposure", "-1", "-q"});
    CHECK(line.files == std::vector<std::string>{"a.aff"});
    REQUIRE(line.options.size() == 4);
    Options options;
    for (const auto &[name, value] : line.options) set_option(options, name, value, "");
    CHECK(options.samples == 9);
    CHECK(options.outputs == std::vector<std::string>{"x.png"});
    CHECK(options.exposure == -1);
    CHECK(options.quiet);

    for (const auto &[name, value] : {std::make_pair("reference", "1"), std::make_pair("passes", "7:2147483647"),
                                      std::make_pair("output", "a.passes"), std::make_pair("error-out", "e_%04d.pfm")})
        set_option(options, name, value, "");
    CHECK(options.reference);
    CHECK(options.passes->first == 7);
    CHECK(options.passes->last == 2147483647);
    CHECK(options.outputs.back() == "a.passes");
    CHECK(options.error_out == "e_%04d.pfm");

    const struct {
        const char *name, *value, *error;
    } wrong[] = {
        {"spp", "0", "option 'spp': found '0', expected a whole number from 1 to 65536"},
        {"spp", "4.5", "option 'spp': found '4.5', expected a whole number from 1 to 65536"},
        {"gather", "1", "option 'gather': found '1', expected a whole number from 2 to 1000000"},
        {"size", "20", "option 'size': found '20', expected WIDTHxHEIGHT"},
        {"crop", "5,5,5,6", "option 'crop': found '5,5,5,6', expected X0 < X1 and Y0 < Y1"},
        {"frames", "3:1", "option 'frames': found '3:1', expected a whole number from 3 to 1000000000"},
        {"memory", "12Q", "option 'memory': found '12Q', expected bytes, with k, M or G behind"},
        {"memory", "99999999999G", "option 'memory': found '99999999999G', expected bytes, with k, M or G behind"},
        {"arith", "f16", "option 'arith': found 'f16', expected f32, f64, fixed"},
        {"deposit", "nearest", "option 'deposit': found 'nearest', expected exact, path, kernel"},
        {"direction", "median", "option 'direction': found 'median', expected flux, mean"},
        {"light-step", "0.001", "option 'light-step': found '0.001', expected 0, or a number from 0.01 to 1000"},
        {"irradiance-step", "0", "option 'irradiance-step': found '0', expected a number from 0.01 to 1000"},
        {"output", "a.jpg",
         "option 'output': found 'a.jpg', expected a file name that ends in .png, .pfm, .passes or .map"},
        {"output", ".passes",
         "option 'output': found '.passes', expected a file name that ends in .png, .pfm, .passes or .map"},
        {"passes", "3", "option 'passes': found '3', expected A:B"},
        {"passes", "1:2:3", "option 'passes': found '1:2:3', expected A:B"},
        {"passes", "3:3", "option 'passes': found '3:3', expected a whole number from 4 to 2147483647"},
        {"passes", "-1:3", "option 'passes': found '-1:3', expected a whole number from 0 to 2147483646"},
        {"passes", "0:2147483648",
         "option 'passes': found '0:2147483648', expected a whole number from 1 to 2147483647"},
        {"passes", "0:", "option 'passes': found '0:', expected a whole number from 1 to 2147483647"},
        {"error-out", "e.png", "option 'error-out': found 'e.png', expected a file name that ends in .pfm"},
        {"error-out", "e.passes", "option 'error-out': found 'e.passes', expected a file name that ends in .pfm"},
        {"step", "nan", "option 'step': found 'nan', expected a number above 0, at most 1000.000000"},
        {"reference", "", "option 'reference': found '', expected 1"},
        {"shadows", "trace", "option 'shadows' is not supported yet by this version"},
        {"digest", "no", "option 'digest': found 'no', expected 1"},
        {"bogus", "", "there is no option 'bogus'; 'wisp help' lists them"},
    };
    for (const auto &c : wrong) {
        std::string found = "no error";
        try {
            set_option(options, c.name, c.value, "");
        } catch (const Error &error) {
            found = error.what();
            CHECK(error.status == exit_usage);
        }
        CHECK(found == c.error);
    }
    CHECK(*to_number("3.") == 3);
    CHECK(*to_number("+.5") == 0.5);
    CHECK(!to_number("+-3"));
    CHECK(!to_number("inf"));
    CHECK(!to_number("1x"));
    CHECK(!to_number(""));
}

TEST_CASE("frame numbers take the place of %04d") {
    CHECK(numbered("a_%04d.png", 7) == "a_0007.png");
    CHECK(numbered("a_%d.png", 12345) == "a_12345.png");
    CHECK(numbered("100%.png", 7) == "100%.png");
    CHECK(numbered("%s%02d", 3) == "%s03");
    CHECK(has_number("%d"));
    CHECK(!has_number("%x"));
}
