// The figures of a difference, worked out by hand on tiny pictures.
#include "host/base/error.h"
#include "host/images/compare.h"
#include "support/refusal.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <limits>

using namespace wisp;

namespace {

const float not_a_number = std::numeric_limits<float>::quiet_NaN();
const float inf = std::numeric_limits<float>::infinity();

// One row of grey pixels.
Picture row(const std::vector<float> &values) {
    Picture picture{static_cast<int>(values.size()), 1, {}};
    for (const float value : values) picture.rgb.insert(picture.rgb.end(), 3, value);
    return picture;
}

float float_of(uint32_t bits) {
    float value;
    std::memcpy(&value, &bits, 4);
    return value;
}

uint64_t ulps(float a, float b) { return compare(row({a}), row({b})).largest_ulps; }

} // namespace

TEST_CASE("compare: figures by hand") {
    const Picture a{2, 2, {1, 2, 3, 4, 5, 6, 0, 0, 0, 1, 1, 1}}, b{2, 2, {1, 2, 3, 4, 5, 8, 0, 0, 0, 1, 1, 2}};
    const Difference d = compare(a, b);
    CHECK(d.width == 2);
    CHECK(d.height == 2);
    CHECK(d.differing_pixels == 2);
    CHECK(d.first_x == 1);
    CHECK(d.first_y == 0);
    CHECK(d.largest_absolute == 2);
    CHECK(d.largest_ulps == 0x00800000); // 1 to 2: one power of two; 6 to 8 is half of that
    CHECK(d.rmse == std::sqrt(5.0 / 12));
    CHECK(d.relative_rmse == std::sqrt(5.0 / 12) / (27.0 / 12));
    CHECK(d.relative_rmse_without_bright == d.relative_rmse); // 0.1 % of 4 pixels is none
    CHECK(d.psnr == doctest::Approx(20 * std::log10(8 / std::sqrt(5.0 / 12))).epsilon(1e-14));
}

TEST_CASE("compare: equal pictures") {
    const Difference d = compare(row({0, 1, 5}), row({0, 1, 5}));
    CHECK(d.differing_pixels == 0);
    CHECK(d.first_x == -1);
    CHECK(d.first_y == -1);
    CHECK(d.largest_absolute == 0);
    CHECK(d.largest_ulps == 0);
    CHECK(d.rmse == 0);
    CHECK(d.relative_rmse == 0);
    CHECK(d.relative_rmse_without_bright == 0);
    CHECK(d.psnr == std::numeric_limits<double>::infinity());
    CHECK(d.mean_flip == 0);
}

TEST_CASE("compare: the first differing pixel is the first in reading order") {
    Picture a{3, 2, std::vector<float>(18, 1)}, b = a;
    b.rgb[3 * 3 + 2] = 2; // row 1, column 0, blue
    b.rgb[3 * 5] = 2;
    const Difference d = compare(a, b);
    CHECK(d.differing_pixels == 2);
    CHECK(d.first_x == 0);
    CHECK(d.first_y == 1);
}

TEST_CASE("compare: distance in ulps") {
    CHECK(ulps(1, std::nextafterf(1, 2)) == 1);
    CHECK(ulps(std::nextafterf(1, 0), std::nextafterf(1, 2)) == 2);
    CHECK(ulps(float_of(1), float_of(0x80000001)) == 2); // the smallest numbers on both sides of 0
    CHECK(ulps(0, float_of(0x80000003)) == 3);
    CHECK(ulps(-0.0f, 0.0f) == 0);
    CHECK(ulps(-1, 1) == 2 * 0x3f800000u);
    CHECK(ulps(std::numeric_limits<float>::max(), inf) == 1);
    CHECK(ulps(-inf, inf) == 2 * 0x7f800000ull); // the largest of all
    CHECK(ulps(not_a_number, 1) == nan_ulps);
    CHECK(ulps(1, not_a_number) == nan_ulps);
    CHECK(nan_ulps > 2 * 0x7f800000ull);
}

TEST_CASE("compare: -0 and 0 are different bits of the same value") {
    const Difference d = compare(row({-0.0f}), row({0.0f}));
    CHECK(d.differing_pixels == 1);
    CHECK(d.largest_absolute == 0);
    CHECK(d.rmse == 0);
    CHECK(d.relative_rmse == 0);
}

