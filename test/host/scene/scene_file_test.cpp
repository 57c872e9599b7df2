// Scenes as they are written: statements, comments, defaults, and an error line for everything else.
#include "host/base/error.h"
#include "host/prepare/prepare.h"
#include "host/scene/scene_file.h"
#include "support/data.h"
#include "support/refusal.h"
#include <cmath>
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>

using namespace wisp;

namespace {

const std::string view = "v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 20 10\n";

std::string error_of(const std::string &text) {
    return refusal_of([&] { parse_scene("s.aff", text); });
}

void check(const Double3 &found, double x, double y, double z) {
    CHECK(found.x == doctest::Approx(x));
    CHECK(found.y == doctest::Approx(y));
    CHECK(found.z == doctest::Approx(z));
}

const std::string ball = "s 0 0 0 1\n";
// A quarter turn about z; twice as large; 1 to the right.
const std::string turn = "xs 1 1 1 0 0 3 90 0 0 0 {", twice = "xs 2 2 2 0 0 1 0 0 0 0 {",
                  right = "xs 1 1 1 0 0 1 0 1 0 0 {";

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
    REQUIRE(s.smokes[0].node == 0);
    const Placement &place = s.graph.nodes[0].placement;
    CHECK(s.graph.nodes[0].parent == -1);
    CHECK(s.graph.nodes[0].name.empty());
    CHECK(place.scale.x == 2);
    CHECK(place.degrees == 90);
    CHECK(place.translation.y == 2);
    CHECK(s.smokes[1].node == -1);
    CHECK(s.smokes[0].first_frame == 5);
    CHECK(s.smokes[0].frame_step == -1);
    CHECK(s.smokes[1].file == "/abs.ply");
    CHECK(s.smokes[1].albedo.x == 0.9);
    CHECK(!s.smokes[1].radius);
    REQUIRE(s.defaults.size() == 2);
    CHECK(s.defaults[0].option == "spp");
    CHECK(s.defaults[0].where == "dir/s.aff:12");
}

TEST_CASE("scene: lights of an .nff file without colour share the intensity that its text proposes") {
    const SceneFile s = parse_scene("a.nff", "l 1 1 1\nl 2 2 2\nl 3 3 3 .5 .5 .5\nl 4 4 4");
    CHECK(s.lights[0].color.x == doctest::Approx(std::sqrt(4.0) / 8));
    CHECK(s.lights[2].color.x == 0.5);
    check(s.ambient, std::sqrt(4.0) / 8, std::sqrt(4.0) / 8, std::sqrt(4.0) / 8);
    CHECK(parse_scene("a.nff", "l 1 1 1 am 1 2 3").ambient.z == 3);
    CHECK(parse_scene("a.nff", "").ambient.x == 1);
    CHECK(parse_scene("a.aff", "l 1 1 1\nl 2 2 2").lights[0].color.x == 1);
    CHECK(parse_scene("a.aff", "l 1 1 1\nl 2 2 2").ambient.x == 1);
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
    CHECK(s.graph.nodes[static_cast<size_t>(s.smokes[0].node)].placement.degrees == 90);
    CHECK(s.smokes[0].where == "dir/s.aff:1");
    const char *files[] = {"", "dir/box", "dir/./box", "dir/box4", "dir/grid.vol"};
    for (size_t i = 1; i < 5; ++i) {
        CHECK(!s.smokes[i].box);
        CHECK(s.smokes[i].file == files[i]);
    }
    // What only particles have is remembered, with its line, until the file is known to be a grid.
    CHECK(s.smokes[1].of_particles.where == "dir/s.aff:3");
    CHECK(s.smokes[4].of_particles.key.empty());
}

