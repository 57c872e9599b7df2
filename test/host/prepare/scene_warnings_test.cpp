// What a scene is warned of, and what not: every doubt has a scene beside it that is in order.
#include "host/prepare/scene_warnings.h"
#include "support/temporary_folder.h"
#include <doctest/doctest.h>
#include <fstream>

using namespace wisp;

namespace {

const std::string camera = "v from 0 0 9 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 8 6\n",
                  light = "lp 3 3 3 40 40 40\n";

struct WarningTest : TemporaryFolder {
    WarningTest() { particles("p.vtk", 40); }
    void particles(const std::string &name, int count) const {
        std::ofstream out(file(name));
        out << "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS " << count << " float\n";
        for (int i = 0; i < 3 * count; ++i) out << (i * 37 % 101) / 101.0 - 0.5 << " ";
        out << "\n";
    }
    // The kinds of the warnings of frame 0, and their texts.
    std::string kinds(const std::string &scene) {
        const SceneFile parsed = parse_scene(file("s.aff"), scene);
        PreparedScene prepared;
        prepare_scene(file("s.aff"), parsed, options, 0, prepared);
        std::string kinds;
        texts.clear();
        for (const Warning &warning : scene_warnings(file("s.aff"), parsed, options, 0, prepared)) {
            kinds += (kinds.empty() ? "" : ", ") + warning.kind;
            texts += warning.place.substr(file("").size()) + ": " + warning.text + "\n";
        }
        return kinds;
    }
    Options options;
    std::string texts;
};

} // namespace

TEST_CASE("scene warnings: nothing in view, in front, behind and beside the camera") {
    WarningTest test;
    const std::string box = "smoke box -1 -1 -1 1 1 1 1 { }\n", ball = "smoke p.vtk { radius 0.2 mass 0.1 }\n",
                      triangle = "p 3\n-1 -1 0\n1 -1 0\n0 1 0\n",
                      moving =
                          "a 0 1 2\nk m { transl 4 0 -0 0 0 0 0 0 0.3 0 0 0 0 0 0 0.6 0 0 0 0 0 0 1 0 0 0 0 0 0 }\n"
                          "x m { " +
                          triangle + "}\n";
    const auto from = [](const std::string &eye, const std::string &at) {
        return "v from " + eye + " at " + at + " up 0 1 0 angle 30 hither 1 resolution 8 6\n" + light;
    };
    for (const std::string &thing : {box, ball, triangle, moving}) {
        CAPTURE(thing);
        CHECK(test.kinds(from("0 0 9", "0 0 0") + thing).empty());
        CHECK(test.kinds(from("0 0 0.5", "0 0 -1") + thing).empty()); // close by, or in it
        CHECK(test.kinds(from("0 0 9", "0 0 20") + thing) == "view");
        CHECK(test.kinds(from("0 0 9", "9 0 3") + thing) == "view");
        CHECK(test.kinds(from("0 0 9", "0 9 3") + thing) == "view");
        CHECK(test.texts == "s.aff: nothing is in view in frame 0: the camera looks past all smoke and surfaces, or "
                            "they are invisible\n");
    }
    // One of several is enough; a corner is.
    CHECK(test.kinds(from("0 0 9", "9 0 3") + ball + "smoke box 8 0 3 9 1 4 1 { }\n").empty());
    CHECK(test.kinds(from("0 0 9", "9 0 3") + "p 3\n-1 -1 0\n1 -1 0\n9 0 3\n").empty());
    CHECK(test.kinds(camera + light) == "view");
    CHECK(test.texts == "s.aff: the scene has neither smoke nor surfaces: the picture is its background\n");
}

