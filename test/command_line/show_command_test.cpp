// build/wisp show: every stage's picture is its golden, a crop is part of the whole, and what cannot be shown is
// refused in one line.
#include "host/images/picture.h"
#include "support/command_line.h"
#include <map>
#include <sstream>

namespace wisp {

namespace {

const std::string smoke = "fixtures/glow.aff --size 48x36 --spp 1 --photons 3000",
                  ball = "fixtures/lessons/02-tree/one.aff --size 48x36 --spp 1",
                  table = "fixtures/lessons/03-shadows/table.aff --frames 3 --size 80x60 --spp 1";

// Stage and scene, and the digests in each arithmetic.
struct Golden {
    std::string words, f32, f64, fixed;
};
const Golden goldens[] = {
    {"density " + smoke, "65ba90e850e98ae09e3322b5a90b774db963fb1ec67e07368b1b68fa46a34409",
     "96fa942ed12c546b304cd4866bccb287c47aeff46a6d4b3592b2e2da56decef4",
     "b6b638412cdf275d349840936a97525c44ae004da135e8be72704cc3f821d5d5"},
    {"density " + smoke + " --slice 0.25 --density-step 0",
     "33b07920105f4120965b7eb3a7d2f3075ff05ed8fe2ba1d021cf9f54efe3b880",
     "e0d1b5de81ed2df94bd1e83351b5587ba99c8472f061b4ddb2e86bd60e57c775",
     "944646509d1fa0fdbef83c993c20cd0cbada8523cc748c4c98aae90d71d8345d"},
    {"depth " + smoke, "7d1da40ea601dcdadd643d018e8843b382345800d760fad280d135d4eb07b547",
     "4feb83a40de848c320d8f9c8ef141970985db880f69b94d8478e2860161e306d",
     "427ccb2429f0e8a6b75d946082128afe21a3d9dfcc48d84702d5ff2f1c7b8cc1"},
    {"light-depth " + smoke + " --light 1", "e1fdb7113c2d2130a0cf06195a54286baaedf2c68db77c25a891b15f233b104b",
     "315b16337c0455ab8d7e8163a0e6395fce0464fe131d916723140ee27310422b",
     "1e24c1bc817bad08aabb3a8384f2feadade94269733891cd2e34237cb2b3e279"},
    {"photons " + smoke, "ba0f15ed32577e93028aa43a9be29714ae635cc726fb854889bd593e5cc57055",
     "a9b63afb31f9e5def615d0cc6ea5a41e9bbe8d6976602f1241eb2fa66aa67b6a",
     "022efe523e7dec2360110fb2be939000f4d098def4175d82e89fd38cde6fb537"},
    {"photons " + smoke + " --smoke direct", "17feaf5e9b3e7cf846da24899dff0f95c2977fe6d393e077462d7847932dcd4a",
     "73a9832109a38e2019a890d34658ff49d72ffc378b2fc21dfbe0ad8c392058dd",
     "e6df6c61ce815248c62a9305c4d359a5ddf2925f73fc49b03672c116bcfa5219"},
    {"paths " + smoke, "75da27aaff300f4a174b4ac874e600daeb3444a5b1c3d45918bd11a5f4ac80f5",
     "d561fcead58bc37fc99d8786d1d4fe933838e994e91b17dcf39d73647e94058a",
     "a5c2ef47f4ade06b64c7b4658780f067184da763bfb2930ae5d9d06414b1f156"},
    {"nodes " + smoke, "c2af4d6f5a04565dde30ba8d6ad8e4a3440a04c77ce0bf39bfdcc4e744533c6a",
     "ddc4c076279f8e625dbfd75be5f64ff70937b1ac82951ffd67e99ec0536825c5",
     "ba3aa87e5ffc076487fd3c33d76546a4d56566a9ea8d49309638790da55e0dff"},
    {"tree " + ball, "de83768f9b24ea39c7eba148156d573390b4904a073219217b1ebfcdfa338937",
     "3b5d0eebf50099279791df22a528dc54dca827b1e93ebe0be1626002c16aeffa",
     "3b5d0eebf50099279791df22a528dc54dca827b1e93ebe0be1626002c16aeffa"},
    {"tree " + ball + " --tree kd --row 20", "9bcf18c53419d85ee4cfaa262659bd0f812f8e43718c7a5a9a7d58c12641beaf",
     "9bcf18c53419d85ee4cfaa262659bd0f812f8e43718c7a5a9a7d58c12641beaf",
     "9bcf18c53419d85ee4cfaa262659bd0f812f8e43718c7a5a9a7d58c12641beaf"},
    {"visits " + ball, "7c609bd9c5d16006d810ac6731203846fc7ed303cb6b0cdffa287e9da7802a07",
     "754865308e44de5a80719a2ceddeafc7c165e253119f3201bd0b0e53b4686308",
     "754865308e44de5a80719a2ceddeafc7c165e253119f3201bd0b0e53b4686308"},
    {"proofs " + ball + " --spp 9", "1dbe1adf955544056b709b8043dacc332f1b510e10a48d29b937fa5a797a223d",
     "b24a73032a3a8e86bb7fd0bf934d89bafcc2098e6a5cd4c9a61251732817c217",
     "b24a73032a3a8e86bb7fd0bf934d89bafcc2098e6a5cd4c9a61251732817c217"},
    {"wrong " + table, "c92cbf62e5daae9b91ac55be0332f96524a9da767d0811f78ba7cbdc9ef11f48",
     "04dae60089dfa0d45b60e9bbec64ce77d573903e643b66e0ef3be8845eeb13e8",
     "304741891c124de578ef9d6d99ef91bcdcefd646e86a73b3fd789c2e500d15d1"},
};

const char *const stages[] = {"density", "depth", "light-depth", "photons", "paths",
                              "nodes",   "tree",  "visits",      "proofs",  "wrong"};

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
    for (const std::string &stage : {"depth " + smoke, "light-depth " + smoke + " --slice 0.3", "tree " + ball}) {
        CAPTURE(stage);
        REQUIRE(test.wisp("show " + stage + " -q -o " + whole + " -o " + png).status == 0);
        const Ran cropped = test.wisp("show " + stage + " -q --crop 10,6,30,26 -o " + part);
        REQUIRE(cropped.status == 0);
        CHECK(cropped.err == ""); // --quiet
        const Picture a = read_pfm(whole), b = read_pfm(part);
        REQUIRE(b.width == 20);
        REQUIRE(b.height == 20);
        // Colours are those of the part's own range, so pixels are as bright in the same order.
        std::vector<std::pair<float, float>> both; // red grows with the value
        for (size_t y = 0; y < 20; ++y)
            for (size_t x = 0; x < 20; ++x)
                both.push_back({a.rgb[3 * ((y + 6) * 48 + x + 10)], b.rgb[3 * (y * 20 + x)]});
        std::sort(both.begin(), both.end());
        size_t ordered = 0;
        for (size_t i = 1; i < both.size(); ++i) ordered += both[i - 1].second <= both[i].second;
        CHECK(ordered > 370); // lines are blended with what is below
        CHECK(both.front().second < both.back().second);
    }
    CHECK(test.wisp("show density " + smoke + " -q -o -.png").out.substr(1, 3) == "PNG");
}

TEST_CASE("command line: show's wrong pixels are those in which a sequence by the paper's method differs") {
    const CommandLineTest test;
    const std::string scene = "render fixtures/lessons/03-shadows/table.aff --spp 1 --size 160x120 ";
    REQUIRE(test.wisp(scene + "--shadows paper --frames 0:5 -q -o " + test.file("paper_%d.pfm")).status == 0);
    REQUIRE(test.wisp(scene + "--frames 5 -q -o " + test.file("exact.pfm")).status == 0);
    const Picture paper = read_pfm(test.file("paper_5.pfm")), exact = read_pfm(test.file("exact.pfm"));
    int differing = 0;
    for (size_t i = 0; i < exact.rgb.size(); i += 3)
        differing += !std::equal(&exact.rgb[i], &exact.rgb[i] + 3, &paper.rgb[i]);
    CHECK(differing > 0);
    const Ran ran =
        test.wisp("show wrong fixtures/lessons/03-shadows/table.aff --spp 1 --size 160x120 --frames 5 --digest");
    CHECK(ran.err.find("wrong: " + std::to_string(differing) + " pixels of frame 5") == 0);
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
        {"show wrong fixtures/lessons/02-tree/one.aff" + out + " --crop 0,0,8,8", "learns from whole pictures"},
        {"show density fixtures/wake.aff" + out, "found several frames, expected one with --frames"},
        {"show density " + scene + out + " --layers", "option 'layers' does not go with show"},
        {"show density " + scene + out + " --reference", "option 'reference' does not go with show"},
        {"show photons " + scene + out + " --map-in " + test.file("a.map"), "no photon is traced"},
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
