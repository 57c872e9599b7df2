// The list of hard cases against the tests: what it calls tested has one test of that name, what is pending none.
#include <algorithm>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

std::string text_of(const std::filesystem::path &path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

// How many TEST_CASEs "hard case ID:" each id has in the files of a folder and those below. Those of the core count
// once, though they run in three arithmetics.
std::map<std::string, int> tests_of(const std::filesystem::path &folder) {
    std::map<std::string, int> tests;
    for (const auto &entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.path().extension() != ".cpp" || entry.path().filename() == "hard_cases_test.cpp") continue;
        const std::string text = text_of(entry.path()), start = "hard case ";
        for (size_t at = text.find("TEST_CASE("); at != std::string::npos; at = text.find("TEST_CASE(", at + 1)) {
            const size_t name = text.find('"', at), id = text.find(start, at);
            // The name begins with the words, behind ": " in the core.
            if (id != name + 1 && id != name + 3) continue;
            const size_t end = text.find(':', id);
            ++tests[text.substr(id + start.size(), end - id - start.size())];
        }
    }
    return tests;
}

struct Case {
    std::string id, outcome, state;
};

std::vector<Case> listed() {
    std::vector<Case> cases;
    std::istringstream lines(text_of("test/physics/hard_cases.txt"));
    for (std::string line; std::getline(lines, line);) {
        const size_t first = line.find(" | "), second = line.rfind(" | ");
        REQUIRE(first != std::string::npos);
        REQUIRE(second > first);
        cases.push_back({line.substr(0, first), line.substr(first + 3, second - first - 3), line.substr(second + 3)});
    }
    return cases;
}

} // namespace

TEST_CASE("hard cases: each has one test, or says what it waits for") {
    std::map<std::string, int> tests = tests_of("test");
    const std::vector<Case> cases = listed();
    CHECK(cases.size() == 78);
    for (const Case &c : cases) {
        CAPTURE(c.id);
        CHECK(std::count_if(cases.begin(), cases.end(), [&](const Case &other) { return other.id == c.id; }) == 1);
        CHECK(!c.outcome.empty());
        const bool pending = c.state.rfind("pending: ", 0) == 0 && c.state.size() > 9;
        CHECK((pending || c.state == "tested"));
        CHECK(tests[c.id] == (pending ? 0 : 1));
        tests.erase(c.id);
    }
    for (const auto &[id, count] : tests) {
        CAPTURE(id);
        CHECK(count == 0); // the list does not have it
    }
}
