// tools/cluster/piece: one of several pieces of a picture. `make cluster` holds what they are joined to.
#include "support/command_line.h"

using namespace wisp;

TEST_CASE("piece: a word that names no piece, or nothing to divide, is refused with what was expected") {
    const CommandLineTest test;
    const auto refusal = [&](const std::string &words) {
        const Ran ran = test.run("tools/cluster/piece " + words + " out.png scene.aff");
        CHECK(ran.status == 2);
        CHECK(ran.out == "");
        return ran.err;
    };
    const std::string piece = "tools/cluster/piece: ";
    CHECK(refusal("0 2 photons 1M") == piece + "photons: found '1M', expected a number of photons, in digits\n");
    CHECK(refusal("2 2 crops 24x20") == piece + "I: found '2', expected a number from 0 to 1\n");
    CHECK(refusal("one 2 crops 24x20") == piece + "I: found 'one', expected join, or a number from 0 to 1\n");
    CHECK(refusal("0 0 crops 24x20") == piece + "N: found '0', expected the number of pieces\n");
    for (const char *script : {"parallel_render", "slurm_render"}) {
        const Ran ran = test.run(std::string("tools/cluster/") + script + " x crops 24x20 out.png scene.aff");
        CHECK(ran.status == 2);
        CHECK(ran.err == piece + "N: found 'x', expected the number of pieces\n");
    }
    CHECK(refusal("join 2 crops 24") == piece + "crops: found '24', expected WxH\n");
    CHECK(refusal("0 2 frames 3") == piece + "frames: found '3', expected A:B\n");
    CHECK(refusal("0 2 rows 3") == piece + "mode: found 'rows', expected frames, crops or photons\n");
}
