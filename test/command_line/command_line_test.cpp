// build/wisp as a user meets it: exit statuses, error lines, outputs, digests, crops, frames, memory.
#include "host/base/sha256.h"
#include "host/images/picture.h"
#include "host/results/passes.h"
#include "host/scene/options.h"
#include "support/command_line.h"
#include "wisp/progress.h"
#include <cmath>
#include <doctest/doctest.h>
#include <map>
#include <sstream>
#include <unistd.h>

using namespace wisp;

TEST_CASE("command line: wrong usage ends with 2, and a line that says what was found and expected") {
    const CommandLineTest test;
    const std::string scene = "render " + test.s() + " --digest ", surfaces = "render fixtures/surfaces.aff ",
                      commands = "expected render, plan, inspect, show, info, compare, merge, stitch, help or version",
                      paper_frames = "option 'frames' does not go with --shadows paper: it learns from frame to frame, "
                                     "expected all from 0 on";
    const std::pair<std::string, std::string> cases[] = {
        {"", "found no command, " + commands},
        {"paint", "there is no command 'paint', " + commands},
        {"render", "found 0 scene files, expected one; see 'wisp help'"},
        {"version 2", "found '2' behind 'version', expected nothing"},
        {"help render plan", "found 'plan' behind 'render', expected one command"},
        {scene + test.s(), "found 2 scene files, expected one; see 'wisp help'"},
        {scene + "--bogus", "there is no option '--bogus'; 'wisp help' lists them"},
        {scene + "--photon 5", "there is no option '--photon'; 'wisp help' lists them; did you mean '--photons'?"},
        {"rendr a.aff", "there is no command 'rendr', " + commands + "; did you mean 'render'?"},
        {scene + "--smoke dirct",
         "option 'smoke': found 'dirct', expected direct, map, volume; did you mean 'direct'?"},
        {scene + "--photons --digest", "the value of '--photons' is '--digest', which is an option: was the value "
                                       "forgotten? '--photons=--digest' takes it as it is"},
        {scene + "-o -v", "the value of '--output' is '-v', which is an option: was the value forgotten? "
                          "'--output=-v' takes it as it is"},
        {"render " + test.s(),
         "found nothing to make of the scene, expected --output, --digest, --stats, --map-out or --error-out"},
        {scene + "--photons 9 -o - --digest",
         "option 'digest' writes to standard output like 'output', expected another file"},
        {scene + "--stats - -o -.png", "option 'stats' writes to standard output like 'output', expected another file"},
        {scene + "-o - -o -.png", "option 'output' writes to standard output like 'output', expected another file"},
        {scene + "-o a.png -o ./a.png", "option 'output' writes to './a.png' like 'output', expected another file"},
        {scene + "-o a_0000.png -o a_%04d.png",
         "option 'output' writes to 'a_0000.png' like 'output', expected another file"},
        {scene + "--stats " + test.s(),
         "option 'stats' writes to '" + test.s() + "', which is read, expected another file"},
        {scene + "--spp", "option '--spp' needs a value: N"},
        {scene + "--spp 0", "option 'spp': found '0', expected a whole number from 1 to 65536"},
        {scene + "--deposit exact --density-step 0.5",
         "option 'density-step': found resampled smoke, expected 0 with --deposit, --direction mean, --estimate knn or "
         "--irradiance none of --smoke map"},
        {"render fixtures/grid.aff --digest --smoke map --estimate knn",
         "fixtures/grid.aff: option 'estimate': found 'knn' with --smoke map for a grid or a box, expected kernel, or "
         "particles alone"},
        {scene + "--smoke map --estimate knn --irradiance uniform",
         "option 'irradiance': found a map, expected none with --estimate knn of --smoke map"},
        {scene + "--smoke volume --density-step 0",
         "option 'density-step': found 0, expected cells with --smoke volume"},
        {scene + "--irradiance-step 0", "option 'irradiance-step': found '0', expected a number from 0.01 to 1000"},
        {scene + "--smoke direct --estimate kernel",
         "option 'estimate': found 'kernel', expected knn with --smoke direct"},
        {scene + "--reference=1", "option '--reference' takes no value"},
        {scene + "--crop 0,0,17,3", "option 'crop': found 0,0,17,3, expected pixels of the 16 x 12 picture"},
        {scene + "--frames 0:1 -o a.png",
         "option 'output': found 'a.png' for several frames, expected a name with %04d"},
        {scene + "-o a.jpg",
         "option 'output': found 'a.jpg', expected a file name that ends in .png, .pfm, .exr, .passes or .map, or -"},
        {scene + "--quiet=1", "option '--quiet' takes no value"},
        {scene + "--reference --passes 16:8", "option 'passes': found '16:8', expected A:B with A < B"},
        {surfaces + "--shadows soft",
         "option 'shadows': found 'soft', expected trace, cache, paper, exact, voxel, lightbuffer, lie"},
        {surfaces + "--shadows paper --crop 0,0,4,4",
         "option 'crop' does not go with --shadows paper: it learns from whole pictures"},
        {surfaces + "--shadows paper --frames 1", paper_frames},
        {surfaces + "--shadows paper --frames 0:2:2", paper_frames},
        {"compare a.pfm", "'wisp compare' has 1 files, expected two pictures"}};
    for (const auto &[arguments, line] : cases) {
        CAPTURE(arguments);
        test.refuses(test.wisp(arguments), 2, line);
    }
}