TEST_CASE("scene warnings: nothing shines where something could be lit") {
    WarningTest test;
    const std::string triangle = "p 3\n-1 -1 0\n1 -1 0\n0 1 0\n";
    const auto smoke = [](const std::string &more) { return "smoke box -1 -1 -1 1 1 1 1 { " + more + " }\n"; };
    CHECK(test.kinds(camera + smoke("")) == "light");
    CHECK(test.texts == "s.aff: there is no light: the smoke is black\n");
    CHECK(test.kinds(camera + "lp 3 3 3 0 0 0\n" + smoke("")) == "light");
    CHECK(test.texts == "s.aff: all lights are of power 0: the smoke is black\n");
    CHECK(test.kinds(camera + "am 0 0 0\n" + triangle + smoke("")) == "light");
    CHECK(test.texts == "s.aff: there is no light: the smoke and the surfaces are black\n");
    CHECK(test.kinds(camera + smoke("albedo 1 1 1 emission 2 2 2")) == "emission, light"); // it absorbs nothing
    CHECK(test.texts == "s.aff:2: 'emission' does nothing: the smoke emits where it absorbs, and its albedo is 1\n"
                        "s.aff: there is no light: the smoke is black\n");
    CHECK(test.kinds(camera + smoke("albedo 1 0.5 1 emission 2 0 2")) == "emission, light");
    CHECK(test.kinds(camera + smoke("albedo 1 0.5 1 emission 2 1 2")).empty());
    for (const std::string &scene : {"lp 3 3 3 0 0 1\n" + smoke(""), smoke("albedo 0 0 0"), smoke("emission 0 0.1 0"),
                                     triangle, smoke("emission 1 0 0") + smoke("")}) {
        CAPTURE(scene);
        CHECK(test.kinds(camera + scene).empty());
    }
}

TEST_CASE("scene warnings: supports wider than the smoke") {
    WarningTest test; // particles in a cube of edge 1
    test.particles("many.vtk", 101);
    const auto kinds = [&test](const std::string &file, const std::string &radius) {
        return test.kinds(camera + light + "smoke " + file + " { radius " + radius + " mass 0.01 }\n");
    };
    CHECK(kinds("many.vtk", "0.45").empty());
    CHECK(kinds("many.vtk", "0.55") == "wide smoke");
    CHECK(test.texts == "s.aff:3: the supports of the smoke's particles are wider than the smoke: most of its 101 "
                        "particles are in each; is the radius too large?\n");
    CHECK(kinds("p.vtk", "0.55").empty()); // 40 particles
}

TEST_CASE("scene warnings: a still surface so far away that rays start too far from others") {
    WarningTest test;
    const std::string near = "s 0 0 0 0.5\n", box = "smoke box -1 -1 -1 1 1 1 1 { }\n";
    const auto floor = [](const std::string &half) {
        return "p 4 -" + half + " -1 -" + half + " -" + half + " -1 " + half + " " + half + " -1 " + half + " " + half +
               " -1 -" + half + "\n";
    };
    // A picture of a ball in smoke errs by 0.1, 2 and 30 % where a small ball stands at x = 1e5, 1e6 and 1e7.
    for (const std::string &smoke : {std::string(), box})
        for (const char *half : {"10", "1000", "5000"}) {
            CAPTURE(half);
            CHECK(test.kinds(camera + light + near + floor(half) + smoke).empty());
            CHECK(test.kinds(camera + light + near + smoke + "s " + half + " 0 0 0.3\n").empty());
        }
    for (const std::string &smoke : {std::string(), box}) {
        CHECK(test.kinds(camera + light + near + floor("10000000") + smoke) == "far surfaces, near light");
        CHECK(test.kinds(camera + light + near + near + smoke + "s 10000000 0 0 0.3\n") == "far surfaces");
    }
    CHECK(test.kinds(camera + light + floor("10000000")) == "near light"); // no surface is near
}

TEST_CASE("scene warnings: a light nearer to a surface than any arithmetic tells") {
    WarningTest test;
    const auto kinds = [&test](const std::string &half, const std::string &height, const std::string &more = "") {
        return test.kinds("v from 0 2 9 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 80 60\nlp 0 " + height +
                          " 0 1 1 1\n" + more + "p 4 -" + half + " 0 -" + half + " -" + half + " 0 " + half + " " +
                          half + " 0 " + half + " " + half + " 0 -" + half + "\n");
    };
    CHECK(kinds("5e6", "3.5") == "near light");
    CHECK(test.texts ==
          "s.aff: a surface is nearer than 4 to a light, and is lit as if it were so far away: no arithmetic "
          "tells less beside surfaces that reach so far; leave out what is far away\n");
    CHECK(kinds("5e6", "-3.5") == "near light");
    CHECK(kinds("5e6", "4.5").empty());
    CHECK(kinds("5e5", "0.5").empty());
    CHECK(kinds("5e5", "0.2") == "near light");
    CHECK(kinds("5", "0").empty()); // a pixel is wider
    // A triangle's edge, and its corner, beside the light.
    CHECK(kinds("5e6", "9", "p 3 1 7 0 3 7 1 3 7 -1\n") == "near light");
    CHECK(kinds("5e6", "9", "p 3 5 9 0 8 9 1 8 9 -1\n").empty());
}

