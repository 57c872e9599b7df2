// tools/manual: the manual page and what shells complete have every command and option of wisp's own help.
#include "support/command_line.h"
#include <regex>

namespace {

using namespace wisp;

struct ManualTest : CommandLineTest {
    std::string made(const std::string &kind) const {
        const Ran ran = run("tools/manual " + kind + " " + built("wisp"));
        REQUIRE_MESSAGE(ran.status == 0, ran.err);
        return ran.out;
    }
    static std::vector<std::string> found_in(const std::string &text, const char *pattern) {
        const std::regex regex(pattern, std::regex::ECMAScript | std::regex::multiline);
        std::vector<std::string> found;
        for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) found.push_back((*it)[1]);
        return found;
    }
    std::vector<std::string> commands() const {
        std::vector<std::string> names = found_in(wisp("help").out, "^wisp ([a-z]+) [^|]");
        REQUIRE(names.size() == 8);
        return names;
    }
    std::vector<std::string> options_of(const std::string &command) const {
        return found_in(wisp(command + " --help").out, "^  (--[a-z-]+)");
    }
    // What bash completes behind these words.
    std::string completed(const std::string &words) const {
        return run("echo '. " + file("wisp.bash") + "; COMP_WORDS=(" + words +
                   "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _wisp; echo \" ${COMPREPLY[*]} \"' | bash")
            .out;
    }
};

bool holds(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

} // namespace

TEST_CASE_FIXTURE(ManualTest, "manual: the page has every command and option, and renders without warnings") {
    const std::string page = made("man"), plain = std::regex_replace(page, std::regex(R"(\\-)"), "-");
    for (const std::string &command : commands()) {
        CHECK_MESSAGE(holds(plain, "\\fBwisp " + command + " "), command);
        for (const std::string &option : options_of(command))
            CHECK_MESSAGE(holds(plain, "\\fB" + option + "\\fR"), command << " " << option);
    }
    CHECK(holds(plain, "wisp " + found_in(wisp("version").out, "^wisp (.*)")[0]));
    write("wisp.1", page);
    if (run("command -v man").status != 0) return;
    const Ran shown = run("man --warnings -l " + file("wisp.1"));
    CHECK(shown.status == 0);
    CHECK(shown.err == "");
}

TEST_CASE_FIXTURE(ManualTest, "manual: bash completes every command and option, and the words of their values") {
    write("wisp.bash", made("bash"));
    const std::string names = completed("wisp \"\"");
    for (const std::string &command : commands()) {
        CHECK_MESSAGE(holds(names, " " + command + " "), command);
        const std::string options = completed("wisp " + command + " -");
        for (const std::string &option : options_of(command))
            CHECK_MESSAGE(holds(options, " " + option + " "), command << " " << option);
    }
    CHECK(completed("wisp v") == " version \n");
    CHECK(completed("wisp show d") == " density depth \n");
    CHECK(completed("wisp help in") == " inspect info \n");
    CHECK(completed("wisp render a.aff --arith f") == " f32 f64 fixed \n");
    CHECK(completed("wisp render a.aff --arith = fi") == " fixed \n"); // as bash has --arith=fi
    CHECK(completed("wisp render a.aff --arith =") == " f32 f64 fixed \n");
    CHECK(completed("wisp render a.aff --size -o \"\"") == "  \n"); // then files are
}

TEST_CASE_FIXTURE(ManualTest, "manual: zsh and fish complete every command and option") {
    const std::string zsh = made("zsh"), fish = made("fish");
    for (const std::string &command : commands()) {
        CHECK_MESSAGE(holds(zsh, "'" + command + ":"), command);
        CHECK_MESSAGE(holds(fish, " -a " + command + " "), command);
        const size_t start = zsh.find("\n" + command + ")\n");
        REQUIRE(start != std::string::npos);
        const std::string here = zsh.substr(start, zsh.find(";;", start) - start);
        for (const std::string &option : options_of(command)) {
            CHECK_MESSAGE((holds(here, "*" + option + "=[") || holds(here, "*" + option + "[")),
                          command << " " << option);
            CHECK_MESSAGE(holds(fish, "from " + command + "' -l " + option.substr(2) + " "), command << " " << option);
        }
    }
    write("wisp.zsh", zsh);
    write("wisp.fish", fish);
    for (const std::string shell : {"zsh", "fish"})
        if (run("command -v " + shell).status == 0) CHECK(run(shell + " -n " + file("wisp." + shell)).status == 0);
    if (run("command -v fish").status != 0) return;
    const auto offered = [&](const std::string &line) {
        return run("fish -c 'source " + file("wisp.fish") + "; complete -C \"" + line + "\"'").out;
    };
    CHECK(offered("wisp show d") == "density\ndepth\n"); // no files
    CHECK(!holds(offered("wisp show density d"), "depth"));
}
