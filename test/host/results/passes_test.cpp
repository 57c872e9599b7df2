// Passes of --reference: sums that add up alike in any order, pictures of them, and files that are read only as
// written.
#include "core/numbers/random.h"
#include "core/numbers/sample_sums.h"
#include "host/results/passes.h"
#include "support/checksummed.h"
#include "support/refusal.h"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;

namespace {

using Ranges = std::vector<std::pair<uint32_t, uint32_t>>;

const std::string scene_name(64, 'a');

// Sums of passes that nobody rendered: pass p of pixel i has `samples` samples hashed from both.
double sample_of(uint32_t pass, size_t pixel, size_t channel, uint32_t i) {
    const uint64_t x = (pass * 1000003u + pixel * 7919u + channel * 131u + i + 1) * 0x9e3779b97f4a7c15u;
    return static_cast<double>((x ^ (x >> 31)) * 0xbf58476d1ce4e5b9u >> 40) * 0x1p-20; // below 16, of 24 bits
}

Passes passes_of(const Ranges &ranges, int width = 3, int height = 2, uint32_t samples = 4) {
    Passes passes;
    passes.scene = scene_name;
    passes.width = width;
    passes.height = height;
    passes.samples = samples;
    passes.exponent = 3;
    passes.ranges = ranges;
    passes.pixels.resize(static_cast<size_t>(width * height));
    for (const auto &[first, last] : ranges)
        for (uint32_t pass = first; pass < last; ++pass)
            for (size_t p = 0; p < passes.pixels.size(); ++p)
                for (size_t c = 0; c < 3; ++c)
                    for (uint32_t i = 0; i < samples; ++i)
                        add_sample(passes.pixels[p].channels[c], sample_of(pass, p, c, i), 0);
    return passes;
}

std::string error_of(const std::string &file) {
    return refusal_of([&] { parse_passes(bytes_of(file), "p.passes"); });
}

struct About {
    std::string scene = scene_name, size = "3 2", samples = "4", exponent = "3", passes = "0:2";
};
std::string text_of(const About &about) {
    return "scene " + about.scene + "\nsize " + about.size + "\nsamples " + about.samples + "\nexponent " +
           about.exponent + "\npasses " + about.passes + "\n";
}
const std::string no_sums(3 * 2 * 96, '\0'); // of 3 x 2 pixels

std::string error_of(const About &about, const std::string &sums = no_sums) {
    return error_of(checksummed("wisp passes 1", text_of(about) + sums));
}

bool same(const Passes &a, const Passes &b) { return passes_bytes(a) == passes_bytes(b); }

} // namespace

TEST_CASE("passes: a file gives back what was written") {
    Passes passes = passes_of({{0, 2}, {5, 6}, {2147483640, 2147483647}});
    passes.exponent = -40;
    passes.pixels[0].channels[1].sum = {0x0123456789abcdef, 0xfedcba9876543210};
    passes.pixels[5].channels[2].square = {UINT64_MAX, 0x8000000000000001};
    const Bytes bytes = passes_bytes(passes);
    CHECK(text_of(bytes).rfind("wisp passes 1\nsha256 ", 0) == 0);
    const Passes again = parse_passes(bytes, "p.passes");
    CHECK(again.scene == passes.scene);
    CHECK(again.width == 3);
    CHECK(again.height == 2);
    CHECK(again.samples == 4);
    CHECK(again.exponent == -40);
    CHECK(again.ranges == passes.ranges);
    REQUIRE(again.pixels.size() == 6);
    for (size_t p = 0; p < 6; ++p)
        for (int c = 0; c < 3; ++c) {
            const auto &a = again.pixels[p].channels[c], &b = passes.pixels[p].channels[c];
            CHECK(a.sum.high == b.sum.high);
            CHECK(a.sum.low == b.sum.low);
            CHECK(a.square.high == b.square.high);
            CHECK(a.square.low == b.square.low);
        }
    CHECK(passes_bytes(again) == bytes);
    CHECK(error_of(About()) == "no error"); // what the refusals below begin with is sound
}

TEST_CASE("passes: a bit that changed anywhere, and a cut anywhere, are refused") {
    check_damage_is_refused(text_of(passes_bytes(passes_of({{0, 1}}, 1, 1))),
                            [](const std::string &file) { return error_of(file); });
}

