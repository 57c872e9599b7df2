// FLIP against closed forms of its definition, against its authors' evaluator, and in its order: equal 0, more of the
// same distortion more.
#include "host/images/flip.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>

using namespace wisp;

namespace {

// A picture of 8-bit sRGB values f(x, y, channel).
template <class F> Picture picture_of(int width, int height, F f) {
    Picture picture{width, height, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) picture.rgb.push_back(static_cast<float>(srgb_to_linear(f(x, y, c) / 255.0)));
    return picture;
}

Picture uniform(float r, float g, float b) {
    Picture picture{5, 4, {}};
    for (int i = 0; i < 20; ++i) picture.rgb.insert(picture.rgb.end(), {r, g, b});
    return picture;
}

double mean_flip(const Picture &a, const Picture &b) {
    double sum = 0;
    for (const double error : flip(a, b)) sum += error;
    return sum / (a.width * a.height);
}

// Lightness of a grey of this linear value.
long double lightness(long double y) { return 116 * std::cbrt(y) - 16; }

// The colour error of two greys, from the definition: HyAB is the difference in lightness, to the power 0.7; 0.4 of the
// largest distance, green to blue, gives 0.95. Their L*, a*, b* follow from the primaries of sRGB and FLIP's white, D65
// at (0.31271, 0.32902); with the Hunt effect a* and b* are times 0.01 L*.
long double grey_error(long double lightness_difference) {
    const long double green[3] = {87.73621066L, 0.8773621066L * -86.17870509L, 0.8773621066L * 83.18256604L};
    const long double blue[3] = {32.29817001L, 0.3229817001L * 79.19359826L, 0.3229817001L * -107.85863725L};
    const long double largest = std::pow(green[0] - blue[0] + std::hypot(green[1] - blue[1], green[2] - blue[2]), 0.7L);
    const long double knee = 0.4L * largest, distance = std::pow(lightness_difference, 0.7L);
    return distance < knee ? 0.95L * distance / knee : 0.95L + 0.05L * (distance - knee) / (largest - knee);
}

int noise(int x, int y, int c) { // -16 to 15
    const uint32_t hash = uint32_t(x) * 2654435761u ^ uint32_t(y) * 2246822519u ^ uint32_t(c) * 3266489917u;
    return static_cast<int>(hash >> 27) - 16;
}
int clamped(int value) { return value < 0 ? 0 : value > 255 ? 255 : value; }
int wave(int x, int y, int c) { return (4 * x + 3 * y * (c + 1)) % 256; }

} // namespace

TEST_CASE("flip: equal pictures have error 0 everywhere") {
    const Picture picture = picture_of(64, 48, wave);
    for (const double error : flip(picture, picture)) CHECK(error == 0);
    Picture brighter = uniform(2, 3, 4), white = uniform(1, 1, 1); // PNG shows the same
    CHECK(mean_flip(brighter, white) == 0);
}

TEST_CASE("flip: uniform colours have no features, so the error is that of colours") {
    CHECK(mean_flip(uniform(0, 1, 0), uniform(0, 0, 1)) == doctest::Approx(1).epsilon(1e-12)); // the largest there is
    CHECK(mean_flip(uniform(0, 0, 0), uniform(1, 1, 1)) ==
          doctest::Approx(static_cast<double>(grey_error(100))).epsilon(1e-9)); // 0.967
    for (const int byte : {30, 60, 120, 240}) {                                 // below and above the knee
        const Picture single_channel = picture_of(5, 4, [&](int, int, int) { return byte; });
        const long double linear = std::pow((byte / 255.0L + 0.055L) / 1.055L, 2.4L);
        CHECK(mean_flip(uniform(0, 0, 0), single_channel) ==
              doctest::Approx(static_cast<double>(grey_error(lightness(linear)))).epsilon(1e-9));
    }
}

