// `wisp info` as a user meets it.
#include "host/images/picture.h"
#include "support/command_line.h"
#include "support/data.h"
#include "support/json_check.h"
#include <cmath>
#include <limits>

using namespace wisp;

namespace {

struct InfoTest : CommandLineTest {
    std::string text(const std::string &path) const { return printed("info '" + path + "'"); }
    std::string json(const std::string &path) const {
        const std::string object = printed("info --json '" + path + "'");
        CHECK_MESSAGE(JsonCheck(object).whole(), object);
        return object;
    }
    void says(const std::string &path, const std::vector<std::string> &facts) const {
        const std::string object = json(path);
        for (const std::string &fact : facts) CHECK_MESSAGE(object.find(fact) != std::string::npos, fact, object);
    }
    void refused(const std::string &path, const std::string &error) const {
        refuses(wisp("info '" + path + "'"), 3, path + error);
    }

  private:
    std::string printed(const std::string &arguments) const {
        const Ran ran = wisp(arguments);
        CHECK(ran.status == 0);
        CHECK(ran.err.empty());
        return ran.out;
    }
};

// Particles on a lattice of 11 x 10 x 9 points, 0.5 apart.
std::string lattice(bool attributes) {
    std::string points, lengths, masses;
    for (int i = 0; i < 990; ++i) {
        points += std::to_string(0.5 * (i % 11)) + " " + std::to_string(0.5 * (i / 11 % 10)) + " " +
                  std::to_string(0.5 * (i / 110)) + "\n";
        lengths += i == 7 ? "0.3125 " : "0.25 ";
        masses += i % 2 ? "1 " : "2 ";
    }
    std::string file = "# vtk DataFile Version 3.0\np\nASCII\nDATASET POLYDATA\nPOINTS 990 float\n" + points;
    if (attributes)
        file += "POINT_DATA 990\nFIELD f 3\nh 1 990 float\n" + lengths + "\nmass 1 990 float\n" + masses +
                "\nradius 1 990 float\n" + masses;
    return file;
}

} // namespace

TEST_CASE("info command: what is not JSON is found") {
    for (const std::string text :
         {"{}", "[]", "-0.5e-07", "\"\\u00e9 \\n \xc3\xa9\"", " { \"a\": [1, 20, null],\n \"b\": true }\n"})
        CHECK_MESSAGE(JsonCheck(text).whole(), text);
    for (const std::string text : {"",
                                   "{",
                                   "[1,]",
                                   "{\"a\" 1}",
                                   "{a: 1}",
                                   "1 2",
                                   "+1",
                                   "01",
                                   ".5",
                                   "1.",
                                   "1e",
                                   "nan",
                                   "inf",
                                   "\"a",
                                   "\"a\nb\"",
                                   "\"\\x41\"",
                                   "\"\\u12g4\"",
                                   "\"\\u12\"",
                                   "\"\\",
                                   "\"\xff\"",
                                   "\"\xc0\x80\"",
                                   "\"\xed\xa0\x80\""})
        CHECK_MESSAGE(!JsonCheck(text).whole(), text);
}

TEST_CASE("info command: optical depths of the rays that meet smoke, as it is rendered") {
    InfoTest test;
    // Rays through the middle of a box, along its edge of 1.
    const std::string scene = "v from 0 0 100 at 0 0 0 up 0 1 0 angle 0.1 hither 1 resolution 4 4\nl 9 9 9 1 1 1\n"
                              "smoke box -0.5 -0.5 -0.5 0.5 0.5 0.5 1 { extinction ";
    test.write("s.aff", scene + "2.5 }\n");
    test.says(test.file("s.aff"), {"\"optical_depth\": { \"low\": 2.5", "\"high\": 2.5"});
    test.write("s.aff", scene + "0 }\n");
    test.says(test.file("s.aff"), {"\"optical_depth\": null"});
}

TEST_CASE("info command: particles: number, bounds, spacing, attributes and neighbours") {
    InfoTest test;
    test.write("p.vtk", lattice(true));
    test.says(test.file("p.vtk"),
              {"\"kind\": \"particles\"", "\"format\": \"legacy VTK\"", "\"particles\": 990", "\"low\": [0, 0, 0]",
               "\"high\": [5, 4.5, 4]", "\"spacing\": 0.5,", "\"smoothing_length\": { \"low\": 0.25, \"high\": 0.3125,",
               "\"mass\": { \"low\": 1, \"high\": 2, \"mean\": 1.5 }", "\"particle_radius\": true"});
    // Supports end at the neighbours, but for that of particle 7, which holds 4.
    test.says(test.file("p.vtk"), {"\"neighbours\": 0.00404040404040404"});
    CHECK(test.text(test.file("p.vtk")).find("\nspacing           0.5, the median distance to the nearest of 990 ") !=
          std::string::npos);
    test.write("bare.vtk", lattice(false));
    test.says(test.file("bare.vtk"), {"\"smoothing_length\": null", "\"mass\": null"});
    CHECK(test.json(test.file("bare.vtk")).find("neighbours") == std::string::npos);
}