TEST_CASE("scene: ambient light, animation, lights with names") {
    const SceneFile s = parse_scene("a.aff", "am 2.5 1 0 a 0 20 800 la lamp 1 2 3 la other 4 5 6 .5 .5 .25 l 0 0 0");
    check(s.ambient, 2.5, 1, 0);
    REQUIRE(s.animation);
    CHECK(s.animation->end == 20);
    CHECK(s.animation->frames == 800);
    REQUIRE(s.lights.size() == 3);
    CHECK(s.lights[0].kind == LightKind::constant);
    CHECK(s.lights[0].name == "lamp");
    check(s.lights[0].position, 1, 2, 3);
    check(s.lights[0].color, 1, 1, 1);
    CHECK(s.lights[1].name == "other");
    check(s.lights[1].color, 0.5, 0.5, 0.25);
    CHECK(s.lights[2].name.empty());
    const SceneFile none = parse_scene("a.aff", "l 0 0 0");
    check(none.ambient, 1, 1, 1);
    CHECK(!none.animation);
}

TEST_CASE("scene: blocks are a tree, and what is in them stands in their spaces") {
    const SceneGraph g =
        parse_scene("a", ball + "xs 1 2 -3 0 3 4 30 5 6 7 {" + ball + "x wheel{" + ball + "xs 1 1 1 0 0 0 0 0 0 0 {}}" +
                             ball + "}" + ball + "x wheel {" + ball + "}")
            .graph;
    REQUIRE(g.nodes.size() == 4);
    const int32_t parents[] = {-1, 0, 1, -1}, nodes[] = {-1, 0, 1, 0, -1, 3};
    const char *names[] = {"", "wheel", "", "wheel"};
    for (size_t i = 0; i < 4; ++i) {
        CHECK(g.nodes[i].parent == parents[i]);
        CHECK(g.nodes[i].name == names[i]);
    }
    REQUIRE(g.meshes.size() == 6);
    for (size_t i = 0; i < 6; ++i) CHECK(g.meshes[i].node == nodes[i]);
    check(g.nodes[0].placement.scale, 1, 2, -3);
    check(g.nodes[0].placement.axis, 0, 0.6, 0.8); // of unit length
    CHECK(g.nodes[0].placement.degrees == 30);
    check(g.nodes[0].placement.translation, 5, 6, 7);
    check(g.nodes[1].placement.scale, 1, 1, 1);
    CHECK(g.nodes[1].placement.degrees == 0);
    check(g.nodes[2].placement.axis, 0, 0, 1); // where there is no rotation any axis is right

    std::string deep;
    for (int i = 0; i < 256; ++i) deep += "x a {\n";
    CHECK(error_of(deep + "b 0 0 0") == "s.aff:257: the file ends, expected '}' for the block of line 256");
    CHECK(error_of(deep + "x a {") == "s.aff:257: more than 256 blocks in one another, expected no more");
}

TEST_CASE("scene: key frames stay as they are, but for the axes' length; the last motion of a name counts") {
    const std::string transl = "transl 4 0 1 2 3 .1 .2 .3  0 4 5 6 0 0 0  5 7 8 9 1 1 1  2 0 0 0 0 0 0\n";
    const SceneGraph g =
        parse_scene("a", "x wheel { k wheel { visibility 1 9 0 } " + ball + "}\nk wheel {" + transl +
                             "visibility 2 1 0 0 1\n"
                             "rot 4 0 0 3 4 8640 .1 .2 .3  1 0 0 .971 -9 0 0 0  1 0 0 0 0 0 0 0  3 1e-200 0 0 1 0 0 0\n"
                             "scale 5 0 1 2 3 0 0 0 0 1 1 1 0 0 0 0 1 1 1 0 0 0 0 1 1 1 0 0 0 7 0 -1 1 0 0 .5 }\n"
                             "k camera { } k old_camera {" +
                             transl + "}")
            .graph;
    REQUIRE(g.motions.size() == 3);
    CHECK(g.motions.count("camera"));
    CHECK(g.motions.count("old_camera"));
    const Motion &m = g.motions.at("wheel");
    REQUIRE(m.translation.size() == 4);
    check(m.translation[0].value, 1, 2, 3);
    CHECK(m.translation[0].tension == 0.1);
    CHECK(m.translation[0].continuity == 0.2);
    CHECK(m.translation[0].bias == 0.3);
    const double times[] = {0, 0, 5, 2};
    for (size_t i = 0; i < 4; ++i) CHECK(m.translation[i].time == times[i]);
    REQUIRE(m.rotation.size() == 4);
    check(m.rotation[0].value, 0, 0.6, 0.8);
    CHECK(m.rotation[0].degrees == 8640);
    CHECK(m.rotation[0].bias == 0.3);
    check(m.rotation[1].value, 0, 0, 1);
    check(m.rotation[2].value, 0, 0, 1); // no axis, no angle
    check(m.rotation[3].value, 1, 0, 0);
    REQUIRE(m.scale.size() == 5);
    check(m.scale[4].value, 0, -1, 1);
    CHECK(m.scale[4].bias == 0.5);
    REQUIRE(m.visibility.size() == 2);
    CHECK(m.visibility[0].time == 1);
    CHECK(!m.visibility[0].visible);
    CHECK(m.visibility[1].visible);
}

