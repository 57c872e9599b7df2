// Warnings as a user meets them: once in a run, and none where all is in order.
#include "support/command_line.h"
#include "host/images/compare.h"
#include "host/images/picture.h"
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <vector>

using namespace wisp;

namespace {

struct WarningCommandTest : CommandLineTest {
    // What `render` warns of with these options, in the scene s.aff.
    std::string warned(const std::string &options) const {
        const Ran ran = wisp("render " + s() + " --digest " + options);
        CHECK(ran.status == 0);
        if (!ran.err.empty()) CHECK(wisp("render " + s() + " --digest -q " + options).err.empty());
        return ran.err;
    }
    static std::string idle(const std::string &option, const std::string &reason) {
        return "wisp: warning: option '" + option + "' does nothing here: " + reason + "\n";
    }
};

} // namespace

TEST_CASE("warnings: an option that does nothing says why, one that does something is silent") {
    const WarningCommandTest test;
    const auto idle = WarningCommandTest::idle;
    const std::string by_paths = "the reference follows random paths instead", reference = "--reference --passes 0:1 ";
    const std::pair<std::string, std::string> cases[] = {
        {"--gather 10", idle("gather", "no nearest photons are looked up")},
        {"--gather 10 --smoke direct --photons 300000", ""},
        {"--gather-radius 1", idle("gather-radius", "no nearest photons are looked up")},
        {"--irradiance-step 1 --irradiance none",
         idle("irradiance-step", "--irradiance none: estimated at every step")},
        {"--irradiance-step 1", ""},
        {"--light-step 0.5 " + reference, idle("light-step", by_paths)},
        {"--step 0.3 " + reference, idle("step", by_paths)},
        {"--step 0.3", ""},
        {"--photons 100 " + reference, idle("photons", by_paths)},
        {"--seed 2 " + reference, ""},
        {"--photons 0", ""},
        {"--photons 0 --seed 3", idle("seed", "--photons 0")},
        {"--density-step 0.5 " + reference, idle("density-step", "densities are exact")},
        {"--density-step 0.5", ""},
        {"--deposit path --smoke direct --photons 300000", idle("deposit", "photons are kept, not power on particles")},
        {"--estimate kernel --smoke volume --photons 300000",
         idle("estimate", "photons are kept, not power on particles")},
        {"--estimate kernel", ""},
        {"--remap", idle("remap", "there is one frame, and no map before it")},
        {"--shadows trace", idle("shadows", "there is no triangle")},
        {"--lights cuts", idle("lights", "of no use: there is no surface")},
        {"--lights all --thin 0 --exposure 0", ""},
        {"--exposure 1", idle("exposure", "no .png is written")},
        {"--exposure 1 -o " + test.file("x.png"), ""},
        {"--frames 0:1", idle("frames", "nothing differs from frame to frame")},
        {"--frames 4", ""},
        {"--gather 10 --gather 11 --frames 0:2",
         idle("gather", "no nearest photons are looked up") + idle("frames", "nothing differs from frame to frame")}};
    for (const auto &[options, err] : cases) {
        CAPTURE(options);
        CHECK(test.warned(options) == err);
    }
}

TEST_CASE("warnings: without smoke the methods of smoke do nothing, and there is no map to write") {
    WarningCommandTest test;
    const std::string view = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 8 8\nl 0 3 5\n";
    for (const std::string &scene : {view + "s 0 0 0 1\n", view}) {
        test.write("s.aff", scene);
        const std::string digest = test.wisp("render -q --digest " + test.s()).out;
        for (const std::string method : {"map", "direct", "volume"}) {
            CHECK(test.warned("--smoke " + method).find(test.idle("smoke", "there is no smoke")) != std::string::npos);
            CHECK(test.wisp("render -q --digest " + test.s() + " --smoke " + method).out == digest);
        }
        for (const std::string option : {"map-out", "map-in"})
            test.refuses(test.wisp("render " + test.s() + " -o " + test.file("p.png") + " --" + option + " " +
                                   test.file("m.map")),
                         2,
                         test.s() + ": option '" + option +
                             "': found a scene without smoke, expected smoke, of whose photons a map is");
    }
}

TEST_CASE("warnings: an option that is said to do nothing changes no bit" * doctest::test_suite("long")) {
    WarningCommandTest test;
    test.write("g.vol", CommandLineTest::volume(2, 2, 2, 1, 1, 1, {1, 2, 0, 1, 2, 0, 0, 1}));
    test.write("q.vtk", CommandLineTest::puff(40));
    const std::string view = "v from 0 0 6 at 0 0 0 up 0 1 0 angle 40 hither 0.01 resolution 6 6\nlp 3 4 3 40 40 40\n";
    const std::string samples = view + "smoke g.vol { extinction 2 albedo .9 .9 .9 ", box = "smoke box -1 -1 -1 1 1 1 ";
    int idle = 0;
    for (const std::string &scene :
         {samples + "}\n", samples + "transform 1 1 1 0 1 1 35 0 0 0 }\n", view + box + "2 { albedo .9 .9 .9 }\n",
          view + "smoke q.vtk { radius 0.5 mass 1 extinction 0.5 albedo .9 .9 .9 phase 0.3 }\n",
          view + "f .5 .5 .5 1 0 1 0 1\np 3 -5 -2 -5 5 -2 -5 0 -2 5\n" + box + "2 { albedo .9 .9 .9 }\n"}) {
        test.write("s.aff", scene);
        CAPTURE(scene);
        for (const std::string base : {"", "--smoke map ", "--photons 0 ", "--irradiance none ", "--smoke direct "}) {
            CAPTURE(base);
            const std::string without = test.s() + " --photons 500 " + base;
            const std::string digest = test.wisp("render -q --digest " + without).out;
            for (const std::string option :
                 {"density-step 0.6", "irradiance-step 0.7", "light-step 0.8", "step 0.3", "gather 20", "deposit path",
                  "deposit kernel", "direction mean", "shadows trace", "lights cuts", "seed 7"}) {
                CAPTURE(option);
                const std::string with = without + "--" + option, name = option.substr(0, option.find(' '));
                if (test.wisp("plan " + with).err.find("option '" + name + "' does nothing here") == std::string::npos)
                    continue;
                ++idle;
                CHECK(test.wisp("render -q --digest " + with).out == digest);
            }
        }
    }
    CHECK(idle > 100);
}

