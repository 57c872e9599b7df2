// Figures are doubles, summed in pixel order, so they are the same on every machine.
#include "core/numbers/elementary.h"
#include "host/base/error.h"
#include "host/images/compare.h"
#include "host/images/drawing.h"
#include "host/images/flip.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>

namespace wisp {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::string size_text(const Picture &p) { return std::to_string(p.width) + " x " + std::to_string(p.height); }

uint32_t bits_of(float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, 4);
    return bits;
}

// Numbers in order give integers in order, neighbours differ by 1, and both zeros are 0.
int64_t rank(uint32_t bits) {
    const int64_t magnitude = bits & 0x7fffffff;
    return bits >> 31 ? -magnitude : magnitude;
}

// a - b, but 0 for equal bits: infinity - infinity would be NaN.
double value_difference(float a, float b) {
    return bits_of(a) == bits_of(b) ? 0 : static_cast<double>(a) - static_cast<double>(b);
}

uint64_t ulps_between(float a, float b) {
    if (bits_of(a) == bits_of(b)) return 0;
    if (std::isnan(a) || std::isnan(b)) return nan_ulps;
    const int64_t ulps = rank(bits_of(a)) - rank(bits_of(b));
    return static_cast<uint64_t>(ulps < 0 ? -ulps : ulps);
}

// The larger one; NaN wins.
double larger(double a, double b) { return std::isnan(a) || a > b ? a : b; }

// An error relative to the mean of B: infinite where that tells no scale.
double relative_to(double mean, double error) {
    return error == 0 ? 0 : mean <= 0 || std::isinf(mean) ? infinity : error / mean;
}

// The sums of pixels that RMSE and its mean need.
struct Sums {
    double squares = 0, values_of_b = 0;
    uint64_t count = 0;

    void add(const Picture &a, const Picture &b, size_t pixel) {
        for (size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
            const double d = value_difference(a.rgb[i], b.rgb[i]);
            squares += d * d;
            values_of_b += static_cast<double>(b.rgb[i]);
            ++count;
        }
    }
    double rmse() const { return std::sqrt(squares / static_cast<double>(count)); }
    double relative_rmse() const { return relative_to(values_of_b / static_cast<double>(count), rmse()); }
};

double luminance(const Picture &p, size_t pixel) { // ITU-R BT.709; NaN counts as brightest
    const double y = 0.2126 * static_cast<double>(p.rgb[3 * pixel]) +
                     0.7152 * static_cast<double>(p.rgb[3 * pixel + 1]) +
                     0.0722 * static_cast<double>(p.rgb[3 * pixel + 2]);
    return std::isnan(y) ? infinity : y;
}

// For each pixel 1 when it is one of the floor(0.1 %) of largest luminance; of equals, the earlier ones.
std::vector<uint8_t> bright_pixels(const Picture &picture) {
    std::vector<double> brightness(picture.rgb.size() / 3);
    std::vector<size_t> order(brightness.size());
    for (size_t i = 0; i < order.size(); ++i) {
        brightness[i] = luminance(picture, i);
        order[i] = i;
    }
    const size_t count = order.size() / 1000;
    std::nth_element(order.begin(), order.begin() + count, order.end(), [&](size_t i, size_t j) {
        return brightness[i] != brightness[j] ? brightness[i] > brightness[j] : i < j;
    });
    std::vector<uint8_t> bright(order.size(), 0);
    for (size_t i = 0; i < count; ++i) bright[order[i]] = 1;
    return bright;
}

// 20 log10(peak of B / RMSE).
double psnr(const Picture &b, double rmse) {
    if (rmse == 0) return infinity;
    double peak = 0;
    for (const float value : b.rgb) peak = std::max(peak, static_cast<double>(value)); // passes over NaN
    const double ratio = peak / rmse;
    if (ratio == 0) return -infinity;
    return std::isfinite(ratio) ? 20 / 2.30258509299404568 * log(ratio) : ratio; // ln 10
}

