// The goldens: each fixture's picture has the SHA-256 that fixtures/goldens.txt says, in each arithmetic; and the
// arithmetics agree within a thousandth.
#include "host/compare.h"
#include "host/picture.h"
#include "temporary_folder.h"
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

} // namespace

TEST_CASE("every fixture has its golden, and f32 and fixed are within a thousandth of f64") {
    const TemporaryFolder folder;
    std::map<std::string, std::map<std::string, Picture>> pictures; // scene, arithmetic
    for (const Golden &golden : goldens()) {
        const std::string pfm = folder.file("a.pfm"), out = folder.file("out");
        CAPTURE(golden.scene);
        CAPTURE(golden.arithmetic);
        REQUIRE(std::system(("build/wisp render fixtures/" + golden.scene + " --arith " + golden.arithmetic + " --digest -o " + pfm + " > " + out).c_str()) == 0);
        std::string digest;
        std::ifstream(out) >> digest;
        CHECK(digest == golden.digest);
        pictures[golden.scene][golden.arithmetic] = read_pfm(pfm);
    }
    CHECK(pictures.size() >= 3);
    for (auto &[scene, of] : pictures) {
        CAPTURE(scene);
        REQUIRE(of.size() == 3);
        for (const char *arithmetic : {"f32", "fixed"}) {
            CAPTURE(std::string(arithmetic));
            CHECK(compare(of[arithmetic], of["f64"]).relative_rmse < 1e-3);
        }
    }
}