TEST_CASE("warnings: --remap changes no bit, where paths take the place of photons neither" *
          doctest::test_suite("long")) {
    WarningCommandTest test;
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 40 hither 0.01 resolution 6 6\nlp 3 4 3 40 40 40\n"
                        "smoke box -1 -1 -1 1 1 1 100 { albedo .5 .5 .5 }\n");
    CHECK(test.warned("--remap").find("option 'remap' does nothing here") != std::string::npos);
    for (const std::string frames : {"", " --frames 0:1"}) {
        const std::string without = "render -q --digest " + test.s() + frames;
        const std::string digest = test.wisp(without).out;
        CHECK(digest.size() >= 64);
        CHECK(test.wisp(without + " --remap").out == digest);
    }
}

TEST_CASE("warnings: cells that a density grid does not have are taken for those that it has") {
    WarningCommandTest test;
    test.write("g.vol", CommandLineTest::volume(2, 2, 2, 1, 1, 1, {1, 2, 0, 1, 2, 0, 0, 1}));
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 40 hither 0.01 resolution 6 6\nlp 3 4 3 40 40 40\n"
                        "smoke g.vol { extinction 2 albedo .9 .9 .9 }\n");
    const auto taken = [](const std::string &found, const std::string &cell) {
        return "wisp: warning: option 'density-step': found " + found + ", taken for " + cell +
               ": the cells of a density grid are 1, 0.5, 0.25 or 0.125 samples\n";
    };
    CHECK(test.warned("--photons 0 --density-step 0.2") == taken("0.2", "0.25"));
    CHECK(test.warned("--photons 0 --density-step 0.01") == taken("0.01", "0.125"));
    CHECK(test.warned("--photons 0 --density-step 3") == taken("3", "1"));
    for (const char *cell : {"0.5", "0.25", "0.125"})
        CHECK(test.warned(std::string("--photons 0 --density-step ") + cell) == "");
    CHECK(test.wisp("plan " + test.s() + " -q --photons 0 --density-step 0.2").out.find(", --density-step 0.25\n") !=
          std::string::npos);
}

TEST_CASE("warnings: an option that one frame of several needs is silent") {
    WarningCommandTest test;
    const std::string none = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n\n";
    test.write("q_0.vtk", none);
    test.write("q_1.vtk", CommandLineTest::puff(40));
    test.write("q_2.vtk", none);
    test.write("s.aff", CommandLineTest::scene("q_%d.vtk", ""));
    const std::string empty = test.s() + ":4: warning: " + test.file("q_0.vtk") + " has no particles\n";
    CHECK(test.warned("--frames 0:2 --photons 2000") == empty); // once, though frame 2 has none either
    CHECK(test.warned("--frames 0 --photons 2000") == empty + WarningCommandTest::idle("photons", "there is no smoke"));
}

TEST_CASE("warnings: the nearest photons' estimate, where it is far off" * doctest::test_suite("long")) {
    WarningCommandTest test;
    std::string ball = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 500 float\n";
    uint32_t state = 4;
    for (int count = 0; count < 500;) {
        double p[3], square = 0;
        for (double &x : p) {
            state = state * 1664525u + 1013904223u;
            x = (state >> 8) * 0x1p-23 - 1;
            square += x * x;
        }
        if (square > 1) continue;
        ball += std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + " ";
        ++count;
    }
    test.write("ball.vtk", ball + "\n");
    const auto render = [&](const std::string &options) {
        const Ran ran = test.wisp("render " + test.s() + " -o " + test.file("p.pfm") + " " + options);
        CHECK(ran.status == 0);
        return std::pair(read_pfm(test.file("p.pfm")), ran.err);
    };
    struct Error {
        int said; // per cent, or 0
        double found;
    };
    const auto error = [&](const std::string &extinction, const std::string &albedo, const std::string &options) {
        test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 22 hither 0.1 resolution 12 12\nlp 4 5 4 40 40 40\n"
                            "smoke ball.vtk { radius 0.25 mass 0.01 extinction " +
                                extinction + " albedo " + albedo + " " + albedo + " " + albedo + " }\n");
        const auto [picture, err] = render("--spp 1 " + options);
        const size_t at = err.find("up to ");
        CHECK((err.empty() || (err.rfind("wisp: warning: --smoke ", 0) == 0 && at != std::string::npos)));
        const int said = err.empty() ? 0 : std::stoi(err.substr(at + 6));
        return Error{said, compare(picture, render("--spp 1 --photons 200k").first).relative_rmse};
    };
    const std::pair<const char *, const char *> cases[] = {
        {"3", "--smoke direct --photons 20000"},   {"100", "--smoke direct --photons 20000"},
        {"100", "--smoke volume --photons 20000"}, {"100", "--smoke direct --photons 20000 --gather 50"},
        {"10", "--smoke direct --photons 150000"}, {"3", "--smoke direct --photons 20000 --gather 50"},
        {"1", "--smoke direct --photons 20000"}};
    for (const auto &[extinction, options] : cases) {
        CAPTURE(extinction);
        CAPTURE(options);
        const auto [said, found] = error(extinction, "0.9", options);
        CHECK(said >= 10);
        CHECK(found < 0.012 * said);
        CHECK(found > 0.003 * said);
    }
    CHECK(error("0.2", "0.9", "--smoke direct --photons 20000").said == 0);
    CHECK(error("30", "0.2", "--smoke direct --photons 20000").said == 0);
    CHECK(error("3", "0.9", "--photons 20000").said == 0);
    // Against --reference the first lacks all that is scattered more than once.
    for (const auto &[radius, few] : {std::pair("0.001", true), {"0.1", true}, {"1", false}}) {
        CAPTURE(radius);
        const std::string options =
            std::string(" --smoke direct --gather 50 --photons 20000 --gather-radius ") + radius;
        const std::string err = test.wisp("render " + test.s() + " --digest" + options).err;
        CHECK((err.find("within --gather-radius there are about ") != std::string::npos) == few);
    }
}