TEST_CASE("compare: NaN") {
    SUBCASE("on one side only it is a difference that no tolerance allows") {
        for (const auto &[a, b] :
             {std::pair(row({1, not_a_number}), row({1, 1})), std::pair(row({1, 1}), row({1, not_a_number}))}) {
            const Difference d = compare(a, b);
            CHECK(d.differing_pixels == 1);
            CHECK(d.first_x == 1);
            CHECK(std::isnan(d.largest_absolute));
            CHECK(d.largest_ulps == nan_ulps);
            CHECK(std::isnan(d.rmse));
            CHECK(std::isnan(d.relative_rmse));
            CHECK(std::isnan(d.psnr));
            CHECK(d.mean_flip > 0);
        }
    }
    SUBCASE("the largest difference is NaN wherever it stands") {
        CHECK(std::isnan(compare(row({not_a_number, 1}), row({1, 5})).largest_absolute));
        CHECK(std::isnan(compare(row({1, not_a_number}), row({5, 1})).largest_absolute));
    }
    SUBCASE("the same bits are equal") {
        const Difference d = compare(row({not_a_number, 1}), row({not_a_number, 1}));
        CHECK(d.differing_pixels == 0);
        CHECK(d.largest_absolute == 0);
        CHECK(d.relative_rmse == 0);
    }
    SUBCASE("other bits are not") {
        CHECK(compare(row({float_of(0x7fc00000)}), row({float_of(0x7fc00001)})).differing_pixels == 1);
    }
}

TEST_CASE("compare: infinity") {
    CHECK(compare(row({inf, 1}), row({inf, 1})).differing_pixels == 0);
    CHECK(compare(row({inf, 1}), row({inf, 1})).rmse == 0);
    const Difference d = compare(row({inf, 1}), row({1, 1}));
    CHECK(d.largest_absolute == inf);
    CHECK(d.relative_rmse == inf);
    CHECK(d.psnr == -inf);
    CHECK(compare(row({inf, 1}), row({inf, 2})).relative_rmse == inf); // 1 against an infinite mean is no 0
}

TEST_CASE("compare: a mean that is not above 0 makes every difference infinite") {
    CHECK(compare(row({1}), row({0})).relative_rmse == inf);
    CHECK(compare(row({1}), row({-1})).relative_rmse == inf);
    CHECK(compare(row({0}), row({0})).relative_rmse == 0);
    CHECK(compare(row({1}), row({0})).psnr == -inf);
}

TEST_CASE("compare: the brightest 0.1 % of B's pixels") {
    std::vector<float> ones(2000, 1);
    SUBCASE("are left out, by B's brightness and not by A's") {
        std::vector<float> a = ones, b = ones;
        b[700] = 100, b[701] = 200;
        a[700] = 50, a[701] = 50, a[3] = 1.5f, a[4] = 1000;
        const Difference d = compare(row(a), row(b));
        const double square = 0.25 + 999.0 * 999.0;
        CHECK(d.relative_rmse_without_bright == doctest::Approx(std::sqrt(square / 1998)).epsilon(1e-14));
        CHECK(d.relative_rmse ==
              doctest::Approx(std::sqrt((square + 2500 + 22500) / 2000) / (2298.0 / 2000)).epsilon(1e-14));
    }
    SUBCASE("are 1 of 1000 pixels and none of 999") {
        std::vector<float> b(1000, 1);
        b[5] = 100;
        CHECK(compare(row(std::vector<float>(1000, 1)), row(b)).relative_rmse_without_bright == 0);
        b.pop_back();
        CHECK(compare(row(std::vector<float>(999, 1)), row(b)).relative_rmse_without_bright > 1);
    }
    SUBCASE("are the earlier ones of equals") {
        for (const size_t pixel : {0, 1, 2, 1999}) {
            std::vector<float> a = ones;
            a[pixel] = 2;
            const double rest = compare(row(a), row(ones)).relative_rmse_without_bright;
            CHECK(rest == (pixel < 2 ? 0 : std::sqrt(3.0 / (3 * 1998))));
        }
    }
    SUBCASE("count NaN as brightest") {
        std::vector<float> b = ones;
        b[9] = not_a_number;
        CHECK(compare(row(ones), row(b)).relative_rmse_without_bright == 0);
    }
    SUBCASE("are found by luminance: green counts most") {
        Picture a{1000, 1, std::vector<float>(3000, 1)}, b = a;
        b.rgb[3 * 10] = 4;                                   // red: 1 + 3 * 0.2126
        b.rgb[3 * 20 + 1] = 3;                               // green: 1 + 2 * 0.7152
        b.rgb[3 * 30 + 2] = 9;                               // blue: 1 + 8 * 0.0722
        const double mean = (3.0 * 999 + 3 + 8) / (3 * 999); // green is left out
        CHECK(compare(a, b).relative_rmse_without_bright ==
              doctest::Approx(std::sqrt((9.0 + 64) / (3 * 999)) / mean).epsilon(1e-14));
    }
}