std::string figure(double value) {
    if (std::isnan(value)) return "nan"; // printf shows a sign that has no meaning
    char text[40];
    std::snprintf(text, sizeof text, "%.9g", value);
    return text;
}

std::string json_figure(double value) { return std::isfinite(value) ? figure(value) : "null"; }

const char *verdict_word(Verdict verdict) {
    constexpr const char *words[] = {"equal", "within", "different"};
    return words[static_cast<size_t>(verdict)];
}

std::string verdict_text(const Difference &d) {
    constexpr const char *words[] = {"equal to the bit", "within the tolerance", "different"};
    return std::string("the pictures are ") + words[static_cast<size_t>(*d.verdict)] +
           (d.exceeded.empty() ? "" : ": " + d.exceeded) + "\n";
}

void check_size(const Picture &a, const Picture &b, const std::string &name_a, const std::string &name_b) {
    if (a.width != b.width || a.height != b.height)
        throw InputError(name_b, size_text(b) + " pixels, expected " + size_text(a) + " as in " + name_a);
}

} // namespace

Difference compare(const Picture &a, const Picture &b, const std::string &name_a, const std::string &name_b) {
    check_size(a, b, name_a, name_b);
    Difference result;
    result.width = a.width;
    result.height = a.height;
    const std::vector<uint8_t> bright = bright_pixels(b);
    Sums all, all_but_bright;
    for (size_t pixel = 0; pixel < bright.size(); ++pixel) {
        bool differs = false;
        for (size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
            differs = differs || bits_of(a.rgb[i]) != bits_of(b.rgb[i]);
            const double absolute = std::abs(value_difference(a.rgb[i], b.rgb[i]));
            result.largest_absolute = larger(result.largest_absolute, absolute);
            result.largest_ulps = std::max(result.largest_ulps, ulps_between(a.rgb[i], b.rgb[i]));
        }
        if (differs && result.differing_pixels++ == 0) {
            result.first_x = static_cast<int>(pixel % a.width);
            result.first_y = static_cast<int>(pixel / a.width);
        }
        all.add(a, b, pixel);
        if (!bright[pixel]) all_but_bright.add(a, b, pixel);
    }
    result.rmse = all.rmse();
    result.relative_rmse = all.relative_rmse();
    result.relative_rmse_without_bright = all_but_bright.relative_rmse();
    result.psnr = psnr(b, result.rmse);
    const std::vector<double> errors = flip(a, b);
    for (const double error : errors) result.mean_flip += error;
    result.mean_flip /= static_cast<double>(errors.size());
    return result;
}

void weigh_noise(Difference &difference, const Picture &b, const Picture &error, const std::string &name_b,
                 const std::string &name_error) {
    check_size(b, error, name_b, name_error);
    double sum = 0, squares = 0;
    for (const float value : b.rgb) sum += static_cast<double>(value);
    for (size_t i = 0; i < error.rgb.size(); ++i) {
        const double value = static_cast<double>(error.rgb[i]);
        if (!(value >= 0) || std::isinf(value)) {
            const size_t pixel = i / 3;
            throw InputError(name_error, "found the standard error " + figure(value) + " at " +
                                             std::to_string(pixel % error.width) + "," +
                                             std::to_string(pixel / error.width) +
                                             ", expected numbers of at least 0 (a single sample has none)");
        }
        squares += value * value;
    }
    const double count = static_cast<double>(b.rgb.size()), mean = sum / count;
    const double beyond = difference.rmse * difference.rmse - squares / count;
    difference.relative_noise = relative_to(mean, std::sqrt(squares / count));
    difference.relative_rmse_beyond_noise =
        relative_to(mean, std::isnan(beyond) ? beyond : std::sqrt(std::max(beyond, 0.0)));
}