TEST_CASE("warnings: shapes that are not there, or not whole") {
    WarningCommandTest test;
    const std::string view = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 60 hither 1 resolution 4 4\nl 0 0 4\n",
                      triangle = "p 3 -1 -1 0 1 -1 0 0 1 0\n";
    const auto warned = [&](const std::string &shape) {
        test.write("s.aff", view + shape + triangle);
        return test.warned("");
    };
    const std::string no_area = test.s() + ":3: warning: the surface has no area: it is invisible\n",
                      crosses = test.s() + ":3: warning: the polygon crosses itself: parts of it are missing\n";
    CHECK(warned("").empty());
    CHECK(warned("p 4 0 0 0 2 2 0 2 0 0 0 1 0\n") == crosses);
    CHECK(warned("p 3 0 0 0 1 1 0 2 2 0\n") == no_area);
    CHECK(warned("pp 3 0 0 0 0 0 1 1 1 0 0 0 1 2 2 0 0 0 1\n") == no_area);
    CHECK(warned("m vertices 3 0 0 0 1 0 0 2 0 0 triangles 2 0 1 2 0 0 1\n") == no_area);
    CHECK(warned("m vertices 3 0 0 0 1 0 0 2 1 0 triangles 2 0 1 1 0 1 2\n").empty());
}

TEST_CASE("warnings: what stands so near to a large sphere that its flat triangles reach it") {
    WarningCommandTest test;
    // An eye and a light so high above the sphere, and a sphere that stands on it.
    const auto warned = [&](double eye, double light, double radius, const std::string &more = "") {
        test.write("s.aff", "v from 0 " + std::to_string(eye) +
                                " 0 at 0 0 9 up 0 1 0 angle 30 hither 0.1 resolution 4 4\nl 0 " +
                                std::to_string(light) + " 9\ns 0 -" + std::to_string(radius) + " 0 " +
                                std::to_string(radius) + "\n" + more);
        return test.warned("");
    };
    const std::string
        here = test.s() + ":3: warning: ",
        hidden = " may lie on the wrong side of this sphere: it is made of 720 flat triangles, which reach up to ",
        advice = " it; a smaller sphere errs by less, a polygon by nothing\n";
    CHECK(warned(6, 60, 1000) == "");
    CHECK(warned(5, 60, 1000) == here + "the eye" + hidden + "5.0965 out of" + advice);
    CHECK(warned(6, 4, 1000) == here + "a light" + hidden + "5.0965 out of" + advice);
    CHECK(warned(-2, 60, 1000) == here + "the eye" + hidden + "2.34364 into" + advice);
    CHECK(warned(-3, 60, 1000) == "");
    CHECK(warned(60, 60, 100, "s 0 6 0 6\n") == "");
    CHECK(warned(60, 60, 1000, "s 0 6 0 6\n") == here + "a sphere of radius 6" + hidden + "5.0965 out of" + advice);
    CHECK(warned(60, 60, 1000, "s 0 26 0 6\n") == ""); // it flies
}

TEST_CASE("warnings: motions that turn the other way round, and tracks that move nothing") {
    WarningCommandTest test;
    const auto warned = [&](const std::string &keys) {
        test.write("s.aff", "v from 0 0 9 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nla lamp 0 0 9\n"
                            "x w { p 3 -1 -1 0 1 -1 0 0 1 0 }\nk " +
                                keys + "\n");
        return test.warned("");
    };
    const auto turns = [](const std::string &name, const std::vector<int> &degrees) {
        std::string keys = name + " { rot " + std::to_string(degrees.size());
        for (size_t i = 0; i < degrees.size(); ++i)
            keys += " " + std::to_string(i) + " 0 0 1 " + std::to_string(degrees[i]) + " 0 0 0";
        return keys + " }";
    };
    CHECK(warned(turns("w", {270, 315, 360, 405})).empty());
    CHECK(warned(turns("w", {0, 170, 340, 510})).empty());
    CHECK(warned(turns("w", {270, 315, 360, 45})) ==
          test.s() + ": warning: keys 3 and 4 of 'rot' in 'k w' are half a turn or more apart: the turn is the shorter "
                     "one, and uneven (behind 315 comes 360, then 405, not 45)\n");
    for (const std::vector<int> &far : {std::vector<int>{0, 180, 200, 220}, {0, 0, 360, 360}, {0, 0, 300, 300}})
        CHECK(warned(turns("w", far)).find("half a turn or more apart") != std::string::npos);
    CHECK(warned(turns("lamp", {0, 10, 20, 30})) ==
          test.s() + ": warning: 'rot' in 'k lamp' does nothing: a light has 'transl' alone\n");
    CHECK(warned("camera { visibility 1 0 1 }") ==
          test.s() + ": warning: 'visibility' in 'k camera' does nothing: a camera has 'transl' and 'rot' alone\n");
    CHECK(warned("w { visibility 1 0 1 }").empty());
}

