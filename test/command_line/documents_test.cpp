// What the documents show is so: command lines run, scenes render, options exist, links lead somewhere.
#include "support/command_line.h"
#include <map>
#include <regex>
#include <set>

namespace {

using namespace wisp;
using Path = std::filesystem::path;

struct Line {
    Path document;
    int number;
    std::string text;
};

// Lines of code that are no commands of ours to run here, without their comments, and why.
const std::map<std::string, std::string> excused = {
    {"apt-get update && apt-get install -y make && make deps demo", "installs packages"},
    {"tools/cluster/parallel_render 8 frames 0:4 wake_%04d.png fixtures/wake.aff", "`make cluster` runs it"},
    {"tools/cluster/slurm_render 40 crops 2000x1600 still.png scene.aff", "`make cluster` runs it"},
    {"tools/cluster/slurm_render 40 photons 100000000 smoke.png scene.aff", "`make cluster` runs it"},
    {"build/plume --frame 275 -o smoke.vtk", "two minutes"},
    {"build/plume --rate 1500 --frames 200:275:25 -o smoke_%04d.vtk", "minutes"},
    {"build/plume --sph --rate 28 --frame 215 -o fixtures/plume.vtk", "`plume_test` runs it"},
    {"build/tests -tc=\"f32: *furnace*\"", "these are the tests"},
    {"build/tests -sf=\"*kernel_test.cpp\"", "these are the tests"},
    {"build/tests -ltc", "these are the tests"},
    {"tools/embedded/run fixed cortex-m3", "needs an emulator: `make embedded` runs it"},
    {"python3 tools/measure/random_smoke.py --seed 1 --scene 36", "`random_smoke_test` runs it"},
    {"python3 tools/faults memory calls --command stitch -j 1", "`make faults` runs all of it"},
    {"python3 tools/measure/max_error.py", "a measurement, not a check"},
    {"python3 tools/measure/stopping.py build/wisp", "a measurement, not a check"},
    {"python3 tools/measure thin", "a measurement, not a check"},
};

// Options of other programs that documents name.
const std::set<std::string> foreign_options = {
    "--frame",   "--rate", "--sph", // build/plume
    "--scene",                      // tools/measure/random_smoke.py
    "--outfile",                    // imgtool of pbrt
    "--cflags",  "--libs",          // pkg-config
    "--answer",                     // tools/lessons
    "--command", "--most",          // tools/faults
};

std::vector<Path> documents() {
    std::vector<Path> found = {"README.md"};
    for (const char *folder : {"fixtures", "include", "src", "test", "tools"})
        for (const auto &entry : std::filesystem::recursive_directory_iterator(folder))
            if (entry.path().extension() == ".md") found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
}

std::vector<Line> lines_of(const Path &document) {
    std::vector<Line> lines;
    std::ifstream file(document);
    for (std::string text; std::getline(file, text);)
        lines.push_back({document, static_cast<int>(lines.size()) + 1, text});
    return lines;
}

std::string place(const Line &line) { return line.document.string() + ":" + std::to_string(line.number); }

bool matches(const std::string &text, const char *pattern) { return std::regex_search(text, std::regex(pattern)); }

std::string without_comment(const std::string &command) {
    return std::regex_replace(command, std::regex("(\\s+#.*|\\s+)$"), "");
}

// The command lines of a document: code that is indented or between fences, and begins with a program.
std::vector<Line> commands_of(const Path &document) {
    std::vector<Line> commands;
    bool fenced = false;
    for (Line line : lines_of(document)) {
        if (line.text.rfind("```", 0) == 0) fenced = !fenced;
        if (!fenced && line.text.rfind("    ", 0) != 0) continue;
        line.text = std::regex_replace(line.text, std::regex("^ +"), "");
        if (matches(line.text, "^(build/|tools/|(wisp|make|python3|apt-get) )")) commands.push_back(line);
    }
    return commands;
}

// The words of a fence ```scene, one scene each.
std::vector<Line> scenes_of(const Path &document) {
    std::vector<Line> scenes;
    bool inside = false;
    for (const Line &line : lines_of(document)) {
        if (line.text.rfind("```", 0) == 0) {
            inside = line.text == "```scene";
            if (inside) scenes.push_back({document, line.number, ""});
        } else if (inside) {
            scenes.back().text += line.text + "\n";
        }
    }
    return scenes;
}

// A folder in which a reader's commands run as they stand: with build/wisp, with the fixtures made small, and with
// files of the reader's own (smoke.bgeo, smoke.nvdb, scene.aff and side.aff).
struct ReadersFolder : CommandLineTest {
    ReadersFolder() {
        namespace fs = std::filesystem;
        fs::create_directory(file("build"));
        // A file of smoke by itself has no scene that could be made small.
        write("build/wisp",
              "#!/bin/sh\ncase \"$1 $2\" in 'render smoke'*|'render wake_'*) set -- \"$@\" --photons 2000 "
              "--size 64x48 ;; esac\nexec " +
                  fs::absolute(built("wisp")).string() + " \"$@\"\n");
        fs::permissions(file("build/wisp"), fs::perms::owner_all);
        fs::create_directory(file("fixtures"));
        for (const auto &entry : fs::directory_iterator("fixtures")) {
            const std::string name = entry.path().filename().string();
            if (entry.path().extension() == ".aff")
                write("fixtures/" + name, small(text_of(entry.path().string())));
            else
                fs::create_symlink(fs::absolute(entry.path()), file("fixtures/" + name));
            fs::create_symlink("fixtures/" + name, file(name)); // for scenes of the documents
        }
        fs::copy("test/corpus/particles/bgeo.bgeo", file("smoke.bgeo"));
        fs::copy("test/corpus/volume/fog_zip.nvdb", file("smoke.nvdb"));
        write("scene.aff", box("0.5 0.5 6"));
        write("side.aff", box("6 0.5 0.5"));
    }
    static std::string box(const std::string &eye) {
        return "v from " + eye +
               " at 0 0 0 up 0 1 0 angle 35 hither 1 resolution 400 400\nb 0.1 0.1 0.2\n"
               "lp 3 3 3 40 40 40\nsmoke box -1 -1 -1 1 1 1 1 { }\nrender spp 1\nrender photons 3000\n";
    }
    // A scene in 64 x 48 pixels and with 3,000 photons at most.
    static std::string small(std::string scene) {
        scene = std::regex_replace(scene, std::regex("resolution \\d{3} \\d{3}"), "resolution 64 48");
        return std::regex_replace(scene, std::regex("render photons \\d+"), "render photons 3000");
    }
    Ran bash(const std::string &command) const {
        std::ofstream(file("command")) << command << "\n";
        return run("cd " + file("") + " && bash -o pipefail command");
    }
};

// What wisp says it expected instead of a word that it does not know.
std::set<std::string> expected_words(CommandLineTest &folder, const std::string &scene) {
    folder.write("unknown.aff", scene);
    const std::string error = folder.wisp("plan " + folder.file("unknown.aff")).err;
    std::istringstream words(
        std::regex_replace(error, std::regex("^[^]*expected (one of )?|( or a comment)?\\n$|( or)? \\}"), ""));
    std::set<std::string> found;
    for (std::string word; words >> word;) found.insert(word);
    REQUIRE_MESSAGE(found.size() > 3, error);
    return found;
}

// As GitHub names the heading's anchor.
std::string anchor_of(const std::string &heading) {
    std::string anchor;
    for (const char c : std::regex_replace(heading, std::regex("^#+ +"), ""))
        if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
            anchor += static_cast<char>(std::tolower(c));
        else if (c == ' ')
            anchor += '-';
    return anchor;
}

bool has_anchor(const Path &document, const std::string &anchor) {
    const std::vector<Line> lines = lines_of(document);
    return std::any_of(lines.begin(), lines.end(), [&](const Line &line) {
        return line.text.rfind("#", 0) == 0 && anchor_of(line.text) == anchor;
    });
}

// All matches of a pattern's first group.
std::vector<std::string> found_in(const std::string &text, const char *pattern) {
    const std::regex regex(pattern);
    std::vector<std::string> found;
    for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) found.push_back((*it)[1]);
    return found;
}

} // namespace