TEST_CASE("command line: bad input ends with 3 and a line that names the file") {
    CommandLineTest test;
    test.write("bad.aff", "v from 1");
    test.write("noview.aff", "b 0 0 0");
    test.write("missing.aff", CommandLineTest::scene("none.vtk", ""));
    test.write("broken.vtk", CommandLineTest::puff(40).substr(0, 300));
    test.write("broken.aff", CommandLineTest::scene("broken.vtk", ""));
    test.write("empty.vtk", "");
    test.write("picture.pfm", "PF\n1 1\n-1.0\n............");
    test.write("picture.ppm", "P3\n1 1\n255\n0 0 0\n");
    test.write("mesh.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    test.write("includes.aff", "v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 8 8\ni 0 mesh.OBJ\n");
    test.write("x.map", "wisp map 1\n");
    test.write("twice.aff", "v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 8 8\n"
                            "smoke puff.vtk { mass 1 radius 0.2 mass 2 }\n");
    test.write("textured.aff", "v from 0 0 5 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 8 8\n"
                               "tt none.ppm  0 0 0 0 0  1 0 0 1 0  0 1 0 0 1\n");
    test.write("option.aff", CommandLineTest::scene("puff.vtk", "render spp zero"));
    const std::pair<std::string, std::string> cases[] = {
        {"nowhere.aff", "nowhere.aff: cannot be opened: No such file or directory"},
        {"bad.aff", "bad.aff:1: the file ends, expected y of from"},
        {"noview.aff", "noview.aff:1: there is no view, expected a statement 'v from ...'"},
        {"missing.aff", "missing.aff:4: " + test.file("none.vtk") + ": cannot be opened: No such file or directory"},
        {"broken.aff", "broken.aff:4: " + test.file("broken.vtk") +
                           ":5: 40 points, expected at most 38: the file ends 230 bytes further on"},
        {"empty.vtk", "empty.vtk: found an empty file, expected a scene, particles or a density grid"},
        {"picture.pfm", "picture.pfm: found a picture, expected a scene, particles or a density grid"},
        {"picture.ppm", "picture.ppm: found a picture, expected a scene, particles or a density grid"},
        {"mesh.OBJ",
         "mesh.OBJ: found a mesh, whose format wisp does not read, expected a scene, particles or a density "
         "grid"},
        {"includes.aff", "includes.aff:2: include of " + test.file("mesh.OBJ") +
                             ": found a mesh, whose format wisp does not read, expected statements of a scene"},
        {"x.map", "x.map: found 'wisp map 1', expected a scene, particles or a density grid"},
        {"twice.aff", "twice.aff:2: found 'mass' again, expected it once in a smoke"},
        {"textured.aff", "textured.aff:2: " + test.file("none.ppm") + ": cannot be opened: No such file or directory"},
        {"option.aff", "option.aff:11: option 'spp': found 'zero', expected a whole number from 1 to 65536"}};
    for (const auto &[scene, line] : cases) {
        CAPTURE(scene);
        test.refuses(test.wisp("render " + test.file(scene) + " -o " + test.file("x.png")), 3, test.file("") + line);
        CHECK(!test.has("x.png"));
    }
}

TEST_CASE("command line: a plan beyond --memory ends with 4, an unwritable output with 5") {
    const CommandLineTest test;
    const Ran small = test.wisp("render " + test.s() + " --memory 10k -o " + test.file("x.png"));
    test.refuses(small, 4);
    CHECK(small.err.rfind(test.s() + ": error: the plan needs ", 0) == 0);
    CHECK(small.err.find(", expected at most the 10240 of --memory") != std::string::npos);
    CHECK(!std::filesystem::exists(test.file("x.png")));
    CHECK(test.wisp("render " + test.s() + " --memory 1G --digest").status == 0);
    for (const std::string option : {"-o ", "--stats "}) {
        const std::string name = test.file(option == "-o " ? "none/x.png" : "none/x.json");
        test.refuses(test.wisp("render " + test.s() + " " + option + name), 5,
                     name + ": could not be written: No such file or directory");
    }
}

TEST_CASE("command line: an output whose name no file can have, or whose folder is gone, is an error as any other") {
    const CommandLineTest test;
    const std::string longest = test.file(std::string(300, 'a') + ".png");
    test.refuses(test.wisp("render " + test.s() + " -o " + longest), 5,
                 longest + ": could not be written: File name too long");
    test.refuses(test.wisp("render " + test.s() + " -o " + longest + " -o " + longest), 2,
                 "option 'output' writes to '" + longest + "' like 'output', expected another file");
    const std::string program = std::filesystem::absolute(built("wisp")).string();
    test.refuses(test.run("mkdir " + test.file("gone") + " && cd " + test.file("gone") + " && rmdir " +
                          test.file("gone") + " && " + program + " render " + test.s() + " -o x.png -o y.png"),
                 5, "x.png: could not be written: No such file or directory");
}

TEST_CASE("command line: a picture beyond --memory, or beyond the machine's, ends with 4 before any work") {
    CommandLineTest test;
    test.write("triangle.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 35 hither 0.1 resolution 8 8\n"
                               "p 3\n-1 -1 0\n1 -1 0\n0 1 0\n");
    const std::string out = " -o " + test.file("x.pfm");
    for (const char *options : {" --size 16384x16384 --memory 1G", " --size 65536x65536 --memory 64G",
                                " --size 8192x8192 --reference --memory 1G"}) {
        CAPTURE(options);
        for (const char *command : {"render ", "plan "}) {
            const Ran big = test.wisp(command + test.file("triangle.aff") + options + out);
            test.refuses(big, 4);
            CHECK(big.err.find(" of them for 'picture', expected at most the ") != std::string::npos);
            CHECK(big.err.find("; --size ") != std::string::npos);
        }
    }
    // Sums of --reference, 515 GB of them: more than most machines have.
    const uint64_t needed = uint64_t{65536} * 65536 * 120;
    if (static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) < needed)
        CHECK(test.wisp("render " + test.file("triangle.aff") + " --size 65536x65536 --reference" + out).status == 4);
    const std::string crop = test.file("triangle.aff") + " --size 16384x16384 --memory 1M --crop 0,0,8,8";
    CHECK(test.wisp("render " + crop + out).status == 0);
    CHECK(test.wisp("inspect " + test.file("triangle.aff") + " 3 4 --size 16384x16384 --memory 1M").status == 0);
}

TEST_CASE("command line: the digest is the SHA-256 of the .pfm, the same on every run") {
    const CommandLineTest test;
    for (const char *arithmetic : {"f32", "f64", "fixed"}) {
        const std::string pfm = test.file("a.pfm");
        const Ran ran = test.wisp("render " + test.s() + " --digest --arith " + arithmetic + " -o " + pfm + " -o " +
                                  test.file("a.png"));
        REQUIRE(ran.status == 0);
        CHECK(ran.err.empty());
        const Bytes bytes = read_file(pfm);
        CHECK(ran.out == std::string(sha256(bytes.data(), bytes.size()).text) + "  " + pfm + "\n");
        const Picture picture = read_pfm(pfm);
        CHECK(picture.width == 16);
        CHECK(picture.height == 12);
        CHECK(test.wisp("render " + test.s() + " --digest --arith=" + arithmetic).out == ran.out.substr(0, 66) + "-\n");
    }
}

TEST_CASE("command line: permuted particles give the same picture") { // C10
    CommandLineTest test;
    std::string text = CommandLineTest::puff(40);
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
    test.write("turned.vtk", turned);
    test.write("t.aff", CommandLineTest::scene("turned.vtk", ""));
    for (const char *arithmetic : {"f32", "f64", "fixed"}) {
        const std::string options = std::string(" --digest --arith ") + arithmetic;
        CHECK(test.wisp("render " + test.s() + options).out == test.wisp("render " + test.file("t.aff") + options).out);
    }
}

TEST_CASE("command line: a scene far from the origin is the same picture") { // C11
    CommandLineTest test;
    const auto shifted = [&](double by) {
        const std::string b = std::to_string(by);
        return "v from " + b + " 0 4 at " + b + " 0 0 up 0 1 0 angle 30 hither 1 resolution 16 12\nlp " +
               std::to_string(by + 3) +
               " 3 3 40 40 40\nsmoke puff.vtk { radius 0.2 mass 1 extinction 0.02 transform 1 1 1 0 0 1 0 " + b +
               " 0 0 }\nrender photons 3000";
    };
    test.write("near.aff", shifted(0));
    REQUIRE(test.wisp("render " + test.file("near.aff") + " -o " + test.file("near.pfm")).status == 0);
    for (double by : {1024.0, 131072.0, 8388608.0}) {
        test.write("far.aff", shifted(by));
        REQUIRE(test.wisp("render " + test.file("far.aff") + " -o " + test.file("far.pfm")).status == 0);
        CHECK(test.wisp("compare " + test.file("far.pfm") + " " + test.file("near.pfm") + " --tolerance 1e-3").status ==
              0);
    }
}