TEST_CASE("warnings: what shows a bright background is not black; channels that fixed point has no digits for") {
    WarningCommandTest test;
    const auto warned = [&](const std::string &scene, const std::string &options = "") {
        test.write("s.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 4 4\nam 0 0 0\n" + scene +
                                " s 0 0 0 1\n");
        return test.warned(options);
    };
    const std::string black = test.s() + ": warning: there is no light: the surfaces are black\n";
    CHECK(warned("b 1 1 1 f 1 1 1 0 1 0 0 1").empty());
    CHECK(warned("b 1 1 1 f 1 1 1 0 0 0 1 1.5").empty());
    CHECK(warned("b 0 0 0 f 1 1 1 0 1 0 0 1") == black);
    CHECK(warned("b 1 1 1 f 1 1 1 1 0 0 0 1") == black);
    CHECK(warned("lp 0 0 2 1e9 1 1 f 1 1 1 1 0 0 0 1", "--arith fixed") ==
          test.s() + ": warning: fixed point has no digits for a channel of a light that is 1e-09 of the light's "
                     "brightest one; --arith f32 and f64 have\n");
    CHECK(warned("lp 0 0 2 1e9 1 1 f 1 1 1 1 0 0 0 1").empty());
    CHECK(warned("lp 0 0 2 1e3 1 0 f 1 1 1 1 0 0 0 1", "--arith fixed").empty());
}

TEST_CASE("warnings: files that are to change from frame to frame have a number") {
    WarningCommandTest test;
    const auto warned = [&](const std::string &name, const std::string &frames) {
        test.write("s.aff", "v from 0 0 9 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nl 0 9 0\n\nsmoke " +
                                name + " { radius 1  mass 1  extinction 1 " + frames + "}\n");
        return test.warned("--photons 0");
    };
    for (const char *name : {"q_0.vtk", "q_7.vtk"}) test.write(name, CommandLineTest::puff(40));
    CHECK(warned("q_0.vtk", "frames 7 1 ") == test.s() +
                                                  ":4: warning: 'frames' does nothing: there is no %04d in the name " +
                                                  test.file("q_0.vtk") + ", so each frame shows the same file\n");
    CHECK(warned("q_%01d.vtk", "frames 7 1 ").empty());
    CHECK(warned("q_0.vtk", "").empty());
}

TEST_CASE("warnings: the project's own scenes have none") {
    const CommandLineTest test;
    for (const std::string scene : {"demo", "glow", "grid", "small", "surfaces", "wake"}) {
        CAPTURE(scene);
        const Ran ran = test.wisp("plan fixtures/" + scene + ".aff --frames 2 --size 8x6 --spp 1");
        CHECK(ran.status == 0);
        CHECK(ran.err.empty());
    }
}

TEST_CASE("warnings: plan and inspect warn as render does") {
    WarningCommandTest test;
    test.write("s.aff", "v from 0 0 4 at 0 0 9 up 0 1 0 angle 30 hither 1 resolution 4 4\nb 1 1 1\n"
                        "smoke box 0 0 0 1 1 1 1 { }\n");
    const std::string err = test.warned("--gather 9");
    CHECK(err == test.s() +
                     ": warning: nothing is in view in frame 0: the camera looks past all smoke and surfaces, or they "
                     "are invisible\n" +
                     test.s() + ": warning: there is no light: the smoke is black\n" +
                     WarningCommandTest::idle("gather", "there are no photons"));
    CHECK(test.wisp("plan " + test.s() + " --gather 9").err == err);
    CHECK(test.wisp("inspect " + test.s() + " 1 2 --gather 9").err == err);
    CHECK(test.wisp("plan " + test.s() + " --gather 9 -q").err.empty());
    CHECK(test.wisp("plan " + test.file("s.aff") + " --smoke direct").out.find("gather") != std::string::npos);
}

TEST_CASE("warnings: options that leave light in places of many mean free paths, or of backward phases" *
          doctest::test_suite("long")) {
    WarningCommandTest test;
    const auto warned = [&](const std::string &density, const std::string &phase, const std::string &options) {
        test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 30 hither 0.01 resolution 4 4\nlp 3 4 3 40 40 40\n"
                            "smoke box -1 -1 -1 1 1 1 " +
                                density + " { albedo .9 .9 .9 phase " + phase + " }\n");
        return test.warned("--photons 2000 " + options);
    };
    // Against --reference light of more than one scattering is 0.22 of what it is for the first of these.
    CHECK(warned("8", "0", "--irradiance none") ==
          "wisp: warning: light that is scattered more than once is likely up to 100 % wrong here: photons leave it in "
          "places that are up to 16 mean free paths wide; without --irradiance wisp chooses what errs by less\n");
    CHECK(warned("8", "0", "--density-step 3").find("likely up to 62 % wrong here") != std::string::npos); // 19 %
    CHECK(warned("8", "0", "--irradiance-step 6").find("; without --irradiance-step wisp chooses ") !=
          std::string::npos);
    CHECK(warned("1", "-0.9", "--irradiance-step 1").find("50 % wrong here, or more") != std::string::npos);
    for (const char *density : {"0.1", "8", "500"})
        for (const char *phase : {"0", "-0.9", "0.9"}) { // paths take their place, few of which are noisy
            const std::string said = without_noise(warned(density, phase, "")),
                              noise = " wrong here, by noise: 31 random paths from each";
            CAPTURE(said);
            if (said.empty()) continue;
            CHECK(said.find(noise) != std::string::npos);
            CHECK(std::count(said.begin(), said.end(), '\n') == 1);
        }
    CHECK(warned("0.1", "0", "--irradiance none") == "");
    CHECK(without_noise(warned("1", "0", "--irradiance-step 1")) == "");
}

