// Pictures in parts that are rendered apart, together again, bit by bit what one run makes; and every refusal.
#include "host/results/picture_record.h"
#include "support/command_line.h"
#include "wisp/settings.h"

using namespace wisp;

namespace {

struct Table : CommandLineTest {
    Table() {
        write("p.aff", lit("puff.vtk { radius 0.3 mass 1 extinction 0.02 phase 0.3 }"));
        write("b.aff",
              lit("box -1 -1 -1 1 1 1 0.15 { phase 0.3 emission 0.2 0.1 0 }\nsmoke puff.vtk { radius 0.3 mass 1 "
                  "extinction 0.001 }"));
    }
    // A part, and its name behind a space.
    std::string part(const std::string &command, int i, const Crop &crop) const {
        const auto number = [](int n) { return std::to_string(n); };
        const std::string name = file("p" + number(i) + ".pfm");
        const Ran ran = wisp(command + " --crop " + number(crop.x0) + "," + number(crop.y0) + "," + number(crop.x1) +
                             "," + number(crop.y1) + " -o " + name);
        REQUIRE(ran.status == 0);
        return " " + name;
    }
    // The crop in parts, cut where chance says.
    static std::vector<Crop> cut(const Crop &whole, int parts, uint32_t &state) {
        if (parts == 1) return {whole};
        state = state * 1664525u + 1013904223u;
        const bool across = whole.x1 - whole.x0 > whole.y1 - whole.y0;
        const int length = across ? whole.x1 - whole.x0 : whole.y1 - whole.y0, first = (parts + 1) / 2;
        const int at = length * first / parts + static_cast<int>((state >> 16) % 3) - 1;
        Crop a = whole, b = whole;
        (across ? a.x1 : a.y1) = (across ? b.x0 : b.y0) = (across ? whole.x0 : whole.y0) + at;
        std::vector<Crop> all = cut(a, first, state), rest = cut(b, parts - first, state);
        all.insert(all.end(), rest.begin(), rest.end());
        return all;
    }
};

} // namespace

TEST_CASE("stitch command: a picture in 2, 3 and 7 parts is that of one run, as .pfm and as .png") {
    const Table test;
    const std::string surfaces = "render fixtures/surfaces.aff -q --spp 1 --frames 2 --size 40x31",
                      smoke = "render " + test.file("b.aff") + " -q --size 40x31 ",
                      particles = "render " + test.file("p.aff") + " -q --size 40x31 ";
    uint32_t state = 5;
    for (const std::string &command :
         {surfaces, surfaces + " --arith f64 --shadows exact", surfaces + " --arith fixed", particles,
          particles + " --irradiance adaptive --arith fixed", smoke + "--smoke map", smoke + "--smoke volume",
          smoke + "--smoke direct --irradiance adaptive", smoke + "--smoke map --irradiance none",
          smoke + "--smoke direct --irradiance none", smoke + "--reference --passes 0:2 --arith fixed"}) {
        CAPTURE(command);
        REQUIRE(test.wisp(command + " -o " + test.file("one.pfm") + " -o " + test.file("one.png")).status == 0);
        for (int parts : {2, 3, 7}) {
            std::string names, turned;
            int i = 0;
            for (const Crop &crop : Table::cut({0, 0, 40, 31}, parts, state)) {
                const std::string name = test.part(command, i++, crop);
                names += name;
                turned = name + turned;
            }
            for (const std::string &order : parts == 7 ? std::vector{names, turned} : std::vector{names}) {
                const Ran ran = test.wisp("stitch" + order + " -o " + test.file("all.pfm") + " --digest -o " +
                                          test.file("all.png"));
                CHECK(ran.status == 0);
                CHECK(ran.err.empty());
                CHECK(test.same("all.pfm", "one.pfm"));
                CHECK(test.same("all.png", "one.png"));
                CHECK(ran.out.substr(64) == "  " + test.file("all.pfm") + "\n");
            }
        }
    }
    CHECK(!test.has("all.pfm.wisp"));
}

