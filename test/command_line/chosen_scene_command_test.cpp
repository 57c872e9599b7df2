// Files of smoke by themselves, without a scene.
#include "support/command_line.h"

using namespace wisp;

TEST_CASE_FIXTURE(CommandLineTest, "a file of smoke by itself is rendered, by the scene that --write-scene leaves") {
    write("g.vol", volume(18, 24, 12, 1, 1, 1, std::vector<float>(5184, 0.5f)));
    for (const std::string name : {"puff.vtk", "g.vol"}) {
        const std::string more = " --photons 200k --size 24x16 --digest --write-scene ";
        const Ran alone = wisp("render " + file(name) + " -o " + file("a.pfm") + more + file("chosen.aff"));
        CHECK(alone.status == 0);
        CAPTURE(alone.err);
        CHECK(alone.err.empty());
        const Ran scene =
            wisp("render " + file("chosen.aff") + " -o " + file("b.pfm") + " --photons 200k --size 24x16");
        CHECK(scene.status == 0);
        CHECK(text_of(file("a.pfm")) == text_of(file("b.pfm")));
        CHECK(text_of(file("chosen.aff")).find("smoke " + name + " {") != std::string::npos);
        CHECK(wisp("plan " + file(name)).status == 0);
        CHECK(wisp("inspect " + file(name) + " 3 4 --photons 500 --size 24x16").status == 0);
    }
}

TEST_CASE_FIXTURE(CommandLineTest, "a grid's name may have blanks, also in the scene that is chosen, but no quotes") {
    const auto render_grid = [&](const std::string &name) {
        std::string bytes = text_of("test/corpus/volume/fog_zip.nvdb");
        const std::string old = "ls2fog_sphere";
        REQUIRE(name.size() == old.size());
        for (size_t at; (at = bytes.find(old)) != std::string::npos;) bytes.replace(at, old.size(), name);
        write("g.nvdb", bytes);
        return wisp("render " + file("g.nvdb") + " --grid '" + name + "' --photons 500 --size 9x7 -q -o " +
                    file("a.pfm") + " --write-scene " + file("c.aff"));
    };
    const Ran ran = render_grid("fog of a ball");
    CHECK_MESSAGE(ran.status == 0, ran.err);
    CHECK(wisp("render " + file("c.aff") + " --photons 500 --size 9x7 -q -o " + file("b.pfm")).status == 0);
    CHECK(text_of(file("a.pfm")) == text_of(file("b.pfm")));
    refuses(render_grid("fog of \"ball\""), 3,
            file("g.nvdb") + ": '\"' or a line end in the name, expected none: a scene cannot name such a grid");
}

TEST_CASE_FIXTURE(CommandLineTest, "a scene written to another folder names the file from there") {
    std::filesystem::create_directory(file("below"));
    const std::string options = " --photons 500 --size 9x7 -q -o ";
    CHECK(
        wisp("render " + file("puff.vtk") + options + file("a.pfm") + " --write-scene " + file("below/c.aff")).status ==
        0);
    CHECK(text_of(file("below/c.aff")).find("smoke ../puff.vtk {") != std::string::npos);
    CHECK(wisp("render " + file("below/c.aff") + options + file("b.pfm")).status == 0);
    CHECK(text_of(file("a.pfm")) == text_of(file("b.pfm")));
}

TEST_CASE_FIXTURE(CommandLineTest, "a sequence of files by itself has a picture for each") {
    write("s_7.vtk", puff(30));
    write("s_8.vtk", puff(50));
    const Ran ran = wisp("render " + file("s_%d.vtk") + " --photons 500 --size 9x7 -q --digest -o " + file("o_%d.pfm"));
    CHECK(ran.status == 0);
    CHECK(lines(ran.out) == 2);
    CHECK(text_of(file("o_0.pfm")) != text_of(file("o_1.pfm")));

    CHECK(wisp("plan " + file("s_%d.vtk")).err.empty());
    write("s_10.vtk", puff(40));
    const Ran gap = wisp("render " + file("s_%d.vtk") + " --photons 200k --size 9x7 --digest");
    CHECK(lines(gap.out) == 2);
    CHECK(gap.err == file("s_%d.vtk") + ": warning: no file has number 9: the 2 before it are the frames, and those "
                                        "from 10 on are left out\n");
}

TEST_CASE_FIXTURE(CommandLineTest, "what is no smoke, and options that have no meaning, are refused in a line") {
    const auto refused = [&](const std::string &arguments, int status, const std::string &text) {
        const Ran ran = wisp(arguments + " -o " + file("a.png"));
        CHECK(ran.status == status);
        CHECK(lines(ran.err) == 1);
        CHECK(ran.err.find(text) != std::string::npos);
    };
    refused("render " + s() + " --up z", 2, "option 'up' is for a file of smoke by itself, found a scene");
    refused("render " + file("none.vtk") + " --up z", 3, "cannot be opened");
    refused("render " + s() + " --write-scene " + file("c.aff"), 2, "option 'write-scene' is for a file of smoke");
    refused("render " + file("puff.vtk") + " --up x", 2, "expected y, z");
    refused("render " + file("puff.vtk") + " --ground maybe", 2, "expected yes, no");
    refused("render " + file("none_%d.vtk"), 3, "no file has a name like this");
    write("empty.vtk", puff(0));
    refused("render " + file("empty.vtk"), 3, "no smoke, expected particles");
    write("cut.vtk", puff(40).substr(0, 200));
    refused("render " + file("cut.vtk"), 3, "cut.vtk:");
    write("a\"b.vtk", puff(40));
    refused("render '" + file("a\"b.vtk") + "'", 3, "'\"' or a line end in the name");
    refused("render " + file("puff.vtk") + " --write-scene " + file("no/c.aff"), 5, "could not be written");
    write("s2.aff", scene("puff.vtk", "render up z\n"));
    refused("render " + file("s2.aff"), 3, "option 'up' in a scene");
}