TEST_CASE("warnings: a light at the eye, both in smoke" * doctest::test_suite("long")) {
    WarningCommandTest test;
    const auto warns = [&](const std::string &light, const std::string &options = "") {
        test.write("s.aff", "v from 0 0 0 at 0 0 1 up 0 1 0 angle 60 hither 0.01 resolution 8 8\n" + light +
                                " 9 9 9\nsmoke box -1 -1 -1 1 1 1 1 { extinction 3 phase 0.5 }\n");
        return test.warned(options).find("up to 10 % too dark here: a light in the smoke") != std::string::npos;
    };
    CHECK(warns("lp 0 0.03 0"));
    // The warning is true.
    REQUIRE(test.wisp("render " + test.s() + " -q -o " + test.file("p.pfm")).status == 0);
    REQUIRE(test.wisp("render " + test.s() + " -q -o " + test.file("r.pfm") + " --reference --passes 0:512").status ==
            0);
    const auto mean = [&](const char *name) {
        const std::vector<float> rgb = read_pfm(test.file(name)).rgb;
        return std::accumulate(rgb.begin(), rgb.end(), 0.0) / static_cast<double>(rgb.size());
    };
    const double ratio = mean("p.pfm") / mean("r.pfm");
    CHECK(ratio < 0.97);
    CHECK(ratio > 0.8);
    CHECK(!warns("lp 0 0.3 0"));
    CHECK(!warns("ld 0 -1 0"));
    CHECK(!warns("lp 0 0.03 0", "--photons 0"));
    CHECK(!warns("lp 0 0.03 0", "--reference --passes 0:2"));
}

TEST_CASE("warnings: a light in the eye, whose light scattered back has no limit") {
    WarningCommandTest test;
    const auto warned = [&](const std::string &light, const std::string &albedo, const std::string &options) {
        test.write("s.aff", "v from 0 0 0 at 0 0 1 up 0 1 0 angle 60 hither 0.01 resolution 4 4\n" + light +
                                " 9 9 9\nsmoke box -1 -1 -1 1 1 1 1 { albedo " + albedo + " }\n");
        return test.warned(options);
    };
    const std::string no_limit = "no picture of this is right: a light in the smoke stands in the eye";
    for (const char *options : {"--photons 0", "--photons 1000", "--reference --passes 0:2"}) {
        CAPTURE(options);
        CHECK(warned("lp 0 0 0", ".9 .9 .9", options).find(no_limit) != std::string::npos);
        CHECK(warned("lp 0 0 0", ".9 .9 .9", options).find("up to 10 % too dark") == std::string::npos);
        CHECK(warned("lp 0 0 0.01", ".9 .9 .9", options).find(no_limit) == std::string::npos);
    }
    CHECK(warned("lp 0 0 0", "0 0 0", "--photons 0") == "");
    CHECK(warned("lp 0 0 2", ".9 .9 .9", "--photons 0") == "");
}

TEST_CASE("warnings: a light that is seen through smoke of a narrow peak") {
    WarningCommandTest test;
    const auto warns = [&](const std::string &light, const std::string &phase, const std::string &beside = "",
                           const std::string &options = "") {
        test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 30 hither 0.01 resolution 4 4\n" + light +
                                " 40 40 40\n" + beside + "smoke box -1 -1 -1 1 1 1 0.5 { phase " + phase + " }\n");
        const std::string warned = test.warned("--photons 2000 " + options);
        return warned.find("warning: pixels around a light that is seen through the smoke are likely 10 % wrong or "
                           "more: a phase of " +
                           phase + " scatters") != std::string::npos;
    };
    CHECK(warns("lp 0.5 0.5 -6", "0.95"));
    CHECK(warns("lp 0.5 0.5 -6", "0.999"));
    CHECK(warns("lp 0.5 0.5 0.5", "0.95")); // in it
    CHECK(warns("ld 0.1 0 1", "0.95"));
    CHECK(!warns("lp 0.5 0.5 -6", "0.9"));
    CHECK(!warns("lp 0.5 0.5 1.5", "0.95")); // before it
    CHECK(!warns("lp 5 0.5 -6", "0.95"));    // beside the picture
    CHECK(!warns("lp 2.5 0.5 -6", "0.95"));  // beside the smoke
    CHECK(!warns("ld 0.1 0 -1", "0.95"));    // from behind the eye
    const std::string black = "f 0 0 0 0 0 0 0 0\n", wall = black + "p 4  -9 -9 -3  9 -9 -3  9 9 -3  -9 9 -3\n",
                      step = black + "p 4  -9 -9 -3  9 -9 -3  9 -3 -3  -9 -3 -3\n";
    CHECK(!warns("lp 0.5 0.5 -6", "0.95", wall));
    CHECK(warns("lp 0.5 0.5 -6", "0.95", step));
    CHECK(!warns("lp 0.5 0.5 -6", "0.95", "", "--photons 0")); // light that is scattered once has the whole phase
}

