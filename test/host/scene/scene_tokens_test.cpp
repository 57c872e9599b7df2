// Words, comments, and files in files.
#include "host/base/error.h"
#include "host/scene/scene_file.h"
#include "host/scene/scene_tokens.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"
#include <doctest/doctest.h>

using namespace wisp;

namespace {

const std::string dot = "s 0 0 0 1 ";

// A scene of files by name, of which `s.aff` is the outermost; and how often each was read.
struct Files {
    std::map<std::string, std::string> text;
    std::map<std::string, int> reads = {};
    SceneLimits limits = {};

    SceneFile parse() {
        return parse_scene(
            "s.aff", text["s.aff"],
            [this](const std::string &path) {
                ++reads[path];
                if (!text.count(path)) throw InputError(path, "cannot be opened: lost");
                return Bytes(text[path].begin(), text[path].end());
            },
            limits);
    }
    std::string error() {
        return refusal_of([&] { parse(); });
    }
};

} // namespace

TEST_CASE("scene files: comments behind numbers, any white space, any bytes, no last line end") {
    const SceneFile s = parse_scene("a", "# 50\xc3 \xff%\r\na -1 5 300%d frames\r\nb\t1\f2\v3#{\r\n"
                                         "x a{x b{s 0 0 0 1}}xs 1 1 1 0 0 1 0 5 -05.e-01 +.5{s 0 0 0 1}");
    REQUIRE(s.animation);
    CHECK(s.animation->start == -1);
    CHECK(s.animation->end == 5);
    CHECK(s.animation->frames == 300);
    CHECK(s.background.z == 3);
    REQUIRE(s.graph.nodes.size() == 3);
    CHECK(s.graph.nodes[1].name == "b");
    CHECK(s.graph.nodes[2].placement.translation.y == -0.5);
    CHECK(s.graph.nodes[2].placement.translation.z == 0.5);
    CHECK(s.graph.meshes.size() == 2);
}

TEST_CASE("scene files: a name in double quotes may hold blanks, braces and signs of comments") {
    Files files = {{{"s.aff", "i 0 \"a b/c {#}.aff\"smoke \"p %04d%.ply\"{}"}, {"a b/c {#}.aff", dot}}};
    const SceneFile s = files.parse();
    CHECK(s.graph.meshes.size() == 1);
    REQUIRE(s.smokes.size() == 1);
    CHECK(s.smokes[0].file == "p %04d%.ply");
    files.text["s.aff"] = "\n i 0 \"a b\n\"";
    CHECK(files.error() == "s.aff:2: the line ends in a name in quotes, expected '\"' behind the name");
    files.text["s.aff"] = "i 0 \"";
    CHECK(files.error() == "s.aff:1: the line ends in a name in quotes, expected '\"' behind the name");
    files.text["s.aff"] = "i 0 \"\"";
    CHECK(files.error() == "s.aff:1: an empty name in quotes, expected a name");
}

TEST_CASE("scene files: a name of a file is written so that it is read back") {
    for (const std::string name : {"a.vtk", "a_%04d.vtk", "a b.vtk", "a#b{c}.vtk", "50%.vtk", "50%_%04d.vtk", "a\tb"}) {
        CAPTURE(name);
        const SceneFile s = parse_scene("s.aff", "smoke " + name_word(name).value() + " {}");
        REQUIRE(s.smokes.size() == 1);
        CHECK(s.smokes[0].file == name);
    }
    CHECK(name_word("a_%04d.vtk") == "a_%04d.vtk");
    CHECK_FALSE(name_word("a\"b"));
    CHECK_FALSE(name_word("a\nb"));
    CHECK_FALSE(name_word(""));
}

