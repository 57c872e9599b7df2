// build/wisp as a user meets it: exit statuses, error lines, outputs, digests, crops, frames, memory.
#include "host/files.h"
#include "host/picture.h"
#include "host/sha256.h"
#include "temporary_folder.h"
#include <algorithm>
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>
#include <sys/wait.h>

using namespace wisp;

namespace {

struct Ran {
    int status;
    std::string out, err;
};

std::string text_of(const std::string &path) {
    const Bytes bytes = read_file(path);
    return std::string(bytes.begin(), bytes.end());
}

struct Desk : TemporaryFolder {
    Desk() {
        write("puff.vtk", puff(40));
        write("s.aff", scene("puff.vtk", ""));
    }
    void write(const std::string &name, const std::string &text) {
        std::ofstream(file(name), std::ios::binary) << text;
    }
    // A small ball of particles as ASCII VTK.
    static std::string puff(int count) {
        std::string text =
            "# vtk DataFile Version 3.0\npuff\nASCII\nDATASET POLYDATA\nPOINTS " + std::to_string(count) + " float\n";
        uint32_t state = 9;
        for (int i = 0; i < 3 * count; ++i) {
            state = state * 1664525u + 1013904223u;
            text += std::to_string((state >> 8) * 0x1p-24 - 0.5) + " ";
        }
        return text + "\n";
    }
    static std::string scene(const std::string &particles, const std::string &more) {
        return "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 16 12\nb 0.1 0.1 0.2\nlp 3 3 3 40 40 "
               "40\nsmoke " +
               particles + " {\n radius 0.2\n mass 1\n extinction 0.02\n}\nrender photons 3000\nrender gather 20\n" +
               more;
    }
    Ran wisp(const std::string &arguments) const {
        const std::string command = "build/wisp " + arguments + " > " + file("out") + " 2> " + file("err");
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(file("out")), text_of(file("err"))};
    }
    std::string s() const { return file("s.aff"); }
};

size_t lines(const std::string &text) { return static_cast<size_t>(std::count(text.begin(), text.end(), '\n')); }

} // namespace

TEST_CASE("command line: wrong usage ends with 2 and one line") {
    const Desk desk;
    for (const std::string &arguments :
         {std::string(""), std::string("paint"), std::string("render"), "render " + desk.s() + " " + desk.s(),
          "render --bogus " + desk.s(), "render " + desk.s() + " --spp", "render " + desk.s() + " --spp 0",
          "render " + desk.s() + " --smoke map", "render " + desk.s() + " --reference",
          "render " + desk.s() + " --crop 0,0,17,3", "render " + desk.s() + " --frames 0:1 -o a.png",
          "render " + desk.s() + " -o a.jpg", "render " + desk.s() + " --quiet=1", std::string("inspect a.aff 1 2"),
          std::string("compare a.pfm")}) {
        CAPTURE(arguments);
        const Ran ran = desk.wisp(arguments);
        CHECK(ran.status == 2);
        CHECK(lines(ran.err) == 1);
        CHECK(ran.out.empty());
    }
}

TEST_CASE("command line: bad input ends with 3 and a line that names the file") {
    Desk desk;
    desk.write("bad.aff", "v from 1");
    desk.write("noview.aff", "b 0 0 0");
    desk.write("missing.aff", Desk::scene("none.vtk", ""));
    desk.write("broken.vtk", Desk::puff(40).substr(0, 300));
    desk.write("broken.aff", Desk::scene("broken.vtk", ""));
    desk.write("option.aff", Desk::scene("puff.vtk", "render spp zero"));
    desk.write("massless.aff",
               "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nsmoke puff.vtk { radius 1 }");
    const struct {
        const char *scene, *error;
    } cases[] = {{"nowhere.aff", "nowhere.aff: cannot be opened: No such file or directory\n"},
                 {"bad.aff", "bad.aff:1: the file ends, expected y of from\n"},
                 {"noview.aff", "noview.aff:1: there is no view, expected a statement 'v from ...'\n"},
                 {"missing.aff", "none.vtk: cannot be opened: No such file or directory\n"},
                 {"broken.aff", nullptr},
                 {"option.aff", "option.aff:11: option 'spp': found 'zero', expected a whole number from 1 to 65536\n"},
                 {"massless.aff", nullptr}};
    for (const auto &c : cases) {
        const Ran ran = desk.wisp("render " + desk.file(c.scene) + " -o " + desk.file("x.png"));
        CAPTURE(std::string(c.scene));
        CHECK(ran.status == 3);
        CHECK(lines(ran.err) == 1);
        if (c.error) CHECK(ran.err == desk.file("") + c.error);
        CHECK(!std::filesystem::exists(desk.file("x.png")));
    }
}

