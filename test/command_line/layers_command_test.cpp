// --layers: the channels of an EXR and the files beside a PFM, what they are of, and what is refused.
#include "host/images/layers.h"
#include "host/images/picture_reader.h"
#include "support/command_line.h"
#include "support/exr_channels.h"
#include <cmath>
#include <set>

using namespace wisp;

namespace {

using Channels = std::map<std::string, std::vector<float>>;

// A wall 5 before the eye, lit past a ball of smoke that glows, and sky around.
struct Wall : CommandLineTest {
    Wall() {
        write("puff.vtk", puff(40));
        write("w.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 24 16\nb 0.1 0.1 0.2\n"
                       "lp 3 3 3 40 40 40\nf 0.5 0.6 0.7 1 0 0 0 1\np 4 -1 -1 -1 1 -1 -1 1 1 -1 -1 1 -1\n"
                       "smoke puff.vtk {\n radius 0.2\n mass 1\n extinction 0.02\n emission 0.1 0.2 0\n}\n"
                       "render photons 3000\n");
    }
    std::string w() const { return file("w.aff"); }
    Channels channels(const std::string &name) const { return exr_channels(read_file(file(name))); }
    std::set<std::string> names(const std::string &start) const {
        std::set<std::string> found;
        for (const auto &entry : std::filesystem::directory_iterator(file(""))) {
            const std::string name = entry.path().filename().string();
            if (name.rfind(start, 0) == 0) found.insert(name.substr(start.size()));
        }
        return found;
    }
    void renders(const std::string &arguments) const {
        const Ran ran = wisp("render " + arguments);
        CHECK(ran.status == 0);
        CHECK(ran.err == "");
    }
};

std::set<std::string> names_of(const Channels &channels) {
    std::set<std::string> names;
    for (const auto &[name, values] : channels) names.insert(name);
    return names;
}

const std::set<std::string> words = {"emission", "single", "multiple", "surfaces", "background", "direct", "albedo",
                                     "normal",   "depth",  "alpha",    "shadow",   "visits",     "samples"};

std::string line_with(const std::string &text, const std::string &start) {
    const size_t at = text.find(start);
    return at == std::string::npos ? "" : text.substr(at, text.find('\n', at + 1) - at);
}

} // namespace

TEST_CASE("layers command: an EXR has them as channels by the field's names, which add up to R, G and B") {
    const Wall test;
    for (const std::string arithmetic : {"f32", "f64", "fixed"}) {
        const std::string as = " -q --arith " + arithmetic;
        test.renders(test.w() + as + " --layers -o " + test.file("a.exr"));
        test.renders(test.w() + as + " -o " + test.file("b.exr") + " -o " + test.file("b.pfm"));
        const Channels all = test.channels("a.exr"), plain = test.channels("b.exr");
        std::set<std::string> expected = {"R", "G", "B", "N.X", "N.Y", "N.Z", "Z", "A", "shadow", "visits", "samples"};
        for (const char *layer : {"emission", "single", "multiple", "surfaces", "background", "direct", "albedo"})
            for (const char *color : {".R", ".G", ".B"}) expected.insert(std::string(layer) + color);
        CHECK(names_of(all) == expected);
        CHECK(names_of(plain) == std::set<std::string>{"R", "G", "B"});
        for (const std::string color : {"R", "G", "B"}) {
            CHECK(all.at(color) == plain.at(color));
            for (size_t i = 0; i < all.at(color).size(); ++i) {
                float sum = 0;
                for (const char *layer : {"emission.", "single.", "multiple.", "surfaces.", "background."})
                    sum += all.at(layer + color)[i];
                CHECK(sum == all.at(color)[i]);
            }
        }
        const size_t middle = 8 * 24 + 12, corner = 0;
        CHECK(all.at("Z")[middle] == doctest::Approx(5).epsilon(1e-6)); // in the scene's unit of length
        CHECK(all.at("N.Z")[middle] == doctest::Approx(1).epsilon(1e-6));
        CHECK(all.at("albedo.G")[middle] == doctest::Approx(0.6).epsilon(1e-6));
        CHECK(all.at("A")[middle] == 1);
        CHECK(std::isinf(all.at("Z")[corner]));
        CHECK(all.at("A")[corner] == 0);
        CHECK(all.at("samples")[corner] == 4);
        const Ran compared = test.wisp("compare " + test.file("a.exr") + " " + test.file("b.pfm"));
        CHECK(compared.status == 0);
        CHECK(compared.out.find("equal to the bit") != std::string::npos);
    }
}