TEST_CASE("passes: errors name the file and what is wrong") {
    CHECK(error_of("") == "p.passes:1: not a file of passes, expected 'wisp passes 1'");
    CHECK(error_of("PF\n1 1\n") == "p.passes:1: not a file of passes, expected 'wisp passes 1'");
    CHECK(error_of("wisp passes 2\n") == "p.passes:1: not a file of passes, expected 'wisp passes 1'");
    CHECK(error_of("wisp passes 1\n").rfind("p.passes:2: the file ends, expected ", 0) == 0);
    std::string file = checksummed("wisp passes 1", text_of(About()) + no_sums);
    const std::string digest = file.substr(21, 64);
    file.back() = 1;
    CHECK(error_of(file) == "p.passes:2: the file is damaged: its SHA-256 is another, expected " + digest);
    CHECK(error_of(checksummed("wisp passes 1", "")).rfind("p.passes:", 0) == 0);
}

// Whoever writes such a file knows how to compute its SHA-256.
TEST_CASE("passes: a file with the right SHA-256 and wrong numbers is refused, and nothing is allocated for them") {
    const auto with = [](std::string About::*field, const std::string &value) {
        About about;
        about.*field = value;
        const std::string error = error_of(about);
        CHECK(error.rfind("p.passes:", 0) == 0);
        CHECK(error.find('\n') == std::string::npos);
        return error;
    };
    for (const char *size :
         {"0 2", "3 0", "-3 -2", "3", "3 2 1", "x 2", "3.0 2", "2147483648 1", "99999999999999999999 1",
          "2147483647 2147483647", "65536 65536", "1431655765 3", "4 2", "2 2", ""}) {
        CAPTURE(std::string(size));
        with(&About::size, size);
    }
    // 2^32 pixels of 96 bytes: more than a word of 32 bits holds, and more than the file.
    CHECK(with(&About::size, "65536 65536").find("4294967296 pixels, expected at most 6") != std::string::npos);
    for (const char *samples : {"0", "", "many", "2147483648", "4 4"}) {
        CAPTURE(std::string(samples));
        with(&About::samples, samples);
    }
    for (const char *exponent : {"", "-100001", "2147483648", "1e3", "3 3"}) {
        CAPTURE(std::string(exponent));
        with(&About::exponent, exponent);
    }
    for (const char *ranges : {"", "0", "0:", ":2", "2:2", "2:1", "-1:2", "0:2147483649", "0:99999999999999999999",
                               "0:2:3", "0:2,3:4", "a:b", "0:2 3"}) {
        CAPTURE(std::string(ranges));
        with(&About::passes, ranges);
    }
    CHECK(error_of(About(), "").rfind("p.passes: byte ", 0) == 0);
    CHECK(error_of(About(), no_sums.substr(1)).rfind("p.passes: byte ", 0) == 0);
    CHECK(error_of(About(), no_sums + "x").rfind("p.passes: byte ", 0) == 0);
}

TEST_CASE("passes: ranges that a file gives twice, or out of order, are refused") {
    for (const char *ranges : {"0:2 1:3", "0:5 1:3", "0:2 0:2", "5:6 0:2", "0:2 2:4"}) {
        About about;
        about.passes = ranges;
        CAPTURE(std::string(ranges));
        CHECK(error_of(about).rfind("p.passes:7: ", 0) == 0);
    }
}

TEST_CASE("passes: a negative number of samples is refused") { // not 4294967291 of them
    About about;
    about.samples = "-5";
    CHECK(error_of(about).rfind("p.passes:5: ", 0) == 0);
}

TEST_CASE("passes: in any order and grouping they add up to the same bytes") {
    const Ranges pieces = {{0, 2}, {2, 3}, {3, 7}, {9, 10}, {10, 12}};
    const Passes whole = passes_of({{0, 7}, {9, 12}});
    std::vector<size_t> order = {0, 1, 2, 3, 4};
    do {
        Passes sum = passes_of({pieces[order[0]]});
        for (size_t i = 1; i < order.size(); ++i) add_passes(sum, passes_of({pieces[order[i]]}), "more");
        CHECK(sum.ranges == whole.ranges);
        CHECK(same(sum, whole));
    } while (std::next_permutation(order.begin(), order.end()));
    // Grouped: pairs first, through files.
    Passes left = passes_of({{0, 2}}), right = passes_of({{9, 10}});
    add_passes(left, passes_of({{3, 7}}), "more");
    add_passes(right, passes_of({{2, 3}, {10, 12}}), "more");
    Passes sum = parse_passes(passes_bytes(right), "right");
    add_passes(sum, parse_passes(passes_bytes(left), "left"), "left");
    CHECK(same(sum, whole));
}