TEST_CASE("scene: lights in blocks stand and point where those put them; their light is the same") {
    const SceneFile s = parse_scene("a", "l 1 2 3 .1 .2 .3 " + right + twice + turn +
                                             "l 1 2 3 .1 .2 .3 lp 1 2 3 4 5 6 ls 1 2 3 1 0 .5 30 7 8 9 "
                                             "ld 0 1 0 1 1 1 } } xs 1 2 3 0 0 1 0 0 0 0 { l 1 1 1 } } l 1 2 3");
    REQUIRE(s.lights.size() == 7);
    check(s.lights[0].position, 1, 2, 3);
    for (size_t i = 1; i < 4; ++i)
        check(s.lights[i].position, 1 - 4, 2, 6); // turned to (-2, 1, 3), then twice, then moved
    check(s.lights[1].color, 0.1, 0.2, 0.3);
    check(s.lights[2].color, 4, 5, 6);
    check(s.lights[3].direction, 0, 1, 0.5);
    CHECK(s.lights[3].degrees == 30);
    check(s.lights[4].direction, -1, 0, 0);
    check(s.lights[5].position, 2, 2, 3);
    check(s.lights[6].position, 1, 2, 3);
}

TEST_CASE("scene: smoke in blocks is as if its own transform did it") {
    const auto grid = [](const std::string &text) {
        PreparedScene prepared;
        prepare_scene("a", parse_scene("a", view + "smoke box -100 -100 -100 -99 -99 -99 1 {}\n" + text), Options(), 0,
                      prepared);
        const GridDescription far = prepared.smokes[0].grid, near = prepared.smokes[1].grid;
        // In units of the far box.
        const double unit = 2 * far.half.x;
        const Double3 half = {near.half.x / unit, near.half.y / unit, near.half.z / unit};
        const Double3 way = {(near.center.x - far.center.x) / unit - 99.5, (near.center.y - far.center.y) / unit - 99.5,
                             (near.center.z - far.center.z) / unit - 99.5};
        return std::array<Double3, 5>{half, way, near.axis[0], near.axis[1], near.axis[2]};
    };
    const std::string box = "smoke box 0 0 0 2 4 6 1 ";
    // The middle, (1, 2, 3), turns to (-2, 1, 3), grows to (-4, 2, 6), and moves to (-3, 2, 6).
    for (const std::string &text :
         {right + twice + turn + box + "{ } } } }", right + twice + box + "{ transform 1 1 1 0 0 1 90 0 0 0 } } }",
          right + box + "{ transform 2 2 2 0 0 7 90 0 0 0 } }", box + "{ transform 2 2 2 0 0 1 90 1 0 0 }"}) {
        CAPTURE(text);
        const auto found = grid(text);
        check(found[0], 2, 4, 6);
        check(found[1], -3, 2, 6);
        check(found[2], 0, 1, 0);
        check(found[3], -1, 0, 0);
        check(found[4], 0, 0, 1);
    }
    std::string grows;
    for (int i = 0; i < 5; ++i) grows += "xs 1e30 1e30 1e30 0 0 1 0 0 0 0 {";
    CHECK_THROWS_WITH(grid(grows + box + "{ } } } } } }"),
                      "a:3: an edge of the grid is outside 1e-100 to 1e100, expected one within");
}