TEST_CASE("info command: particles: none, one, and many in one place") {
    InfoTest test;
    const auto points = [&](const std::string &count, const std::string &coordinates) {
        test.write("p.vtk", "# vtk DataFile Version 3.0\np\nASCII\nDATASET POLYDATA\nPOINTS " + count + " double\n" +
                                coordinates);
        return test.json(test.file("p.vtk"));
    };
    CHECK(points("0", "").find("\"particles\": 0, \"render_chooses\": null") != std::string::npos);
    CHECK(points("1", "1 2 3").find("spacing") == std::string::npos);
    CHECK(points("3", "1 2 3 1 2 3 1 2 3").find("\"spacing\": 0,") != std::string::npos);
    CHECK(points("2", "-1e308 0 0 1e308 0 0").find("\"spacing\": null,") != std::string::npos);
}

TEST_CASE("info command: a density grid") {
    InfoTest test;
    test.write("g.vol", CommandLineTest::volume(2, 1, 2, 1, 2, 3, {0, 0.5f, 0.25f, 2}));
    test.says(test.file("g.vol"),
              {"\"kind\": \"density grid\"", "\"cells\": [2, 1, 2]", "\"low\": [-1, -2, -3], \"high\": [1, 2, 3]",
               "\"cell_size\": [1, 4, 3]",
               "\"turned\": false, \"density\": { \"low\": 0, \"high\": 2, \"mean\": 0.6875 }", "\"not_zero\": 3"});
    CHECK(test.text(test.file("g.vol")).find("\ncells             2 x 1 x 2\n") != std::string::npos);
}

TEST_CASE("info command: a numbered sequence, of which files may be missing") {
    InfoTest test;
    for (const char *name : {"p_0003.vtk", "p_0004.vtk", "p_0010.vtk"})
        test.write(name, CommandLineTest::puff(name[4] == '1' ? 20 : 10));
    for (const char *name : {"p_11.vtk", "p_x.vtk", "p_.vtk"}) test.write(name, "no file of it");
    test.says(test.file("p_%04d.vtk"),
              {"\"files\": 3, \"numbers\": [3, 10], \"missing\": 5", "\"first\": { \"file\": ", "\"particles\": 10,",
               "\"last\": { \"file\": \"" + test.file("p_0010.vtk"), "\"particles\": 20,"});
    CHECK(test.text(test.file("p_%04d.vtk")).find("\nfirst\n  file              ") != std::string::npos);
    test.refused(test.file("q_%04d.vtk"), ": no file has such a name and a number in place of its '%d'");
    test.refused(test.file("none/q_%d.vtk"), ": no file has such a name and a number in place of its '%d'");
    test.write("100%d.vtk", CommandLineTest::puff(5));
    test.says(test.file("100%d.vtk"), {"\"kind\": \"particles\""}); // its name
}

TEST_CASE("info command: a scene, and the plan of its first frame") {
    InfoTest test;
    test.says("fixtures/glow.aff", {"\"kind\": \"scene\"", "\"frames\": 1, \"triangles\": 0",
                                    "\"lights\": { \"point\": 0, \"spot\": 0, \"parallel\": 1, \"constant\": 1 }",
                                    "\"size\": [40, 40]", "\"file\": \"fixtures/ball.ply\", \"particles\": 400",
                                    "\"neighbours\": 7.865,", "\"arith\": \"f32\", \"bytes\": "});
    test.says("fixtures/grid.aff", {"\"file\": \"fixtures/puff.vol\", \"cells\": [10, 8, 12], \"low\": [-2.0303",
                                    "\"box\": true, \"low\": [0.9, -0.5, -1]"});
    test.says("fixtures/surfaces.aff", {"\"frames\": 5, \"triangles\": 1571", "\"constant\": 2 }"});
    test.says("fixtures/wake.aff", {"\"file\": \"fixtures/wake_0000.vtk\", \"particles\": 6160"});
    // Stages that are needed, in the words of `plan`.
    const std::string plan = test.wisp("plan " + test.s()).out, stages = test.text(test.s());
    size_t needed = 0;
    for (size_t at = plan.find(" yes "); at != std::string::npos; at = plan.find(" yes ", at + 1), ++needed) {
        const size_t reason = plan.find(" bytes  ", at) + 8;
        if (plan.compare(plan.rfind('\n', at) + 1, 7, "picture") == 0) break;
        if (plan.compare(plan.rfind('\n', at) + 1, 5, "arena") == 0) continue;
        CHECK(stages.find(plan.substr(reason, plan.find('\n', reason) + 1 - reason)) != std::string::npos);
    }
    CHECK(needed > 5);
    CHECK(stages.find("\nlights            1 point\nsize              16 x 12\nsmoke 1\n") != std::string::npos);
}