TEST_CASE("command line: crops, frames and defaults of the scene") {
    CommandLineTest test;
    REQUIRE(test.wisp("render " + test.s() + " -o " + test.file("whole.pfm")).status == 0);
    REQUIRE(test.wisp("render " + test.s() + " --crop 3,2,9,7 -o " + test.file("part.pfm")).status == 0);
    const Picture whole = read_pfm(test.file("whole.pfm")), part = read_pfm(test.file("part.pfm"));
    REQUIRE(part.width == 6);
    REQUIRE(part.height == 5);
    for (size_t y = 0; y < 5; ++y)
        for (size_t x = 0; x < 18; ++x) CHECK(part.rgb[y * 18 + x] == whole.rgb[((y + 2) * 16 + 3) * 3 + x]);

    test.write("p_03.vtk", CommandLineTest::puff(10));
    test.write("p_05.vtk", CommandLineTest::puff(20));
    test.write("f.aff", CommandLineTest::scene("p_%02d.vtk", "render spp 1"));
    const Ran frames = test.wisp("render " + test.file("f.aff") + " --frames 3:5:2 --digest -o " +
                                 test.file("f_%04d.pfm") + " --stats " + test.file("f.json"));
    CHECK(frames.status == 0);
    CHECK(lines(frames.out) == 2);
    CHECK(std::filesystem::exists(test.file("f_0003.pfm")));
    CHECK(std::filesystem::exists(test.file("f_0005.pfm")));
    CHECK(!std::filesystem::exists(test.file("f_0004.pfm")));
    const std::string stats = text_of(test.file("f.json"));
    CHECK(stats.find("\"frame\": 3") != std::string::npos);
    CHECK(stats.find("\"primary\": 192") != std::string::npos); // spp 1 of the scene
    CHECK(stats.find("\"particles\": 20") != std::string::npos);
    CHECK(test.wisp("render " + test.file("f.aff") + " --frames 4 --quiet --digest").status == 3);
    // The command line beats the scene.
    CHECK(test.wisp("render " + test.file("f.aff") + " --frames 3 --spp 2 --stats " + test.file("g.json")).status == 0);
    CHECK(text_of(test.file("g.json")).find("\"primary\": 384") != std::string::npos);
}

TEST_CASE("command line: plan says what a scene needs and renders nothing") {
    CommandLineTest test;
    const Ran lit = test.wisp("plan " + test.s() + " --smoke direct");
    CHECK(lit.status == 0);
    CHECK(lit.out.find("photons        yes") != std::string::npos);
    CHECK(lit.out.find("no directions (isotropic)") != std::string::npos);
    test.write("black.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nlp 3 3 3 1 1 1\nsmoke "
                            "puff.vtk { radius 1 mass 1 albedo 0 0 0 }");
    CHECK(test.wisp("plan " + test.file("black.aff") + " --smoke direct")
              .out.find("photons        no                0 bytes  the albedo is 0: nothing scatters") !=
          std::string::npos);
    const std::string even = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nlp 3 3 3 1 1 1\n"
                             "smoke puff.vtk { radius 1 mass 1 phase ";
    const auto kept = [&](const std::string &phase, const std::string &what) {
        test.write("even.aff", even + phase + " }");
        return test.wisp("plan " + test.file("even.aff") + " --irradiance uniform").out.find(", " + what + "\n") !=
               std::string::npos;
    };
    CHECK(kept("0", "no flux (isotropic)"));
    CHECK(kept("0.3", "flux and spherical harmonics of directions"));
    CHECK(kept("0.31", "as scattered to the eye"));
    CHECK(kept("-0.5", "flux and spherical harmonics of directions"));
    CHECK(kept("0.1 albedo .9 .5 .5", "flux and spherical harmonics of directions"));
    CHECK(kept("0.11 albedo .9 .5 .5", "as scattered to the eye"));
    CHECK(kept("-0.58", "flux"));
    test.write("empty.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4");
    const Ran empty = test.wisp("plan " + test.file("empty.aff"));
    CHECK(empty.out.find("particle tree  no") != std::string::npos);
    CHECK(empty.out.find("there is no smoke") != std::string::npos);
    CHECK(test.wisp("plan " + test.s() + " --memory 10k").status == 4);
}

TEST_CASE("command line: progress is shown only where it is wanted") {
    const CommandLineTest test;
    const std::string render = "render " + test.s() + " --digest";
    CHECK(test.wisp(render).err.empty());
    CHECK(test.wisp(render + " --progress always").err.find("camera rays") != std::string::npos);
    CHECK(test.wisp(render + " --progress always -q").err.empty());
    CHECK(test.wisp(render + " --progress never").err.empty());
}