TEST_CASE("scene warnings: rays that multiply") {
    WarningTest test;
    const auto kinds = [&test](uint32_t depth, const std::string &reflected, const std::string &transmitted) {
        test.options.depth = depth;
        return test.kinds(camera + light + "f 1 1 1 0.1 " + reflected + " 10 " + transmitted + " 1\ns 0 0 0 0.5\n");
    };
    CHECK(kinds(16, "0.9", "0.9") == "many rays");
    CHECK(test.texts ==
          "s.aff: a surface reflects and lets through 1.8 times what it receives, so one camera ray may be "
          "followed by 1.2e+04 others within --depth 16\n");
    CHECK(kinds(10, "0.9", "0.9").empty());
    CHECK(kinds(64, "0.5", "0.5").empty());
    CHECK(kinds(64, "1", "0").empty()); // one ray follows another
}

TEST_CASE("scene warnings: a motion that moves nothing") {
    WarningTest test;
    const auto kinds = [&test](const std::string &motion, const std::string &more) {
        return test.kinds(camera + light + "a 0 1 2\nk " + motion +
                          " { transl 4 0 0 0 0 0 0 0 0.3 0 0 0 0 0 0 0.6 0 0 0 0 0 0 1 0 0 0 0 0 0 }\n"
                          "x box { p 3\n-1 -1 0\n1 -1 0\n0 1 0\n}\n" +
                          more);
    };
    CHECK(kinds("box", "").empty()); // an 'x' without a motion stands still: files of others have such
    CHECK(kinds("camera", "").empty());
    CHECK(kinds("bix", "") == "motion");
    CHECK(test.texts ==
          "s.aff: the motion 'bix' moves nothing: there is neither an 'x bix' nor a light 'la' of this name\n");
    CHECK(kinds("lamp", "la lamp 0 3 3 40 40 40\n").empty());
}

TEST_CASE("scene warnings: times that descend") {
    WarningTest test;
    const auto kinds = [&test](const std::string &tracks) {
        return test.kinds(camera + light + "a 0 3 4\nk b { " + tracks + " }\nx b { p 3\n-1 -1 0\n1 -1 0\n0 1 0\n}\n");
    };
    const auto keys = [](const char *a, const char *b, const char *c, const char *d) {
        std::string text = "transl 4";
        for (const char *time : {a, b, c, d}) text += std::string(" ") + time + " 0 0 0 0 0 0";
        return text;
    };
    CHECK(kinds(keys("0", "1", "2", "3")).empty());
    CHECK(kinds(keys("0", "0", "3", "3")).empty()); // files of others have such
    CHECK(kinds(keys("0", "2", "1", "3")) == "times");
    CHECK(test.texts == "s.aff: the times of 'transl' in 'k b' descend\n");
    CHECK(kinds("visibility 2 2 1 0 1") == "times");
    CHECK(test.texts == "s.aff: the times of 'visibility' in 'k b' descend\n");
}

TEST_CASE("scene warnings: smoke that is not there") {
    WarningTest test;
    test.particles("none.vtk", 0);
    CHECK(test.kinds(camera + light + "smoke none.vtk { }") == "empty smoke");
    CHECK(test.texts == "s.aff:3: " + test.file("none.vtk") + " has no particles\n");
    test.options.decimate = 0.9;
    CHECK(test.kinds(camera + light + "smoke p.vtk { radius 1 mass 1e-9 }") == "empty smoke");
    CHECK(test.texts == "s.aff:3: " + test.file("p.vtk") + " has no particles, or --thin leaves out all of them\n");
    test.options.decimate = 0;
    CHECK(test.kinds(camera + light + "smoke p.vtk { radius 1 mass 0 }") == "empty smoke");
    CHECK(test.texts == "s.aff:3: " + test.file("p.vtk") + " has no particle with a mass above 0\n");
    CHECK(test.kinds(camera + light + "smoke p.vtk { radius 1 mass 1 extinction 0 }") == "empty smoke");
    CHECK(test.kinds(camera + light + "smoke box -1 -1 -1 1 1 1 0 { }") == "empty smoke");
    CHECK(test.texts == "s.aff:3: the smoke is invisible: its density is 0\n");
}

