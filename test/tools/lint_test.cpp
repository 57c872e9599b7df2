// The determinism lint passes on the sources, and each of its rules finds what it is for.
#include "support/temporary_folder.h"
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>
#include <map>

namespace {

int lint(const std::string &words) { return std::system(("tools/lint " + words + " > /dev/null 2>&1").c_str()); }

void write(const wisp::TemporaryFolder &folder, const std::string &file, const std::string &text) {
    std::filesystem::create_directories(std::filesystem::path(folder.file(file)).parent_path());
    std::ofstream(folder.file(file)) << text << "\n";
}

} // namespace

TEST_CASE("the sources keep the rules of determinism and of rooms") { CHECK(std::system("tools/lint . >&2") == 0); }

TEST_CASE("the lint finds one violation of each rule, and none in a comment") {
    const struct {
        const char *file, *line;
    } violations[] = {
        {"src/core/smoke/a.cpp", "Real x = std::exp(y);"},
        {"src/host/base/a.cpp", "double x = pow(y, 2);"},
        {"include/wisp/a.h", "#include <cmath>"},
        {"src/host/base/a.cpp", "std::shuffle(a, b, c);"},
        {"src/host/base/a.cpp", "#include <random>"},
        {"src/host/base/a.cpp", "std::unordered_map<int, int> m;"},
        {"src/core/smoke/a.cpp", "#include <thread>"},
        {"src/core/smoke/a.cpp", "#include <chrono>"},
        {"src/core/smoke/a.cpp", "int *p = new int;"},
        {"include/wisp/a.h", "#include <vector>"},
        {"src/core/smoke/a.cpp", "throw 1;"},
        {"src/core/smoke/a.cpp", "static int counter = 0;"},
        {"Makefile", "FLAGS = -ffp-contract=off -Ofast"},
        {"Makefile", "FLAGS = -O3"},
        {"src/core/smoke/a.cpp", "return pair(generator(), generator());"},
        {"src/core/shadows/rivals/a.cpp", "#include <thread>"}, // at any depth
        {"src/host/base/a.cpp", "std::shuffle(a, b, c);"},
        {"src/c_api/a.cpp", "int *p = new int;"},
        {"tools/plume/a.cpp", "double x = std::sin(y);"},
    };
    const wisp::TemporaryFolder without;
    std::map<std::string, std::string> comments;
    for (const auto &violation : violations) {
        const wisp::TemporaryFolder folder;
        CAPTURE(std::string(violation.line));
        write(folder, violation.file, violation.line);
        CHECK(lint(folder.file("")) != 0);
        if (violation.file != std::string("Makefile"))
            comments[violation.file] += std::string("// ") + violation.line + " in a comment\n";
    }
    for (const auto &[file, text] : comments) write(without, file, text);
    CHECK(lint(without.file("")) == 0);
}

TEST_CASE("the lint finds a room that includes what it may not, and each cycle of includes") {
    const struct {
        const char *file, *included;
        bool wrong;
    } includes[] = {
        {"src/core/smoke/a.h", "core/numbers/b.h", false},
        {"src/core/smoke/a.h", "core/smoke/b.h", false},
        {"src/core/smoke/a.h", "core/lights/b.h", true},
        {"src/core/shadows/rivals/a.cpp", "core/photons/b.h", true},
        {"src/core/smoke/a.h", "wisp/scene.h", false},
        {"src/core/march/a.h", "wisp/wisp.h", true},
        {"src/core/render/a.h", "wisp/wisp.h", false},
        {"src/core/render/a.cpp", "host/base/b.h", true},
        {"src/host/scene/a.cpp", "core/render/b.h", false},
        {"src/host/scene/a.cpp", "host/formats/b.h", false},
        {"src/host/scene/a.cpp", "host/results/b.h", true},
        {"include/wisp/a.h", "wisp/b.h", false},
        {"src/c_api/a.cpp", "host/prepare/b.h", false},
        {"src/host/prepare/a.cpp", "c_api/b.h", true},
        {"src/core/render/a.cpp", "c_api/b.h", true},
        {"include/wisp/a.h", "core/numbers/b.h", true},
        {"src/core/fog/a.h", "core/numbers/b.h", true}, // no such room
    };
    for (const auto &include : includes) {
        const wisp::TemporaryFolder folder;
        const bool door = std::string(include.included).rfind("wisp/", 0) == 0;
        CAPTURE(std::string(include.file));
        CAPTURE(std::string(include.included));
        write(folder, std::string(door ? "include/" : "src/") + include.included, "");
        write(folder, include.file, std::string("#include \"") + include.included + "\"");
        CHECK((lint(folder.file("")) != 0) == include.wrong);
    }
    // a.h alone includes nothing of b, but a.cpp does: a unit is both.
    const wisp::TemporaryFolder folder;
    write(folder, "src/core/smoke/a.h", "");
    write(folder, "src/core/smoke/a.cpp", "#include \"core/smoke/a.h\"\n#include \"core/smoke/b.h\"");
    write(folder, "src/core/smoke/b.h", "// #include \"core/smoke/a.h\"");
    CHECK(lint(folder.file("")) == 0);
    write(folder, "src/core/smoke/b.h", "#include \"core/smoke/a.h\"");
    CHECK(lint(folder.file("")) != 0);
}
