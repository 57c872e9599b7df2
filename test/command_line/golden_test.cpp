// The goldens: each fixture's picture has the SHA-256 that fixtures/goldens.txt says, in each arithmetic; and the
// arithmetics agree within a thousandth.
#include "host/base/files.h"
#include "host/images/compare.h"
#include "host/images/picture.h"
#include "support/built.h"
#include "support/temporary_folder.h"
#include <doctest/doctest.h>
#include <fstream>
#include <map>
#include <sstream>

using namespace wisp;

namespace {

struct Golden {
    std::string digest, arithmetic, scene;
};

std::vector<Golden> goldens() {
    std::vector<Golden> list;
    std::ifstream file("fixtures/goldens.txt");
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        Golden golden;
        words >> golden.digest >> golden.arithmetic >> std::ws;
        std::getline(words, golden.scene);
        list.push_back(golden);
    }
    return list;
}

struct GoldenRenderer : TemporaryFolder {
    // The picture of a golden's scene, and its digest.
    Picture render(const std::string &scene, const std::string &arithmetic, std::string *digest = nullptr) const {
        const std::string pfm = file("a.pfm"), out = file("out");
        const std::string command = built("wisp") + " render fixtures/" + scene + " --arith " + arithmetic +
                                    " --digest -o " + pfm + " > " + out;
        REQUIRE(std::system(command.c_str()) == 0);
        if (digest) std::ifstream(out) >> *digest;
        return read_pfm(pfm);
    }
};

} // namespace

TEST_CASE("every fixture has its golden in every arithmetic") {
    const GoldenRenderer renderer;
    const std::vector<Golden> list = goldens();
    CHECK(list.size() >= 18);
    for (const Golden &golden : list) {
        CAPTURE(golden.scene);
        CAPTURE(golden.arithmetic);
        std::string digest;
        renderer.render(golden.scene, golden.arithmetic, &digest);
        CHECK(digest == golden.digest);
    }
}

TEST_CASE("pictures of every fixture in f32 and fixed are within a thousandth of f64" * doctest::test_suite("long")) {
    const GoldenRenderer renderer;
    const std::vector<Golden> list = goldens();
    std::map<std::string, Picture> known; // by arithmetic and scene
    const auto picture = [&](const std::string &scene, const std::string &arithmetic) -> const Picture & {
        const auto found = known.find(arithmetic + scene);
        return found != known.end() ? found->second : known[arithmetic + scene] = renderer.render(scene, arithmetic);
    };
    // Without photons as they are. With photons a few of them take another path after a decision that fell the other
    // way (one in some hundred of those with many collisions), so the pictures differ as those of other seeds do, by
    // far less: that is counted apart.
    for (const Golden &golden : list) {
        if (golden.arithmetic == "f64") continue;
        CAPTURE(golden.scene);
        CAPTURE(golden.arithmetic);
        const std::string single = golden.scene + " --photons 0", other_seed = golden.scene + " --seed 2";
        const bool paths = golden.scene.find("--reference") != std::string::npos; // they diverge as photons do
        if (!paths) CHECK(compare(picture(single, golden.arithmetic), picture(single, "f64")).relative_rmse < 1e-3);
        const bool drawn =
            golden.scene.find("surfaces.aff") != 0 && golden.scene.find("--photons 0") == std::string::npos;
        if (!drawn) continue; // nothing there is drawn by lot
        const Picture &exact = picture(golden.scene, "f64");
        // Photons of resampled smoke start by sums over all nodes. Their last digits move a part p of the photons to
        // another node (in f32 a sixth of those of wake.aff), which differ by sqrt(p) of the noise: p < 1/4.
        const bool resampled = !paths && golden.scene.find("--smoke direct") == std::string::npos &&
                               golden.scene.find("--deposit") == std::string::npos;
        const double noise = compare(picture(other_seed, "f64"), exact).relative_rmse;
        CHECK(compare(picture(golden.scene, golden.arithmetic), exact).relative_rmse < (resampled ? 0.5 : 0.1) * noise);
    }
}

TEST_CASE("golden: fixtures/demo.png is the picture of make demo") {
    const TemporaryFolder folder;
    const std::string png = folder.file("demo.png");
    REQUIRE(std::system((built("wisp") + " render fixtures/wake.aff --frames 2 -q -o " + png).c_str()) == 0);
    CHECK(read_file(png) == read_file("fixtures/demo.png"));
}
