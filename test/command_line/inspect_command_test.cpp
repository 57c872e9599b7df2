// build/wisp inspect: its pixel is that of the picture, its JSON is valid and has what the text has, and wrong usage is
// refused.
#include "host/images/picture.h"
#include "host/base/text.h"
#include "support/command_line.h"
#include "support/json_check.h"
#include <cmath>

namespace wisp {

namespace {

// The three numbers behind the last `"name": [`.
std::vector<double> last_triple(const std::string &json, const std::string &name) {
    const std::string head = "\"" + name + "\": [";
    size_t at = json.rfind(head);
    REQUIRE(at != std::string::npos);
    at += head.size();
    std::vector<double> numbers;
    for (const char *end : {", ", ", ", "]"}) {
        const size_t stop = json.find(end, at);
        numbers.push_back(*to_number(json.substr(at, stop - at)));
        at = stop + 2;
    }
    return numbers;
}

size_t count(const std::string &text, const std::string &word) {
    size_t n = 0;
    for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
}

} // namespace

TEST_CASE("command line: an inspected pixel is that of the picture, to the bit") {
    const CommandLineTest test;
    const std::string wake = "wake.aff --frames 2 --size 16x12 --spp 2 --photons 2000 --density-step 1 --light-step 2 ",
                      surfaces = "surfaces.aff --size 16x12 --spp 3 ", smoke = "small.aff --size 16x12 --photons 2000 ";
    for (const std::string &scene :
         {wake + "--arith f32", wake + "--arith f64", wake + "--arith fixed",
          std::string("wake.aff --frames 2 --size 16x12 --smoke direct --photons 2000 --irradiance none --shadows lie"),
          wake + "--crop 2,1,14,11", surfaces + "--frames 3 --arith fixed",
          surfaces + "--frames 2 --lights cuts --shadows cache", smoke + "--smoke volume",
          smoke + "--irradiance none --arith fixed", smoke + "--exposure 2 --irradiance adaptive --arith f64",
          std::string("grid.aff --size 16x12 --photons 2000 --arith fixed"),
          std::string("glow.aff --size 16x12 --photons 2000 --arith f64")}) {
        const std::string command = "fixtures/" + scene + " ";
        CAPTURE(command);
        REQUIRE(test.wisp("render " + command + "-q -o " + test.file("p.pfm")).status == 0);
        const Picture picture = read_pfm(test.file("p.pfm"));
        const int left = picture.width == 16 ? 0 : 2, top = picture.height == 12 ? 0 : 1;
        const Ran ran = test.wisp("inspect " + command + "7 6 --json -q");
        CHECK(ran.err == "");
        REQUIRE(ran.status == 0);
        const std::vector<double> value = last_triple(ran.out, "value");
        for (size_t c = 0; c < 3; ++c) {
            const size_t place = static_cast<size_t>((6 - top) * picture.width + 7 - left) * 3 + c;
            CHECK(static_cast<double>(picture.rgb[place]) == value[c]);
        }
        JsonCheck check(ran.out);
        CHECK(check.whole());
        CHECK(check.numbers > 30);
    }
}

TEST_CASE("command line: the events of a pixel are in the units of the scene, in text and in JSON") {
    CommandLineTest test;
    // A box of fog above a floor, a light straight above: all is known.
    test.write("t.aff", "v from 0 0 8 at 0 -4 0 up 0 1 0 angle 30 hither 1 resolution 9 9\nb 0.5 0.25 0.125\nam 0 0 0\n"
                        "ld 0 -1 0 4 2 1\nf 0.5 0.5 0.5 1 0 1 0 1\n"
                        "p 4 -64 -4 64 64 -4 64 64 -4 -64 -64 -4 -64\n"
                        "smoke box -8 4 -8 8 8 8 0.25 {\n albedo 0 0 0\n}\n");
    const std::string command =
        "inspect " + test.file("t.aff") + " 4 4 --photons 0 --irradiance none --spp 1 --arith f64 ";
    const Ran text = test.wisp(command);
    CHECK(text.err == "");
    REQUIRE(text.status == 0);
    const std::string expected = test.file("t.aff") +
                                 ", frame 0, f64: pixel 4 4 of 9 x 9\n"
                                 "sample 0 of 1 at 4.5 4.5: radiance 0.234199 0.1171 0.0585498\n"
                                 "  camera ray from 0 0 8 along 0 -0.447214 -0.894427, share 1 1 1, weight 1\n";
    CHECK(text.out.substr(0, expected.size()) == expected);
    // (0.5 / pi) 4 exp(-1)
    for (const char *line :
         {"\n    hits triangle 0 (still) at 8.94427 from outside: point 0 -4 0, ",
          "\n      light 0: irradiance 4 2 1 from ", " away along 0 -1 0; not in shadow, asked by a ray (",
          "smoke of depth 1 passes 0.367879; gives 0.234199 0.1171 0.0585498\n",
          "\n    radiance 0.234199 0.1171 0.0585498 = 0 0 0 of smoke + 1 x 0.234199 0.1171 0.0585498 of the "
          "surface\n"}) {
        CAPTURE(text.out);
        CHECK(count(text.out, line) == 1);
    }
    CHECK(test.wisp(command).out == text.out);
    const Ran json = test.wisp(command + "--json");
    const std::vector<double> direct = last_triple(json.out, "contribution");
    CHECK(direct[0] == doctest::Approx(4 * 0.5 / 3.14159265358979324 * std::exp(-1.0)).epsilon(1e-12));
    CHECK(direct == last_triple(json.out, "mean")); // no other light
    // A name that JSON would stumble over.
    std::filesystem::copy(test.file("t.aff"), test.file("t\"\\\t.aff"));
    const Ran odd = test.wisp("inspect '" + test.file("t\"\\\t.aff") + "' 4 4 --photons 0 --irradiance none --json");
    CHECK(JsonCheck(odd.out).whole());
    CHECK(count(odd.out, "t\\\"\\\\\\u0009.aff") == 1);
}

TEST_CASE("command line: all samples are printed or one alone, their sums in any case") {
    const CommandLineTest test;
    const std::string command = "inspect fixtures/surfaces.aff 20 30 --frames 1 --json --spp 4";
    const Ran all = test.wisp(command), one = test.wisp(command + " --sample 2"),
              same = test.wisp(command + " --sample=2");
    CHECK(count(all.out, "\"camera\"") == 4);
    CHECK(count(one.out, "\"camera\"") == 1);
    CHECK(count(one.out, "\"index\"") == 4);
    CHECK(one.out == same.out);
    CHECK(last_triple(one.out, "value") == last_triple(all.out, "value"));
    const size_t ray = one.out.find("\"ray\": ");
    CHECK(all.out.find(one.out.substr(ray, 2000)) != std::string::npos);
    // In text, the same numbers of rays and lights.
    const std::string words = "inspect fixtures/surfaces.aff 20 30 --frames 1 --spp 4";
    const Ran text = test.wisp(words);
    CHECK(count(text.out, " ray from ") == count(all.out, "\"kind\": ") - count(all.out, "\"too_deep\": "));
    CHECK(count(text.out, "light ") - count(text.out, "too light ") == count(all.out, "\"light\": "));
}

TEST_CASE("command line: with a crop, shadows are decided by what the pixels before have taught") {
    const CommandLineTest test;
    const std::string command = "inspect fixtures/surfaces.aff 40 40 --frames 0 --json ";
    const Ran alone = test.wisp(command), whole = test.wisp(command + "--crop 0,0,64,48"),
              traced = test.wisp(command + "--crop 0,0,64,48 --shadows trace");
    CHECK(last_triple(alone.out, "value") == last_triple(whole.out, "value"));
    CHECK(last_triple(alone.out, "value") == last_triple(traced.out, "value"));
    const auto known = [](const Ran &ran) { return count(ran.out, "\"known\"") + count(ran.out, "\"known_still\""); };
    CHECK(known(whole) > known(alone));
    CHECK(known(traced) == 0);
    CHECK(count(traced.out, "\"lit\": 0,") == count(whole.out, "\"lit\": 0,"));
}

TEST_CASE("command line: a saved map serves to inspect") {
    const CommandLineTest test;
    const std::string scene =
        "fixtures/small.aff --smoke map --irradiance none --light-step 1.5 --size 16x12 --photons 5000 ";
    REQUIRE(test.wisp("render " + scene + "-q --map-out " + test.file("m.map")).status == 0);
    const Ran anew = test.wisp("inspect " + scene + "7 6"),
              saved = test.wisp("inspect " + scene + "7 6 --map-in " + test.file("m.map"));
    CHECK(saved.status == 0);
    CHECK(saved.out == anew.out);
    test.refuses(test.wisp("inspect " + scene + "-q 7 6 --seed 2 --map-in " + test.file("m.map")), 3);
}

TEST_CASE("command line: what cannot be inspected is refused with a line") {
    const CommandLineTest test;
    const std::string s = "inspect " + test.s() + " ";
    for (const auto &[words, line] :
         {std::pair(s + "16 0", "X: found '16', expected a whole number from 0 to 15"),
          std::pair(s + "0 12", "Y: found '12', expected a whole number from 0 to 11"),
          std::pair(s + "1.5 0", "X: found '1.5', expected a whole number from 0 to 15"),
          std::pair(s + "a 0", "X: found 'a', expected a whole number from 0 to 15"),
          std::pair(s + "99999999999999999999 0",
                    "X: found '99999999999999999999', expected a whole number from 0 to 15"),
          std::pair(s + "1", "found 2 words behind 'inspect', expected SCENE X Y; see 'wisp help'"),
          std::pair(s + "1 2 3", "found 4 words behind 'inspect', expected SCENE X Y; see 'wisp help'"),
          std::pair(s + "-1 2", "there is no option '-1'; 'wisp help' lists them"),
          std::pair(s + "1 2 --sample 4", "option 'sample': found '4', expected a whole number from 0 to 3"),
          std::pair(s + "1 2 --sample", "option '--sample' needs a value: I"),
          std::pair(s + "1 2 --crop 0,0,1,1", "option 'crop' does not have the pixel 1 2"),
          std::pair(s + "1 2 -o a.pfm", "option 'output' does not go with inspect: it makes no picture"),
          std::pair(s + "1 2 --digest", "option 'digest' does not go with inspect: it makes no picture"),
          std::pair(s + "1 2 --stats a", "option 'stats' does not go with inspect: it makes no picture"),
          std::pair(s + "1 2 --map-out a", "option 'map-out' does not go with inspect: it makes no picture"),
          std::pair(s + "1 2 --reference", "option 'reference' does not go with inspect: its pixels are sums of paths"),
          std::pair(s + "1 2 --map-in a --smoke direct", "option 'map-in' belongs to --smoke map"),
          std::pair(std::string("inspect fixtures/surfaces.aff 1 2 --frames 0 --shadows paper"),
                    "option 'shadows' does not go with inspect: paper's pixels depend on frames before"),
          std::pair(std::string("inspect fixtures/surfaces.aff 1 2"),
                    "fixtures/surfaces.aff: found several frames, expected one with --frames")}) {
        CAPTURE(words);
        test.refuses(test.wisp(words), 2, line);
    }
    test.refuses(test.wisp("inspect " + test.file("none.aff") + " 1 2"), 3);
    test.refuses(test.wisp("inspect " + test.s() + " 1 2 --memory 1k"), 4);
}

} // namespace wisp