TEST_CASE("layers command: beside a PFM they are files, of the same numbers") {
    const Wall test;
    test.renders(test.w() + " -q --layers -o " + test.file("a.pfm") + " -o " + test.file("a.png") + " -o " +
                 test.file("a.exr"));
    test.renders(test.w() + " -q -o " + test.file("b.pfm") + " -o " + test.file("b.png"));
    CHECK(test.same("a.pfm", "b.pfm"));
    CHECK(test.same("a.png", "b.png"));
    std::set<std::string> expected = {"pfm", "png", "exr"};
    for (const std::string &word : words) expected.insert(word + ".pfm");
    CHECK(test.names("a.") == expected);
    const Channels all = test.channels("a.exr");
    for (const LayerNames &layer : layer_names()) {
        if (!words.count(layer.word)) continue;
        const Bytes bytes = read_file(layer_path(test.file("a.pfm"), layer.word));
        CHECK(bytes[1] == (layer.channels.size() == 3 ? 'F' : 'f'));
        const Picture picture = parse_picture(bytes, layer.word);
        CHECK(picture.width == 24);
        for (size_t i = 0; i < picture.rgb.size(); ++i)
            CHECK(picture.rgb[i] == all.at(layer.channels[i % 3 % layer.channels.size()])[i / 3]);
    }
}

TEST_CASE("layers command: a scene has only layers of what is in it") {
    const Wall test;
    const std::string options = " -q --layers -o " + test.file("x.exr");
    test.renders("fixtures/surfaces.aff --frames 0" + options);
    for (const std::string layer : {"emission.R", "single.R", "multiple.R"})
        CHECK(!test.channels("x.exr").count(layer));
    CHECK(test.channels("x.exr").count("direct.R"));
    test.renders(test.s() + options);
    for (const std::string layer : {"emission.R", "surfaces.R", "Z", "N.X", "shadow", "visits"})
        CHECK(!test.channels("x.exr").count(layer));
    CHECK(test.channels("x.exr").count("multiple.R"));
    test.renders(test.s() + " --photons 0" + options);
    CHECK(!test.channels("x.exr").count("multiple.R"));
    CHECK(test.channels("x.exr").count("single.R"));
}

TEST_CASE("layers command: the reference has what is met first, and the standard error of --error-out") {
    const Wall test;
    test.renders(test.w() + " -q --reference --passes 0:5 --spp 2 --layers -o " + test.file("r.exr") + " --error-out " +
                 test.file("e.pfm"));
    const Channels all = test.channels("r.exr");
    CHECK(names_of(all) == std::set<std::string>{"R", "G", "B", "error.R", "error.G", "error.B", "albedo.R", "albedo.G",
                                                 "albedo.B", "N.X", "N.Y", "N.Z", "Z", "A", "shadow", "visits",
                                                 "samples"});
    const Picture error = read_pfm(test.file("e.pfm"));
    for (size_t i = 0; i < error.rgb.size(); ++i)
        CHECK(error.rgb[i] == all.at(std::string("error.") + "RGB"[i % 3])[i / 3]);
    CHECK(all.at("samples")[0] == 10);
}

