// `wisp render --max-error`: what it chooses, against the reference.
#include "support/command_line.h"
#include "host/images/compare.h"
#include "host/images/picture.h"
#include <cmath>

using namespace wisp;

namespace {

struct MaxErrorTest : CommandLineTest {
    void write_box(double extinction, const std::string &phase, const std::string &more = "") const {
        std::ofstream(s(), std::ios::binary)
            << "v from 0 0 6 at 0 0 0 up 0 1 0 angle 26 hither 0.1 resolution 20 20\nlp 3 4 3 40 40 40\n"
               "smoke box -1 -1 -1 1 1 1 " +
                   std::to_string(extinction) + " {\n phase " + phase + "\n" +
                   (more.empty() ? " albedo 0.9 0.9 0.9\n" : more) + "}\n";
    }
    // What is said of the choice, without the seconds.
    std::string chosen(const std::string &options) const {
        const Ran ran = wisp("render " + s() + " --progress never -o " + file("p.pfm") + " " + options);
        CAPTURE(ran.err);
        REQUIRE(ran.status == 0);
        REQUIRE(lines(ran.err) == 1);
        CHECK(ran.err.rfind("max-error: by ", 0) == 0);
        CHECK(ran.err.find("a frame takes about ") != std::string::npos);
        return ran.err.substr(0, ran.err.find(';'));
    }
    // The number that `chosen` gives an option.
    static double value(const std::string &chosen, const std::string &option) {
        const std::string name = " --" + option + " ";
        const size_t at = chosen.find(name);
        REQUIRE(at != std::string::npos);
        return std::stod(chosen.substr(at + name.size()));
    }
    // The estimated error of `chosen`.
    static double estimate(const std::string &chosen) {
        const std::string about = "errs by about ";
        return std::stod(chosen.substr(chosen.find(about) + about.size())) / 100;
    }
    void render_truth(int passes, const std::string &options = "") const {
        // Passes that no choice has.
        const std::string range = "5000000:" + std::to_string(5000000 + passes);
        REQUIRE(wisp("render " + s() + " -q --reference --passes " + range + " " + options + " -o " + file("r.pfm") +
                     " --error-out " + file("e.pfm"))
                    .status == 0);
    }
    // The relative RMSE of p.pfm beyond the noise of the truth.
    double error() const {
        const Picture picture = read_pfm(file("p.pfm")), truth = read_pfm(file("r.pfm"));
        Difference difference = compare(picture, truth);
        weigh_noise(difference, truth, read_pfm(file("e.pfm")));
        return *difference.relative_rmse_beyond_noise;
    }
};

} // namespace

TEST_SUITE_BEGIN("long");

TEST_CASE("max-error: the picture errs by no more than is asked for, and by no less than a quarter") {
    const MaxErrorTest test;
    const std::pair<const char *, double> cases[] = {{"0", 0.1}, {"0.5", 0.06}};
    for (const auto &[phase, asked] : cases) {
        CAPTURE(phase);
        test.write_box(3, phase);
        const std::string chosen = test.chosen("--max-error " + std::to_string(asked));
        CAPTURE(chosen);
        CHECK(test.estimate(chosen) <= asked);
        test.render_truth(300);
        const double error = test.error();
        CHECK(error <= asked);
        CHECK(error >= asked / 4);
    }
}

// The eye is in smoke, so that the noise of the nearest photons is that of many pixels.
TEST_CASE("max-error: of the pictures by several seeds nine in ten err by no more than is asked for") {
    MaxErrorTest test;
    test.write("s.aff", "v from 0.1 0.2 0.3 at 0 0 -1 up 0 1 0 angle 90 hither 0.1 resolution 32 32\n"
                        "ld -1 -1 -1 3 2 1\nlp 0.5 -0.5 -0.5 1 1 2\n"
                        "smoke box -1 -1 -1 1 1 1 0.5 {\n extinction 1\n albedo 0.9 0.9 0.9\n phase 0.2\n}\n");
    test.render_truth(1500);
    int above = 0, far_below = 0;
    for (int seed = 3; seed <= 12; ++seed) {
        CAPTURE(seed);
        const std::string chosen = test.chosen("--max-error 0.05 --seed " + std::to_string(seed));
        CAPTURE(chosen);
        const double error = test.error();
        above += error > 0.05;
        far_below += error < 0.05 / 3;
    }
    CHECK(above <= 1);
    CHECK(far_below <= 1);
}

