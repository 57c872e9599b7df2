// build/wisp on scenes of surfaces: frames, crops, counts, plans; scenes that are hardly one.
#include "host/images/picture.h"
#include "support/command_line.h"
#include <cmath>
#include <stb/stb_image_write.h>

namespace wisp {

namespace {

const std::string five_frames = "render fixtures/surfaces.aff --size 20x15 --spp 1 --quiet --digest ";

// Small enough for tests, unlike those that a user would draw.
struct SurfaceCommandTest : CommandLineTest {
    SurfaceCommandTest() { std::filesystem::copy("fixtures/tiles.ppm", file("tiles.ppm")); }
    // A camera at z = 6, a light, a grey material, then what is given.
    Ran draw(const std::string &shapes, const std::string &options = "") const {
        return draw_seen("0 1 6", shapes, options);
    }
    Ran draw_seen(const std::string &from, const std::string &shapes, const std::string &options = "") const {
        std::ofstream(file("t.aff")) << "v from " + from +
                                            " at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 8 6\nl 3 3 5\n"
                                            "b 0.25 0.25 0.25\nf 1 0.5 0.2 0.8 0.3 10 0 1\n" +
                                            shapes;
        std::filesystem::remove(file("t.pfm"));
        return wisp("render " + file("t.aff") + " -q --spp 1 -o " + file("t.pfm") + " " + options);
    }
    // The picture is there, and all of it are numbers; the sum of it.
    double sum(const Ran &ran) const {
        CHECK(ran.err == "");
        REQUIRE(ran.status == 0);
        double sum = 0;
        for (const float value : read_pfm(file("t.pfm")).rgb) {
            CHECK((std::isfinite(value) && value >= 0));
            sum += static_cast<double>(value);
        }
        return sum;
    }
    double background() const { return 8 * 6 * 3 * 0.25; }
};

const std::string corners = "m vertices 3 -1 0 0 1 0 0 0 1.5 0 triangles 1 0 1 2\n";

std::string scaled(const std::string &early, const std::string &late) {
    const std::string rest = " 0 0 0 ";
    return "k b { scale 4 0 " + early + rest + "0 " + early + rest + "1 " + late + rest + "1 " + late + rest + "}\n";
}

} // namespace

TEST_CASE("command line: frames of surfaces are the same alone and in order, in every arithmetic") {
    const SurfaceCommandTest test;
    for (const std::string arithmetic : {"--arith f32 ", "--arith f64 ", "--arith fixed "}) {
        const Ran all = test.wisp(five_frames + arithmetic);
        CHECK(all.status == 0);
        CHECK(lines(all.out) == 5);
        std::string alone, some;
        for (const char *frame : {"4", "3", "2", "1", "0"})
            alone = test.wisp(five_frames + arithmetic + "--frames " + frame).out + alone;
        CHECK(alone == all.out);
        std::istringstream rows(all.out);
        std::string row;
        for (int i = 0; std::getline(rows, row); ++i)
            if (i % 2 == 1) some += row + "\n";
        CHECK(test.wisp(five_frames + arithmetic + "--frames 1:4:2").out == some);
    }
    // Other frames of the same time.
    const std::string first = test.wisp(five_frames + "--frames 0").out,
                      last = test.wisp(five_frames + "--frames 4").out;
    CHECK(test.wisp(five_frames + "--frame-count 2").out == first + last);
    CHECK(test.wisp(five_frames + "--frame-count 1").out == first);
    test.refuses(test.wisp(five_frames + "--frames 3:5"), 2);
    test.refuses(test.wisp(five_frames + "--frame-count 2 --frames 2"), 2);
}

TEST_CASE("command line: a crop of surfaces is a part of the whole; rays are counted") {
    const SurfaceCommandTest test;
    const std::string one = "render fixtures/surfaces.aff --size 20x15 -q --frames 2 -o " + test.file("a.pfm") + " ";
    REQUIRE(test.wisp(one + "--stats " + test.file("a.json")).status == 0);
    const std::string counts = text_of(test.file("a.json"));
    CHECK(counts.find("\"primary\": 1200") != std::string::npos);
    const Picture whole = read_pfm(test.file("a.pfm"));
    REQUIRE(test.wisp(one + "--crop 4,3,17,11").status == 0);
    const Picture part = read_pfm(test.file("a.pfm"));
    CHECK(part.width == 13);
    CHECK(part.height == 8);
    for (size_t y = 0; y < 8; ++y)
        CHECK(std::equal(part.rgb.begin() + static_cast<int64_t>(y * 39),
                         part.rgb.begin() + static_cast<int64_t>(y * 39 + 39),
                         whole.rgb.begin() + static_cast<int64_t>(((y + 3) * 20 + 4) * 3)));
    const Ran plan = test.wisp("plan fixtures/surfaces.aff");
    CHECK(plan.status == 0);
    CHECK(plan.out.find("triangle trees yes") != std::string::npos);
    test.refuses(test.wisp("render fixtures/surfaces.aff --frames 0 --memory 100k -q -o " + test.file("a.pfm")), 4);
}

TEST_CASE("command line: surfaces that are hardly there are pictures") {
    const SurfaceCommandTest test;
    for (const std::string arithmetic : {"--arith f32", "--arith f64", "--arith fixed"}) {
        CAPTURE(arithmetic);
        const auto drawn = [&](const std::string &shapes) { return test.sum(test.draw(shapes, arithmetic)); };
        const double nothing = test.background();
        CHECK(drawn("m vertices 3 1 1 1 1 1 1 1 1 1 triangles 1 0 1 2\n") == nothing); // a point
        CHECK(drawn("m vertices 3 0 0 0 1 1 1 2 2 2 triangles 1 0 1 2\n") == nothing); // a line
        CHECK(drawn("x b { " + corners + "}\n" + scaled("0 0 0", "0 0 0")) == nothing);
        CHECK(drawn("x b { " + corners + "}\n" + scaled("1 0 1", "1 0 1")) == nothing);
        const double there = drawn(corners);
        CHECK(there != nothing);
        CHECK(drawn("x b { " + corners + "}\n") == doctest::Approx(there).epsilon(1e-6)); // without motion
        CHECK(drawn("x b { " + corners + "}\n" + scaled("-1 1 1", "-1 1 1")) == doctest::Approx(there).epsilon(1e-6));
        CHECK(drawn("x b { " + corners + "}\nk b { visibility 1 0 0 }\n") == nothing);
        CHECK(drawn("k b { visibility 1 0 0 }\n" + corners) == there);
        // Almost no volume, and as much as goes.
        const std::string flat = "x b { xs 1 1 1e4 0 1 0 0 0 0 0 { xs 1 1 1 0 1 0 40 0 0 0 { " + corners + "} } }\n";
        if (arithmetic != "--arith fixed") {
            const double slanted = drawn("xs 1 1 1 0 1 0 40 0 0 0 { " + corners + "}\n");
            CHECK(drawn(flat + scaled("1 1 1e-4", "1 1 1e-4")) == doctest::Approx(slanted).epsilon(1e-4));
        }
        for (const std::string from : {"0 1e-29 6e-29", "0 1e28 6e28"}) {
            const std::string size = from.substr(2, from.find(' ', 2) - 2);
            const Ran ran = test.draw_seen(
                from, "m vertices 3 -" + size + " 0 0 " + size + " 0 0 0 " + size + " 0 triangles 1 0 1 2\n",
                arithmetic);
            if (size == "1e-29")
                test.refuses(ran, 3); // the light is far too far away
            else
                CHECK(test.sum(ran) != nothing);
        }
    }
}

TEST_CASE("command line: the mirror image of a glass box is one of glass, standing, moving or changing its form") {
    CommandLineTest test;
    // Of the corners of a cube that is its own mirror image, counter-clockwise from outside.
    const int faces[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                              {3, 6, 2}, {3, 7, 6}, {0, 4, 7}, {0, 7, 3}, {1, 2, 6}, {1, 6, 5}};
    const auto corner = [](int i) {
        return std::string(i % 4 == 1 || i % 4 == 2 ? "0.5 " : "-0.5 ") + (i % 4 > 1 ? "0.5 " : "-0.5 ") +
               (i > 3 ? "0.5 " : "-0.5 ");
    };
    std::string mesh = "m vertices 8 ", forms;
    for (int i = 0; i < 8; ++i) mesh += corner(i);
    mesh += "triangles 12 ";
    for (const auto &face : faces) {
        forms += "tpa 1 0 ";
        for (const int i : face) mesh += std::to_string(i) + " ", forms += corner(i) + "0 0 0 ";
        forms += "\n";
    }
    const auto picture = [&](const std::string &box, const std::string &keys) {
        test.write("box.aff", "v from 0.6 1 4 at 0 0 0 up 0 1 0 angle 30 hither 0.1 resolution 24 24\nb 0.1 0.1 0.1\n"
                              "l 4 6 5\nf 1 1 1 0 0 1 0.9 1.5\n" +
                                  box + "\nf 1 0.2 0.2 0.8 0 1 0 1\np 4 -3 -3 -2 0 -3 -2 0 3 -2 -3 3 -2\n" + keys);
        REQUIRE(test.wisp("render " + test.file("box.aff") + " --spp 1 --arith f64 -o " + test.file("p.pfm")).status ==
                0);
        return read_pfm(test.file("p.pfm"));
    };
    const auto scaled = [](const std::string &x) {
        std::string keys = "k box { scale 4 ";
        for (const char *time : {"0 ", "1 ", "2 ", "3 "}) keys += time + x + " 1 1 0 0 0 ";
        return keys + "}\n";
    };
    const Picture box = picture(mesh, "");
    const auto differs = [&box](const Picture &other) {
        double most = 0;
        for (size_t i = 0; i < box.rgb.size(); ++i)
            most = std::max(most, std::abs(static_cast<double>(box.rgb[i] - other.rgb[i])));
        return most;
    };
    CHECK(differs(picture("xs -1 1 1 0 1 0 0 0 0 0 { " + mesh + "}", "")) < 1e-6);
    CHECK(differs(picture("x box { " + mesh + "}", scaled("1"))) < 1e-6);
    CHECK(differs(picture("x box { " + mesh + "}", scaled("-1"))) < 1e-6);
    CHECK(differs(picture(forms, "")) < 1e-6);
    CHECK(differs(picture("xs -1 1 1 0 1 0 0 0 0 0 { " + forms + "}", "")) < 1e-6);
    CHECK(differs(picture("x box { xs 1 -1 1 0 1 0 0 0 0 0 { " + mesh + "} }", scaled("-1"))) < 1e-6);
    mesh.replace(mesh.find("4 5 6"), 5, "4 6 5"); // the other way round it is another picture
    CHECK(differs(picture(mesh, "")) > 1e-3);
}

TEST_CASE("command line: a body that flies a hundred times as far as what is still is rendered in every frame") {
    CommandLineTest test;
    test.write("far.aff", "v from 0 0 4 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 9 9\nl 0 9 9\na 0 3 4\n"
                          "p 4 -1 -1 0 1 -1 0 1 1 0 -1 1 0\nx a { s 0 0 1 0.3 }\n"
                          "k a { transl 4 0 0 0 0 0 0 0  1 0 0 0 0 0 0  2 0 0 -100 0 0 0  3 0 0 -100 0 0 0 }\n");
    for (const char *arithmetic : {"f32", "f64", "fixed"}) {
        const Ran ran = test.wisp("render " + test.file("far.aff") + " --digest --frames 0:3 --arith " + arithmetic);
        CHECK_MESSAGE(ran.status == 0, ran.err);
        CHECK(lines(ran.out) == 4);
        CHECK(ran.out.substr(0, 64) !=
              test.wisp("render " + test.file("far.aff") + " --digest --frames 3 --arith " + arithmetic)
                  .out.substr(0, 64));
    }
}

TEST_CASE("command line: a texture as PNG makes the same picture as the PPM of the same texels") {
    SurfaceCommandTest test;
    const std::string texels = "abcdefghijklmnopqrstuvwx"; // of 4 x 2
    test.write("tiles.ppm", "P6 4 2 255\n" + texels);
    Bytes bytes;
    stbi_write_png_to_func(
        [](void *to, void *data, int size) {
            const auto *begin = static_cast<const uint8_t *>(data);
            static_cast<Bytes *>(to)->insert(static_cast<Bytes *>(to)->end(), begin, begin + size);
        },
        &bytes, 4, 2, 3, texels.data(), 3 * 4);
    write_file(test.file("tiles.png"), bytes);
    const std::string corners_of_texture = " -1 0 0 0 0 1 0 0 1 0 0 1.5 0 0.5 1\n";
    const Ran of_ppm = test.draw("tt tiles.ppm" + corners_of_texture, "--digest"),
              of_png = test.draw("tt tiles.png" + corners_of_texture, "--digest"),
              untextured = test.draw(corners, "--digest");
    CHECK(of_ppm.status == 0);
    CHECK(of_png.err == "");
    CHECK(of_png.out == of_ppm.out);
    CHECK(of_png.out != untextured.out);
    bytes.resize(bytes.size() - 1);
    write_file(test.file("tiles.png"), bytes);
    test.refuses(test.draw("tt tiles.png" + corners_of_texture), 3,
                 test.file("t.aff") + ":5: " + test.file("tiles.png") + ": byte " + std::to_string(bytes.size() - 11) +
                     ": 8 bytes of a chunk, expected at most 7: the file ends 7 bytes further on");
}

TEST_CASE("command line: what does not fit is refused with a line, not drawn otherwise") {
    const SurfaceCommandTest test;
    const std::string t = test.file("t.aff") + ":1: ", end = ", expected a scene that fits";
    const auto refused = [&](const Ran &ran, const std::string &line) { test.refuses(ran, 3, line); };
    refused(test.draw_seen("0 1e9 6e9", corners),
            t + "the camera is too far from the surfaces" + end);
    refused(test.draw("l 1e9 1e9 1e9\n" + corners),
            t + "a light is too far from the surfaces; a parallel light has no distance" + end);
    refused(test.draw("tt nowhere.ppm -1 0 0 0 0 1 0 0 1 0 0 1 0 0 1\n"),
            test.file("t.aff") + ":5: " + test.file("nowhere.ppm") + ": cannot be opened: No such file or directory");
    std::ofstream(test.file("cut.ppm")) << "P6 4 4 255\nabc";
    refused(test.draw("tt cut.ppm -1 0 0 0 0 1 0 0 1 0 0 1 0 0 1\n"),
            test.file("t.aff") + ":5: " + test.file("cut.ppm") +
                ": byte 11: 3 bytes of texels, expected 4 x 4 texels of 3 bytes");
    refused(test.draw("tt tiles.ppm -1 0 0 1e30 0 1 0 0 1 0 0 1 0 0 1\n"),
            test.file("t.aff") + ":5: found 1e30, expected u from -8192 to 8192");
    refused(test.draw("lp 0 0 1e-20 1e30 1e30 1e30\nm vertices 3 -1e-29 0 0 1e-29 0 0 0 1e-29 0 triangles 1 0 1 2\n"),
            t + "the camera is too far from the surfaces" + end);
    // 1 W/sr from 1e-30 away is more than a float is.
    std::ofstream(test.file("u.aff")) << "v from 0 1e-30 6e-30 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 4 4\n"
                                         "lp 1e-30 1e-30 1e-30 1 1 1\nm vertices 3 -1e-30 0 0 1e-30 0 0 0 1e-30 0 "
                                         "triangles 1 0 1 2\n";
    refused(test.wisp("render " + test.file("u.aff") + " -q -o " + test.file("u.pfm")),
            test.file("u.aff") + ":1: it is too bright for a picture of 32-bit numbers" + end);
    // Fixed point holds less.
    const std::string ball = "x b { s 0 0 0 1 }\n" + corners, fixed = "--arith fixed --frames 1";
    const std::string stretched = t + "something is stretched more than 2048 times, too much for fixed point" + end;
    const std::string animated = "a 0 1 2\n" + ball;
    refused(test.draw(animated + scaled("1e-9 1e-9 1e-9", "1 1 1"), fixed), stretched);
    refused(test.draw(animated + scaled("1 1 1", "1 1e-9 1"), fixed), stretched);
    CHECK(test.sum(test.draw(animated + scaled("1e-9 1e-9 1e-9", "1 1 1"), "--frames 1")) ==
          doctest::Approx(test.sum(test.draw(ball))).epsilon(1e-4));
    CHECK(test.sum(test.draw(animated + scaled("0.001 0.001 0.001", "1 1 1"), fixed)) ==
          doctest::Approx(test.sum(test.draw(ball))).epsilon(1e-4));
    refused(test.draw("fm 9 1 1 1 1 1 1 1 1 1 0 1\n" + corners, "--arith fixed"),
            t + "a material is brighter than 4, too much for fixed point" + end);
}

TEST_CASE("command line: fixed point reaches lights and cameras that are far out") {
    const SurfaceCommandTest test;
    const std::string far = "l 100 120 50\n" + corners;
    for (const char *from : {"0 1 6", "0 20 120"}) {
        const double exact = test.sum(test.draw_seen(from, far, "--arith f64"));
        CHECK(test.sum(test.draw_seen(from, far, "--arith fixed")) == doctest::Approx(exact).epsilon(1e-6));
    }
    // By their key frames too.
    const std::string keys = " transl 4  0 0 1 6  0 0 0  0 0 1 6  0 0 0  1 0 20 90  0 0 0  1 0 20 90  0 0 0 }\n";
    const std::string moving = "a 0 1 2\nla lamp 1 1 1\n" + far + "k camera {" + keys + "k lamp {" + keys;
    for (const char *frame : {" --frames 0", " --frames 1"}) {
        const double exact = test.sum(test.draw(moving, std::string("--arith f64") + frame));
        CHECK(test.sum(test.draw(moving, std::string("--arith fixed") + frame)) ==
              doctest::Approx(exact).epsilon(1e-6));
    }
}

TEST_CASE("command line: cuts of many lights take fewer shadow rays; where they are of no use nothing changes") {
    const SurfaceCommandTest test;
    const auto many = [](const std::string &kind, int count, double far, double strong) {
        std::string text;
        for (int i = 0; i < count; ++i)
            text += kind + " " + std::to_string(far + 0.01 * (i % 7)) + " " + std::to_string(far + 0.02 * (i % 11)) +
                    " " + std::to_string(far) + " " + (std::to_string(strong) + " ") + std::to_string(strong) + " " +
                    std::to_string(strong) + "\n";
        return text;
    };
    const auto rays = [&](const std::string &options) {
        test.sum(test.draw(corners + many("l", 150, 9, 0.01) + many("lp", 150, 8, 1),
                           options + " --stats " + test.file("a.json")));
        const std::string counts = text_of(test.file("a.json")), name = "\"shadow\": ";
        return std::atoi(counts.c_str() + counts.find(name) + name.size());
    };
    for (const std::string arithmetic : {"--arith f32", "--arith f64", "--arith fixed"}) {
        CAPTURE(arithmetic);
        const int all = rays(arithmetic + " --lights all");
        const Bytes picture = read_file(test.file("t.pfm"));
        CHECK(rays(arithmetic) == all);
        CHECK(read_file(test.file("t.pfm")) == picture);
        CHECK(rays(arithmetic + " --lights cuts") < all / 2);
        const Bytes cut = read_file(test.file("t.pfm"));
        CHECK(cut != picture);
        CHECK(rays(arithmetic + " --lights=cuts --shadows exact") < all / 2);
        CHECK(read_file(test.file("t.pfm")) == cut);
        test.sum(
            test.draw("render lights cuts\n" + corners + many("l", 150, 9, 0.01) + many("lp", 150, 8, 1), arithmetic));
        CHECK(read_file(test.file("t.pfm")) == cut);
    }
    const std::string strong = corners + many("lp", 200, 100, 1e6);
    CHECK(test.draw(strong, "--arith fixed").status == 0);
    CHECK(test.draw(strong, "--arith f32 --lights cuts").status == 0);
    test.refuses(test.draw(strong, "--arith fixed --lights cuts"), 3,
                 test.file("t.aff") +
                     ":1: the lights together are too strong for cuts in fixed point, expected a scene "
                     "that fits");
    test.refuses(test.draw(corners, "--lights some"), 2, "option 'lights': found 'some', expected all, cuts");
    const std::string plan = "plan fixtures/surfaces.aff --lights ";
    CHECK(test.wisp(plan + "all").out.find("light cuts     no                0 bytes") != std::string::npos);
    CHECK(test.wisp(plan + "cuts").out.find("light cuts     yes") != std::string::npos);
    CHECK(test.wisp("plan " + test.s() + " --lights cuts").out.find("of no use: there is no surface") !=
          std::string::npos);
    for (const std::string method : {"", " --reference --passes 0:1"}) {
        const std::string smoke = "render " + test.s() + " -q --digest" + method;
        const Ran all = test.wisp(smoke);
        CHECK(all.status == 0);
        CHECK(test.wisp(smoke + " --lights cuts").out == all.out);
    }
}

} // namespace wisp
