// How two pictures differ, in figures and as a picture.
#pragma once
#include "host/images/picture.h"
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace wisp {

// Whether pictures are equal to the bit, differ within what is allowed, or differ by more.
enum class Verdict { equal, within, different };

// What is allowed. Where nothing is given, bits must match.
struct Limits {
    std::optional<double> relative_rmse, mean_flip;
    std::optional<uint64_t> ulps; // of the largest difference
};

// Of picture A against picture B. Two values differ when their bits do. Equal values count as difference 0 even where
// they are NaN or infinite; where a NaN meets another value, the absolute difference and RMSE are NaN.
struct Difference {
    int width = 0, height = 0;
    uint64_t differing_pixels = 0;
    int first_x = -1, first_y = -1;          // the first differing pixel in reading order; -1 when there is none
    double largest_absolute = 0;             // of any channel
    uint64_t largest_ulps = 0;               // float32 values passed from one to the other, -0 and 0 being one value;
                                             // nan_ulps, more than there are between any two numbers, with a NaN
    double rmse = 0;                         // over all channels of all pixels
    double relative_rmse = 0;                // RMSE / mean of B; infinite when B's mean is not above 0 and RMSE is
    double relative_rmse_without_bright = 0; // the same without the floor(0.1 %) of B's pixels of largest luminance
    double psnr = 0;                         // dB, peak = largest value of B; infinite when RMSE is 0
    double mean_flip = 0;                    // of the pictures as PNG shows them, 0 to 1; see flip.h
    // Given B's standard errors: their root mean square, and what RMSE has beyond it (sqrt(RMSE^2 - noise^2), 0 where
    // noise explains all of it), both relative to the mean of B.
    std::optional<double> relative_noise, relative_rmse_beyond_noise;
    std::optional<Verdict> verdict; // given limits
    std::string exceeded;           // in words: a NaN or an infinity on one side only, and the limits that it breaks
};
constexpr uint64_t nan_ulps = uint64_t{1} << 32;

// Throws InputError `NAME_B: W x H pixels, expected W x H as in NAME_A` when the sizes differ.
Difference compare(const Picture &a, const Picture &b, const std::string &name_a = "A",
                   const std::string &name_b = "B");

// Sets the figures beyond the noise. `error`, of the same size: the standard error of each value of B.
// Throws InputError like compare().
void weigh_noise(Difference &difference, const Picture &b, const Picture &error, const std::string &name_b = "B",
                 const std::string &name_error = "error");

// Sets the verdict. The limit of the relative RMSE is for what is beyond the noise, where that is known. Within the limits is what breaks none of them; no limit allows a NaN on one side only.
void judge(Difference &difference, const Limits &limits);

// The figures, one a line, and the verdict in words, for people.
std::string difference_text(const Difference &difference);

// The figures as one JSON object, its keys the names above, but `first_differing_pixel`: [x, y] or null, and
// `verdict`: "equal", "within" or "different". What JSON cannot hold, infinity and NaN, is null.
std::string difference_json(const Difference &difference);

// Each pixel's FLIP error, 0 to 1, from black over purple and orange to pale yellow. Sizes must be equal.
Picture difference_picture(const Picture &a, const Picture &b);

} // namespace wisp