TEST_CASE("compare: sizes that differ are an input error") {
    const Picture wide{3, 2, std::vector<float>(18)}, high{2, 3, std::vector<float>(18)};
    CHECK_THROWS_WITH_AS(compare(wide, high, "a.pfm", "b.pfm"), "b.pfm: 2 x 3 pixels, expected 3 x 2 as in a.pfm",
                         InputError);
}

TEST_CASE("compare: text and JSON") {
    Difference d = compare(Picture{2, 1, {1, 1, 1, 1, 1, 1}}, Picture{2, 1, {1, 1, 1, 1, 1, 1.5f}});
    d.mean_flip = 0.125;
    CHECK(difference_text(d) == "size                            2 x 1\n"
                                "differing pixels                1 of 2\n"
                                "first differing pixel           1 0\n"
                                "largest absolute difference     0.5\n"
                                "largest difference in ulps      4194304\n"
                                "RMSE                            0.204124145\n"
                                "relative RMSE                   0.188422288\n"
                                "  without brightest 0.1 %       0.188422288\n"
                                "PSNR                            17.3239376 dB\n"
                                "mean FLIP                       0.125\n");
    CHECK(difference_json(d) == "{ \"width\": 2, \"height\": 1,\n"
                                "  \"differing_pixels\": 1,\n"
                                "  \"first_differing_pixel\": [1, 0],\n"
                                "  \"largest_absolute\": 0.5,\n"
                                "  \"largest_ulps\": 4194304,\n"
                                "  \"rmse\": 0.204124145,\n"
                                "  \"relative_rmse\": 0.188422288,\n"
                                "  \"relative_rmse_without_bright\": 0.188422288,\n"
                                "  \"psnr\": 17.3239376,\n"
                                "  \"mean_flip\": 0.125 }\n");
}

TEST_CASE("compare: the verdict, in words and in JSON") {
    const auto verdict = [](const Picture &a, const Picture &b, const Limits &limits) {
        Difference d = compare(a, b);
        const std::string text = difference_text(d), json = difference_json(d);
        judge(d, limits);
        CHECK(difference_text(d).substr(0, text.size()) == text); // nothing else changes
        const std::string more = difference_json(d).substr(json.size() - 3);
        constexpr const char *words[] = {"equal", "within", "different"};
        CHECK(more == std::string(",\n  \"verdict\": \"") + words[static_cast<size_t>(*d.verdict)] + "\" }\n");
        return difference_text(d).substr(text.size());
    };
    const Picture half = row({1.5f, 1.5f}), one = row({1, 1}), next = row({1, std::nextafterf(1, 2)}); // RMSE 0.5
    const std::string equal = "the pictures are equal to the bit\n", within = "the pictures are within the tolerance\n",
                      different = "the pictures are different";
    CHECK(verdict(one, one, {}) == equal);
    CHECK(verdict(one, one, {0, 0, 0}) == equal);
    CHECK(verdict(one, next, {}) == different + "\n");
    CHECK(verdict(half, one, {0.5, {}, {}}) == within);
    CHECK(verdict(half, one, {0.49, {}, {}}) == different + ": relative RMSE above 0.49\n");
    CHECK(verdict(half, one, {{}, 0, {}}) == within); // both are shown as white
    CHECK(verdict(row({0}), row({1}), {{}, 0.9, {}}) == different + ": mean FLIP above 0.9\n");
    CHECK(verdict(one, next, {{}, {}, 1}) == within);
    CHECK(verdict(one, next, {{}, {}, 0}) == different + ": largest difference in ulps above 0\n");
    CHECK(verdict(half, one, {0.1, 1, 5}) ==
          different + ": relative RMSE above 0.1, largest difference in ulps above 5\n");
    CHECK(verdict(row({-0.0f}), row({0}), {}) == different + "\n");
    CHECK(verdict(row({-0.0f}), row({0}), {0, {}, {}}) == within);
    // PNG shows both as nan_color, so that FLIP is 0.
    const Picture magenta{1, 1, {1, 0, 1}};
    CHECK(verdict(row({not_a_number}), magenta, {{}, 1, {}}) == different + ": a NaN meets another value\n");
    CHECK(verdict(row({not_a_number}), row({not_a_number}), {}) == equal);
    // An infinity is shown as the largest number is, and is as many ulps away from other numbers as those are apart.
    for (float other : {1.0f, std::numeric_limits<float>::max(), -inf}) {
        CHECK(verdict(row({inf}), row({other}), {{}, 1, nan_ulps - 1}) ==
              different + ": an infinity meets another value\n");
        CHECK(verdict(row({other}), row({inf}), {{}, 1, nan_ulps - 1}) ==
              different + ": an infinity meets another value\n");
    }
    CHECK(verdict(row({inf, 1}), row({inf, 2}), {1000, {}, {}}) == different + ": relative RMSE above 1000\n");
    CHECK(verdict(row({inf, 1}), row({inf, 1}), {}) == equal);
}