TEST_CASE("stitch command: parts and the whole may be .exr, which carries its record") {
    Table test;
    const std::string command = "render fixtures/surfaces.aff -q --spp 1 --frames 2 --size 40x31 ";
    REQUIRE(test.wisp(command + "-o " + test.file("one.exr") + " -o " + test.file("one.pfm")).status == 0);
    const std::string top = test.file("top.exr"), rest = test.file("rest.exr"), low = test.file("low.pfm");
    REQUIRE(test.wisp(command + "--crop 0,0,40,9 -o " + top).status == 0);
    REQUIRE(test.wisp(command + "--crop 0,9,40,31 -o " + rest + " -o " + low).status == 0);
    CHECK(!test.has("top.exr.wisp"));
    for (const std::string &other : {rest, low}) {
        const Ran ran =
            test.wisp("stitch " + top + " " + other + " -o " + test.file("all.exr") + " -o " + test.file("all.pfm"));
        CHECK(ran.err.empty());
        CHECK(test.same("all.exr", "one.exr"));
        CHECK(test.same("all.pfm", "one.pfm"));
    }
    const auto refuses = [&](const std::string &line) {
        test.refuses(test.wisp("stitch " + top + " " + rest + " -o " + test.file("x.exr")), 3, line);
        CHECK(!test.has("x.exr"));
    };
    const std::string whole = text_of(top);
    std::string other = whole;
    other[other.find("screenWindowWidth")] = 'S'; // what says nothing about pixels
    test.write("top.exr", other);
    refuses(top + ": not the picture of its record, expected the one as rendered");
    test.write("top.exr", whole.substr(0, 100));
    refuses("");
    other = whole;
    other[other.find("crop 0") + 5] = '1';
    test.write("top.exr", other);
    refuses("");
    test.write("top.exr", text_of(test.file("one.exr")));
    refuses(top + ": no record of what it shows, expected a picture of --crop as rendered");
    test.write("top.exr", text_of(low));
    refuses(top + ": byte 0: this is not an EXR, expected its magic number");
}

TEST_CASE("stitch command: frames and batches of photons in 2, 3 and 7 parts are those of one run") {
    const Table test;
    const std::string frames = "render fixtures/surfaces.aff -q --spp 1 --size 20x15 --frame-count 14 --digest -o ";
    const Ran one = test.wisp(frames + test.file("one_%02d.pfm"));
    const std::string smoke = "render " + test.file("b.aff") + " --smoke map --photons 65000 ";
    const std::string picture = test.wisp(smoke + "--digest").out;
    for (int parts : {2, 3, 7}) {
        std::string maps;
        for (int i = 0; i < parts; ++i) {
            const std::string number = std::to_string(i);
            CHECK(test.wisp(frames + test.file("all_%02d.pfm") + " --frames " + number + ":13:" + std::to_string(parts))
                      .status == 0);
            maps += " " + test.file(number + ".map");
            CHECK(test.wisp(smoke + "--batches " + std::to_string(16 * i / parts) + ":" +
                            std::to_string(16 * (i + 1) / parts) + " --map-out " + test.file(number + ".map"))
                      .status == 0);
        }
        for (int i = 0; i < 14; ++i) {
            const std::string number = (i < 10 ? "0" : "") + std::to_string(i);
            CHECK(test.same("one_" + number + ".pfm", "all_" + number + ".pfm"));
            for (const char *kind : {".pfm", ".pfm.wisp"}) std::filesystem::remove(test.file("all_" + number + kind));
        }
        CHECK(test.wisp("merge" + maps + " -o " + test.file("all.map")).status == 0);
        CHECK(test.wisp(smoke + "--digest --map-in " + test.file("all.map")).out == picture);
    }
}