TEST_CASE("scene files: one is included in place, beside the file that names it, and read once") {
    Files files = {
        {{"s.aff", "fm 1 1 1 1 1 1 0 0 0 1 0 0 i 0 sub/a.aff " + dot + " x n { i 0 sub/a.aff } i 0 /abs.aff"},
         {"sub/a.aff", dot + "f 1 0 0 1 0 1 0 0 i 0 b.aff"},
         {"sub/b.aff", "tt t.ppm 0 0 0 0 0 1 0 0 0 0 0 1 0 0 0"},
         {"/abs.aff", "tt t.ppm 0 0 0 0 0 1 0 0 0 0 0 1 0 0 0 smoke p.ply {}"}}};
    const SceneFile s = files.parse();
    CHECK(files.reads == std::map<std::string, int>{{"sub/a.aff", 1}, {"sub/b.aff", 1}, {"/abs.aff", 1}});
    REQUIRE(s.graph.textures.size() == 2);
    CHECK(s.graph.textures[0].path == "sub/t.ppm");
    CHECK(s.graph.textures[1].path == "/t.ppm");
    REQUIRE(s.smokes.size() == 1);
    CHECK(s.smokes[0].file == "/p.ply");
    CHECK(s.smokes[0].where == "/abs.aff:1");
    // The material goes into included files and comes out of them; the space of the block goes in.
    const int32_t nodes[] = {-1, -1, -1, 0, 0, -1};
    const uint32_t materials[] = {0, 1, 1, 1, 1, 1};
    REQUIRE(s.graph.meshes.size() == 6);
    REQUIRE(s.graph.materials.size() == 2);
    CHECK(s.graph.materials[0].diffuse.y == 1);
    for (size_t i = 0; i < 6; ++i) {
        CAPTURE(i);
        CHECK(s.graph.meshes[i].node == nodes[i]);
        CHECK(s.graph.meshes[i].material == materials[i]);
    }
}

TEST_CASE("scene files: the level of detail decides what is included") {
    Files files = {{{"s.aff", "i 0 a i 1 lost d 2 i 2 a i 3 lost i -7 b i 2 a"}, {"a", dot}, {"b", "d 1"}}};
    // `b` lowers the level: the last include is none.
    CHECK(files.parse().graph.meshes.size() == 2);
    CHECK(files.reads == std::map<std::string, int>{{"a", 1}, {"b", 1}});
}

TEST_CASE("scene files: what an included file may not do, with its line") {
    const struct {
        std::string text, a, error;
    } cases[] = {
        {"b 0 0 0\ni 0 lost", "", "s.aff:2: include of lost: cannot be opened: lost"},
        {"i 0 a", "\n\nb 1 1 x", "a:3: found 'x', expected a number: blue of 0 or more of the background"},
        {"i 0 a\n b x", "b 1 1 1\n", "s.aff:2: found 'x', expected a number: red of 0 or more of the background"},
        {"i 0 a 1", "\nb 1 1", "a:2: the file ends, expected blue of 0 or more of the background"},
        {"i 0 a }", "\nx n {\n" + dot, "a:3: the file ends, expected '}' for the block of line 2"},
        {"x n {\ni 0 a", "", "s.aff:2: the file ends, expected '}' for the block of line 1"},
        {"x n { i 0 a", "}", "a:1: found '}', expected a statement: no block is open in this file"},
        {"i 0 a\n}", "", "s.aff:2: found '}', expected a statement: no block is open in this file"},
        {"i 0 s.aff", "", "s.aff:1: 's.aff' includes itself, expected no circle of includes"},
        {"i 0 a", "\ni 0 s.aff", "a:2: 's.aff' includes itself, expected no circle of includes"},
        {"i 0 {", "", "s.aff:1: found '{', expected a file to include"},
        {"i 0.5 a", "",
         "s.aff:1: found '0.5', expected a whole number from -1000000000 to 1000000000: the level of detail"},
    };
    for (const auto &c : cases) {
        CAPTURE(c.text);
        Files files = {{{"s.aff", c.text}, {"a", c.a}}};
        CHECK(files.error() == c.error);
    }
}