TEST_CASE("info command: neighbours are those of plan -v") {
    InfoTest test;
    const std::string plan = test.wisp("plan fixtures/glow.aff -v").out;
    CHECK(plan.find("smoke 1: a particle has 7.9 neighbours") != std::string::npos); // 7.865
    CHECK(plan.find("smoke 2: a particle has 17.7 neighbours") != std::string::npos);
    CHECK(test.text("fixtures/glow.aff").find("neighbours        17.68 in a support") != std::string::npos);
}

TEST_CASE("info command: a file of a scene, without a view of its own") {
    InfoTest test;
    test.write("part.aff", "s 0 0 0 1\nls 0 3 0 0 -1 0 30 1 1 1\nsmoke none.vtk { }\n");
    test.says(test.file("part.aff"), {"\"size\": null", "\"spot\": 1", "\"triangles\": 720", "none.vtk\" }"});
    CHECK(test.json(test.file("part.aff")).find("rendering") == std::string::npos);
    test.says("fixtures/surfaces_box.aff", {"\"kind\": \"scene\"", "\"size\": null"});
}

TEST_CASE("info command: pictures: values of each channel, and what is no number") {
    InfoTest test;
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    write_file(test.file("a.pfm"), pfm_bytes({2, 1, {1, nan, -infinity, 2, nan, 0.5f}}));
    test.says(test.file("a.pfm"),
              {"\"kind\": \"picture, linear 32-bit values\"", "\"size\": [2, 1]",
               "\"red\": { \"low\": 1, \"high\": 2, \"mean\": 1.5 }, \"green\": null",
               "\"blue\": { \"low\": 0.5, \"high\": 0.5, \"mean\": 0.5 }", "\"nan\": 2, \"infinite\": 1 }"});
    test.says("fixtures/tiles.ppm", {"\"kind\": \"picture, 8-bit sRGB values\"", "\"size\": [12, 10]"});
    test.says("fixtures/demo.png", {"\"kind\": \"picture, 8-bit sRGB values\"", "\"size\": [640, 480]"});
    CHECK(test.json("fixtures/demo.png").find("record") == std::string::npos);
}

TEST_CASE("info command: pictures: the record of what they show, and whether they are still as they were") {
    InfoTest test;
    REQUIRE(test.wisp("render " + test.s() + " --crop 2,3,10,7 --exposure 1 -o " + test.file("a.pfm") + " -o " +
                      test.file("a.png"))
                .status == 0);
    const std::string record = "\"whole_picture\": [16, 12], \"crop\": [2, 3, 10, 7], ";
    test.says(test.file("a.pfm"), {"\"record\": { " + record + "\"fingerprint\": ", "\"unchanged\": true"});
    test.says(test.file("a.png"), {"\"record\": { " + record + "\"exposure\": 1, ", "\"unchanged\": true"});
    test.says(test.file("a.pfm.wisp"), {"\"kind\": \"record of a picture\"", record});
    write_file(test.file("a.pfm"), pfm_bytes({1, 1, {0, 0, 0}}));
    test.says(test.file("a.pfm"), {"\"unchanged\": false"});
    test.write("a.pfm.wisp", "wisp picture 1\nsha256 x\n");
    test.refuses(test.wisp("info " + test.file("a.pfm")), 3);
}

