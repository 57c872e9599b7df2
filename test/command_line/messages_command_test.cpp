// Lines on standard error, and what goes to standard output.
#include "host/images/picture.h"
#include "support/command_line.h"

using namespace wisp;

TEST_CASE("messages: an error names the file, its line or byte, else the program, as compilers do") {
    CommandLineTest test;
    test.write("bad.aff", "v from 1");
    test.write("g.vol", CommandLineTest::volume(2, 1, 2, 1, 1, 1, {1, 0.5f, 0.25f, 2}).substr(0, 60));
    test.write("g.aff", CommandLineTest::lit("g.vol { }"));
    test.write("none.aff", CommandLineTest::lit("none.vtk { radius 1 mass 1 }"));
    test.write("bad.pfm", "PF\n1 1\n2\n");
    const std::pair<std::string, std::string> cases[] = {
        {"paint", "wisp: error: there is no command 'paint', expected render, plan, inspect, show, info, compare, "
                  "merge, stitch, "
                  "help or version"},
        {"render " + test.file("bad.aff") + " --digest",
         test.file("bad.aff") + ":1: error: the file ends, expected y of from"},
        {"render " + test.file("none.aff") + " --digest -q", test.file("none.aff") +
                                                                 ":5: error: " + test.file("none.vtk") +
                                                                 ": cannot be opened: No such file or directory"},
        {"plan " + test.file("g.aff"), test.file("g.aff") + ":5: error: " + test.file("g.vol") +
                                           ": byte 48: 12 bytes of samples, expected 2 x 1 x 2 samples of 4 bytes"},
        {"compare " + test.file("bad.pfm") + " " + test.s(),
         test.file("bad.pfm") + ": byte 7: error: '2', expected a scale of 1.0 or -1.0"},
        {"compare " + test.file("no.pfm") + " " + test.s(),
         test.file("no.pfm") + ": error: cannot be opened: No such file or directory"},
        {"inspect " + test.s() + " 99 1", "wisp: error: X: found '99', expected a whole number from 0 to 15"}};
    for (const auto &[arguments, line] : cases) {
        CAPTURE(arguments);
        CHECK(test.wisp(arguments).err == line + "\n");
    }
}

TEST_CASE("messages: control bytes of files and arguments are shown escaped, in errors, warnings and notes") {
    CommandLineTest test;
    const std::string odd = "a\x1b[31m\xc2\x9b\xff\xc3\xa9\n\t\x7f",
                      shown = "a\\x1b[31m\\xc2\\x9b\\xff\xc3\xa9\\n\\t\\x7f";
    const auto err = [&](const std::string &arguments) { return test.wisp(arguments).err; };
    CHECK(err("'" + odd + "'").rfind("wisp: error: there is no command '" + shown + "', ", 0) == 0);
    CHECK(err("plan '" + test.file(odd) + "'") ==
          test.file(shown) + ": error: cannot be opened: No such file or directory\n");
    test.write("w.aff", "v from 1 \x1b]0;x\x07 2");
    CHECK(err("plan " + test.file("w.aff")) ==
          test.file("w.aff") + ":1: error: found '\\x1b]0;x\\x07', expected a number: y of from\n");
    test.write("p.vtk", "# vtk DataFile Version 3.0\np\nASCII\nDATASET \x9b\x1b[2J\n");
    test.write("p.aff", CommandLineTest::lit("p.vtk { radius 1 mass 1 }"));
    CHECK(err("plan " + test.file("p.aff")).find(": DATASET '\\x9b\\x1b[2J' does not hold") != std::string::npos);
    test.write(odd + ".aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4");
    CHECK(err("plan '" + test.file(odd + ".aff") + "'") ==
          test.file(shown + ".aff") +
              ": warning: the scene has neither smoke nor surfaces: the picture is its background\n");
    CHECK(err("render " + test.s() + " -v -o '" + test.file(odd + ".png") + "'") ==
          "wrote " + test.file(shown + ".png") + "\n");
}

TEST_CASE("messages: --quiet silences warnings, never errors") {
    CommandLineTest test;
    test.write("e.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4");
    const std::string render = "render " + test.file("e.aff") + " --digest";
    CHECK(lines(test.wisp(render).err) == 1);
    CHECK(test.wisp(render + " -q").err.empty());
    CHECK(test.wisp(render + " -q").out == test.wisp(render).out);
    test.refuses(test.wisp("render " + test.file("none.aff") + " --digest -q"), 3,
                 test.file("none.aff") + ": cannot be opened: No such file or directory");
}