TEST_CASE("layers command: what cannot hold them, or makes no picture, is refused") {
    const Wall test;
    const std::string none =
        "option 'layers': found no output that holds them, expected a .exr, or a .pfm with files beside it";
    for (const std::string &output : {"-o " + test.file("x.png"), std::string("-o -"), std::string("--digest")})
        test.refuses(test.wisp("render " + test.w() + " --layers " + output), 2, none);
    test.refuses(test.wisp("inspect " + test.w() + " 1 1 --layers"), 2,
                 "option 'layers' does not go with inspect: it makes no picture");
    test.refuses(test.wisp("plan " + test.s() + " --layers --batches 0:1 --map-out " + test.file("m.map")), 2,
                 "option 'layers' does not go with --batches: they make no picture");
    test.refuses(
        test.wisp("render " + test.w() + " --layers -o " + test.file("x.pfm") + " -o " + test.file("x.depth.pfm")), 2,
        "option 'output' writes to '" + test.file("x.depth.pfm") + "' like 'layers', expected another file");
    CHECK(test.names("x.").empty());
    CHECK(test.wisp("merge a b --layers -o c").status == 2);
    CHECK(test.wisp("stitch a b --layers -o c").status == 2);
    CHECK(test.wisp("render " + test.w() + " -q --layers -o -.exr").status == 0);
}

TEST_CASE("layers command: a plan has a row for them, and counts their planes with the picture") {
    const Wall test;
    const std::string with = test.wisp("plan -q --layers " + test.w()).out,
                      without = test.wisp("plan -q " + test.w()).out;
    CHECK(line_with(with, "layers ").find("yes") == 15);
    CHECK(line_with(without, "layers ").find("no ") == 15);
    // R G B, 7 layers of three, N.X N.Y N.Z, Z, A, shadow, visits, samples; each held twice
    CHECK(line_with(with, "\npicture ").find(std::to_string(24 * 16 * (3 + 7 * 3 + 3 + 5) * 2 * 4) + " bytes") !=
          std::string::npos);
    CHECK(line_with(with, "\npicture ").find("24 x 16 pixels and 29 channels of layers, beside the arena") !=
          std::string::npos);
    CHECK(line_with(without, "\npicture ").find(std::to_string(24 * 16 * 3 * 2 * 4) + " bytes") != std::string::npos);
}

TEST_CASE("layers command: parts of a picture with layers can be stitched") {
    const Wall test;
    const std::string command = test.w() + " -q --layers -o ";
    test.renders(command + test.file("whole.exr"));
    test.renders(command + test.file("l.exr") + " --crop 0,0,9,16");
    test.renders(command + test.file("r.exr") + " --crop 9,0,24,16");
    CHECK(
        test.wisp("stitch " + test.file("l.exr") + " " + test.file("r.exr") + " -o " + test.file("both.exr")).status ==
        0);
    const Channels whole = test.channels("whole.exr"), left = test.channels("l.exr"), both = test.channels("both.exr");
    CHECK(both.at("G") == whole.at("G"));
    for (const auto &[name, values] : left)
        for (size_t i = 0; i < values.size(); ++i) CHECK(values[i] == whole.at(name)[i / 9 * 24 + i % 9]);
}

TEST_CASE("layers command: frames are kept where their file says that it has them") {
    const Wall test;
    const std::string sequence = "render " + test.w() + " -q --frames 0:1 -o " + test.file("f%d");
    const auto kept = [&](const std::string &options) {
        const Ran ran = test.wisp(sequence + options + " -v"); // the last of -q and -v... both: notes are printed
        CHECK(ran.status == 0);
        return ran.err.find("kept ") != std::string::npos;
    };
    CHECK(!kept(".exr"));
    CHECK(kept(".exr"));
    CHECK(!kept(".exr --layers"));
    CHECK(kept(".exr --layers"));
    CHECK(!kept(".exr"));
    CHECK(!kept(".pfm --layers"));
    CHECK(!kept(".pfm --layers"));
    CHECK(test.has("f1.single.pfm"));
}