TEST_CASE("command line: help and version") {
    const CommandLineTest test;
    const std::string help = test.wisp("help").out;
    CHECK(help.find("--photons") != std::string::npos);
    const auto widest = [](const std::string &text) {
        size_t most = 0;
        for (size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
            most = std::max(most, end - begin);
        return most;
    };
    CHECK(widest(help) <= 100);
    for (const std::string command : {"render", "plan", "inspect", "info", "compare", "merge", "stitch"}) {
        CAPTURE(command);
        const Ran ran = test.wisp(command + " --help");
        CHECK(ran.status == 0);
        CHECK(ran.err.empty());
        CHECK(ran.out.rfind("wisp " + command, 0) == 0);
        CHECK(ran.out.find("Example: wisp " + command + " ") != std::string::npos);
        CHECK((ran.out.find("--photons") != std::string::npos) ==
              (command == "render" || command == "plan" || command == "inspect"));
        CHECK(widest(ran.out) <= 100);
        CHECK(test.wisp(command + " -h").out == ran.out);
        CHECK(test.wisp("help " + command).out == ran.out);
    }
    // Every option stands under one subject.
    const std::string render = test.wisp("render --help").out;
    for (const std::string &name : option_names(scene_options())) {
        CAPTURE(name);
        const size_t found = render.find("\n  --" + name + " ");
        REQUIRE(found != std::string::npos);
        CHECK(render.find("\n  --" + name + " ", found + 1) == std::string::npos);
        CHECK(found > render.find("\n Picture:\n"));
    }
    const Ran wrong = test.wisp("help rendr");
    CHECK(wrong.status == 2);
    CHECK(wrong.err.find("there is no command 'rendr', expected render, ") != std::string::npos);
    CHECK(wrong.err.find("did you mean 'render'?") != std::string::npos);
    const Ran version = test.wisp("version");
    CHECK(version.out.find("wisp ") == 0);
    CHECK(version.out.find("f32 f64 fixed") != std::string::npos);
    CHECK(version.out.find("-ffp-contract=off") != std::string::npos);
}

TEST_CASE("command line: the help on a command lists of render's options those that it does not refuse") {
    const CommandLineTest test;
    const auto value_of = [&test](const std::string &name) -> std::string {
        for (const std::string flag : {"digest", "quiet", "verbose", "layers", "reference", "remap"})
            if (name == flag) return "";
        const std::map<std::string, std::string> values = {{"size", "4x4"},
                                                           {"crop", "0,0,2,2"},
                                                           {"frames", "0"},
                                                           {"arith", "f64"},
                                                           {"output", test.file("o.png")},
                                                           {"stats", "-"},
                                                           {"progress", "never"},
                                                           {"smoke", "map"},
                                                           {"irradiance", "uniform"},
                                                           {"estimate", "kernel"},
                                                           {"deposit", "exact"},
                                                           {"direction", "flux"},
                                                           {"shadows", "exact"},
                                                           {"lights", "all"},
                                                           {"tree", "kd"},
                                                           {"up", "y"},
                                                           {"grid", "x"},
                                                           {"write-scene", test.file("w.aff")},
                                                           {"passes", "0:2 --reference"},
                                                           {"memory", "1G"},
                                                           {"error-out", test.file("e.pfm") + " --reference"},
                                                           {"map-out", test.file("m.map")},
                                                           {"map-in", test.file("none.map")},
                                                           {"batches", "0:1 --map-out " + test.file("m.map")},
                                                           {"max-error", "0.5"},
                                                           {"ground", "yes"}};
        const auto found = values.find(name);
        return " " + (found == values.end() ? "1" : found->second);
    };
    for (const std::string command : {"plan ", "inspect ", "show density "}) {
        const std::string first_word = command.substr(0, command.find(' '));
        const std::string help = test.wisp(first_word + " --help").out;
        for (const std::string &name : option_names(scene_options())) {
            CAPTURE(command);
            CAPTURE(name);
            const bool is_listed = help.find("\n  --" + name + " ") != std::string::npos;
            const Ran ran =
                test.wisp(command + test.s() + (command == "inspect " ? " 1 1" : "") + " --" + name + value_of(name) +
                          (command[0] == 's' && name != "output" && name != "batches" ? " --digest" : ""));
            const bool is_refused = ran.err.find("does not go with " + first_word + ":") != std::string::npos ||
                                    ran.err.find("belongs to render") != std::string::npos;
            CHECK_MESSAGE(is_listed != is_refused, ran.err);
        }
    }
}

TEST_CASE("command line: degenerate pictures and smokes") { // C1, C4, E15, E17
    CommandLineTest test;
    const std::string camera = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution ";
    const std::string head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS ";
    const std::string rest =
        "\nlp 3 3 3 40 40 40\nsmoke p.vtk { radius 0.2 mass 1 extinction 0.02 }\nrender photons 500";
    for (const std::string &points :
         {std::string("0 float\n"), std::string("1 float\n0 0 0\n"), std::string("2 float\n0 0 0 1 0 0\n"),
          std::string("3 float\n0 0 0 0 0 0 0 0 0\n"), std::string("4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n")})
        for (const std::string &size : {std::string("1 1"), std::string("1 5"), std::string("5 1"), std::string("4 3")})
            for (const char *arithmetic : {"f32", "f64", "fixed"}) {
                test.write("p.vtk", head + points);
                test.write("d.aff", camera + size + rest);
                CAPTURE(points);
                CAPTURE(size);
                CHECK(test.wisp("render " + test.file("d.aff") + " --digest --arith " + arithmetic).status == 0);
            }
}

TEST_CASE("command line: what does not fit fixed point is refused with the reason") {
    CommandLineTest test;
    const auto with = [&](const std::string &smoke, const std::string &light) {
        test.write("x.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 2 2\nlp " + light +
                                "\nsmoke puff.vtk { " + smoke + " }\nrender photons 100");
        return test.wisp("render " + test.file("x.aff") + " --digest --arith fixed");
    };
    CHECK(with("radius 0.2 mass 1 extinction 0.02", "3 3 3 1 1 1").status == 0);
    CHECK(with("radius 1e-5 mass 1", "3 3 3 1 1 1").status == 3); // wider than the range of coordinates
    CHECK(with("radius 0.2 mass 1e9", "3 3 3 1 1 1").err.find("optical depth") != std::string::npos);
    CHECK(with("radius 0.2 mass 1", "3 3 3e4 1 1 1").err.find("a light is more than") != std::string::npos);
    CHECK(with("radius 0.2 mass 1 extinction 1e30", "3 3 3 1 1 1").status == 3); // B2
}

namespace {

struct ReferenceCommandTest : CommandLineTest {
    ReferenceCommandTest() { write("r.aff", lit("box -1 -1 -1 1 1 1 1.5 { phase 0.3 emission 0.2 0.1 0 }")); }
    Ran render(const std::string &options) const { return wisp("render " + file("r.aff") + " --reference " + options); }
    Ran merge(const std::string &options) const { return wisp("merge " + options); }
};

} // namespace

TEST_CASE("command line: what belongs to --reference is refused without it, and in a scene what names a file") {
    const ReferenceCommandTest test;
    const std::string s = test.s(), x = test.file("x");
    test.refuses(test.wisp("render " + s + " --passes 0:2 -o " + x + ".pfm"), 2,
                 "option 'passes' belongs to --reference");
    test.refuses(test.wisp("render " + s + " --error-out " + x + ".pfm"), 2,
                 "option 'error-out' belongs to --reference");
    test.refuses(test.wisp("render " + s + " -o " + x + ".passes"), 2,
                 "option 'output': found '" + x + ".passes', expected .passes only with --reference");
    test.refuses(test.render("--passes 2:2"), 2, "option 'passes': found '2:2', expected A:B with A < B");
    test.refuses(test.render("--error-out " + x + ".png"), 2,
                 "option 'error-out': found '" + x + ".png', expected a file name that ends in .pfm");
    test.refuses(test.render("--frames 0:1 --error-out " + x + ".pfm"), 2,
                 "option 'error-out': found '" + x + ".pfm' for several frames, expected a name with %04d");
    test.refuses(test.render("--frames 0:1 -o " + x + ".passes"), 2,
                 "option 'output': found '" + x + ".passes' for several frames, expected a name with %04d");
    CHECK(!test.has("x.pfm"));
    CHECK(!test.has("x.passes"));

    CommandLineTest scenes;
    scenes.write("o.aff", CommandLineTest::lit("box 0 0 0 1 1 1 1 {}", "render reference 1\nrender error-out e.pfm"));
    const Ran named = scenes.wisp("render " + scenes.file("o.aff"));
    CHECK(named.status == 3);
    CHECK(named.err ==
          scenes.file("o.aff") + ":10: error: option 'error-out' in a scene, expected it on the command line\n");
    // The others may be a scene's defaults.
    scenes.write("d.aff", CommandLineTest::lit("box 0 0 0 1 1 1 1 {}", "render reference 1\nrender passes 0:2"));
    scenes.write("e.aff", CommandLineTest::lit("box 0 0 0 1 1 1 1 {}"));
    const Ran ran = scenes.wisp("render " + scenes.file("d.aff") + " --digest");
    CHECK(ran.status == 0);
    CHECK(ran.out == scenes.wisp("render " + scenes.file("e.aff") + " --digest --reference --passes 0:2").out);
}

TEST_CASE("command line: passes apart and merged are the passes together, to the byte") {
    const ReferenceCommandTest test;
    for (const std::string arithmetic : {"f32", "f64", "fixed"}) {
        const std::string arith = " --arith " + arithmetic;
        const auto files = [&](const std::string &name) {
            return " -o " + test.file(name + ".passes") + " -o " + test.file(name + ".pfm") + " --error-out " +
                   test.file(name + "_e.pfm") + " -o " + test.file(name + ".png") + " --digest";
        };
        const Ran whole = test.render("--passes 0:5" + arith + files("whole"));
        REQUIRE(whole.status == 0);
        CHECK(whole.err.empty());
        const Bytes pfm = read_file(test.file("whole.pfm"));
        CHECK(whole.out == std::string(sha256(pfm.data(), pfm.size()).text) + "  " + test.file("whole.pfm") + "\n");
        const Ran a = test.render("--passes 0:2" + arith + files("a")),
                  b = test.render("--passes 2:5" + arith + files("b"));
        REQUIRE(a.status == 0);
        REQUIRE(b.status == 0);
        CHECK(!test.same("a.pfm", "b.pfm")); // other passes have other samples
        for (const auto &order : {test.file("a.passes") + " " + test.file("b.passes"),
                                  test.file("b.passes") + " " + test.file("a.passes")}) {
            const Ran merged = test.merge(order + files("m"));
            REQUIRE(merged.status == 0);
            CHECK(merged.err.empty());
            CHECK(merged.out.substr(0, 64) == whole.out.substr(0, 64));
            CHECK(merged.out.substr(64) == "  " + test.file("m.pfm") + "\n");
            for (const char *kind : {".pfm", ".passes", "_e.pfm", ".png"})
                CHECK(test.same("m" + std::string(kind), "whole" + std::string(kind)));
        }
        CHECK(test.merge(test.file("m.passes") + files("n")).status == 0); // of one: the same
        CHECK(test.same("n.passes", "whole.passes"));
        CHECK(test.same("n_e.pfm", "whole_e.pfm"));
        const Passes passes = parse_passes(read_file(test.file("whole.passes")), "whole.passes");
        CHECK(passes.ranges.size() == 1);
        CHECK(pfm == pfm_bytes(mean_picture(passes)));
        CHECK(read_file(test.file("whole_e.pfm")) == pfm_bytes(error_picture(passes)));
    }
}

TEST_CASE("command line: a crop of a reference is a part of the whole, in the picture and its errors") {
    const ReferenceCommandTest test;
    REQUIRE(test.render("--passes 0:3 -o " + test.file("w.pfm") + " --error-out " + test.file("we.pfm")).status == 0);
    REQUIRE(test.render("--passes 0:3 --crop 2,1,7,5 -o " + test.file("p.pfm") + " --error-out " + test.file("pe.pfm"))
                .status == 0);
    for (const auto &[whole_name, part_name] : {std::make_pair("w.pfm", "p.pfm"), std::make_pair("we.pfm", "pe.pfm")}) {
        const Picture whole = read_pfm(test.file(whole_name)), part = read_pfm(test.file(part_name));
        REQUIRE(part.width == 5);
        REQUIRE(part.height == 4);
        for (size_t y = 0; y < 4; ++y)
            for (size_t x = 0; x < 15; ++x) CHECK(part.rgb[y * 15 + x] == whole.rgb[((y + 1) * 9 + 2) * 3 + x]);
    }
}

TEST_CASE("command line: frames of a reference have their own outputs, and -v says what was written") {
    const ReferenceCommandTest test;
    const Ran ran = test.render("--passes 0:2 --frames 0:1 -v -o " + test.file("f_%02d.passes") + " --error-out " +
                                test.file("e_%02d.pfm") + " --digest");
    CHECK(ran.status == 0);
    CHECK(ran.err == "wrote " + test.file("f_00.passes") + "\nwrote " + test.file("e_00.pfm") +
                         "\nwisp: warning: option 'frames' does nothing here: nothing differs from frame to "
                         "frame\nwrote " +
                         test.file("f_01.passes") + "\nwrote " + test.file("e_01.pfm") + "\n");
    CHECK(lines(ran.out) == 2);
    CHECK(ran.out.substr(64, 4) == "  -\n");
    CHECK(test.same("f_00.passes", "f_01.passes")); // nothing moves
}

TEST_CASE("command line: merge refuses what does not belong together, and writes nothing then") {
    ReferenceCommandTest test;
    const auto sums = [&](const std::string &name, const std::string &options) {
        REQUIRE(test.render(options + " -o " + test.file(name)).status == 0);
        return test.file(name);
    };
    const std::string a = sums("a.passes", "--passes 0:2"), b = sums("b.passes", "--passes 1:3"),
                      out = " -o " + test.file("x.pfm") + " -o " + test.file("x.passes") + " --error-out " +
                            test.file("e.pfm") + " --digest";
    const auto refuses = [&](const std::string &arguments, int status, const std::string &line = "") {
        CAPTURE(arguments);
        test.refuses(test.merge(arguments + out), status, line);
        for (const char *name : {"x.pfm", "x.passes", "e.pfm"}) CHECK(!test.has(name));
    };
    refuses("", 2, "found no file to merge, expected some .passes or .map");
    refuses(a + " --spp 4", 2,
            "there is no option '--spp' of merge, expected --output, --error-out, --exposure, --digest, --quiet or "
            "--verbose");
    refuses(a + " -o " + test.file("x.jpg"), 2,
            "option 'output': found '" + test.file("x.jpg") +
                "', expected a file name that ends in .png, .pfm, .exr, .passes or .map, or -");
    refuses(a + " --error-out " + test.file("x.png"), 2,
            "option 'error-out': found '" + test.file("x.png") + "', expected a file name that ends in .pfm");

    refuses(test.file("none.passes"), 3, test.file("none.passes") + ": cannot be opened: No such file or directory");
    refuses(a + " " + test.file("none.passes"), 3,
            test.file("none.passes") + ": cannot be opened: No such file or directory");
    refuses(a + " " + test.s(), 3, test.s() + ":1: not a file of passes, expected 'wisp passes 1'");
    std::string text = text_of(a);
    text.back() = static_cast<char>(text.back() ^ 1);
    test.write("damaged.passes", text);
    refuses(test.file("damaged.passes"), 3,
            test.file("damaged.passes") + ":2: the file is damaged: its SHA-256 is another, expected " +
                text.substr(21, 64));
    test.write("cut.passes", text.substr(0, text.size() / 2));
    refuses(a + " " + test.file("cut.passes"), 3);

    refuses(a + " " + b, 3, b + ": passes 1:3, expected none of 0:2, which are there already");
    refuses(a + " " + a, 3, a + ": passes 0:2, expected none of 0:2, which are there already");
    for (const std::string options : {"--seed 2", "--arith f64", "--crop 0,0,8,7", "--size 9x8", "--spp 2"}) {
        const std::string other = sums("other.passes", "--passes 2:3 " + options);
        CAPTURE(options);
        refuses(a + " " + other, 3,
                other + ": passes of another scene, size, crop, seed, arithmetic or version, expected all of the same");
    }
    test.write("r.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 1.5 { phase 0.31 emission 0.2 0.1 0 }"));
    const std::string other = sums("other.passes", "--passes 2:3");
    refuses(a + " " + other, 3,
            other + ": passes of another scene, size, crop, seed, arithmetic or version, expected all of the same");
    // What samples do not depend on does not part them.
    test.write("r.aff", "# again\n" + CommandLineTest::lit("box -1 -1 -1 1 1 1 1.5 { emission 0.2 0.1 0 phase 0.3 }",
                                                           "render step 0.25\nrender exposure 1"));
    CHECK(test.merge(a + " " + sums("same.passes", "--passes 2:3 --photons 9") + out).status == 0);
}