TEST_CASE("scene files: a bomb of includes is refused") {
    const auto limited = [](size_t SceneLimits::*limit, size_t most) {
        Files files = {{{"s.aff", "i 0 a i 0 a"}, {"a", "i 0 b i 0 b"}, {"b", dot + dot}}};
        files.limits.*limit = most;
        return files.error();
    };
    const size_t triangles = parse_scene("s", dot).graph.meshes[0].rows.size();
    const struct {
        size_t SceneLimits::*limit;
        size_t fits;
        std::string what;
    } cases[] = {
        {&SceneLimits::depth, 2, "a:1: more than 1 files in one another, expected no more"},
        {&SceneLimits::includes, 6, "a:1: more than 5 included files, expected no more"},
        {&SceneLimits::words, 2 * 6 + 4 * 10, "a:1: more than 51 words in included files, expected no more"},
        {&SceneLimits::bytes, 11 + 11 + 20, "a:1: more than 41 bytes in all files of a scene, expected no more"},
        {&SceneLimits::triangles, 8 * triangles,
         "b:1: more than " + std::to_string(8 * triangles - 1) + " triangles, expected no more"},
    };
    for (const auto &c : cases) {
        CAPTURE(c.what);
        CHECK(limited(c.limit, c.fits) == "no error");
        CHECK(limited(c.limit, c.fits - 1) == c.what);
    }
    // As they are by default: for 2^40 includes, and for a file that includes itself by other names.
    Files files = {{{"s.aff", "i 0 0"}}};
    for (int i = 0; i < 40; ++i)
        files.text[std::to_string(i)] = "i 0 " + std::to_string(i + 1) + "\ni 0 " + std::to_string(i + 1);
    files.text["40"] = "b 0 0 0";
    CHECK(files.error().find(":1: more than 100000 included files, expected no more") != std::string::npos);
    TemporaryFolder folder;
    write_file(folder.file("s.aff"), std::string("i 0 ./s.aff"));
    CHECK_THROWS_WITH(read_scene(folder.file("s.aff")),
                      doctest::Contains("s.aff:1: more than 64 files in one another, expected no more"));
}

TEST_CASE("scene files: from a disk; devices are refused") {
    TemporaryFolder folder;
    write_file(folder.file("s.aff"), "i 0 a.aff\n" + dot);
    write_file(folder.file("a.aff"), dot);
    CHECK(read_scene(folder.file("s.aff")).graph.meshes.size() == 2);
    write_file(folder.file("s.aff"), std::string("\ni 0 /dev/zero"));
    CHECK_THROWS_WITH(read_scene(folder.file("s.aff")),
                      (folder.file("s.aff") + ":2: include of /dev/zero: cannot be read: not a plain file").c_str());
    write_file(folder.file("s.aff"), std::string("\ni 0 none.aff"));
    CHECK_THROWS_WITH(read_scene(folder.file("s.aff")),
                      (folder.file("s.aff") + ":2: include of " + folder.file("none.aff") +
                       ": cannot be opened: No such file or directory")
                          .c_str());
}

TEST_CASE("scene files: counts never claim more than the file has") {
    const struct {
        const char *text, *error;
    } cases[] = {
        {"m vertices 4000000000 0",
         "s.aff:1: found '4000000000', expected a whole number from 1 to 2147483647: the mesh's vertices"},
        {"m vertices 2000000000\n0", "s.aff:1: found '2000000000', but the file has only 1 words more, expected 3 for "
                                     "each: the mesh's vertices"},
        {"p 1000000000 0 0 0", "s.aff:1: found '1000000000', but the file has only 3 words more, expected 3 for each: "
                               "the polygon's corners"},
        {"pp 3 0 0 0", "s.aff:1: found '3', but the file has only 3 words more, expected 6 for each: the patch's "
                       "corners"},
        {"tpa 2147483647", "s.aff:1: found '2147483647', but the file has only 0 words more, expected 19 for each: "
                           "the triangle's times"},
        {"k a { transl 2000000000 0", "s.aff:1: found '2000000000', but the file has only 1 words more, expected 7 "
                                      "for each: the keys of 'transl'"},
        {"k a { visibility 3 0 1 }", "s.aff:1: found '3', but the file has only 3 words more, expected 2 for each: "
                                     "the keys of 'visibility'"},
    };
    for (const auto &c : cases) {
        CAPTURE(c.text);
        Files files = {{{"s.aff", c.text}}};
        CHECK(files.error() == c.error);
    }
}
