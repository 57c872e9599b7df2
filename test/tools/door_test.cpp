// The door is small: `wisp/wisp.h`, with all that it includes, drags in nothing of the core.
#include <doctest/doctest.h>
#include <fstream>
#include <set>
#include <string>

namespace {

// Lines of a header below include/ and of those that it includes, each once.
int lines_with_includes(const std::string &header, std::set<std::string> &seen) {
    if (!seen.insert(header).second) return 0;
    std::ifstream file("include/" + header);
    CAPTURE(header);
    REQUIRE(file.good());
    int lines = 0;
    const std::string start = "#include \"";
    for (std::string line; std::getline(file, line); ++lines)
        if (line.rfind(start, 0) == 0)
            lines += lines_with_includes(line.substr(start.size(), line.rfind('"') - start.size()), seen);
    return lines;
}

} // namespace

TEST_CASE("the door has at most 500 lines with all that it includes, and includes the door alone") {
    std::set<std::string> seen;
    const int lines = lines_with_includes("wisp/wisp.h", seen);
    CHECK(lines > 300);
    CHECK(lines <= 500);
    CHECK(seen.size() > 5);
    for (const std::string &header : seen) CHECK(header.rfind("wisp/", 0) == 0);
}
