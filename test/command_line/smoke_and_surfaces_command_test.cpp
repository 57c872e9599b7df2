// build/wisp on scenes of smoke and surfaces: pictures, maps that walls are a part of, what is refused.
#include "host/images/picture.h"
#include "support/command_line.h"
#include <cmath>

namespace wisp {

namespace {

// A puff above a floor, a wall beside it, a lamp.
struct Cave : CommandLineTest {
    void write_scene(const std::string &wall = "1.2", const std::string &more = "", const std::string &smoke = "",
                     const std::string &from = "0 0.5 4") {
        write("c.aff", "v from " + from +
                           " at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 12 9\nb 0.1 0.1 0.2\n"
                           "am 0.1 0.1 0.1\nlp 3 4 3 40 40 40\nf 0.8 0.7 0.6 1 0.2 10 0 1\n"
                           "m vertices 4 -4 -0.9 4 4 -0.9 4 4 -0.9 -4 -4 -0.9 -4 triangles 2 0 1 2 0 2 3\n"
                           "m vertices 3 " +
                           wall + " -0.9 -1 " + wall + " -0.9 1 " + wall +
                           " 0.8 0 triangles 1 0 1 2\n"
                           "smoke puff.vtk {\n radius 0.2\n mass 1\n extinction 0.02\n" +
                           smoke + "}\nrender photons 2000\nrender gather 20\nrender spp 1\n" + more);
    }
    Ran draw(const std::string &options = "") const { return wisp("render " + file("c.aff") + " -q " + options); }
    std::string digest(const std::string &options = "") const {
        const Ran ran = draw("--digest " + options);
        CHECK(ran.status == 0);
        CHECK(ran.err == "");
        return ran.out;
    }
};

// The root of the mean square of the differences, relative to the mean of `b`, which must not be black.
double relative_difference(const std::string &a, const std::string &b) {
    const Picture one = read_pfm(a), other = read_pfm(b);
    REQUIRE(one.rgb.size() == other.rgb.size());
    double squares = 0, sum = 0;
    for (size_t i = 0; i < one.rgb.size(); ++i) {
        const double difference = static_cast<double>(one.rgb[i]) - static_cast<double>(other.rgb[i]);
        squares += difference * difference;
        sum += static_cast<double>(other.rgb[i]);
    }
    REQUIRE(sum > 0);
    return std::sqrt(squares * static_cast<double>(one.rgb.size())) / sum;
}

} // namespace

TEST_CASE("command line: surfaces of any size leave the cells of a box of smoke as they are") {
    // 1,440,000 triangles take more than the bricks of a box may.
    CommandLineTest test;
    std::string spheres;
    for (int i = 0; i < 8000; ++i)
        spheres += "s " + std::to_string(i % 100) + " " + std::to_string(i / 100) + " -9 0.4\n";
    const std::string view = "v from 0 0 6 at 0 0 0 up 0 1 0 angle 22 hither 0.1 resolution 8 8\nld 0 -1 0 1 1 1\n",
                      smoke = "smoke box -1 -1 -1 1 1 1 1 { extinction 0.3 albedo 0.9 0.9 0.9 }\n";
    test.write("many.aff", view + "f 1 1 1 1 0 0 0 0\n" + spheres + smoke);
    test.write("none.aff", view + smoke);
    const auto bricks = [&test](const char *scene) {
        const Ran ran = test.wisp("plan " + test.file(scene));
        CHECK(ran.status == 0);
        const size_t at = ran.out.find("\nbricks ");
        REQUIRE(at != std::string::npos);
        return ran.out.substr(at, ran.out.find('\n', at + 1) - at);
    };
    CHECK(bricks("many.aff") == bricks("none.aff"));
}

TEST_CASE("command line: smoke and surfaces are one picture, by every method, in every arithmetic") {
    Cave cave;
    for (const std::string method : {"", "--smoke direct", "--smoke volume", "--smoke map --deposit path",
                                     "--reference --passes 0:4", "--lights cuts", "--shadows paper"}) {
        CAPTURE(method);
        std::string of[2];
        for (const bool smoke : {true, false})
            for (const std::string arithmetic : {"--arith f32 ", "--arith f64 ", "--arith fixed "}) {
                cave.write_scene("1.2", "", smoke ? "" : "transform 1 1 1 0 1 0 0 0 0 9\n"); // behind the camera
                const std::string digest = cave.digest(arithmetic + method);
                CHECK(lines(digest) == 1);
                CHECK(cave.digest(arithmetic + method) == digest);
                if (arithmetic == "--arith f64 ") of[smoke] = digest;
            }
        CHECK(of[0] != of[1]);
    }
    cave.write_scene();
    const std::string exact = cave.digest();
    for (const char *shadows : {"trace", "cache", "voxel", "lightbuffer", "lie"})
        CHECK(cave.digest(std::string("--shadows ") + shadows) == exact);
    const Ran plan = cave.wisp("plan " + cave.file("c.aff"));
    CHECK(plan.status == 0);
    CHECK(plan.out.find("triangle trees yes") != std::string::npos);
}

TEST_CASE("command line: passes of smoke and surfaces apart and merged are the passes together") {
    Cave cave;
    cave.write_scene();
    const auto passes = [&](const std::string &range, const std::string &name) {
        const Ran ran = cave.draw("--reference --passes " + range + " -o " + cave.file(name));
        CHECK(ran.err.empty());
        CHECK(ran.status == 0);
    };
    passes("0:2", "a.passes");
    passes("2:5", "b.passes");
    passes("0:5", "all.passes");
    CHECK(cave.wisp("merge " + cave.file("a.passes") + " " + cave.file("b.passes") + " -o " + cave.file("m.passes"))
              .status == 0);
    CHECK(cave.same("m.passes", "all.passes"));
    cave.write_scene("1.3"); // another wall
    passes("2:5", "b.passes");
    cave.refuses(
        cave.wisp("merge " + cave.file("a.passes") + " " + cave.file("b.passes") + " -o " + cave.file("n.passes")), 3);
}

TEST_CASE("command line: a particle map is that of its walls; views and colours may change") {
    Cave cave;
    const std::string map = cave.file("c.map");
    cave.write_scene();
    REQUIRE(cave.draw("--map-out " + map + " -o " + cave.file("c.pfm")).status == 0);
    for (const std::string from : {"0 0.5 4", "-2 1 3"}) {
        cave.write_scene("1.2", "", "", from);
        CHECK(cave.digest("--map-in " + map) == cave.digest());
    }
    cave.write_scene("1.25"); // the wall has moved
    const Ran moved = cave.draw("--digest --map-in " + map);
    cave.refuses(moved, 3);
    CHECK(moved.err.find("c.map") != std::string::npos);
    // Frames in which only smoke and camera stay have maps of their own.
    cave.write_scene("1.2", "a 0 1 2\nx lid { m vertices 3 -1 1 -1 -1 1 1 1 1 0 triangles 1 0 1 2 }\n"
                            "k lid { transl 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1 0 0.5 0 0 0 0 1 0 0.5 0 0 0 0 }\n");
    const std::string frames = cave.digest("--frames 0:1");
    CHECK(frames == cave.digest("--frames 0:1 --remap"));
    CHECK(frames == cave.digest("--frames 0") + cave.digest("--frames 1"));
    CHECK(frames.substr(0, 64) != frames.substr(frames.size() / 2, 64));
}

TEST_CASE("command line: smoke may be far larger and coarser than the surfaces beside it, in every arithmetic") {
    CommandLineTest test;
    const std::string view = "v from 0 1 8 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 12 9\nb 0.1 0.1 0.2\n"
                             "lp 6 8 5 400 380 340\nrender spp 1\nrender photons 0\n";
    const std::string smokes[] = {"smoke box -2 -2 -2 2 2 2 0.3 {\n}\n",
                                  "smoke puff.vtk {\n radius 0.25\n mass 1\n extinction 0.02\n}\n"};
    for (const std::string &smoke : smokes)
        for (const char *radius : {"1", "0.01", "0.0005"})
            for (const char *arithmetic : {"f32", "f64", "fixed"}) {
                CAPTURE(radius);
                CAPTURE(arithmetic);
                const std::string sphere = std::string("s 0 1 20 ") + radius + "\n"; // behind the camera
                test.write("beside.aff", view + smoke + sphere);
                test.write("alone.aff", view + smoke);
                for (const std::string name : {"beside", "alone"})
                    REQUIRE(test.wisp("render " + test.file(name + ".aff") + " -q --arith " +
                                      (name == "alone" ? "f64" : arithmetic) + " -o " + test.file(name + ".pfm"))
                                .err == "");
                CHECK(relative_difference(test.file("beside.pfm"), test.file("alone.pfm")) < 1e-3);
            }
}

TEST_CASE("command line: without photons the arithmetics make one picture of thin smoke between mirrors, and of a box" *
          doctest::test_suite("long")) {
    CommandLineTest test;
    const auto differs = [&](const std::string &options, const std::string &arithmetic) {
        for (const std::string &one : {arithmetic, std::string("f64")})
            REQUIRE(test.wisp("render " + test.file("one.aff") + " -q --photons 0 --spp 1 " + options + " --arith " +
                              one + " -o " + test.file(one + ".pfm"))
                        .err == "");
        return relative_difference(test.file(arithmetic + ".pfm"), test.file("f64.pfm"));
    };
    const std::string view = " up 0 1 0 angle 50 hither 0.1 resolution 20 20\n";
    // Smoke of a depth of 0.003 in the beam of a spot, and two mirrors that face one another.
    test.write("one.aff", "v from 0.3 0.2 0 at 0 0 -2" + view +
                              "ls 0 5 0 0 -1 0 40 1000 1000 1000\nf 1 1 1 0 1 8 0 1\n"
                              "p 4\n-2 -2 -2 2 -2 -2 2 2 -2 -2 2 -2\np 4\n-2 -2 2 -2 2 2 2 2 2 2 -2 2\n"
                              "smoke box -1.5 -1.5 -1.5 1.5 1.5 1.5 0.001 {\n}\n");
    for (const char *options : {"--depth 40", "--depth 40 --smoke direct"}) {
        CHECK(differs(options, "f32") < 2e-5);
        CHECK(differs(options, "fixed") < 1e-4);
    }
    // A box, in two units of length.
    for (const std::string sphere : {"", "s 0 1 20 1\n"}) {
        test.write("one.aff", "v from 0 1 8 at 0 0 0" + view + "lp 6 8 5 400 380 340\n" + sphere +
                                  "smoke box -2 -2 -2 2 2 2 5 {\n}\n");
        for (const char *arithmetic : {"f32", "fixed"}) CHECK(differs("", arithmetic) < 2e-5);
    }
}

TEST_CASE(
    "command line: where smoke changes the unit of length from frame to frame, frames are those of runs of their own") {
    CommandLineTest test;
    test.write("far_0.vtk", CommandLineTest::puff(40));
    test.write("far_1.vtk", "# vtk DataFile Version 3.0\np\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n"
                            "0 0 0 0.1 0 0 40 0 -40\n");
    test.write("far_2.vtk", CommandLineTest::puff(30));
    test.write("far.aff", "v from 0 1 8 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 12 9\nam 0.1 0.1 0.1\n"
                          "lp 6 8 5 400 380 340\ns 0.6 0 0 0.5\ns 0.2 0.9 0.6 0.2\n"
                          "x ball { s -0.7 0 0 0.3 }\nk ball { transl 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1 0 0.5 0 0 0 0 "
                          "1 0 0.5 0 0 0 0 }\na 0 1 3\n"
                          "smoke far_%d.vtk {\n radius 0.2\n mass 1\n extinction 0.02\n}\n"
                          "render spp 1\nrender photons 500\n");
    const auto digests = [&](const std::string &options) {
        const Ran ran = test.wisp("render " + test.file("far.aff") + " -q --digest " + options);
        CHECK(ran.status == 0);
        CHECK(ran.err == "");
        return ran.out;
    };
    for (const std::string arithmetic : {" --arith f32", " --arith f64", " --arith fixed"}) {
        const std::string all = digests("--frames 0:2" + arithmetic);
        CHECK(lines(all) == 3);
        CHECK(all == digests("--frames 0" + arithmetic) + digests("--frames 1" + arithmetic) +
                         digests("--frames 2" + arithmetic));
    }
}

TEST_CASE("command line: smoke and surfaces that do not go together are refused with a line") {
    Cave cave;
    cave.write_scene("1.2", "", "phase 0.3\n");
    const std::string line = "option 'irradiance': found none, expected a map beside surfaces where the phase is not 0";
    cave.refuses(cave.draw("--digest --smoke map --irradiance none --density-step 0"), 2, line);
    CHECK(cave.digest("--smoke map --density-step 0") != "");
    cave.write_scene();
    CHECK(cave.digest("--smoke map --irradiance none --density-step 0") != "");
    cave.refuses(cave.draw("--digest --reference --passes 0:1 --shadows paper"), 2);
    cave.write_scene("9000"); // the surfaces are large, the smoke is fine
    const Ran fine = cave.draw("--digest --arith fixed");
    cave.refuses(fine, 3);
    CHECK(fine.err.find("is too fine for fixed point beside surfaces that reach ") != std::string::npos);
    CHECK(cave.digest("--arith f32") != "");
}

} // namespace wisp