TEST_CASE("documents: command lines run as they stand, with status 0 or the one that their comment names" *
          doctest::test_suite("long")) {
    std::set<std::string> not_run;
    int ran = 0;
    for (const Path &document : documents()) {
        // `make lessons` runs those of the lessons, and checks what they print: that takes a minute, at full size.
        if (document.string().rfind("fixtures/lessons/", 0) == 0) continue;
        const std::vector<Line> commands = commands_of(document);
        if (commands.empty()) continue;
        const ReadersFolder folder; // of a document: its lines use what those before them made
        for (const Line &line : commands) {
            const std::string command = without_comment(line.text);
            if (excused.count(command)) not_run.insert(command);
            if (excused.count(command) || command.rfind("make ", 0) == 0) continue;
            const std::vector<std::string> status = found_in(line.text, "#.*\\(exit (\\d+)\\)");
            const Ran result = folder.bash(command);
            CHECK_MESSAGE(result.status == (status.empty() ? 0 : std::stoi(status[0])),
                          place(line) << ": " << command << "\n"
                                      << result.out << result.err);
            ++ran;
        }
    }
    for (const auto &[command, why] : excused)
        CHECK_MESSAGE(not_run.count(command) == 1,
                      "no document has the excused line: " << command << " (" << why << ")");
    CHECK(ran > 30);
}