TEST_CASE("command line: what cannot be written ends with 5 and leaves no part of it") {
    const ReferenceCommandTest test;
    REQUIRE(test.render("--passes 0:2 -o " + test.file("a.passes")).status == 0);
    std::filesystem::create_symlink("/dev/full", test.file("full.pfm"));
    const std::string none = test.file("none/e.pfm"), full = test.file("full.pfm");
    for (const std::string &command :
         {"render " + test.file("r.aff") + " --reference --passes 0:2", "merge " + test.file("a.passes")}) {
        CAPTURE(command);
        test.refuses(test.wisp(command + " --digest --error-out " + none), 5,
                     none + ": could not be written: No such file or directory");
        test.refuses(test.wisp(command + " --digest --error-out " + full), 5,
                     full + ": could not be written: No space left on device");
        test.refuses(test.wisp(command + " --error-out " + test.file("e.pfm") + " -o " + test.file("none/x.passes")),
                     5);
        CHECK(!test.has("e.pfm"));
    }
    // An input that is refused leaves what was there.
    std::ofstream(test.file("e.pfm")) << "kept";
    CHECK(test.merge(test.s() + " --error-out " + test.file("e.pfm")).status == 3);
    CHECK(text_of(test.file("e.pfm")) == "kept");
}

TEST_CASE("command line: a grid of equal samples is the box that it fills") {
    CommandLineTest test;
    // Cells as long as a twentieth of the box: the same steps and gather radius.
    test.write("g.vol", CommandLineTest::volume(20, 20, 30, 1, 1, 1.5f, std::vector<float>(20 * 20 * 30, 0.75f)));
    const auto compare = [&](const std::string &more, const std::string &options) {
        test.write("g.aff", CommandLineTest::lit("g.vol { extinction 2 phase 0.3 " + more + "}"));
        test.write("b.aff", CommandLineTest::lit("box -1 -1 -1.5 1 1 1.5 0.75 { extinction 2 phase 0.3 " + more + "}"));
        CAPTURE(more);
        CAPTURE(options);
        const Ran grid = test.wisp("render -q " + test.file("g.aff") + options + " -o " + test.file("g.pfm"));
        CHECK(grid.status == 0);
        CHECK(grid.err.empty());
        CHECK(test.wisp("render " + test.file("b.aff") + options + " -o " + test.file("b.pfm")).status == 0);
        CHECK(test.wisp("compare " + test.file("g.pfm") + " " + test.file("b.pfm") + " --tolerance 1e-5").status == 0);
    };
    std::vector<Bytes> pictures;
    for (const std::string place :
         {"", "transform 0.5 0.5 0.5 1 2 2 50 0.25 0.5 -0.25 ", "emission 0.5 0.25 0 albedo 0.5 0.5 0.5 "}) {
        for (const char *arithmetic : {"f32", "f64", "fixed"})
            compare(place, std::string(" --smoke direct --irradiance none --photons 0 --arith ") + arithmetic);
        pictures.push_back(read_file(test.file("b.pfm")));
        if (place.find("emission") != std::string::npos) continue; // a photon's birth is a sample's
        compare(place,
                " --smoke direct --irradiance none --arith f64"); // in which no photon's decision falls the other way
        pictures.push_back(read_file(test.file("b.pfm")));
    }
    // All those pictures differ.
    std::sort(pictures.begin(), pictures.end());
    CHECK(std::unique(pictures.begin(), pictures.end()) == pictures.end());
}