TEST_CASE("info command: particle maps and passes, known by their content") {
    InfoTest test;
    REQUIRE(test.wisp("render " + test.s() + " --photons 9000 --batches 1:3 --map-out " + test.file("a.map")).status ==
            0);
    test.says(test.file("a.map"), {"\"kind\": \"particle map\"", "\"photons\": 9000, \"batches\": 3",
                                   "\"traced_batches\": [[1, 3]]", "\"emitted\": 4904", "\"sums\": "});
    REQUIRE(test.wisp("render " + test.s() + " --reference --spp 2 --passes 3:5 -o " + test.file("a.passes") + " -o " +
                      test.file("mean.pfm"))
                .status == 0);
    std::filesystem::rename(test.file("a.passes"), test.file("a"));
    test.says(test.file("a"), {"\"kind\": \"passes of --reference\"", "\"size\": [16, 12]", "\"rays_a_pass\": 2",
                               "\"passes\": [[3, 5]]", "\"standard_error\": "});
    const auto red = [](const std::string &object) { return object.substr(object.find("\"red\""), 60); };
    CHECK(red(test.json(test.file("a"))) == red(test.json(test.file("mean.pfm"))));
}

TEST_CASE("info command: what is broken, strange or not there is one error") {
    InfoTest test;
    const std::string kinds =
        ", expected one of .vtk .bgeo .ply .vol .nvdb .vdb .aff .nff .map .passes .pfm .exr .png .ppm .wisp";
    const auto refused = [&](const std::string &name, const std::string &content, const std::string &error) {
        test.write(name, content);
        test.refused(test.file(name), error);
    };
    refused("a.txt", "text", ": neither its content nor its name tells what it is" + kinds);
    refused("empty", "", ": neither its content nor its name tells what it is" + kinds);
    refused("a.vtk", "text", ": byte 0: not a legacy VTK file, expected '# vtk DataFile Version' at its start");
    refused("a.vtu", "<?xml ?>", ": byte 0: an XML file, expected legacy VTK: save as .vtk");
    refused("a.pfm", "text", ": byte 0: this is not a PFM picture, expected PF or Pf");
    refused("b.pfm", "PF\n65536 65536\n-1\n", ": byte 18: 0 bytes of pixels, expected 51539607552");
    refused("a.vol", CommandLineTest::volume(2, 1, 2, 1, 1, 1, {1, 2}),
            ": byte 48: 8 bytes of samples, expected 2 x 1 x 2 samples of 4 bytes");
    refused("a.map", "wisp map 1\nsha256 x\n", ":2: the file is damaged: its SHA-256 is another, expected x");
    refused("a.aff", "smok",
            ":1: there is no statement 'smok', expected one of c f fm m p pp s tpa tt ttp a am b d i k l "
            "la ld lp ls render smoke v x xs } or a comment; did you mean 'smoke'?");
    refused("b.aff", CommandLineTest::lit("none.vtk { radius 1 mass 1 }"),
            ":5: " + test.file("none.vtk") + ": cannot be opened: No such file or directory");
    test.refused(test.file("none.png"), ": cannot be opened: No such file or directory");
    test.refused(test.file(""), ": cannot be read: not a plain file");
    test.refused("/dev/zero", ": cannot be read: not a plain file");
    test.refused(test.file(std::string(300, 'n')), ": cannot be opened: File name too long");
}

TEST_CASE("info command: names of any bytes are one line, and UTF-8 in JSON") {
    InfoTest test;
    test.write("a\xff\n.vol", CommandLineTest::volume(1, 1, 1, 1, 1, 1, {1}));
    CHECK(test.text(test.file("a\xff\n.vol")).rfind("file              " + test.file("a\\xff\\n.vol") + "\n", 0) == 0);
    test.says(test.file("a\xff\n.vol"), {"a\\\\xff\\\\n.vol\""});
}

TEST_CASE("info command: usage") {
    const InfoTest test;
    test.refuses(test.wisp("info"), 2, "'wisp info' has 0 files, expected one");
    test.refuses(test.wisp("info a b"), 2, "'wisp info' has 2 files, expected one");
    test.refuses(test.wisp("info a --size 3x3"), 2, "there is no option '--size' of info, expected --json");
    CHECK(test.wisp("help").out.find("wisp info FILE [--json]  ") != std::string::npos);
}

TEST_CASE("info command: files of others") {
    WISP_NEEDS_DATA("particles/splishsplash/sphere.bgeo");
    WISP_NEEDS_DATA("volumes/plume.vol");
    const InfoTest test;
    test.says(data_path("particles/splishsplash/sphere.bgeo"),
              {"\"format\": \"BGEO\", \"particles\": 12394", "\"smoothing_length\": null"});
    test.says(data_path("volumes/plume.vol"), {"\"cells\": [64, 128, 64]", "\"cell_size\": [0.015625, 0.015625, 0.0"});
}