TEST_CASE("scene warnings: smoke too thin to be seen, or like a solid") {
    WarningTest test;
    const auto box = [&](const std::string &density, const std::string &more = "") {
        return test.kinds(camera + light + "smoke box -1 -1 -1 1 1 1 " + density + " { " + more + " }\n");
    };
    CHECK(box("1e-7") == "thin smoke");
    CHECK(test.texts ==
          "s.aff:3: the smoke is all but invisible: its optical depth is at most 2e-07; is the density or "
          "the extinction too small?\n");
    CHECK(box("1e-7", "emission 1e6 1e6 1e6").empty()); // glows
    test.options.exposure = 20;
    CHECK(box("1e-7").empty()); // shown a million times as bright
    test.options.exposure = 0;
    CHECK(box("0.001").empty());
    CHECK(box("100").empty());
    CHECK(box("1000") == "solid smoke");
    CHECK(test.texts == "s.aff:3: the smoke is like a solid: its mean optical depth is 2e+03; is the density or the "
                        "extinction too large?\n");
    const auto particles = [&](const std::string &mass) {
        return test.kinds(camera + light + "smoke p.vtk { radius 0.2 mass " + mass + " }\n");
    };
    CHECK(particles("1e-8") == "thin smoke");
    CHECK(particles("0.1").empty());
    CHECK(particles("1e4") == "solid smoke, coarse places");
    test.particles("one.vtk", 1);
    CHECK(test.kinds(camera + light + "smoke one.vtk { radius 0.2 mass 0.1 }\n").empty()); // is 0.8 wide
}

TEST_CASE("scene warnings: materials of which fixed point has few digits") {
    WarningTest test;
    const auto seen = [&test](const std::string &material) {
        return test.kinds(camera + light + "am 0 0 0\n" + material + "\np 3 -1 -1 0 1 -1 0 0 1 0\n");
    };
    const std::string dark = "f 1 1 1 1e-7 0 1 0 0";
    CHECK(seen(dark).empty());
    test.options.arithmetic = Arithmetic::fixed;
    CHECK(seen(dark) == "digits of materials");
    CHECK(test.texts ==
          "s.aff: fixed point has few digits for a material whose brightest colour is 1e-07; --arith f32 and "
          "f64 have\n");
    CHECK(seen("f 1 1 1 1e-5 0 1 0 0").empty());
    CHECK(seen("f 1 1 1 0 0 1 0 0").find("digits") == std::string::npos);    // black
    CHECK(seen("f 1 1 1 1e-7 1 1 0 0").find("digits") == std::string::npos); // beside its mirror
}

TEST_CASE("scene warnings: smoke so dense that f32 has no digits for places in it") {
    WarningTest test;
    const auto box = [&](const std::string &from) {
        return test.kinds("v from " + from + " at 0 0 0 up 0 1 0 angle 40 hither 0.01 resolution 8 8\n" + light +
                          "smoke box -0.01 -0.01 -0.01 0.01 0.01 0.01 48000 { }\n");
    };
    CHECK(box("0 0 10").empty()); // 0.06 mean free paths
    CHECK(box("0 0 40") == "coarse places");
    CHECK(test.texts ==
          "s.aff:3: f32 places what the camera sees to within 0.23 mean free paths in this smoke; --arith f64 has "
          "digits for it\n");
    test.options.arithmetic = Arithmetic::f64;
    CHECK(box("0 0 40").empty());
}

TEST_CASE("scene warnings: optical depths through grids and particles along the axes") {
    SmokeDescription smoke = {};
    const float density[] = {0, 0, 1, 0, 0, 0.5f, 0, 1}; // x fastest
    smoke.grid.nx = smoke.grid.ny = smoke.grid.nz = 2;
    smoke.grid.density = density;
    smoke.grid.extinction = 2;
    smoke.grid.half = {1, 2, 4}; // cells of 1 x 2 x 4
    const DepthRange grid = depths_through(smoke);
    // Along x columns of 1, 0.5 and 1; along y of 1 and 1.5; along z of 1, 0.5 and 1.
    CHECK(grid.least_mean == doctest::Approx(2 * 2.5 / 3));
    CHECK(grid.largest == doctest::Approx(2 * 4 * 1));
    // Two particles on a line along z, and one beside it.
    const Particle particles[] = {{{0.5, 0.5, 0}, 1, 8}, {{0.5, 0.5, 90}, 1, 4}, {{30, 0.5, 0}, 1, 2}};
    SmokeDescription line = {};
    line.particles = particles;
    line.count = 3;
    line.smallest_h = line.largest_h = 1;
    const DepthRange depths = depths_through(line); // columns of 2 x 2
    CHECK(depths.largest == 3);
    CHECK(depths.least_mean == doctest::Approx(14 / 4.0 / 3));
}
