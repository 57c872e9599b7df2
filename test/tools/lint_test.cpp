// The determinism lint passes on the sources, and each of its rules finds what it is for.
#include "support/temporary_folder.h"
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>

namespace {

int lint(const std::string &folder) { return std::system(("tools/lint " + folder + " > /dev/null 2>&1").c_str()); }

} // namespace

TEST_CASE("the sources keep the rules of determinism") { CHECK(std::system("tools/lint . >&2") == 0); }

TEST_CASE("the lint finds one violation of each rule, and none in a comment") {
    const struct {
        const char *file, *line;
    } violations[] = {
        {"src/core/a.cpp", "Real x = std::exp(y);"},
        {"src/host/a.cpp", "double x = pow(y, 2);"},
        {"include/wisp/a.h", "#include <cmath>"},
        {"src/host/a.cpp", "std::shuffle(a, b, c);"},
        {"src/host/a.cpp", "#include <random>"},
        {"src/host/a.cpp", "std::unordered_map<int, int> m;"},
        {"src/core/a.cpp", "#include <thread>"},
        {"src/core/a.cpp", "#include <chrono>"},
        {"src/core/a.cpp", "int *p = new int;"},
        {"include/wisp/a.h", "#include <vector>"},
        {"src/core/a.cpp", "throw 1;"},
        {"src/core/a.cpp", "static int counter = 0;"},
        {"Makefile", "FLAGS = -ffp-contract=off -Ofast"},
        {"Makefile", "FLAGS = -O3"},
        {"src/core/a.cpp", "return pair(generator(), generator());"},
    };
    for (const auto &violation : violations) {
        const wisp::TemporaryFolder folder;
        const std::filesystem::path path = folder.file(violation.file);
        std::filesystem::create_directories(path.parent_path());
        CAPTURE(std::string(violation.line));
        std::ofstream(path) << "// " << violation.line << " in a comment -ffp-contract=off\n";
        if (path.filename() != "Makefile") CHECK(lint(folder.file("")) == 0);
        std::ofstream(path) << violation.line << "\n";
        CHECK(lint(folder.file("")) != 0);
    }
}

TEST_CASE("the core asks for no memory but the arena's, throws nothing and reads no clock") {
    // Undefined symbols of every release object of the core.
    CHECK(std::system("ls build/core/f32/render/render.o build/core/fixed/render/render.o > /dev/null") == 0);
    const int found =
        std::system("nm --undefined-only $(find build/core -name '*.o') | grep -E ' U .*(malloc|calloc|realloc|free$|_Zn[wa]|_Zd[la]|"
                    "__cxa|__gxx|_Unwind|printf|fopen|write$|clock|time$|expf?$|logf?$|powf?$|sinf?$|cosf?$)' >&2");
    CHECK(found != 0); // grep found nothing
}