// Photons err by what their cells show. The defaults take paths in place of very many, which bounds do not tell.
TEST_CASE("max-error: photons stay photons where their cells suffice, however many they are") {
    MaxErrorTest test;
    test.write("b.vtk", CommandLineTest::puff(200));
    test.write("s.aff", "v from 0 0 3 at 0 0 0 up 0 1 0 angle 26 hither 0.1 resolution 12 12\n"
                        "ls 1.5 -1 2 -1.5 1 -2 30 225 200 175\nlp 0.05 0.1 0 0.5 1 2.25\n"
                        "smoke b.vtk {\n radius 0.15\n mass 1\n extinction 0.06\n albedo .95 .9 .8\n phase 0.5\n}\n");
    const std::string chosen = test.chosen("--max-error 0.05");
    CAPTURE(chosen);
    CHECK(chosen.find("--photons ") != std::string::npos);
    CHECK(chosen.find("--density-step ") != std::string::npos);
    test.render_truth(600);
    CHECK(test.error() <= 0.05);
    CHECK(test.error() >= 0.05 / 4);
}

// Few lines meet a lamp. Cells as fine as any err by that, too, and take a hundred times as long.
TEST_CASE("max-error: what lines miss of a lamp in the smoke is no error of cells") {
    MaxErrorTest test;
    test.write("s.aff", "v from 0.3 -6 0.9 at 0 0 0 up 0 0 1 angle 26 hither 0.1 resolution 36 30\n"
                        "lp 0.35 -0.2 0.3 0.4 0.7 1\n"
                        "smoke box -1 -0.9 -0.8 1 0.9 0.8 1 { extinction 1 albedo .95 .95 .95 phase 0.2 }\n");
    const std::string chosen = test.chosen("--max-error 0.05");
    CAPTURE(chosen);
    CHECK((chosen.find("--density-step ") == std::string::npos || test.value(chosen, "density-step") > 0.5));
    test.render_truth(4000);
    CHECK(test.error() <= 0.05);
}

// Cells of 0.2923 and 0.5846 smoothing lengths, doubled and rounded for people, are 0.585 and 1.169 if each is by
// itself: then photons leave their light in every cell, not in every second, which takes eight times as long.
TEST_CASE("max-error: cells of photons stay whole multiples of those of bricks") {
    MaxErrorTest test;
    std::string points;
    for (int i = 0; i < 216; ++i)
        for (int coordinate : {i % 6, i / 6 % 6, i / 36}) points += std::to_string(-1 + 0.4 * coordinate) + " ";
    test.write("b.vtk", "# vtk DataFile Version 3.0\np\nASCII\nDATASET POLYDATA\nPOINTS 216 float\n" + points);
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 26 hither 0.1 resolution 12 12\nlp 3 4 3 40 40 40\n"
                        "smoke b.vtk { radius 0.3 mass 1 extinction 0.0015 albedo .9 .9 .9 }\n");
    const std::string chosen = test.chosen("--max-error 0.05");
    CAPTURE(chosen);
    CHECK(test.value(chosen, "irradiance-step") == 2 * test.value(chosen, "density-step"));
}