TEST_CASE("command line: a plan beyond --memory ends with 4, an unwritable output with 5") {
    const Desk desk;
    const Ran small = desk.wisp("render " + desk.s() + " --memory 10k -o " + desk.file("x.png"));
    CHECK(small.status == 4);
    CHECK(lines(small.err) == 1);
    CHECK(!std::filesystem::exists(desk.file("x.png")));
    CHECK(desk.wisp("render " + desk.s() + " --memory 1G").status == 0);
    const Ran unwritable = desk.wisp("render " + desk.s() + " -o " + desk.file("none/x.png"));
    CHECK(unwritable.status == 5);
    CHECK(lines(unwritable.err) == 1);
    CHECK(desk.wisp("render " + desk.s() + " --stats " + desk.file("none/x.json")).status == 5);
}

TEST_CASE("command line: the digest is the SHA-256 of the .pfm, the same on every run") {
    const Desk desk;
    for (const char *arithmetic : {"f32", "f64", "fixed"}) {
        const std::string pfm = desk.file("a.pfm");
        const Ran ran = desk.wisp("render " + desk.s() + " --digest --arith " + arithmetic + " -o " + pfm + " -o " +
                                  desk.file("a.png"));
        REQUIRE(ran.status == 0);
        CHECK(ran.err.empty());
        const Bytes bytes = read_file(pfm);
        CHECK(ran.out == std::string(sha256(bytes.data(), bytes.size()).text) + "  " + pfm + "\n");
        const Picture picture = read_pfm(pfm);
        CHECK(picture.width == 16);
        CHECK(picture.height == 12);
        CHECK(desk.wisp("render " + desk.s() + " --digest --arith=" + arithmetic).out == ran.out.substr(0, 66) + "-\n");
    }
}

TEST_CASE("command line: permuted particles give the same picture") { // C10
    Desk desk;
    std::string text = Desk::puff(40);
    const size_t start = text.find("float\n") + 6;
    // Turn the list of points round.
    std::vector<std::string> numbers;
    for (size_t at = start; at + 1 < text.size();) {
        const size_t space = text.find(' ', at);
        numbers.push_back(text.substr(at, space - at));
        at = space + 1;
    }
    std::string turned = text.substr(0, start);
    for (size_t i = numbers.size(); i >= 3; i -= 3)
        turned += numbers[i - 3] + " " + numbers[i - 2] + " " + numbers[i - 1] + " ";
    desk.write("turned.vtk", turned);
    desk.write("t.aff", Desk::scene("turned.vtk", ""));
    for (const char *arithmetic : {"f32", "f64", "fixed"}) {
        const std::string options = std::string(" --digest --arith ") + arithmetic;
        CHECK(desk.wisp("render " + desk.s() + options).out == desk.wisp("render " + desk.file("t.aff") + options).out);
    }
}

TEST_CASE("command line: a scene far from the origin is the same picture") { // C11
    Desk desk;
    const auto shifted = [&](double by) {
        const std::string b = std::to_string(by);
        return "v from " + b + " 0 4 at " + b + " 0 0 up 0 1 0 angle 30 hither 1 resolution 16 12\nlp " +
               std::to_string(by + 3) +
               " 3 3 40 40 40\nsmoke puff.vtk { radius 0.2 mass 1 extinction 0.02 transform 1 1 1 0 0 1 0 " + b +
               " 0 0 }\nrender photons 3000";
    };
    desk.write("near.aff", shifted(0));
    REQUIRE(desk.wisp("render " + desk.file("near.aff") + " -o " + desk.file("near.pfm")).status == 0);
    for (double by : {1024.0, 131072.0, 8388608.0}) {
        desk.write("far.aff", shifted(by));
        REQUIRE(desk.wisp("render " + desk.file("far.aff") + " -o " + desk.file("far.pfm")).status == 0);
        CHECK(desk.wisp("compare " + desk.file("far.pfm") + " " + desk.file("near.pfm") + " --tolerance 1e-3").status ==
              0);
    }
}

TEST_CASE("command line: crops, frames and defaults of the scene") {
    Desk desk;
    REQUIRE(desk.wisp("render " + desk.s() + " -o " + desk.file("whole.pfm")).status == 0);
    REQUIRE(desk.wisp("render " + desk.s() + " --crop 3,2,9,7 -o " + desk.file("part.pfm")).status == 0);
    const Picture whole = read_pfm(desk.file("whole.pfm")), part = read_pfm(desk.file("part.pfm"));
    REQUIRE(part.width == 6);
    REQUIRE(part.height == 5);
    for (size_t y = 0; y < 5; ++y)
        for (size_t x = 0; x < 18; ++x) CHECK(part.rgb[y * 18 + x] == whole.rgb[((y + 2) * 16 + 3) * 3 + x]);

    desk.write("p_03.vtk", Desk::puff(10));
    desk.write("p_05.vtk", Desk::puff(20));
    desk.write("f.aff", Desk::scene("p_%02d.vtk", "render spp 1"));
    const Ran frames = desk.wisp("render " + desk.file("f.aff") + " --frames 3:5:2 --digest -o " +
                                 desk.file("f_%04d.pfm") + " --stats " + desk.file("f.json"));
    CHECK(frames.status == 0);
    CHECK(lines(frames.out) == 2);
    CHECK(std::filesystem::exists(desk.file("f_0003.pfm")));
    CHECK(std::filesystem::exists(desk.file("f_0005.pfm")));
    CHECK(!std::filesystem::exists(desk.file("f_0004.pfm")));
    const std::string stats = text_of(desk.file("f.json"));
    CHECK(stats.find("\"frame\": 3") != std::string::npos);
    CHECK(stats.find("\"primary\": 192") != std::string::npos); // spp 1 of the scene
    CHECK(stats.find("\"particles\": 20") != std::string::npos);
    CHECK(desk.wisp("render " + desk.file("f.aff") + " --frames 4 --quiet").status == 3);
    // The command line beats the scene.
    CHECK(desk.wisp("render " + desk.file("f.aff") + " --frames 3 --spp 2 --stats " + desk.file("g.json")).status == 0);
    CHECK(text_of(desk.file("g.json")).find("\"primary\": 384") != std::string::npos);
}