TEST_CASE_FIXTURE(CommandLineTest, "a file whose name has blanks is rendered, and named in quotes in its scene") {
    const std::string options = " --size 9x7 --photons 0 ";
    for (const std::string name : {"a b.vtk", "a#b{c}.vtk", "50%.vtk"}) {
        CAPTURE(name);
        write(name, puff(40));
        REQUIRE(wisp("render '" + file(name) + "'" + options + "-o " + file("a.pfm")).status == 0);
        REQUIRE(wisp("plan '" + file(name) + "'" + options + "--write-scene " + file("chosen.aff")).status == 0);
        CHECK(text_of(file("chosen.aff")).find("smoke \"" + name + "\" {") != std::string::npos);
        REQUIRE(wisp("render " + file("chosen.aff") + options + "-o " + file("b.pfm")).status == 0);
        CHECK(text_of(file("a.pfm")) == text_of(file("b.pfm")));
    }
}

TEST_CASE_FIXTURE(CommandLineTest, "smoke without any light gets two, which are said in a line; what shines does not") {
    const std::string view = "v from 3 1 5 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 8 6\n";
    write("dark.aff", view + "smoke box -1 -1 -1 1 1 1 1 { }\n");
    const Ran ran = wisp("render " + file("dark.aff") + " --photons 1000 -o " + file("a.pfm"));
    CHECK(ran.status == 0);
    const std::string err = without_noise(ran.err);
    CHECK(lines(err) == 1);
    const std::string said = "chosen, as there is no light: ";
    REQUIRE(err.rfind(said, 0) == 0);
    // The same lights, written down.
    const size_t second = err.find(" and ld ");
    REQUIRE(second != std::string::npos);
    write("lit.aff", view + err.substr(said.size(), second - said.size()) + "\n" + err.substr(second + 5) +
                         "smoke box -1 -1 -1 1 1 1 1 { }\n");
    CHECK(without_noise(wisp("render " + file("lit.aff") + " --photons 1000 -o " + file("b.pfm")).err).empty());
    CHECK(wisp("compare " + file("a.pfm") + " " + file("b.pfm") + " --tolerance 1e-5").status == 0);
    for (const char *const smoke : {"emission 1 1 1", "albedo 0 0 0", ""}) {
        write("s.aff", view + (*smoke ? "" : "b 1 1 1\n") + "smoke box -1 -1 -1 1 1 1 1 { " + smoke + " }\n");
        CHECK(wisp("plan " + file("s.aff")).err.find("chosen") == std::string::npos);
    }
}

TEST_CASE_FIXTURE(CommandLineTest, "what a scene leaves out is chosen, and said in a line") {
    write("bare.aff", "lp 3 3 3 40 40 40\nsmoke puff.vtk {\n}\n");
    const Ran ran = wisp("render " + file("bare.aff") + " --photons 0 --size 9x7 -o " + file("a.pfm"));
    CHECK(ran.status == 0);
    CHECK(lines(ran.err) == 2);
    CHECK(ran.err.rfind(file("bare.aff") + ":2: chosen for what the smoke leaves out: radius ", 0) == 0);
    CHECK(ran.err.find("\nchosen, as there is no view: v from ") != std::string::npos);
    CHECK(wisp("plan " + file("bare.aff") + " -q").err.empty());
    // With what was said written into it, the scene is the same.
    const size_t begin = ran.err.find("out: ") + 5, view = ran.err.find("v from");
    write("full.aff", ran.err.substr(view, ran.err.find('\n', view) - view) +
                          "\nlp 3 3 3 40 40 40\nsmoke puff.vtk {\n" +
                          ran.err.substr(begin, ran.err.find('\n') - begin) + "\n}\n");
    CHECK(wisp("render " + file("full.aff") + " --photons 0 --size 9x7 -o " + file("b.pfm")).err.empty());
    const Ran same = wisp("compare " + file("a.pfm") + " " + file("b.pfm") + " --tolerance 0.005");
    CHECK(same.status == 0); // numbers are said with four digits
}

TEST_CASE_FIXTURE(CommandLineTest, "where smoke that would have chosen the camera cannot be read, that is the error") {
    write("bare.aff", "smoke none.vtk {\n}\n");
    CHECK(wisp("plan " + file("bare.aff")).err ==
          file("bare.aff") + ":1: error: " + file("none.vtk") + ": cannot be opened: No such file or directory\n");
}

TEST_CASE_FIXTURE(CommandLineTest, "a scene may come from a pipe, and so may its smoke") {
    const std::string options = " --photons 500 -q -o ";
    write("s.aff", scene(file("puff.vtk"), ""));
    CHECK(wisp("render " + s() + options + file("a.pfm")).status == 0);
    CHECK(run("cat " + s() + " | " + built("wisp") + " render /dev/stdin" + options + file("b.pfm")).status == 0);
    CHECK(text_of(file("a.pfm")) == text_of(file("b.pfm")));
    write("p.aff", scene(file("pipe"), ""));
    CHECK(run("mkfifo " + file("pipe") + "; cat " + file("puff.vtk") + " > " + file("pipe") + " & " + built("wisp") +
              " render " + file("p.aff") + options + file("c.pfm"))
              .status == 0);
    CHECK(text_of(file("a.pfm")) == text_of(file("c.pfm")));
}