void judge(Difference &difference, const Limits &limits) {
    std::string &exceeded = difference.exceeded;
    exceeded = difference.largest_ulps == nan_ulps       ? "a NaN meets another value"
               : std::isinf(difference.largest_absolute) ? "an infinity meets another value"
                                                         : "";
    const auto check = [&exceeded](const char *what, double value, auto limit) {
        if (!limit || value <= static_cast<double>(*limit)) return;
        exceeded +=
            (exceeded.empty() ? "" : ", ") + std::string(what) + " above " + figure(static_cast<double>(*limit));
    };
    if (difference.relative_rmse_beyond_noise)
        check("relative RMSE beyond the noise of B", *difference.relative_rmse_beyond_noise, limits.relative_rmse);
    else
        check("relative RMSE", difference.relative_rmse, limits.relative_rmse);
    check("mean FLIP", difference.mean_flip, limits.mean_flip);
    check("largest difference in ulps", static_cast<double>(difference.largest_ulps), limits.ulps);
    const bool limited = limits.relative_rmse || limits.mean_flip || limits.ulps;
    difference.verdict = difference.differing_pixels == 0 ? Verdict::equal
                         : limited && exceeded.empty()    ? Verdict::within
                                                          : Verdict::different;
}

std::string difference_text(const Difference &d) {
    const std::string pixels = std::to_string(uint64_t(d.width) * d.height);
    std::string text;
    const auto line = [&text](const char *label, const std::string &value) {
        text += label + std::string(32 - std::strlen(label), ' ') + value + "\n";
    };
    line("size", std::to_string(d.width) + " x " + std::to_string(d.height));
    line("differing pixels", std::to_string(d.differing_pixels) + " of " + pixels);
    line("first differing pixel",
         d.differing_pixels ? std::to_string(d.first_x) + " " + std::to_string(d.first_y) : "none");
    line("largest absolute difference", figure(d.largest_absolute));
    line("largest difference in ulps", d.largest_ulps == nan_ulps ? "nan" : std::to_string(d.largest_ulps));
    line("RMSE", figure(d.rmse));
    line("relative RMSE", figure(d.relative_rmse));
    line("  without brightest 0.1 %", figure(d.relative_rmse_without_bright));
    if (d.relative_noise) {
        line("  beyond the noise of B", figure(*d.relative_rmse_beyond_noise));
        line("relative noise of B", figure(*d.relative_noise));
    }
    line("PSNR", figure(d.psnr) + " dB");
    line("mean FLIP", figure(d.mean_flip));
    if (d.verdict) text += verdict_text(d);
    return text;
}

std::string difference_json(const Difference &d) {
    const std::string first =
        d.differing_pixels ? "[" + std::to_string(d.first_x) + ", " + std::to_string(d.first_y) + "]" : "null";
    return "{ \"width\": " + std::to_string(d.width) + ", \"height\": " + std::to_string(d.height) +
           ",\n  \"differing_pixels\": " + std::to_string(d.differing_pixels) +
           ",\n  \"first_differing_pixel\": " + first +
           ",\n  \"largest_absolute\": " + json_figure(d.largest_absolute) +
           ",\n  \"largest_ulps\": " + std::to_string(d.largest_ulps) + ",\n  \"rmse\": " + json_figure(d.rmse) +
           ",\n  \"relative_rmse\": " + json_figure(d.relative_rmse) +
           ",\n  \"relative_rmse_without_bright\": " + json_figure(d.relative_rmse_without_bright) +
           (d.relative_noise ? ",\n  \"relative_noise\": " + json_figure(*d.relative_noise) +
                                   ",\n  \"relative_rmse_beyond_noise\": " + json_figure(*d.relative_rmse_beyond_noise)
                             : "") +
           ",\n  \"psnr\": " + json_figure(d.psnr) + ",\n  \"mean_flip\": " + json_figure(d.mean_flip) +
           (d.verdict ? std::string(",\n  \"verdict\": \"") + verdict_word(*d.verdict) + "\"" : "") + " }\n";
}

Picture difference_picture(const Picture &a, const Picture &b) {
    return heat_picture(a.width, a.height, flip(a, b), 1, {});
}

} // namespace wisp