TEST_CASE("max-error: a first frame that shows nothing of the smoke is not what others are rendered by") {
    MaxErrorTest test;
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 26 hither 0.1 resolution 12 12\nb 0.1 0.1 0.1\na 0 2 3\n"
                        "k camera {\n transl 5  -1 90 0 6 0 0 0  0 90 0 6 0 0 0  1 0 0 6 0 0 0  2 0 0 6 0 0 0"
                        "  3 0 0 6 0 0 0\n}\nlp 3 4 3 40 40 40\n"
                        "smoke box -1 -1 -1 1 1 1 3 { albedo 0.9 0.9 0.9 }\n");
    const auto render = [&](const std::string &options) {
        const Ran ran = test.wisp("render " + test.s() + " --progress never " + options);
        CAPTURE(ran.err);
        REQUIRE(ran.status == 0);
        return ran.err;
    };
    CHECK(render("--max-error 0.1 --frames 0:1 -o " + test.file("p%d.pfm"))
              .rfind("max-error: by the defaults: no light is seen in frame 0 ", 0) == 0);
    render("--frames 1 -o " + test.file("d.pfm"));
    CHECK(test.same("p1.pfm", "d.pfm"));
    CHECK(!test.same("p0.pfm", "d.pfm"));
    // By itself such a frame needs few photons; they are said.
    const std::string alone = render("--max-error 0.1 --frames 0 -o " + test.file("d.pfm"));
    CHECK(alone.rfind("max-error: by --photons 4096 ", 0) == 0);
    // Of several frames that which was measured is said.
    CHECK(render("--max-error 0.1 --frames 1:2 -o " + test.file("p%d.pfm")).find(" in frame 1; ") != std::string::npos);
}

TEST_CASE("max-error: the choice is the same in all arithmetics") {
    const MaxErrorTest test;
    test.write_box(1, "0.3");
    const std::string chosen = test.chosen("--max-error 0.1");
    CHECK(chosen.find("--photons ") != std::string::npos);
    CHECK(test.chosen("--max-error 0.1 --arith f64") == chosen);
    CHECK(test.chosen("--max-error 0.1 --arith fixed") == chosen);
}

TEST_CASE("max-error: cells of a density grid are said as they are, whole samples or parts of them") {
    MaxErrorTest test;
    test.write("g.vol", CommandLineTest::volume(3, 3, 3, 1, 1, 1, std::vector<float>(27, 1)));
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 40 hither 0.01 resolution 8 8\nlp 3 4 3 40 40 40\n"
                        "smoke g.vol { extinction 1 albedo .9 .9 .9 phase 0.5 }\n");
    int said = 0;
    for (const std::string asked : {"0.5", "0.2", "0.05"}) {
        const std::string chosen = test.chosen("--max-error " + asked), name = " --density-step ";
        const size_t at = chosen.find(name);
        if (at == std::string::npos) continue;
        ++said;
        const double cell = std::stod(chosen.substr(at + name.size()));
        CHECK((cell == 1 || cell == 0.5 || cell == 0.25 || cell == 0.125));
    }
    CHECK(said > 0);
}

TEST_CASE("max-error: where photons do not tell whence light comes, paths or the reference are chosen") {
    const MaxErrorTest test;
    test.write_box(8, "0.9");
    std::ofstream(test.s(), std::ios::binary | std::ios::app)
        << "f 0.5 0.5 0.5 1 0.5 9 0 1\np 3  -1 -2 -1  1 -2 -1  1 2 -1\n";
    // Whose fewest paths hardly show how noisy they are.
    const std::string chosen = test.chosen("--max-error 0.06 --size 8x8");
    CHECK(chosen.find("--photons ") != std::string::npos);
    CHECK(test.estimate(chosen) <= 0.06);
    test.render_truth(600, "--size 8x8");
    CHECK(test.error() <= 0.06);
    // No paths are chosen in place of photons where options keep these.
    const Ran kept =
        test.wisp("render " + test.s() + " --max-error 0.06 --size 8x8 --density-step 0.5 -o " + test.file("p.pfm"));
    CHECK(kept.err.rfind("max-error: photons would err by more: the noise of --reference is measured\n"
                         "max-error: by --reference --passes 0:",
                         0) == 0);
}

TEST_CASE("max-error: photons are not mistaken for few paths: their cells err by what seeds do not show") {
    const MaxErrorTest test;
    test.write_box(100, "0", " albedo 0.5 0.5 0.5\n");
    const std::string chosen = test.chosen("--max-error 0.1 --size 12x12");
    CHECK(chosen.find("--photons ") != std::string::npos);
    test.render_truth(300, "--size 12x12");
    CHECK(test.error() <= 0.1); // 1,024 photons err by 33 %, and did not show it
}

