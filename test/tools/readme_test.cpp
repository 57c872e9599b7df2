// The README of each room against its sources: it names each unit and what tests it, and defines the labels that
// comments cite.
#include <algorithm>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <vector>

namespace {

using Path = std::filesystem::path;

std::vector<std::string> lines_of(const Path &path) {
    std::vector<std::string> lines;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
}

// Files below some folders whose names end in one of the endings.
std::vector<Path> files_below(const std::vector<Path> &folders, const std::set<std::string> &endings) {
    std::vector<Path> files;
    for (const Path &folder : folders)
        for (const auto &entry : std::filesystem::recursive_directory_iterator(folder))
            if (endings.count(entry.path().extension().string())) files.push_back(entry.path());
    return files;
}

bool has_match(const std::string &line, const std::string &pattern) {
    return std::regex_search(line, std::regex(pattern));
}

// The lines of the README of a source's room: the nearest one above it.
std::vector<std::string> readme_above(const Path &source) {
    for (Path folder = source.parent_path(); folder.has_parent_path(); folder = folder.parent_path())
        if (std::filesystem::exists(folder / "README.md")) return lines_of(folder / "README.md");
    return {};
}

std::set<std::string> names_of_tests() {
    std::set<std::string> names;
    for (const Path &file : files_below({"test"}, {".cpp"})) names.insert(file.stem().string());
    return names;
}

// The comment of a line, if it has one.
std::string comment_of(const std::string &line) {
    const size_t start = line.find("//");
    return start == std::string::npos ? "" : line.substr(start);
}

// All matches of a pattern's first group.
std::vector<std::string> matches(const std::string &line, const std::regex &pattern) {
    std::vector<std::string> found;
    for (std::sregex_iterator it(line.begin(), line.end(), pattern), end; it != end; ++it) found.push_back((*it)[1]);
    return found;
}

} // namespace

TEST_CASE("each unit has a test of its name, or its room's README says which test it has") {
    const std::set<std::string> tests = names_of_tests();
    size_t units = 0;
    for (const Path &source : files_below({"src"}, {".cpp", ".h"})) {
        const std::string unit = source.stem().string();
        const std::vector<std::string> readme = readme_above(source);
        const auto is_named = [&](const std::string &and_pattern) {
            return std::any_of(readme.begin(), readme.end(), [&](const std::string &line) {
                return has_match(line, "`[^`]*\\b" + unit + "\\b") && has_match(line, and_pattern);
            });
        };
        ++units;
        CHECK_MESSAGE(is_named(""), source.string() << " is not in the README of its room");
        if (source.extension() != ".cpp" || tests.count(unit + "_test")) continue;
        CHECK_MESSAGE(is_named("_test\\b"),
                      "neither " << unit << "_test.cpp nor a test in the README of " << source.string());
    }
    CHECK(units > 100);
}

TEST_CASE("tests that a README names are there") {
    std::set<std::string> tests = names_of_tests();
    tests.insert("self_test"); // a unit of the core
    for (const Path &readme : files_below({"src", "test", "include"}, {".md"}))
        for (const std::string &line : lines_of(readme))
            for (const std::string &name : matches(line, std::regex("\\b(\\w*[a-z0-9]_test)\\b")))
                CHECK_MESSAGE(tests.count(name) == 1, readme.string() << " names " << name);
}

TEST_CASE("labels that comments cite are defined in a README, and no comment cites a page outside the project") {
    // Defined: in a heading or in bold, as `**S4-1**` or `**N-E5, N-E6: ...**`.
    const std::regex label("\\b(S[1-7](?:-[1-9])?|C[1-8]|N-[A-Z]+[0-9]*)\\b"), bold("\\*\\*([^*]+)\\*\\*");
    std::set<std::string> defined;
    for (const Path &readme : files_below({"src", "tools", "include"}, {".md"}))
        for (const std::string &line : lines_of(readme)) {
            const std::vector<std::string> parts =
                line[0] == '#' ? std::vector<std::string>{line} : matches(line, bold);
            for (const std::string &part : parts)
                for (const std::string &name : matches(part, label)) defined.insert(name);
        }
    for (const std::string &line : lines_of("test/physics/hard_cases.txt")) // C1 to C15 name hard cases, too
        defined.insert(line.substr(0, line.find(' ')));

    const std::regex outside("\\bnumerics [A-Z]|\\b(design|method|numerics|decisions|hard-cases)\\.md|\\bdecisions:");
    size_t cited = 0;
    for (const Path &file : files_below({"src", "include", "test"}, {".cpp", ".h"})) {
        int number = 0;
        for (const std::string &line : lines_of(file)) {
            ++number;
            const std::string comment = comment_of(line);
            if (comment.empty()) continue;
            for (const std::string &name : matches(comment, label)) {
                ++cited;
                CHECK_MESSAGE(defined.count(name) == 1, file.string()
                                                            << ":" << number << ": " << name << " is not defined");
            }
            CHECK_MESSAGE(!std::regex_search(comment, outside), file.string() << ":" << number << ": " << comment);
        }
    }
    CHECK(cited > 50);
}