TEST_CASE("command line: a transform moves, turns and scales boxes, and keeps their extinction") {
    CommandLineTest test;
    const struct {
        const char *a, *b;
    } pairs[] = {
        {"box -1 -2 -0.5 1 2 0.5 1 { transform 0.5 0.5 0.5 0 0 1 0 0.25 0 0.5 }",
         "box -0.25 -1 0.25 0.75 1 0.75 1 { }"},
        {"box -0.25 -1 -0.5 0.5 1 0.5 1 { transform 1 1 1 0 0 1 90 0 0 0 }", "box -1 -0.25 -0.5 1 0.5 0.5 1 { }"},
        {"box -0.25 -1 -0.5 0.5 1 0.5 1 { transform 2 2 2 1 1 1 120 0 0 1 extinction 0.5 }",
         "box -1 -0.5 -1 1 1 3 0.5 { }"}, // x to y to z to x
    };
    for (const auto &pair : pairs) {
        test.write("a.aff", CommandLineTest::lit(pair.a));
        test.write("b.aff", CommandLineTest::lit(pair.b));
        for (const char *name : {"a", "b"})
            REQUIRE(test.wisp("render " + test.file(name) + ".aff --smoke direct --photons 0 -o " + test.file(name) +
                              ".pfm")
                        .status == 0);
        CAPTURE(std::string(pair.a));
        CHECK(test.wisp("compare " + test.file("a.pfm") + " " + test.file("b.pfm") + " --tolerance 1e-5").status == 0);
    }
}

