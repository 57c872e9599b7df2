// The determinism lint passes on the sources, and each of its rules finds what it is for.
#include "support/command_line.h"
#include <map>
#include <set>

namespace {

// Small trees of sources, which one run of the lint looks at.
struct Trees : wisp::CommandLineTest {
    void write(const std::string &tree, const std::string &path, const std::string &text) {
        folders.insert(file(tree));
        std::filesystem::create_directories(std::filesystem::path(file(tree + "/" + path)).parent_path());
        CommandLineTest::write(tree + "/" + path, text + "\n");
    }
    // These are the trees in which a rule is broken.
    void check_broken(const std::set<std::string> &expected) const {
        std::string words;
        for (const std::string &folder : folders) words += " " + folder;
        const wisp::Ran ran = run("tools/lint" + words);
        CHECK(ran.status == 1);
        for (const std::string &folder : folders) {
            CAPTURE(folder);
            CAPTURE(ran.out);
            CHECK((ran.out.find(folder + ": ") != std::string::npos) ==
                  (expected.count(folder.substr(folder.rfind('/') + 1)) == 1));
        }
    }
    std::set<std::string> folders;
};

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
    Trees trees;
    std::set<std::string> wrong;
    std::map<std::string, std::string> comments;
    for (const auto &violation : violations) {
        const std::string tree = "violation" + std::to_string(wrong.size() + 1);
        wrong.insert(tree);
        trees.write(tree, violation.file, violation.line);
        if (violation.file != std::string("Makefile"))
            comments[violation.file] += std::string("// ") + violation.line + " in a comment\n";
    }
    for (const auto &[file, text] : comments) trees.write("comments", file, text);
    trees.check_broken(wrong);
}

TEST_CASE("the lint finds a room that includes what it may not, and each cycle of includes") {
    const struct {
        const char *file, *included;
        bool wrong;
    } includes[] = {
        {"src/core/smoke/a.h", "core/numbers/b.h", false},  {"src/core/smoke/a.h", "core/smoke/b.h", false},
        {"src/core/smoke/a.h", "core/lights/b.h", true},    {"src/core/shadows/rivals/a.cpp", "core/photons/b.h", true},
        {"src/core/smoke/a.h", "wisp/scene.h", false},      {"src/core/march/a.h", "wisp/wisp.h", true},
        {"src/core/render/a.h", "wisp/wisp.h", false},      {"src/core/render/a.cpp", "host/base/b.h", true},
        {"src/host/scene/a.cpp", "core/render/b.h", false}, {"src/host/scene/a.cpp", "host/formats/b.h", false},
        {"src/host/scene/a.cpp", "host/results/b.h", true}, {"include/wisp/a.h", "wisp/b.h", false},
        {"src/c_api/a.cpp", "host/prepare/b.h", false},     {"src/host/prepare/a.cpp", "c_api/b.h", true},
        {"src/core/render/a.cpp", "c_api/b.h", true},       {"include/wisp/a.h", "core/numbers/b.h", true},
        {"src/core/fog/a.h", "core/numbers/b.h", true}, // no such room
    };
    Trees trees;
    std::set<std::string> wrong;
    for (const auto &include : includes) {
        const std::string tree = "include" + std::to_string(trees.folders.size() + 1);
        if (include.wrong) wrong.insert(tree);
        const bool door = std::string(include.included).rfind("wisp/", 0) == 0;
        trees.write(tree, std::string(door ? "include/" : "src/") + include.included, "");
        trees.write(tree, include.file, std::string("#include \"") + include.included + "\"");
    }
    // a.h alone includes nothing of b, but a.cpp does: a unit is both.
    for (const std::string tree : {"line", "cycle"}) {
        trees.write(tree, "src/core/smoke/a.h", "");
        trees.write(tree, "src/core/smoke/a.cpp", "#include \"core/smoke/a.h\"\n#include \"core/smoke/b.h\"");
        trees.write(tree, "src/core/smoke/b.h",
                    tree == "line" ? "// #include \"core/smoke/a.h\"" : "#include \"core/smoke/a.h\"");
    }
    wrong.insert("cycle");
    trees.check_broken(wrong);
}
