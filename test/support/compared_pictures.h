// Differences between pictures, and pictures of the path tracer to compare with.
#pragma once
#include "support/built_smoke.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

inline double relative_difference(const std::vector<float> &a, const std::vector<float> &b) {
    double squares = 0, sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        squares += d * d;
        sum += static_cast<double>(b[i]);
    }
    return std::sqrt(squares * static_cast<double>(a.size())) / sum;
}

inline double sum_of(const std::vector<float> &values) {
    double sum = 0;
    for (float value : values) sum += static_cast<double>(value);
    return sum;
}

// The mean of the path tracer's samples per pixel; `noise` is set to the relative RMS noise of the picture.
inline std::vector<float> reference_of(const Scene &scene, int pixels, uint32_t passes, double &noise,
                                       uint32_t depth = 0) {
    Settings settings = small_settings(pixels);
    settings.goal = Goal::reference;
    settings.depth = depth;
    settings.last_pass = passes;
    std::vector<unsigned char> memory(renderer.plan(scene, settings).arena_bytes);
    Arena arena(memory.data(), memory.size());
    std::vector<PixelSums> sums(static_cast<size_t>(pixels * pixels));
    Statistics statistics;
    Job job = {scene, settings, arena, statistics};
    job.pixels = sums.data();
    REQUIRE(renderer.render(job) == Status::done);
    std::vector<float> mean;
    double variance = 0, sum = 0;
    for (const PixelSums &pixel : sums)
        for (const PixelSums::Channel &c : pixel.channels) {
            const double n = passes, x = static_cast<double>(c.sum.low) * 0x1p-32 / n;
            const double square = static_cast<double>(c.square.high) + static_cast<double>(c.square.low) * 0x1p-64;
            mean.push_back(static_cast<float>(x));
            variance += std::max(0.0, square / n - x * x) / n;
            sum += x;
        }
    noise = std::sqrt(variance * static_cast<double>(mean.size())) / sum;
    return mean;
}

} // namespace wisp::WISP_ARITH