TEST_CASE("stitch command: parts that are no whole are refused in one line, and nothing is written") {
    Table test;
    const std::string command = "render fixtures/surfaces.aff -q --spp 1 --frames 2 --size 8x6";
    const std::string a = test.part(command, 0, {0, 0, 3, 6}), b = test.part(command, 1, {3, 0, 8, 4}),
                      c = test.part(command, 2, {3, 4, 8, 6}), over = test.part(command, 3, {2, 4, 8, 6});
    const auto refuses = [&](const std::string &parts, int status, const std::string &line) {
        CAPTURE(parts);
        test.refuses(test.wisp("stitch" + parts + " -o " + test.file("x.pfm")), status, line);
        CHECK(!test.has("x.pfm"));
    };
    const auto name = [](const std::string &part) { return part.substr(1); };
    refuses(a + b + over, 3, name(over) + ": pixel 2,4 is in " + name(a) + " too, expected parts that do not overlap");
    refuses(a + b + b, 3, name(b) + ": pixel 3,0 is in " + name(b) + " too, expected parts that do not overlap");
    const std::string missing = ": of its picture's 8 x 6 pixels no part has ";
    refuses(a + b, 3, name(a) + missing + "3,4, expected all");
    refuses(c + b, 3, name(c) + missing + "0,0, expected all");
    refuses(c + a, 3, name(c) + missing + "3,0, expected all");
    refuses(a, 3, name(a) + missing + "3,0, expected all");
    for (const std::string other : {"--frames 3", "--spp 2", "--arith f64", "--size 9x6", "--depth 1"}) {
        const std::string d = test.part(command + " " + other, 4, {3, 4, 8, 6});
        refuses(a + b + d, 3,
                name(d) + ": a part of another picture than " + name(a) +
                    ": another scene, frame, size, options, arithmetic or version, expected the same");
    }
    refuses("", 2, "found no part to stitch, expected .pfm or .exr files of --crop");
    refuses(a + " x.png", 2, "found 'x.png' to stitch, expected a .pfm or .exr file of --crop");
    refuses(a + " --spp 2", 2,
            "there is no option '--spp' of stitch, expected --output, --exposure, --digest, --quiet or --verbose");
    refuses(a + " -o x.map", 2, "option 'output': found 'x.map', expected .pfm, .exr or .png of stitch");
    test.refuses(test.wisp("stitch" + a), 2, "found nothing to make of the parts, expected --output or --digest");
    // A picture that is no part, one without its record, with that of another, and damaged ones.
    const std::string none = test.file("none.pfm");
    test.wisp(command + " -o " + none);
    refuses(" " + none, 3, none + ".wisp: cannot be opened: No such file or directory");
    refuses(" " + test.file("nowhere.pfm"), 3,
            test.file("nowhere.pfm.wisp: cannot be opened: No such file or directory"));
    const std::string record = text_of(name(c) + ".wisp"), picture = text_of(name(c));
    test.write("none.pfm.wisp", record);
    refuses(a + b + " " + none, 3, none + ": not the picture of " + none + ".wisp, expected the one as rendered");
    test.write("p2.pfm", picture.substr(0, picture.size() - 1) + "x");
    refuses(a + b + c, 3, name(c) + ": not the picture of " + name(c) + ".wisp, expected the one as rendered");
    test.write("p2.pfm", picture.substr(0, picture.size() - 1));
    refuses(a + b + c, 3, name(c) + ": byte 12: 119 bytes of pixels, expected 120");
    test.write("p2.pfm", picture);
    test.write("p2.pfm.wisp", record.substr(0, record.size() - 2));
    refuses(a + b + c, 3,
            name(c) + ".wisp:2: the file is damaged: its SHA-256 is another, expected " + record.substr(22, 64));
    test.write("p2.pfm.wisp", "P5");
    refuses(a + b + c, 3, name(c) + ".wisp:1: not a record of a picture, expected 'wisp picture 1'");
    test.write("p2.pfm.wisp", record);
    CHECK(test.wisp("stitch" + a + b + c + " -o " + test.file("y.pfm")).status == 0);
    CHECK(test.same("y.pfm", "none.pfm"));
    test.refuses(test.wisp("stitch" + a + b + c + " -o " + test.file("no/y.pfm")), 5,
                 test.file("no/y.pfm") + ": could not be written: No such file or directory");
}