TEST_CASE("warnings: few photons for their cells, as noisy as is said" * doctest::test_suite("long")) {
    const WarningCommandTest test;
    const auto scene = [&](const std::string &eye, const std::string &more) {
        std::ofstream(test.s()) << "v from " + eye +
                                       " at 5 0.1 0.3 up 0 1 0 angle 60 hither 0.1 resolution 8 8\n"
                                       "ld 1 -1 -1 3 2 1\nlp 2 0.5 2 4 5 8\nsmoke box -1 -1 -1 1 1 1 " +
                                       more + " }\n";
    };
    const std::string eye = "0.1 0.05 0.2", outside = "-4 0.4 0.1", dense = "6 { albedo 0.9 0.9 0.9 phase 0.5",
                      said = "wrong here, by noise of ";
    const auto warns = [&](const std::string &options) {
        const Ran ran = test.wisp("render " + test.s() + " --spp 1 -o " + test.file("p.pfm") + " " + options);
        CHECK(ran.status == 0);
        const size_t at = ran.err.find(said);
        if (at == std::string::npos) return 0;
        const size_t number = ran.err.rfind("up to ", at) + 6;
        return std::stoi(ran.err.substr(number));
    };
    // Between seeds, of a pixel.
    const auto noise_of = [&](const std::string &options) {
        constexpr int seeds = 8;
        std::vector<Picture> pictures;
        for (int seed = 1; seed <= seeds; ++seed) {
            REQUIRE(test.wisp("render " + test.s() + " -q --spp 4 -o " + test.file("p.pfm") + " --seed " +
                              std::to_string(seed) + " " + options)
                        .status == 0);
            pictures.push_back(read_pfm(test.file("p.pfm")));
        }
        double mean = 0, variance = 0;
        const size_t values = pictures[0].rgb.size();
        for (size_t i = 0; i < values; ++i) {
            double sum = 0, squares = 0;
            for (const Picture &picture : pictures) {
                const double value = static_cast<double>(picture.rgb[i]);
                sum += value, squares += value * value;
            }
            mean += sum / seeds;
            variance += (squares - sum * sum / seeds) / (seeds - 1);
        }
        return std::sqrt(variance * static_cast<double>(values)) / mean;
    };
    // From within and from outside: photons that are kept towards the eye; those of a turned box, which are not
    // gathered along lines; and those that are, deep in the dark.
    const std::string turned = "6 { albedo 0.9 0.9 0.9 phase 0 transform 1 1 1  0.3 1 0.2 25  0 0 0",
                      dark = "12 { albedo 0.7 0.6 0.5 phase -0.4";
    for (const std::string &from : {eye, outside})
        for (const std::string &smoke : {dense, turned, dark}) {
            CAPTURE(from);
            CAPTURE(smoke);
            scene(from, smoke);
            const std::string photons = smoke == dark ? "--photons 3k" : "--photons 30k";
            const int percent = warns(photons);
            CHECK(percent > 5);
            const double noise = noise_of(photons);
            CAPTURE(noise);
            CHECK(noise < 0.01 * percent);
            CHECK(noise > 0.002 * percent);
        }
    scene(eye, dense);
    CHECK(warns("--photons 4M") == 0);
    scene("6 0 0", dense);
    CHECK(warns("--photons 500k") > 10); // that is what four seeds differ by
    // With an even phase, which lines gather, and in thin smoke there is less.
    scene(eye, "6 { albedo 0.9 0.9 0.9 phase 0");
    CHECK(warns("--photons 500k") == 0);
    scene(eye, "0.5 { albedo 0.9 0.9 0.9 phase 0.5");
    CHECK(warns("--photons 500k") == 0);
    scene(eye, "0.1 { albedo 0.9 0.9 0.9 phase 0.5");
    CHECK(warns("--photons 30k") == 0);
}

TEST_CASE("warnings: few random paths in place of photons, as noisy as is said" * doctest::test_suite("long")) {
    const WarningCommandTest test;
    // A box of a narrow phase beside a mirror, which sees other directions than the eye.
    std::ofstream(test.s()) << "v from 0 1 6 at 0 0.2 0 up 0 1 0 angle 32 hither 0.1 resolution 12 12\n"
                               "am 0 0 0\nls 2 2 2 -2 -2 -2 25 30 30 20\nf 0.9 0.8 0.7 0.2 0.8 20 0 0\n"
                               "p 4  -1.5 -0.9 -1.5  -1.5 -0.9 1.5  1.5 -0.9 1.5  1.5 -0.9 -1.5\n"
                               "smoke box -0.8 -0.6 -0.8 0.1 0.9 0.5 8 { albedo 0.98 0.98 0.98 phase 0.75 }\n";
    const auto warns = [&](const std::string &options, Picture &picture) {
        const Ran ran = test.wisp("render " + test.s() + " --spp 4 -o " + test.file("p.pfm") + " " + options);
        REQUIRE(ran.status == 0);
        picture = read_pfm(test.file("p.pfm"));
        const size_t at = ran.err.find(" wrong here, by noise: ");
        if (at == std::string::npos) return 0;
        CHECK(ran.err.find("random paths from each ray", at) != std::string::npos);
        return std::stoi(ran.err.substr(ran.err.rfind("up to ", at) + 6));
    };
    for (const std::string arithmetic : {"f32", "fixed"}) {
        Picture a, b;
        const std::string options = "--photons 30k --arith " + arithmetic;
        const int percent = warns(options, a);
        CHECK(warns(options + " --seed 2", b) > percent / 2);
        CHECK(percent > 5);
        CHECK(percent < 100);
        const double noise = compare(a, b).relative_rmse / std::sqrt(2.0); // of one of them
        CAPTURE(noise);
        CAPTURE(percent);
        CHECK(noise < 0.013 * percent);
        CHECK(noise > 0.006 * percent);
    }
    Picture large;
    CHECK(warns("--photons 8M --crop 5,5,7,7", large) == 0);
    // Photons stay where paths would be noisier than photons err, as fewer of them are.
    CHECK(test.wisp("plan " + test.s()).out.find("paths from rays instead: the phase is too uneven") !=
          std::string::npos);
    const Ran few = test.wisp("plan " + test.s() + " --size 128x128");
    CHECK(few.out.find("paths from rays") == std::string::npos);
    CHECK(few.err.find("up to 40 % wrong here: beside mirrors") != std::string::npos);
}