TEST_CASE("messages: a wrong word of a scene is answered with the one that was meant") {
    CommandLineTest test;
    const auto error = [&](const std::string &text) {
        test.write("w.aff", text);
        return test.wisp("plan " + test.file("w.aff")).err;
    };
    const auto ends = [](const std::string &text, const std::string &end) {
        return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
    };
    CHECK(ends(error("smok p.vtk { }"), "or a comment; did you mean 'smoke'?\n"));
    CHECK(ends(error("qqqq"), "or a comment\n"));
    CHECK(ends(error("smoke p.vtk { albdo 1 1 1 }"), "; did you mean 'albedo'?\n"));
    CHECK(error("render photon 5") ==
          test.file("w.aff") + ":1: error: there is no option 'photon'; 'wisp help' lists them; did you mean "
                               "'photons'?\n");
    CHECK(error("render irradiance adaptiv").find("; did you mean 'adaptive'?") != std::string::npos);
}

TEST_CASE("messages: what is chosen for the first file of a sequence does not stand for what later files say") {
    CommandLineTest test;
    const auto write = [&](const char *name, const std::string &more, const char *end) {
        std::string text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                           "property float z\n" +
                           more + "end_header\n";
        for (const char *place : {"0 0 0", "0.5 0 0", "0 0.5 0"}) text += place + std::string(end) + "\n";
        test.write(name, text);
    };
    const std::string render =
        "render " + test.s() + " --size 4x4 --photons 0 --frames 0:1 -o " + test.file("f_%04d.pfm");
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 30 hither 0.1 resolution 8 8\nld 0 0 -1 1 1 1\na 0 1 2\n"
                        "smoke s_%04d.ply { frames 0 1 }\n");
    write("s_0000.ply", "", "");
    write("s_0001.ply", "", "");
    CHECK(test.wisp(render).status == 0);
    for (const auto &[property, line] : {std::pair{"h", "radius H"}, std::pair{"mass", "mass M"}}) {
        write("s_0001.ply", "property float " + std::string(property) + "\n", " 0.25");
        const Ran ran = test.wisp(render);
        CAPTURE(ran.err);
        CHECK(ran.status == 3);
        CHECK(ran.err.find("s_0001.ply has what the file of the first frame leaves out, expected files alike, or a "
                           "line '" +
                           std::string(line) + "' for all of them") != std::string::npos);
    }
    test.refuses(test.wisp("render " + test.s() + " --frames 1:0 -o " + test.file("f_%04d.pfm")), 2,
                 "option 'frames': found '1:0', expected A:B, B not below A");
}

TEST_CASE("messages: - is standard output: the bytes of a picture, or statistics, and nothing else") {
    const CommandLineTest test;
    const std::string render = "render " + test.s() + " ";
    REQUIRE(test.wisp(render + "-o " + test.file("a.pfm") + " -o " + test.file("a.png")).status == 0);
    CHECK(test.wisp(render + "-o -").out == text_of(test.file("a.pfm")));
    CHECK(test.wisp(render + "-o -.png -v").out == text_of(test.file("a.png")));
    CHECK(test.wisp(render + "-o - --crop 0,0,16,12").out == text_of(test.file("a.pfm")));
    CHECK(!std::filesystem::exists("-.pfm"));
    CHECK(!std::filesystem::exists("-.pfm.wisp"));
    const Ran statistics = test.wisp(render + "--stats -");
    CHECK(statistics.status == 0);
    CHECK(statistics.out.rfind("{ \"wisp\": ", 0) == 0);
    test.refuses(test.wisp(render + "--frames 0:1 -o -"), 2,
                 "option 'output': found '-.pfm' for several frames, expected a name with %04d");
    REQUIRE(test.wisp(render + "--reference --passes 0:1 -o " + test.file("a.passes") + " -o " + test.file("r.pfm"))
                .status == 0);
    CHECK(test.wisp("merge " + test.file("a.passes") + " -o -").out == text_of(test.file("r.pfm")));
    const std::string full = built("wisp") + " " + render + "-o - > /dev/full 2> " + test.file("err");
    CHECK(WEXITSTATUS(std::system(full.c_str())) == 5);
    CHECK(text_of(test.file("err")) == "wisp: error: standard output could not be written\n");
}