TEST_CASE("passes: what is there already, or of another scene, is refused and changes nothing") {
    Passes passes = passes_of({{2, 4}, {6, 8}});
    const Bytes before = passes_bytes(passes);
    for (const Ranges &ranges :
         {Ranges{{2, 4}}, Ranges{{3, 5}}, Ranges{{0, 3}}, Ranges{{0, 9}}, Ranges{{7, 8}}, Ranges{{4, 6}, {7, 9}}}) {
        const std::string error = refusal_of([&] { add_passes(passes, passes_of(ranges), "b.passes"); });
        CHECK(error.rfind("b.passes: passes ", 0) == 0);
        CHECK(error.find("expected none of 2:4 6:8, which are there already") != std::string::npos);
        CHECK(passes_bytes(passes) == before);
    }
    Passes other = passes_of({{4, 6}});
    other.scene[63] = 'b';
    CHECK(refusal_of([&] { add_passes(passes, other, "b.passes"); }) ==
          "b.passes: passes of another scene, size, crop, seed, arithmetic or version, expected all of the same");
    CHECK(passes_bytes(passes) == before);
    CHECK(refusal_of([&] { add_passes(passes, passes_of({{4, 6}}), "b.passes"); }) == "no error");
    CHECK(passes.ranges == Ranges{{2, 8}});
}

TEST_CASE("passes: of one scene by name but another size, number of samples or exponent, they are refused") {
    // The name can be copied from one file to another: it proves nothing.
    Passes passes = passes_of({{0, 1}});
    const Bytes before = passes_bytes(passes);
    Passes smaller = passes_of({{1, 2}}, 3, 1), wider = passes_of({{1, 2}}, 6, 1), finer = passes_of({{1, 2}}, 3, 2, 9),
           brighter = passes_of({{1, 2}});
    brighter.exponent = 4;
    for (const Passes *more : {&smaller, &wider, &finer, &brighter}) {
        CHECK(refusal_of([&] { add_passes(passes, *more, "b.passes"); }).rfind("b.passes: ", 0) == 0);
        CHECK(passes_bytes(passes) == before);
    }
}

TEST_CASE("passes: the picture is the mean of all samples, the other its standard error") {
    const Passes passes = passes_of({{0, 3}, {5, 7}});
    const Picture mean = mean_picture(passes), error = error_picture(passes);
    CHECK(mean.width == 3);
    CHECK(mean.height == 2);
    REQUIRE(mean.rgb.size() == 18);
    REQUIRE(error.rgb.size() == 18);
    for (size_t p = 0; p < 6; ++p)
        for (size_t c = 0; c < 3; ++c) {
            std::vector<double> samples;
            for (uint32_t pass : {0u, 1u, 2u, 5u, 6u})
                for (uint32_t i = 0; i < 4; ++i) samples.push_back(8 * sample_of(pass, p, c, i));
            const double n = 20;
            double sum = 0, squares = 0;
            for (double x : samples) sum += x;
            for (double x : samples) squares += (x - sum / n) * (x - sum / n);
            // Sums are exact; what follows is in double, and rounded to float at the end.
            CHECK(static_cast<double>(mean.rgb[3 * p + c]) == doctest::Approx(sum / n).epsilon(1e-7));
            CHECK(static_cast<double>(error.rgb[3 * p + c]) ==
                  doctest::Approx(std::sqrt(squares / (n - 1) / n)).epsilon(1e-7));
        }
}