TEST_CASE("warnings: cells of density that are wider than the particles' kernels") {
    WarningCommandTest test;
    const std::string view = "v from 0 0 6 at 0 0 0 up 0 1 0 angle 22 hither 0.1 resolution 4 4\nld 0 -1 -0.5 3 2 1\n";
    test.write("p.vtk", CommandLineTest::puff(40));
    test.write("s.aff", view + "smoke p.vtk { radius 0.3 mass 0.02 extinction 1 albedo 0.1 0.1 0.1 }\n");
    CHECK(test.warned("--density-step 1") == "");
    CHECK(test.warned("--density-step 1.5")
              .find("likely up to 12 % wrong: --density-step 1.5 keeps the particles' "
                    "density in cells wider than a smoothing length; 0.5 errs by less "
                    "than 1 %") != std::string::npos);
    CHECK(test.warned("--density-step 3").find("likely up to 24 % wrong") != std::string::npos);
    test.write("s.aff", view + "smoke box -1 -1 -1 1 1 1 0.2 { albedo 0.1 0.1 0.1 }\n"); // a box is exact
    CHECK(test.warned("--density-step 3") == "");
}

TEST_CASE("warnings: photons that fly past smoke that lies far apart") {
    WarningCommandTest test;
    const std::string view = "v from 0 0 6 at 0 0 0 up 0 1 0 angle 30 hither 0.01 resolution 4 4\nld 0 -1 -0.5 3 2 1\n",
                      smoke = "smoke s.ply { radius 0.3 mass 0.02 extinction 1 albedo .9 .9 .9";
    const std::string header = "ply\nformat ascii 1.0\nelement vertex ", ball = "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n",
                      more = "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + ball;
    test.write("s.ply", header + "5" + more + "900 0 0\n");
    test.write("s.aff", view + smoke + " }\n");
    const std::string said = "wisp: warning: light that is scattered more than once is noise here: of 100000 photons ";
    for (const char *method : {"--smoke direct", "--smoke volume", "--smoke map --deposit exact"}) {
        const std::string warned = test.warned("--photons 100000 " + std::string(method));
        CHECK(warned.rfind(said, 0) == 0);
        CHECK(warned.find(" met the smoke, as they fly into the ball around each smoke; --smoke map without "
                          "--deposit") != std::string::npos);
    }
    CHECK(test.warned("--photons 100000") == "");
    // Of two smokes each has photons of its own.
    test.write("s.ply", header + "4" + more);
    test.write("s.aff", view + smoke + " }\n" + smoke + " transform 1 1 1 0 1 0 0 900 0 0 }\n");
    CHECK(test.warned("--smoke direct --photons 100000") == "");
    // No light at all is not noise: here it shines on the other side of a wall.
    test.write("s.aff", view + smoke + " }\nf 1 1 1 1 0 0 0 0\np 3\n-500 9 -500\n500 9 -500\n0 9 900\n");
    CHECK(test.warned("--photons 100000") == "");
    // Thin smoke is met by few, too, and scatters hardly any light twice.
    test.write("s.aff", view + "smoke s.ply { radius 0.3 mass 0.0001 extinction 1 albedo .9 .9 .9 }\n");
    CHECK(test.warned("--smoke direct --photons 100000") == "");
    test.write("s.aff", view + smoke + " }\n");
    CHECK(test.warned("--smoke direct --photons 100000") == "");
}

TEST_CASE("warnings: light of photons that passes through surfaces, which it does not in cut cells") {
    WarningCommandTest test;
    const std::string view =
                          "v from 0 0 6 at 0 0 0 up 0 1 0 angle 22 hither 0.1 resolution 200 200\nlp 4 5 4 40 40 40\n",
                      wall = "p 4 0 -9 -9 0 9 -9 0 9 9 0 -9 9\n", floor = "p 4 -9 -1 -9 -9 -1 9 9 -1 9 9 -1 -9\n",
                      pane = "f 1 1 1 0 0 1 1 1.5\n" + wall, box = "smoke box -1 -1 -1 1 1 1 1 { }\n",
                      turned = "smoke box -1 -1 -1 1 1 1 1 { transform 1 1 1 0 1 0 30 0 0 0 }\n";
    const auto warns = [&](const std::string &things, const std::string &options) {
        test.write("s.aff", view + things);
        const std::string err = test.wisp("plan " + test.s() + " " + options).err;
        CAPTURE(err);
        CHECK((err.empty() || err.rfind("wisp: warning: light that is scattered more than once ", 0) == 0));
        return err.find("passes through the surfaces in the smoke") != std::string::npos;
    };
    CHECK(!warns(wall + box, ""));
    CHECK(!warns(wall + box, "--irradiance adaptive"));
    CHECK(warns(wall + box, "--irradiance none"));
    CHECK(warns(wall + box, "--smoke direct"));
    CHECK(warns(wall + box, "--smoke volume"));
    CHECK(!warns(wall + turned, ""));
    CHECK(warns(wall + turned, "--smoke direct"));
    CHECK(warns(wall + turned, "--deposit exact"));
    CHECK(!warns(turned, "--smoke direct"));
    CHECK(!warns(pane + turned, "--smoke direct"));
    CHECK(!warns(floor + box, "--smoke direct")); // it bounds the smoke
    CHECK(!warns(wall + "smoke box -1 -1 -1 1 1 1 1 { albedo 0.1 0.1 0.1 }\n", "--smoke direct"));
    CHECK(!warns(wall + turned, "--smoke direct --photons 0"));
}