TEST_CASE("messages: what cannot be written is refused before any work, and nothing is left of the trial") {
    CommandLineTest test;
    std::filesystem::create_directory(test.file("folder.png"));
    // The work would fail: it is not begun.
    test.write("none.aff", CommandLineTest::scene("none.vtk", ""));
    const std::string long_name(252, 'n'), none = "No such file or directory";
    const std::pair<std::string, std::string> cases[] = {
        {"-o " + test.file("none/x.png"), test.file("none/x.png") + ": could not be written: " + none},
        {"--frames 3:4 -o " + test.file("none/x_%d.png"),
         test.file("none/x_3.png") + ": could not be written: " + none},
        {"-o " + test.file("x.png") + " --stats " + test.file("none/s"),
         test.file("none/s") + ": could not be written: " + none},
        {"--map-out " + test.file("none/m"), test.file("none/m") + ": could not be written: " + none},
        {"--reference -o " + test.file("x.png") + " --error-out " + test.file("none/e.pfm"),
         test.file("none/e.pfm") + ": could not be written: " + none},
        {"-o " + test.file("folder.png"), test.file("folder.png") + ": could not be written: Is a directory"},
        {"--stats " + test.file(long_name), test.file(long_name) + ": could not be written: File name too long"}};
    for (const auto &[options, line] : cases) {
        CAPTURE(options);
        test.refuses(test.wisp("render " + test.file("none.aff") + " " + options), 5, line);
        CHECK(!test.has("x.png"));
    }
    // What is there stays, and a run that fails later leaves nothing.
    test.write("x.png", "old");
    test.refuses(test.wisp("render " + test.file("none.aff") + " -o " + test.file("x.png")), 3);
    CHECK(text_of(test.file("x.png")) == "old");
    test.refuses(test.wisp("merge none.passes -o " + test.file("none/x.png")), 5);
    test.refuses(test.wisp("stitch none.pfm -o " + test.file("none/x.png")), 5);
    test.refuses(test.wisp("compare none.pfm none.pfm --diff " + test.file("none/x.png")), 5);
}

TEST_CASE("messages: no file that is read is overwritten") {
    CommandLineTest test;
    const auto refused = [&](const std::string &arguments, const char *option, const std::string &name) {
        CAPTURE(arguments);
        const std::string before = text_of(test.file(name));
        test.refuses(
            test.run("cd " + test.file("") + "; " + std::filesystem::absolute(built("wisp")).string() + " " +
                     arguments),
            2, "option '" + std::string(option) + "' writes to '" + name + "', which is read, expected another file");
        CHECK(text_of(test.file(name)) == before);
    };
    // Formats are known by their contents: any name will do.
    for (const char *name : {"smoke.pfm", "s_0002.pfm", "s_0003.pfm"}) test.write(name, CommandLineTest::puff(30));
    refused("plan smoke.pfm --write-scene smoke.pfm", "write-scene", "smoke.pfm");
    refused("render smoke.pfm --write-scene smoke.pfm -o a.png", "write-scene", "smoke.pfm");
    test.write("one.aff", CommandLineTest::scene("smoke.pfm", ""));
    refused("render one.aff -o smoke.pfm", "output", "smoke.pfm");
    refused("render one.aff -o a.pfm --error-out smoke.pfm --reference", "error-out", "smoke.pfm");
    refused("show density one.aff -o smoke.pfm", "output", "smoke.pfm");
    // The picture of frame 3 would be the smoke of frame 1.
    test.write("two.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nlp 3 3 3 9 9 9\n"
                          "smoke s_%04d.pfm { radius 1 mass 1 frames 2 1 }\na 0 1 4\n");
    refused("render two.aff -o s_%04d.pfm", "output", "s_0002.pfm");
    test.write("part.pfm", "b 0.1 0.2 0.3\n");
    test.write("whole.aff", CommandLineTest::scene("smoke.pfm", "i 0 part.pfm\n"));
    refused("render whole.aff -o part.pfm", "output", "part.pfm");
    CHECK(test.wisp("render " + test.s() + " -q --size 4x4 -o " + test.file("t.png")).status == 0);
    test.write("textured.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nlp 3 3 3 9 9 9\n"
                               "f 1 1 1 1 0 0 0 0\ntt t.png  -1 -1 0 0 0  1 -1 0 1 0  0 1 0 0 1\n");
    refused("render textured.aff -o t.png", "output", "t.png");
    CHECK(test.wisp("render " + test.s() + " -q --size 4x4 -o " + test.file("t.pfm")).status == 0);
    refused("compare t.png t.pfm --json t.pfm", "json", "t.pfm");
    refused("compare t.pfm t.png --diff t.png", "diff", "t.png");
    refused("stitch t.pfm -o t.pfm", "output", "t.pfm");
}

TEST_CASE("messages: a file that may not grow is one that cannot be written") {
    CommandLineTest test;
    const Ran ran =
        test.run("ulimit -f 4; " + built("wisp") + " render " + test.s() + " -q --size 64x64 -o " + test.file("a.pfm"));
    test.refuses(ran, 5);
    CHECK(!test.has("a.pfm"));
}