TEST_CASE("flip: an edge that is missing, at its two pixels") {
    const Picture edge = picture_of(64, 3, [](int x, int, int) { return x < 32 ? 0 : 255; });
    const Picture black = picture_of(64, 3, [](int, int, int) { return 0; });
    const std::vector<double> errors = flip(edge, black);

    // Half of the edge filter sees white: its weights on one side sum to 1. The point filter answers less.
    const double feature = std::sqrt(1 / std::sqrt(2.0));
    // The luminance filter sees white in all its weights on one side, and at 32 in the middle too.
    long double sum = 0;
    for (int i = -10; i <= 10; ++i) {
        const long double degrees = i / (3840 * 3.14159265358979323846L / 180);
        sum += std::exp(-9.86960440108935861883L * degrees * degrees / 0.0047L); // pi^2
    }
    const long double one_side = (1 - 1 / sum) / 2;
    for (int y = 0; y < 3; ++y) {
        const double left = static_cast<double>(grey_error(lightness(one_side)));
        const double right = static_cast<double>(grey_error(lightness(one_side + 1 / sum)));
        CHECK(errors[64 * y + 31] == doctest::Approx(std::pow(left, 1 - feature)).epsilon(1e-9));
        CHECK(errors[64 * y + 32] == doctest::Approx(std::pow(right, 1 - feature)).epsilon(1e-9));
        CHECK(errors[64 * y] == 0); // far away nothing differs
        CHECK(errors[64 * y + 63] == doctest::Approx(static_cast<double>(grey_error(100))).epsilon(1e-9));
    }
}

TEST_CASE("flip: the values of the authors' evaluator (version 1.6, single precision)") {
    const Picture picture = picture_of(64, 48, wave);
    const Picture shifted = picture_of(64, 48, [](int x, int y, int c) { return wave(x + 2, y, c); });
    const Picture rotated = picture_of(64, 48, [](int x, int y, int c) { return wave(x, y, (c + 1) % 3); });
    const Picture noisy =
        picture_of(64, 48, [](int x, int y, int c) { return clamped(wave(x, y, c) + noise(x, y, c)); });
    const Picture plain = picture_of(64, 48, [](int, int, int c) { return 40 * c; });
    const Picture dots =
        picture_of(64, 48, [](int x, int y, int c) { return x % 16 == 8 && y % 16 == 8 ? 255 : 40 * c; });
    const auto close = [](double value) { return doctest::Approx(value).epsilon(2e-6); };
    CHECK(mean_flip(picture, shifted) == close(0.335912327));
    CHECK(mean_flip(picture, rotated) == close(0.850537594));
    CHECK(mean_flip(picture, noisy) == close(0.058218607));
    CHECK(mean_flip(dots, plain) == close(0.043200533));
    const size_t pixel = 64 * 30 + 20;
    CHECK(flip(picture, shifted)[pixel] == close(0.7735730));
    CHECK(flip(picture, rotated)[pixel] == close(0.9769129));
    CHECK(flip(picture, noisy)[pixel] == close(0.0344847));
}

TEST_CASE("flip: the order of the pictures does not matter, to the bit") {
    const Picture a = picture_of(40, 30, wave);
    const Picture b = picture_of(40, 30, [](int x, int y, int c) { return clamped(wave(y, x, c) + noise(x, y, c)); });
    CHECK(flip(a, b) == flip(b, a));
}

TEST_CASE("flip: more noise and more blur are more error") {
    const Picture picture = picture_of(64, 48, wave);
    double last = 0;
    for (const int amount : {1, 2, 4, 8}) {
        const Picture noisy = picture_of(
            64, 48, [&](int x, int y, int c) { return clamped(wave(x, y, c) + noise(x, y, c) * amount / 2); });
        const double error = mean_flip(picture, noisy);
        CHECK(error > last);
        CHECK(error < 1);
        last = error;
    }
    last = 0;
    for (const int radius : {1, 2, 3, 5}) {
        const Picture blurred = picture_of(64, 48, [&](int x, int y, int c) {
            int sum = 0;
            for (int i = -radius; i <= radius; ++i) sum += wave(x + i + 64, y, c);
            return sum / (2 * radius + 1);
        });
        const double error = mean_flip(picture, blurred);
        CHECK(error > last);
        last = error;
    }
}

TEST_CASE("flip: pictures smaller than the filters, and values that are no numbers") {
    CHECK(flip(Picture{1, 1, {0, 1, 0}}, Picture{1, 1, {0, 0, 1}})[0] == doctest::Approx(1).epsilon(1e-12));
    const Picture bad{1, 2, {std::nanf(""), 0, 0, INFINITY, 0, 0}}, shown{1, 2, {1, 0, 1, 1, 0, 0}};
    CHECK(mean_flip(bad, shown) == 0); // NaN is shown as magenta, infinity as red
}
