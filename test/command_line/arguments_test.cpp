#include "host/commands/arguments.h"
#include "host/scene/options.h"
#include <doctest/doctest.h>

using namespace wisp;

namespace {

struct Few {
    std::string file;
    bool all = false;
};
const OptionTable<Few> few = {{"file", "FILE", "a file", to_text(&Few::file)},
                              {"all", nullptr, "all", to_switch(&Few::all)}};

} // namespace

TEST_CASE("arguments: files, options of both forms, and letters") {
    const CommandLine line = parse_arguments(
        "render", scene_options(), {"a.aff", "--spp=9", "-o", "x=.png", "--exposure", "-1", "-q", "-", "-o=y.png"});
    CHECK(line.files == std::vector<std::string>{"a.aff", "-"});
    const std::vector<std::pair<std::string, std::string>> expected = {
        {"spp", "9"}, {"output", "x=.png"}, {"exposure", "-1"}, {"quiet", "1"}, {"output", "y.png"}};
    CHECK(line.options == expected);
}

TEST_CASE("arguments: a command's own options are taken out of the line") {
    std::vector<KnownOption> known;
    add_options(known, scene_options(), {"spp"});
    add_options(known, few);
    CommandLine line = parse_arguments("few", known, {"--file", "a", "--spp", "many", "--all"});
    Few options;
    take_options(line, few, options);
    CHECK(options.file == "a");
    CHECK(options.all);
    REQUIRE(line.options.size() == 1);
    CHECK(line.options[0].first == "spp"); // its value is looked at when it is set
}

TEST_CASE("arguments: errors say what was found and expected") {
    const auto refusal = [](const std::vector<std::string> &arguments, bool of_few) {
        try {
            if (of_few)
                parse_arguments("few", few, arguments);
            else
                parse_arguments("render", scene_options(), arguments);
        } catch (const Error &error) {
            CHECK(error.status == exit_usage);
            return std::string(error.what());
        }
        return std::string("no error");
    };
    CHECK(refusal({"--none"}, true) == "there is no option '--none' of few, expected --file or --all");
    CHECK(refusal({"--none=1"}, false) == "there is no option '--none'; 'wisp help' lists them");
    CHECK(refusal({"-f"}, true) == "there is no option '-f' of few, expected --file or --all");
    CHECK(refusal({"-o", "a"}, true) == "there is no option '-o' of few, expected --file or --all");
    CHECK(refusal({"--file"}, true) == "option '--file' needs a value: FILE");
    CHECK(refusal({"--all=no"}, true) == "option '--all' takes no value");
    CHECK(refusal({"--spp"}, false) == "option '--spp' needs a value: N");
}