TEST_CASE("max-error: what all choices see wrong is found by the reference") {
    // A slit that is narrower than a 32nd of a step, to which shadows in smoke are known, at the same places for all
    // pixels.
    MaxErrorTest test;
    test.write("s.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 22 hither 0.1 resolution 12 8\nld 0 -1 0 3000 2000 1000\n"
                        "f 0 0 0 0 0 0 0 0\np 4  -3 1.5 -3  -3 1.5 0.002  3 1.5 0.002  3 1.5 -3\n"
                        "p 4  -3 1.5 0.004  -3 1.5 3  3 1.5 3  3 1.5 0.004\n"
                        "smoke box -1 -1 -1 1 1 1 1 { extinction 0.3 albedo 0.1 0.1 0.1 }\n");
    const Ran ran = test.wisp("render " + test.s() + " --max-error 0.4 -o " + test.file("p.pfm"));
    REQUIRE(ran.status == 0);
    CHECK(ran.err.find(" it would err by ") != std::string::npos);
    CHECK(ran.err.find("\nmax-error: by --reference --passes 0:") != std::string::npos);
    test.render_truth(2000);
    CHECK(test.error() <= 0.4);
}

TEST_CASE("max-error: smoke that scatters nothing gets no photons") {
    const MaxErrorTest test;
    test.write_box(3, "0", " albedo 0 0 0\n emission 1 1 1\n");
    const std::string chosen = test.chosen("--max-error 0.05");
    CHECK(chosen.find("--photons") == std::string::npos);
    test.render_truth(200);
    CHECK(test.error() <= 0.05);
}

TEST_CASE("max-error: crops are rendered as the whole, and a black picture by the defaults") {
    const MaxErrorTest test;
    test.write_box(1, "0");
    std::ofstream(test.s(), std::ios::binary | std::ios::app) << "render photons 0\n";
    const std::string chosen = test.chosen("--max-error 0.2");
    CHECK(chosen.find("--photons ") != std::string::npos);
    std::string of_crop = test.chosen("--max-error 0.2 --crop 5,5,9,9");
    const std::string whole = "the whole frame ";
    REQUIRE(of_crop.find(whole) != std::string::npos);
    CHECK(of_crop.erase(of_crop.find(whole), whole.size()) == chosen);
    test.write_box(1, "0", " emission 0 0 0\n albedo 0 0 0\n");
    CHECK(test.chosen("--max-error 0.2") == "max-error: by the defaults: errs by about 0 %");
}

TEST_CASE("max-error: refused beside what it chooses, where no picture is made, and of a scene") {
    const MaxErrorTest test;
    const std::string render = "render " + test.s() + " -o " + test.file("p.pfm") + " --max-error 0.1 ";
    for (const char *other : {"--photons 10", "--reference", "--smoke map", "--estimate knn", "--irradiance none"}) {
        const std::string name = std::string(other).substr(2, std::string(other).find(' ') - 2);
        test.refuses(test.wisp(render + other), 2,
                     "option '" + name + "' does not go with --max-error, which chooses it");
    }
    for (const std::string &command : {"plan " + test.s(), "inspect " + test.s() + " 3 3"})
        test.refuses(test.wisp(command + " --max-error 0.1"), 2,
                     "option 'max-error' belongs to render: what it chooses is found by rendering, and said there");
    for (const char *error : {"0", "-1", "2", "nan", "x"})
        CHECK(test.wisp(render + "--max-error " + error).status == 2);
    std::ofstream(test.s(), std::ios::binary | std::ios::app) << "render max-error 0.1\n";
    const Ran ran = test.wisp("render " + test.s() + " -o " + test.file("p.pfm"));
    CHECK(ran.status == 3);
    CHECK(ran.err.find("option 'max-error' in a scene, expected it on the command line") != std::string::npos);
}

TEST_CASE("max-error: without smoke it is said to do nothing") {
    const MaxErrorTest test;
    std::ofstream(test.s(), std::ios::binary) << "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 8 8\n";
    const Ran ran = test.wisp("render " + test.s() + " -o " + test.file("p.pfm") + " --max-error 0.1");
    CHECK(ran.status == 0);
    CHECK(ran.err.find("option 'max-error' does nothing here: there is no smoke") != std::string::npos);
}

TEST_SUITE_END();