TEST_CASE("scene: comments may begin like a frame number") {
    CHECK(parse_scene("a", "%draw the view\n%04d frames\nb 1 0 0 %d").background.x == 1);
    CHECK(parse_scene("a", "smoke %04d.vtk {}").smokes[0].file == "%04d.vtk");
    CHECK(parse_scene("a", "b 1 0 5%d comment").background.z == 5);
    CHECK(parse_scene("a", "smoke a#b\n{}").smokes[0].file == "a");
}

TEST_CASE("scene: the first view counts") {
    const std::string other = "v from 0 0 9 at 0 0 0 up 0 1 0 angle 50 hither 1 resolution 5 5 ";
    const auto width = [&](const std::string &text) {
        return parse_scene("a", text, [&](const std::string &) { return Bytes(other.begin(), other.end()); })
            .view->width;
    };
    CHECK(width(view + other) == 20);
    // Of the outermost file, if it has any.
    CHECK(width("i 0 b " + view + "i 0 b") == 20);
    CHECK(width("i 0 b") == 5);
}

TEST_CASE("scene: errors name the file, the line, what is wrong and what was expected") {
    const auto repeated = [](int count, const std::string &text) {
        std::string all;
        for (int i = 0; i < count; ++i) all += text;
        return all;
    };
    const struct {
        std::string text, error;
    } cases[] = {
        {"\nxyz 1",
         "s.aff:2: there is no statement 'xyz', expected one of c f fm m p pp s tpa tt ttp a am b d i k l la "
         "ld lp ls render smoke v x xs } or a comment"},
        {"a 0 5 0", "s.aff:1: found '0', expected a whole number from 1 to 1000000000: the number of frames"},
        {"am 1 1 -1", "s.aff:1: found -1, expected blue of 0 or more of the ambient light"},
        {"la { 1 2 3", "s.aff:1: found '{', expected the light's name"},
        {"x a {\nla b 1 2 3 }", "s.aff:2: found 'la' in a block, expected it outside: its motion is in the world"},
        {"x a\nb { }", "s.aff:2: found 'b', expected '{'"},
        {"x { }", "s.aff:1: found '{', expected the name of a motion"},
        {"x a {\nb 0 0 0\n", "s.aff:2: the file ends, expected '}' for the block of line 1"},
        {"x a { }\n}", "s.aff:2: found '}', expected a statement: no block is open in this file"},
        {"xs 1 1 0 0 0 1 0 0 0 0 {", "s.aff:1: found a scale of 0, expected others"},
        {"xs 1 1 1 0 0 0 9 0 0 0 {", "s.aff:1: found axis 0 0 0, expected some length"},
        {"x a {\nl 1 2 3 }", "s.aff:2: a light is in a block 'x', expected it outside: it does not move"},
        {"x a {" + twice + "\nsmoke a.vtk { } } }",
         "s.aff:2: smoke is in a block 'x', expected it outside: it does not move"},
        {"xs 1 2 1 0 0 1 0 0 0 0 {" + twice + "\nsmoke a.vtk { } } }",
         "s.aff:2: smoke is in a block 'xs' whose scales are not equal and above 0, expected uniform scales"},
        {"xs -1 -1 -1 0 0 1 0 0 0 0 {\nld 0 0 1 1 1 1 }",
         "s.aff:2: a light is in a block 'xs' whose scales are not equal and above 0, expected uniform scales"},
        {"xs 1e20 1e20 1e20 0 0 1 0 0 0 0 {\nl 1e20 0 0 }",
         "s.aff:2: the blocks move the light beyond +-1e30, expected smaller transforms"},
        {"k a { transl 3", "s.aff:1: found '3', expected a whole number from 4 to 2147483647: the keys of 'transl'"},
        {"k a { rot 4 " + repeated(4, "0 0 0 0 9 0 0 0 ") + "}", "s.aff:1: found axis 0 0 0, expected some length"},
        {"k a {\nmove 4", "s.aff:2: there is no 'move' in a motion, expected transl rot scale visibility or }"},
        {"k a { scale 4 " + repeated(4, "0 1 1 1 0 0 0 ") + "\nscale 4",
         "s.aff:2: found a second 'scale', expected one in a motion"},
        {"k a { visibility 1 0 1 visibility 1 0 1 }", "s.aff:1: found a second 'visibility', expected one in a motion"},
        {"k a { visibility 1 0 2 }", "s.aff:1: found '2', expected a whole number from 0 to 1: whether it is visible"},
        {"k a { transl 4 0 0 nan 0 0 0 0 " + repeated(3, "0 0 0 0 0 0 0 ") + "}",
         "s.aff:1: found 'nan', expected a number: y of a key"},
        {"k a { }\n}", "s.aff:2: found '}', expected a statement: no block is open in this file"},
        {"k a {\n", "s.aff:1: the file ends, expected '}'"},
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
        {"smoke box 0 0 0 1 1 1 1 {\n grid a }", "s.aff:2: found 'grid', expected none in a box: it has no file"},
        {"smoke a.vtk {\n kernel gauss }", "s.aff:2: found 'gauss', expected spline or poly6"},
        {"smoke a.vtk {\n colour 1 }", "s.aff:2: there is no 'colour' in smoke, expected grid kernel radius mass "
                                       "extinction albedo phase emission transform frames or }"},
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

TEST_CASE("scene: real scenes have the counts that are known of them") {
    const struct {
        const char *file;
        size_t lights, textures, nodes, shapes, triangles, moving; // 0 triangles: as many as curves are given
        double ambient;
        int64_t frames;
    } scenes[] = {
        // Nodes and shapes (statements s c p pp m) counted by an independent script.
        {"bart/kitchen/kitchen.aff", 6, 8, 423, 393, 110561, 7218, 2.5, 800},
        {"bart/robots/Robot.aff", 1, 44, 711, 1849, 71708, 62490, 1, 800},
        {"nff/balls.nff", 3, 0, 0, 7382, 0, 0, std::sqrt(3.0) / 6, 0},
        {"nff/gears.nff", 5, 0, 0, 9345, 0, 0, std::sqrt(5.0) / 10, 0},
        {"nff/rings.nff", 3, 0, 0, 8401, 0, 0, std::sqrt(3.0) / 6, 0},
        {"nff/teapot.nff", 2, 0, 0, 2292, 0, 0, std::sqrt(2.0) / 4, 0},
        {"nff/tetra.nff", 1, 0, 0, 4096, 4096, 0, 0.5, 0},
    };
    for (const auto &known : scenes) {
        WISP_NEEDS_DATA(known.file);
        const std::string path = data_path(known.file);
        CAPTURE(path);
        const SceneFile s = read_scene(path);
        const SceneGraph &g = s.graph;
        size_t triangles = 0, moving = 0;
        for (const Mesh &mesh : g.meshes) {
            triangles += mesh.rows.size();
            bool moves = false;
            for (int32_t n = mesh.node; n >= 0; n = g.nodes[static_cast<size_t>(n)].parent)
                moves = moves || g.motions.count(g.nodes[static_cast<size_t>(n)].name);
            if (moves) moving += mesh.rows.size();
        }
        CHECK(s.view);
        CHECK(s.lights.size() == known.lights);
        CHECK(s.ambient.x == doctest::Approx(known.ambient));
        CHECK(g.textures.size() == known.textures);
        for (const auto &texture : g.textures) CHECK(std::filesystem::exists(texture.path));
        CHECK(g.nodes.size() == known.nodes);
        CHECK(g.meshes.size() == known.shapes);
        if (known.triangles) CHECK(triangles == known.triangles);
        CHECK(moving == known.moving);
        CHECK((s.animation ? s.animation->frames : 0) == known.frames);
        if (known.frames) CHECK(g.motions.count("camera"));
    }
}
