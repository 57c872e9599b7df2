// build/wisp show: every stage's picture is its golden, a crop is part of the whole, and what cannot be shown is
// refused in one line.
#include "host/images/picture.h"
#include "support/command_line.h"
#include <map>
#include <sstream>

namespace wisp {

namespace {

const std::string smoke = "fixtures/wake.aff --frames 1 --size 48x36 --spp 1 --photons 3000",
                  cubes = "fixtures/lessons/02-tree/eight.aff --size 48x36 --spp 1";

// Stage and scene, and the digests in each arithmetic.
struct Golden {
    std::string words, f32, f64, fixed;
};
const Golden goldens[] = {
    {"density " + smoke, "", "", ""}, {"density " + smoke + " --slice 0.25 --density-step 0", "", "", ""},
    {"depth " + smoke, "", "", ""},   {"light-depth " + smoke + " --light 1", "", "", ""},
    {"photons " + smoke, "", "", ""}, {"photons " + smoke + " --smoke direct", "", "", ""},
    {"paths " + smoke, "", "", ""},   {"nodes " + smoke, "", "", ""},
    {"tree " + cubes, "", "", ""},    {"tree " + cubes + " --tree kd --row 20", "", "", ""},
    {"visits " + cubes, "", "", ""},  {"proofs " + cubes + " --spp 9", "", "", ""},
};

const char *const stages[] = {"density", "depth", "light-depth", "photons", "paths",
                              "nodes",   "tree",  "visits",      "proofs"};

} // namespace

TEST_CASE("command line: show draws every stage, with the same bits everywhere") {
    const CommandLineTest test;
    std::map<std::string, int> drawn;
    for (const Golden &golden : goldens) {
        ++drawn[golden.words.substr(0, golden.words.find(' '))];
        const std::pair<const char *, std::string> digests[] = {
            {"f32", golden.f32}, {"f64", golden.f64}, {"fixed", golden.fixed}};
        for (const auto &[arithmetic, digest] : digests) {
            CAPTURE(golden.words);
            CAPTURE(std::string(arithmetic));
            const Ran ran = test.wisp("show " + golden.words + " --digest --arith " + arithmetic);
            CHECK(ran.status == 0);
            CHECK(lines(ran.err) == 1); // the legend
            CHECK(ran.out.substr(0, ran.out.find(' ')) == digest);
        }
    }
    for (const char *stage : stages) CHECK(drawn[stage] > 0);
    CHECK(drawn.size() == std::size(stages));
}

TEST_CASE("command line: show's crop is part of the whole, and its outputs are those of render") {
    const CommandLineTest test;
    const std::string whole = test.file("whole.pfm"), part = test.file("part.pfm"), png = test.file("a.png");
    for (const char *stage : {"depth", "light-depth --slice 0.3", "proofs"}) {
        CAPTURE(std::string(stage));
        const std::string words =
            std::string("show ") + stage + " fixtures/wake.aff --frames 1 --size 40x30 --photons 0 ";
        REQUIRE(test.wisp(words + "-q -o " + whole + " -o " + png).status == 0);
        const Ran cropped = test.wisp(words + "-q --crop 10,5,30,25 -o " + part);
        REQUIRE(cropped.status == 0);
        CHECK(cropped.err == ""); // --quiet
        const Picture a = read_pfm(whole), b = read_pfm(part);
        REQUIRE(b.width == 20);
        REQUIRE(b.height == 20);
        if (std::string(stage) == "proofs") continue; // fewer rays prove less
        double most_a = 0, most_b = 0;                // colours are those of the part's own range
        for (const float value : a.rgb) most_a = std::max(most_a, double{value});
        for (const float value : b.rgb) most_b = std::max(most_b, double{value});
        CHECK(most_a == doctest::Approx(most_b).epsilon(0.1));
    }
    CHECK(test.wisp("show density fixtures/wake.aff --frames 1 --size 40x30 -q -o -.png").out.substr(1, 3) == "PNG");
}

TEST_CASE("command line: show says in one line what it cannot show") {
    const CommandLineTest test;
    const std::string scene = test.file("s.aff"), out = " -o " + test.file("a.png");
    const struct {
        std::string words, error;
    } refused[] = {
        {"show densty " + scene + out, "did you mean 'density'?"},
        {"show " + scene + out, "expected STAGE SCENE"},
        {"show density " + scene, "expected --output or --digest"},
        {"show tree " + scene + out, "there is nothing to show of tree: there is no triangle"},
        {"show proofs " + scene + out, "there is nothing to show of proofs: there is no triangle"},
        {"show photons " + scene + out + " --photons 0", "there is nothing to show of photons: --photons 0"},
        {"show nodes " + scene + out + " --photons 0", "there is nothing to show of nodes: nothing scatters twice"},
        {"show nodes " + scene + out + " --smoke direct --irradiance none",
         "--irradiance none: estimated at every step"},
        {"show light-depth " + scene + out + " --smoke direct --light-step 0", "every depth is found exactly"},
        {"show density fixtures/lessons/02-tree/one.aff" + out,
         "there is nothing to show of density: there is no smoke"},
        {"show density " + scene + out + " --row 3", "option 'row' does nothing in show density"},
        {"show density " + scene + out + " --slice 2", "expected a number from 0 to 1"},
        {"show light-depth " + scene + out + " --light 1", "expected a light of the scene, 0 to 0"},
        {"show tree fixtures/lessons/02-tree/one.aff" + out + " --row 9999", "option 'row': found '9999'"},
        {"show proofs fixtures/lessons/02-tree/one.aff" + out + " --shadows trace",
         "expected exact, which alone proves"},
        {"show proofs fixtures/lessons/02-tree/one.aff" + out + " --shadows paper", "does not go with show"},
        {"show density fixtures/wake.aff" + out, "found several frames"},
        {"show density " + scene + out + " --layers", "option 'layers' does not go with show"},
        {"show density " + scene + out + " --reference", "option 'reference' does not go with show"},
        {"show photons " + scene + out + " --map-out " + test.file("a.map"), "option 'map-out' does not go with show"},
    };
    for (const auto &words : refused) {
        CAPTURE(words.words);
        const Ran ran = test.wisp(words.words);
        CHECK(ran.status == 2);
        CHECK(lines(ran.err) == 1);
        CHECK_MESSAGE(ran.err.find(words.error) != std::string::npos, ran.err);
        CHECK(!std::filesystem::exists(test.file("a.png")));
    }
    CHECK(test.wisp("show density missing.aff" + out).status == 3);
    CHECK(test.wisp("show density " + scene + out + " --memory 1k").status == 4);
    const std::string help = test.wisp("show --help").out;
    for (const char *stage : stages) CHECK(help.find(std::string("\n  ") + stage + " ") != std::string::npos);
}

} // namespace wisp
