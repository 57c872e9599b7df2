// What the release objects of the core leave to be linked: no heap, no exceptions, no files, no clock, no mathematical
// functions of the C library.
#include "support/built.h"
#include "support/data.h"
#include "support/temporary_folder.h"
#include <algorithm>
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>
#include <regex>
#include <vector>

namespace {

// Undefined symbols of all objects below a folder, but for one object, as `nm` lists them.
std::vector<std::string> undefined_symbols(const std::string &objects, const std::string &except = "") {
    const wisp::TemporaryFolder folder;
    const std::string list = folder.file("symbols");
    const std::string command = "find " + objects + " -name '*.o' ! -path '*/" + except +
                                ".o' -print0 | xargs -0 nm --undefined-only > " + list;
    REQUIRE(std::system(command.c_str()) == 0);
    std::vector<std::string> symbols;
    std::ifstream file(list);
    for (std::string line; std::getline(file, line);) {
        const size_t at = line.find(" U ");
        if (at != std::string::npos) symbols.push_back(line.substr(at + 3));
    }
    return symbols;
}

bool is_forbidden(const std::string &symbol) {
    static const std::regex names(
        "malloc|calloc|realloc|free$|_Zn[wa]|_Zd[la]|__cxa|__gxx|_Unwind|printf|fopen|write$|clock|"
        "time$|(^|_)expf?$|logf?$|powf?$|sinf?$|cosf?$");
    return std::regex_search(symbol, names);
}

} // namespace

TEST_CASE("the core asks for no memory but the arena's, throws nothing and reads no clock") {
    if (wisp::has_address_sanitizer) return wisp::skip_case("AddressSanitizer calls what the core does not");
    for (const char *arithmetic : {"f32", "f64", "fixed"}) {
        const std::vector<std::string> symbols = undefined_symbols(wisp::built("core/") + arithmetic);
        CHECK(symbols.size() > 100); // its units call each other
        for (const std::string &symbol : symbols) {
            CAPTURE(symbol);
            CHECK(!is_forbidden(symbol));
        }
    }
}

TEST_CASE("only who asks for them links the recorder of a pixel and the probes of stages") {
    const struct {
        const char *function, *unit;
    } asked[] = {{"make_recorder", "render/inspect"}, {"cells_at", "render/show"}};
    for (const auto &of : asked) {
        const auto uses = [&](const std::vector<std::string> &symbols) {
            return std::any_of(symbols.begin(), symbols.end(), [&](const std::string &symbol) {
                return symbol.find(of.function) != std::string::npos;
            });
        };
        CAPTURE(std::string(of.function));
        CHECK(uses(undefined_symbols(wisp::built("core/f32"))));
        CHECK(!uses(undefined_symbols(wisp::built("core/f32"), of.unit)));
    }
    for (const char *unit : {"render/inspect", "render/show"}) { // and nothing in the core asks for these
        CAPTURE(std::string(unit));
        for (const std::string &symbol : undefined_symbols(wisp::built("core/f32"), unit))
            CHECK(symbol.find(std::string(unit) == "render/show" ? "4showERK" : "7inspectERK") == std::string::npos);
    }
}

TEST_CASE("so does the C interface, with what it shares with the host") {
    if (wisp::has_address_sanitizer) return wisp::skip_case("AddressSanitizer calls what the interface does not");
    std::vector<std::string> symbols;
    for (const char *objects : {"c_api", "host/prepare/core_units.o", "host/base/sha256.o"})
        for (const std::string &symbol : undefined_symbols(wisp::built(objects))) symbols.push_back(symbol);
    CHECK(symbols.size() > 20);
    for (const std::string &symbol : symbols) {
        CAPTURE(symbol);
        CHECK(!is_forbidden(symbol));
    }
}

TEST_CASE("symbols of the heap, exceptions, files and clocks are found where they are used") {
    const std::vector<std::string> host = undefined_symbols(wisp::built("host"));
    for (const char *start : {"_Zn", "_Zd", "__cxa", "__gxx", "_Unwind"}) { // new, delete, exceptions
        CAPTURE(std::string(start));
        CHECK(std::any_of(host.begin(), host.end(), [&](const std::string &symbol) {
            return symbol.rfind(start, 0) == 0 && is_forbidden(symbol);
        }));
    }
    for (const char *symbol :
         {"malloc", "calloc", "realloc",       "free", "printf", "__fprintf_chk", "fopen", "fwrite",
          "write",  "clock",  "clock_gettime", "time", "exp",    "expf",          "log",   "logf",
          "pow",    "powf",   "sin",           "sinf", "cos",    "cosf"}) {
        CAPTURE(std::string(symbol));
        CHECK(is_forbidden(symbol));
    }
    CHECK(!is_forbidden("memcpy"));
    CHECK(!is_forbidden("ldexp")); // exact
    CHECK(!is_forbidden("sqrtf"));
}