TEST_CASE("compare: what JSON cannot hold is null, and text has no sign of NaN") {
    const std::string equal = difference_json(compare(row({1}), row({1})));
    CHECK(equal.find("\"first_differing_pixel\": null,") != std::string::npos);
    CHECK(equal.find("\"psnr\": null,") != std::string::npos);
    const Difference d = compare(row({not_a_number}), row({1}));
    CHECK(difference_json(d).find("\"rmse\": null,") != std::string::npos);
    CHECK(difference_text(d).find("RMSE                            nan\n") != std::string::npos);
    CHECK(difference_text(d).find("largest difference in ulps      nan\n") != std::string::npos);
    CHECK(difference_text(compare(row({1}), row({1}))).find("first differing pixel           none\n") !=
          std::string::npos);
}

TEST_CASE("compare: the difference picture runs from black to pale yellow") {
    const Picture a{1, 1, {0, 1, 0}}, b{1, 1, {0, 0, 1}};
    CHECK(srgb_bytes(difference_picture(a, a)) == Bytes{0, 0, 0});
    CHECK(srgb_bytes(difference_picture(a, b)) == Bytes{252, 253, 191}); // the largest error, 1
    // Greys of byte 30 and 60 on black have errors 0.313429 and 0.552524: 0.253717 of the second step, 0.210096 of the
    // third.
    const float grey30 = static_cast<float>(srgb_to_linear(30 / 255.0)),
                grey60 = static_cast<float>(srgb_to_linear(60 / 255.0));
    CHECK(srgb_bytes(difference_picture(row({0}), row({grey30}))) == Bytes{107, 27, 123});
    CHECK(srgb_bytes(difference_picture(row({0}), row({grey60}))) == Bytes{197, 72, 116});
    const Picture black = row({0}), white = row({1}); // 0.96738: 0.86953 of the last step
    CHECK(srgb_bytes(difference_picture(black, white)) == Bytes{252, 238, 179});
}

TEST_CASE("compare: what is beyond the noise of B") {
    // RMSE 5 and noise 3 leave 4, relative to a mean of 2; 3 and 5 leave nothing; a NaN is no figure.
    const Picture b = row({1, 3}), error = row({3, 3});
    Difference d = compare(row({6, 8}), b);
    CHECK(difference_text(d).find("noise") == std::string::npos);
    weigh_noise(d, b, error);
    CHECK(*d.relative_noise == 1.5);
    CHECK(*d.relative_rmse_beyond_noise == 2);
    CHECK(difference_text(d).find("  beyond the noise of B         2\nrelative noise of B             1.5\n") !=
          std::string::npos);
    CHECK(difference_json(d).find("\"relative_noise\": 1.5,\n  \"relative_rmse_beyond_noise\": 2,") !=
          std::string::npos);
    Limits limits;
    limits.relative_rmse = 2;
    judge(d, limits); // where all of the RMSE, 2.5, is not
    CHECK(d.verdict == Verdict::within);
    limits.relative_rmse = 1.99;
    judge(d, limits);
    CHECK(d.verdict == Verdict::different);
    CHECK(d.exceeded == "relative RMSE beyond the noise of B above 1.99");
    d = compare(row({4, 6}), b);
    weigh_noise(d, b, row({5, 5}));
    CHECK(*d.relative_rmse_beyond_noise == 0);
    d = compare(row({not_a_number, 6}), b);
    weigh_noise(d, b, error);
    CHECK(std::isnan(*d.relative_rmse_beyond_noise));
    // What is no standard error is not weighed: it would hide any difference.
    for (float wrong : {inf, not_a_number, -1.0f})
        CHECK(refusal_of([&] {
                  weigh_noise(d, b, row({3, wrong}), "b.pfm", "e.pfm");
              }).rfind("e.pfm: found the standard error ", 0) == 0);
    CHECK(refusal_of([&] {
              weigh_noise(d, b, row({3, inf}), "b.pfm", "e.pfm");
          }) ==
          "e.pfm: found the standard error inf at 1,0, expected numbers of at least 0 (a single sample has none)");
}