TEST_CASE("command line: grids are known by what is in the file, and refuse what only particles have") {
    CommandLineTest test;
    const std::string grid = CommandLineTest::volume(2, 1, 2, 1, 1, 1, {1, 0.5f, 0.25f, 2});
    test.write("g.vol", grid);
    test.write("box", grid);
    test.write("g_0003.vol", grid);
    const auto render = [&](const std::string &smoke, const std::string &options = "") {
        test.write("g.aff", CommandLineTest::lit(smoke));
        return test.wisp("render " + test.file("g.aff") + " --digest" + options);
    };
    const Ran ran = render("g.vol { extinction 2 }");
    CHECK(ran.status == 0);
    CHECK(render("box { extinction 2 }").out == ran.out); // a file of that name
    CHECK(render("g_%04d.vol { extinction 2 }", " --frames 3").out == ran.out);
    CHECK(render("g_%04d.vol { extinction 2 }", " --frames 2").status == 3);
    for (const std::string line : {"kernel spline", "kernel poly6", "radius 0.1", "mass 1"}) {
        const Ran refused = render("g.vol {\n extinction 2\n " + line + "\n}");
        CAPTURE(line);
        CHECK(refused.status == 3);
        CHECK(refused.err == test.file("g.aff") + ":7: error: found '" + line.substr(0, line.find(' ')) +
                                 "', expected none for the density grid " + test.file("g.vol") +
                                 ": only particles have it\n");
    }
    test.write("g.vol", grid.substr(0, 60));
    CHECK(render("g.vol { }").err == test.file("g.aff") + ":5: error: " + test.file("g.vol") +
                                         ": byte 48: 12 bytes of samples, expected 2 x 1 x 2 samples of 4 bytes\n");
    // Nothing in it: the background, as without smoke.
    test.write("g.vol", CommandLineTest::volume(2, 1, 2, 1, 1, 1, {0, 0, 0, 0}));
    const Ran nothing = render("g.vol { emission 1 1 1 }");
    CHECK(nothing.status == 0);
    CHECK(nothing.out == render("box -1 -1 -1 1 1 1 0 { }").out);
}

TEST_CASE("command line: a box's smoke between the camera and the background dims it by its extinction") {
    CommandLineTest test;
    // Parallel to the axis through the middle of a single pixel: exp(-2 * 0.75) of the background.
    test.write("d.aff",
               "v from 0 0 50 at 0 0 0 up 0 1 0 angle 1 hither 1 resolution 1 1\nb 1 2 4\nsmoke box -1 -1 -1 1 1 "
               "1 0.25 { extinction 3 }\nrender spp 1");
    for (const std::string options : {"--arith f32", "--arith f64", "--arith fixed", "--reference --arith f32",
                                      "--reference --arith f64", "--reference --arith fixed"}) {
        CAPTURE(options);
        REQUIRE(test.wisp("render " + test.file("d.aff") + " " + options + " -o " + test.file("d.pfm")).status == 0);
        const Picture picture = read_pfm(test.file("d.pfm"));
        for (size_t c = 0; c < 3; ++c)
            CHECK(static_cast<double>(picture.rgb[c]) ==
                  doctest::Approx(std::ldexp(std::exp(-1.5), static_cast<int>(c))).epsilon(1e-5));
    }
}

TEST_CASE("command line: plan --json has the rows of plan, and --stats the bytes that were used beside them") {
    CommandLineTest test;
    for (const std::string options : {"--smoke direct", "--smoke map", "--reference --passes 0:1", "--photons 0"}) {
        CAPTURE(options);
        const Ran text = test.wisp("plan " + test.s() + " " + options);
        const Ran json = test.wisp("plan " + test.s() + " " + options + " --json");
        REQUIRE(text.status == 0);
        REQUIRE(json.status == 0);
        CHECK(json.err.empty());
        const std::string stats = test.file("s.json");
        REQUIRE(test.wisp("render " + test.s() + " " + options + " --stats " + stats).status == 0);
        const std::string used = text_of(stats);
        std::istringstream rows(text.out);
        uint64_t sum = 0;
        int stages = 0;
        for (std::string row; std::getline(rows, row);) {
            const std::string name = row.substr(0, row.find_last_not_of(' ', 14) + 1);
            const bool needed = row.compare(15, 3, "yes") == 0;
            const std::string bytes = std::to_string(std::stoull(row.substr(20, 14)));
            if (name == "picture") continue;
            if (name == "arena") {
                CHECK(std::to_string(sum) == bytes);
                CHECK(json.out.find("\"arena\": " + bytes + ",") != std::string::npos);
                continue;
            }
            sum += std::stoull(bytes);
            ++stages;
            const size_t at = json.out.find("\"name\": \"" + name + "\"");
            REQUIRE(at != std::string::npos);
            const std::string object = json.out.substr(at, json.out.find('}', at) - at);
            CHECK(object.find(std::string("\"needed\": ") + (needed ? "true" : "false")) != std::string::npos);
            CHECK(object.find("\"bytes\": " + bytes + ",") != std::string::npos);
            const size_t row_of_stats = used.find("\"" + name + "\": { \"planned\": " + bytes + ", \"used\": ");
            REQUIRE(row_of_stats != std::string::npos);
            const size_t number = used.find("\"used\": ", row_of_stats) + 8;
            CHECK(std::stoull(used.substr(number)) <= std::stoull(bytes));
        }
        CHECK(stages == stage_count);
    }
}

TEST_CASE("command line: plan counts boxes, grids and the stages of --reference") {
    CommandLineTest test;
    test.write("g.vol", CommandLineTest::volume(2, 3, 4, 1, 1, 1, std::vector<float>(24, 1)));
    test.write("b.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 1 { }"));
    test.write("g.aff", CommandLineTest::lit("g.vol { }"));
    test.write("all.aff",
               CommandLineTest::lit("g.vol { }\nsmoke box -1 -1 -1 1 1 1 1 { }\nsmoke puff.vtk { radius 0.2 mass 1 }"));
    const auto plan = [&](const std::string &arguments) { return test.wisp("plan " + test.file(arguments)); };
    CHECK(plan("b.aff -v").out.find("\nUse the default for pictures, and --max-error E") != std::string::npos);
    CHECK(plan("b.aff --smoke direct").out.find(" bytes  1 box\n") != std::string::npos);
    CHECK(plan("g.aff --smoke direct").out.find(" bytes  24 samples of grids\n") != std::string::npos);
    CHECK(plan("all.aff").out.find(" bytes  40 particles, 24 samples of grids, 1 box\n") != std::string::npos);
    const Ran reference = plan("all.aff --reference --spp 3");
    CHECK(reference.status == 0);
    CHECK(reference.err.empty());
    CHECK(lines(reference.out) == stage_count + 2); // the stages, the arena and the picture
    CHECK(reference.out.find("\nparticle tree  yes") != std::string::npos);
    CHECK(reference.out.find("\nmajorants      yes") != std::string::npos);
    CHECK(reference.out.find("\ncamera rays    yes               0 bytes  48 a pixel\n") != std::string::npos);
    CHECK(reference.out.find("\narena          yes") != std::string::npos);
    // 12 bytes as numbers, 12 in the file, 96 of sums.
    CHECK(reference.out.find("\npicture        yes            7560 bytes  9 x 7 pixels, beside the arena\n") !=
          std::string::npos);
    CHECK(reference.out.find("\nphotons        no                0 bytes  the reference follows random paths") !=
          std::string::npos);
    CHECK(plan("all.aff --reference --spp 3 --passes 4:6").out.find("  6 a pixel\n") != std::string::npos);
    CHECK(plan("all.aff --reference --memory 10k").status == 4);
    CHECK(plan("b.aff --memory 1G").status == 0);
}