TEST_CASE("documents: what `make` is asked for are its targets") {
    CommandLineTest folder;
    const std::string help = folder.run("make help").out;
    for (const Path &document : documents())
        for (const Line &line : commands_of(document))
            for (const std::string &target : found_in(without_comment(line.text), "\\bmake ([a-z][a-z-]*)(?= |$)"))
                CHECK_MESSAGE(matches("\n" + help, ("\n" + target + " ").c_str()), place(line) << ": make " << target);
}

TEST_CASE("documents: scenes render without a word, and every statement is in one of them") {
    const ReadersFolder folder;
    std::string all;
    for (const Path &document : documents())
        for (const Line &scene : scenes_of(document)) {
            all += std::regex_replace(scene.text, std::regex("#.*"), "");
            std::ofstream(folder.file("example.aff")) << scene.text << "render photons 2000\n";
            const Ran result = folder.bash("build/wisp render example.aff --size 8x8 -o example_%04d.pfm");
            CHECK_MESSAGE((result.status == 0 && without_noise(result.err).find("warning:") == std::string::npos),
                          place(scene) << ":\n"
                                       << scene.text << result.err);
        }
    CommandLineTest unknown;
    std::set<std::string> words = expected_words(unknown, "zz");
    words.merge(expected_words(unknown, "smoke puff.vtk { zz"));
    words.merge(expected_words(unknown, "k a { zz"));
    for (const std::string &word : words)
        CHECK_MESSAGE(matches(all, ("(^|[\\s{])" + word + "\\b").c_str()), "no document shows `" << word << "`");
}

TEST_CASE("documents: the options that they name are options") {
    const std::string help = CommandLineTest().wisp("help").out;
    int named = 0;
    for (const Path &document : documents())
        for (const Line &line : lines_of(document))
            for (const std::string &option : found_in(line.text, "(?:^|[^-\\w])(--[a-z][a-z-]*[a-z])")) {
                CHECK_MESSAGE((foreign_options.count(option) || matches(help, (option + "[ ,.|]").c_str())),
                              place(line) << ": " << option);
                ++named;
            }
    CHECK(named > 100);
}

TEST_CASE("documents: links lead to a page and a heading, and README.md leads to every page") {
    std::set<std::string> reached = {"README.md"};
    std::vector<Path> left = {"README.md"};
    while (!left.empty()) {
        const Path document = left.back();
        left.pop_back();
        for (const Line &line : lines_of(document))
            for (const std::string &link : found_in(line.text, "\\]\\(([^)]+)\\)")) {
                if (link.rfind("http", 0) == 0) continue;
                const size_t hash = std::min(link.find('#'), link.size());
                const Path page =
                    hash == 0 ? document : (document.parent_path() / link.substr(0, hash)).lexically_normal();
                CHECK_MESSAGE(std::filesystem::exists(page), place(line) << ": " << link);
                if (page.extension() != ".md" || !std::filesystem::exists(page)) continue;
                if (hash < link.size())
                    CHECK_MESSAGE(has_anchor(page, link.substr(hash + 1)), place(line) << ": " << link);
                if (reached.insert(page.string()).second) left.push_back(page);
            }
    }
    for (const Path &document : documents())
        CHECK_MESSAGE(reached.count(document.string()) == 1, "no link leads to " << document.string());
}