TEST_CASE("warnings: the nearest photons among particles of unlike radii" * doctest::test_suite("long")) {
    WarningCommandTest test;
    const auto warned = [&](const std::string &h, const std::string &extinction, const std::string &method) {
        std::string particles;
        for (int i = 0; i < 64; ++i)
            particles += std::to_string(0.2 * (i % 4)) + " " + std::to_string(0.2 * (i / 4 % 4)) + " " +
                         std::to_string(0.2 * (i / 16)) + " " + (i % 2 ? "0.2" : h) + "\n";
        test.write("s.ply", "ply\nformat ascii 1.0\nelement vertex 64\nproperty double x\nproperty double y\n"
                            "property double z\nproperty double h\nend_header\n" +
                                particles);
        test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 22 hither 0.1 resolution 4 4\nld 0 -1 -0.5 3 2 1\n"
                            "smoke s.ply { mass 0.02 extinction " +
                                extinction + " albedo .9 .9 .9 }\n");
        return test.warned("--photons 50000 --smoke " + method);
    };
    const std::string text = " is likely 30 % wrong here, or more: smoothing lengths differ by a factor of 4, ";
    CHECK(warned("0.05", "1", "direct").find("--smoke direct" + text) != std::string::npos);
    CHECK(warned("0.05", "1", "volume").find("--smoke volume" + text) != std::string::npos);
    CHECK(without_noise(warned("0.05", "1", "map")) == "");
    // Where they differ by less, by how far the nearest reach: 40 % wrong with 20,000 photons, 34 % with 100,000.
    CHECK(warned("0.1", "1", "direct").find(" wrong here: the nearest 500 photons reach ") != std::string::npos);
    CHECK(warned("0.05", "0.001", "direct") == ""); // hardly any light is scattered twice
}

// At 500 x 500 four paths a pixel err by 38 % (measured), photons by 1.2 %; at 32 x 32 there are a thousand.
TEST_CASE("warnings: photons stay where as many paths would be noisier, and say what they err by") {
    const CommandLineTest test;
    const Ran large = test.wisp("plan fixtures/demo.aff"), small = test.wisp("plan fixtures/demo.aff --size 32x32");
    CHECK(large.out.find("\nphotons        yes ") != std::string::npos);
    CHECK(large.err == "wisp: warning: light that is scattered more than once is likely up to 7 % wrong here: photons "
                       "leave it in places that are up to 4.5 mean free paths wide; as many paths instead would be "
                       "noisier, and --max-error E bounds all errors\n");
    CHECK(small.out.find("\nphotons        no  ") != std::string::npos);
    CHECK(small.out.find("paths from rays instead") != std::string::npos);
    CHECK(small.out.find("4 a pixel, 244 random paths from each\n") != std::string::npos); // 1,000,000 in 32 x 32 pixels
    CHECK(small.err.empty());
    // Fewer photons are fewer paths, and more rays a pixel are more of them.
    CHECK(test.wisp("plan fixtures/demo.aff --size 32x32 --spp 1 --photons 4k -q").out.find("\nphotons        yes ") !=
          std::string::npos);
    CHECK(
        test.wisp("plan fixtures/demo.aff --size 32x32 --spp 1024 --photons 4k -q").out.find("\nphotons        no ") !=
        std::string::npos);
}

TEST_CASE("warnings: radiance that fixed point cuts off is warned of once") {
    CommandLineTest test;
    const auto warnings = [&](const std::string &mirror, const std::string &options) {
        test.write("mirrors.aff", "v from 0.1 0.05 0 at 0 0 -2 up 0 1 0 angle 5 hither 0.1 resolution 8 8\n"
                                  "a 0 1 2\nlp 1 1 0 4 3 3\nfm 0.1 0.1 0.1 0.5 0.5 0.5 " +
                                      mirror + " " + mirror + " " + mirror +
                                      " 8 0 1\np 4\n-2 -2 -2 2 -2 -2 2 2 -2 -2 2 -2\n"
                                      "p 4\n-2 -2 2 -2 2 2 2 2 2 2 -2 2\n");
        const Ran ran = test.wisp("render " + test.file("mirrors.aff") + " --digest --spp 1 " + options);
        CHECK(ran.status == 0);
        return ran.err;
    };
    const std::string warning = warnings("2", "--depth 64 --arith fixed");
    CHECK(lines(warning) == 1);
    CHECK(warning.rfind(test.file("mirrors.aff") + ": warning: fixed point has cut off the radiance of ", 0) == 0);
    CHECK(warnings("2", "--depth 64 --arith fixed --quiet").empty());
    CHECK(warnings("2", "--depth 10 --arith fixed").empty());
    CHECK(warnings("0.9", "--depth 64 --arith fixed").empty());
    for (const char *arithmetic : {"f32", "f64"})
        CHECK(warnings("2", std::string("--depth 64 --arith ") + arithmetic).empty());
}