TEST_CASE("command line: thin smoke of a strong extinction is as its product, in fixed point too") {
    CommandLineTest test;
    test.write("plain.vol", CommandLineTest::volume(2, 1, 1, 1, 1, 1, {1, 0.5f}));
    test.write("plain.aff", CommandLineTest::lit("plain.vol { extinction 2 }"));
    REQUIRE(
        test.wisp("render " + test.file("plain.aff") + " --arith fixed --photons 0 -o " + test.file("p.pfm")).status ==
        0);
    // A power of two from one to the other, written in full.
    const struct {
        float density;
        const char *extinction;
    } cases[] = {{0x1p-20f, "2097152"}, {0x1p-36f, "137438953472"}, {0x1p33f, "2.3283064365386963e-10"}};
    for (const auto &c : cases) {
        test.write("thin.vol", CommandLineTest::volume(2, 1, 1, 1, 1, 1, {c.density, c.density / 2}));
        test.write("thin.aff", CommandLineTest::lit("thin.vol { extinction " + std::string(c.extinction) + " }"));
        CAPTURE(std::string(c.extinction));
        const Ran ran =
            test.wisp("render " + test.file("thin.aff") + " --arith fixed --photons 0 -o " + test.file("t.pfm"));
        CHECK(ran.status == 0);
        CHECK(test.wisp("compare " + test.file("t.pfm") + " " + test.file("p.pfm") + " --tolerance 1e-5").status == 0);
    }
}

TEST_CASE("command line: smoke too thin for fixed point may glow") {
    CommandLineTest test;
    test.write("thin.vol", CommandLineTest::volume(2, 1, 1, 1, 1, 1, {1e-11f, 1e-11f}));
    for (const std::string smoke : {"thin.vol { extinction 1e11 emission 1 1 1 }", "thin.vol { emission 1 1 1 }",
                                    "puff.vtk { radius 1 mass 5e-11 emission 1 1 1 }"}) {
        test.write("thin.aff", CommandLineTest::lit(smoke));
        CAPTURE(smoke);
        CHECK(test.wisp("render " + test.file("thin.aff") + " --arith fixed --digest").status == 0);
        CHECK(
            test.wisp("render " + test.file("thin.aff") + " --arith fixed --digest --reference --passes 0:1").status ==
            0);
    }
}

TEST_CASE("command line: --thin leaves out strays, the same in every arithmetic") {
    CommandLineTest test;
    // A ball, and three far away whose mass is small.
    std::string ply = "ply\nformat ascii 1.0\nelement vertex 23\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float mass\nend_header\n";
    for (int i = 0; i < 20; ++i)
        ply += std::to_string(0.1 * (i % 3)) + " " + std::to_string(0.1 * (i % 4)) + " " +
               std::to_string(0.1 * (i % 5)) + " 1\n";
    test.write("ball.ply", std::string(ply).replace(ply.find("vertex 23"), 9, "vertex 20"));
    test.write("strays.ply", ply + "5 0 0 0.01\n-3 4 1 0.01\n0 9 -8 0.01\n");
    const auto scene = [](const std::string &particles, const std::string &more) {
        return "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 16 12\nlp 3 3 3 40 40 40\nsmoke " +
               particles + " { radius 0.2 extinction 0.02 }\nrender photons 100000\n" + more;
    };
    test.write("b.aff", scene("ball.ply", ""));
    test.write("t.aff", scene("strays.ply", "render thin 0.01\n"));
    for (const std::string arithmetic : {"f32", "f64", "fixed"}) {
        const auto digest = [&](const std::string &arguments) {
            const Ran ran = test.wisp("render " + test.file(arguments) + " --digest --arith " + arithmetic);
            CHECK(ran.status == 0);
            return ran.out;
        };
        const std::string ball = digest("b.aff"), strays = digest("t.aff --thin 0");
        CHECK(ball != strays);
        CHECK(digest("t.aff") == ball);
        CHECK(digest("b.aff --thin 0") == ball);
        // A mass of 0.01 takes 0.003 of a ray.
        CHECK(digest("t.aff --thin 0.001") == strays);
        CHECK(test.wisp("render " + test.file("t.aff") + " -v --digest --arith " + arithmetic).err ==
              "smoke 1: --thin leaves out 3 of 23 particles; 0 give their mass to a neighbour\n");
    }
    for (const std::string value : {"-0.1", "1", "x", "nan", ""})
        CHECK(test.wisp("render " + test.file("b.aff") + " --thin " + (value.empty() ? "''" : value)).err ==
              "wisp: error: option 'thin': found '" + value + "', expected a number from 0 to 0.99\n");
}

TEST_CASE("command line: plan -v says whether the particles suffice, and how many are negligible") {
    CommandLineTest test;
    std::string ply = "ply\nformat ascii 1.0\nelement vertex 1001\nproperty float x\nproperty float y\nproperty float "
                      "z\nproperty float mass\nend_header\n20 0 0 0.001\n";
    for (int i = 0; i < 1000; ++i)
        ply += std::to_string(i % 10) + " " + std::to_string(i / 10 % 10) + " " + std::to_string(i / 100) + " 1\n";
    test.write("lattice.ply", ply);
    test.write("l.aff", "v from 4 4 40 at 4 4 4 up 0 1 0 angle 30 hither 1 resolution 4 4\nlp 9 9 90 1 1 1\n"
                        "smoke box 0 0 0 1 1 1 1 { }\nsmoke lattice.ply { radius 0.6 }\n");
    for (const std::string arithmetic : {"f32", "f64", "fixed"}) {
        const Ran ran = test.wisp("plan " + test.file("l.aff") + " -v --arith " + arithmetic);
        CHECK(ran.status == 0);
        // 1.2 reach to the six nearest alone, 2,700 pairs of 10 x 10 x 10, two to a pair. The error, after Campbell:
        // int W^2 = 25 / (56 pi) h^-3, rho = 5.4 * 15 / (64 pi) 3^-3 h^-3: the square is 9.5238.
        CHECK(ran.out.find("smoke 2: a particle has 5.4 neighbours, one in twenty no more than 4; the density errs by "
                           "308.6 %; for 5 % it takes 3810 times as many, for 1 % 95238 times\n") != std::string::npos);
        // 15 / (8 pi) 0.001 / 0.36 = 0.00166.
        CHECK(ran.out.find("smoke 2: particles that no ray would miss: 0 with --thin 0.001, 1 with --thin 0.01, 1 with "
                           "--thin 0.1\n") != std::string::npos);
        CHECK(ran.out.find("smoke 1: ") == std::string::npos); // a box has no particles
    }
    CHECK(test.wisp("plan " + test.file("l.aff")).out.find("neighbours") == std::string::npos);
    test.write("far.aff",
               "v from 4 4 40 at 4 4 4 up 0 1 0 angle 30 hither 1 resolution 4 4\nsmoke lattice.ply { radius "
               "0.4 }\n");
    CHECK(
        test.wisp("plan " + test.file("far.aff") + " -v")
            .out.find("a particle has 0.0 neighbours, one in twenty no more than 0; they are too few for a density") !=
        std::string::npos);
}