TEST_CASE("passes: the error of one sample is not known, that of equal samples is 0, and so are negative squares") {
    const Passes one = passes_of({{0, 1}}, 2, 1, 1);
    for (float value : error_picture(one).rgb) CHECK(value == std::numeric_limits<float>::infinity());
    Passes equal = one;
    equal.samples = 1000;
    equal.pixels = {{}, {}};
    for (int i = 0; i < 1000; ++i)
        for (PixelSums &pixel : equal.pixels) {
            add_sample(pixel.channels[0], 0.375, 0);
            add_sample(pixel.channels[1], -0.375, 0);
            add_sample(pixel.channels[2], Fixed(-1));
        }
    CHECK(mean_picture(equal).rgb == std::vector<float>{3, 0, 0, 3, 0, 0});
    // The difference of two equal numbers of 53 bits, 0.375^2 * 64 each: its root by that of the number of samples.
    for (float value : error_picture(equal).rgb) CHECK(std::fabs(value) <= 3 * std::sqrt(0x1p-51 / 1000));
}

TEST_CASE("passes: samples far below a unit are rounded at random, so that their mean is right") {
    Pcg32 generator(1);
    const int count = 100000;
    for (double units : {0.001, 0.3, 7.9}) {
        PixelSums::Channel channel = {};
        for (int i = 0; i < count; ++i) add_sample(channel, units * 0x1p-32, generator());
        const double fraction = units - std::floor(units), deviation = std::sqrt(fraction * (1 - fraction) / count);
        CHECK(std::fabs(to_double(channel.sum) / count - units) < 4 * deviation);
    }
}

TEST_CASE("passes: sums beyond a word do not wrap") {
    PixelSums::Channel channel = {};
    for (int i = 0; i < 4; ++i) add_sample(channel, 2147483647.75, 0);
    CHECK(channel.sum.high == 1);
    CHECK(channel.sum.low == UINT64_MAX - (uint64_t{1} << 32) + 1);
    // 4 (2^31 - 2^-2)^2 = 2^64 - 2^32 + 2^-2
    CHECK(channel.square.high == UINT64_MAX - (uint64_t{1} << 32) + 1);
    CHECK(channel.square.low == uint64_t{1} << 62);

    Passes passes = passes_of({{0, 1}}, 1, 1, 2);
    passes.ranges = {{0, 1u << 31}};
    const uint64_t n = uint64_t{1} << 32;
    PixelSums::Channel *channels = passes.pixels[0].channels;
    channels[0].sum = {n - 1, UINT64_MAX};         // 2^96 - 1 units: a mean of 2^64 units, 2^32
    channels[1].sum = {0, UINT64_MAX};             // 2^64 - 1: 2^-32 of it
    channels[2].sum = {1, 0};                      // one more
    channels[0].square = {UINT64_MAX, UINT64_MAX}; // 2^64
    channels[1].square = {uint64_t{1} << 40, 0};
    channels[2].square = {uint64_t{1} << 40, 0};
    const std::vector<float> mean = mean_picture(passes).rgb;
    CHECK(mean == std::vector<float>{0x1p35f, 8, 8});
    const std::vector<float> error = error_picture(passes).rgb;
    CHECK(error[0] == 0); // the squares are less than so large a mean's
    // Mean squares of 2^40 / 2^32 = 2^8 less the mean's 1: sqrt(255 / 2^32) * 8
    for (size_t c : {1u, 2u})
        CHECK(static_cast<double>(error[c]) == doctest::Approx(8 * std::sqrt(255.0) / 65536).epsilon(1e-7));

    // Carries from word to word when passes are added.
    Passes more = passes, sum = passes;
    sum.ranges = {{0, 1}};
    more.ranges = {{1, 2}};
    more.pixels[0].channels[0].sum = {1, 1};
    sum.pixels[0].channels[0].sum = {5, UINT64_MAX};
    sum.pixels[0].channels[0].square = more.pixels[0].channels[0].square = {3, uint64_t{1} << 63};
    add_passes(sum, more, "more");
    CHECK(sum.pixels[0].channels[0].sum.high == 7);
    CHECK(sum.pixels[0].channels[0].sum.low == 0);
    CHECK(sum.pixels[0].channels[0].square.high == 7);
    CHECK(sum.pixels[0].channels[0].square.low == 0);
}

TEST_CASE("passes: squares that no longer fit stay at the most that does") {
    PixelSums::Channel channel = {};
    for (int i = 0; i < 9; ++i) add_sample(channel, 0x1p40, 0);
    CHECK(channel.square.high == UINT64_MAX); // 9 * 2^62, not that less 2^64 twice
}