TEST_CASE("command line: plan says what a scene needs and renders nothing") {
    Desk desk;
    const Ran lit = desk.wisp("plan " + desk.s());
    CHECK(lit.status == 0);
    CHECK(lit.out.find("photons        yes") != std::string::npos);
    CHECK(lit.out.find("no directions (isotropic)") != std::string::npos);
    desk.write("black.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nlp 3 3 3 1 1 1\nsmoke "
                            "puff.vtk { radius 1 mass 1 albedo 0 0 0 }");
    CHECK(desk.wisp("plan " + desk.file("black.aff"))
              .out.find("photons        no                0 bytes  the albedo is 0: nothing scatters") !=
          std::string::npos);
    desk.write("empty.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4");
    const Ran empty = desk.wisp("plan " + desk.file("empty.aff"));
    CHECK(empty.out.find("particle tree  no") != std::string::npos);
    CHECK(empty.out.find("there is no smoke") != std::string::npos);
    CHECK(desk.wisp("plan " + desk.s() + " --memory 10k").status == 4);
}

TEST_CASE("command line: progress is silent unless asked for, and never in the way") {
    const Desk desk;
    CHECK(desk.wisp("render " + desk.s()).err.empty());
    CHECK(desk.wisp("render " + desk.s() + " --progress always").err.find("render") != std::string::npos);
    CHECK(desk.wisp("render " + desk.s() + " --progress always -q").err.empty());
    CHECK(desk.wisp("render " + desk.s() + " --progress never").err.empty());
}

TEST_CASE("command line: help and version") {
    const Desk desk;
    CHECK(desk.wisp("help").out.find("--photons") != std::string::npos);
    const Ran version = desk.wisp("version");
    CHECK(version.out.find("wisp ") == 0);
    CHECK(version.out.find("f32 f64 fixed") != std::string::npos);
    CHECK(version.out.find("-ffp-contract=off") != std::string::npos);
}

TEST_CASE("command line: degenerate pictures and smokes") { // C1, C4, E15, E17
    Desk desk;
    const std::string camera = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution ";
    const std::string head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS ";
    const std::string rest =
        "\nlp 3 3 3 40 40 40\nsmoke p.vtk { radius 0.2 mass 1 extinction 0.02 }\nrender photons 500";
    for (const std::string &points :
         {std::string("0 float\n"), std::string("1 float\n0 0 0\n"), std::string("2 float\n0 0 0 1 0 0\n"),
          std::string("3 float\n0 0 0 0 0 0 0 0 0\n"), std::string("4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n")})
        for (const std::string &size : {std::string("1 1"), std::string("1 5"), std::string("5 1"), std::string("4 3")})
            for (const char *arithmetic : {"f32", "f64", "fixed"}) {
                desk.write("p.vtk", head + points);
                desk.write("d.aff", camera + size + rest);
                CAPTURE(points);
                CAPTURE(size);
                CHECK(desk.wisp("render " + desk.file("d.aff") + " --arith " + arithmetic).status == 0);
            }
}

TEST_CASE("command line: what does not fit fixed point is refused with the reason") {
    Desk desk;
    const auto with = [&](const std::string &smoke, const std::string &light) {
        desk.write("x.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 2 2\nlp " + light +
                                "\nsmoke puff.vtk { " + smoke + " }\nrender photons 100");
        return desk.wisp("render " + desk.file("x.aff") + " --arith fixed");
    };
    CHECK(with("radius 0.2 mass 1 extinction 0.02", "3 3 3 1 1 1").status == 0);
    CHECK(with("radius 1e-5 mass 1", "3 3 3 1 1 1").status == 3); // wider than the range of coordinates
    CHECK(with("radius 0.2 mass 1e9", "3 3 3 1 1 1").err.find("optical depth") != std::string::npos);
    CHECK(with("radius 0.2 mass 1", "3 3 3e4 1 1 1").err.find("a light is more than") != std::string::npos);
    CHECK(with("radius 0.2 mass 1 extinction 1e30", "3 3 3 1 1 1").status == 3); // B2
}
