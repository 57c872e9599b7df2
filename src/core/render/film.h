// The film: the mean of each pixel's samples.
#pragma once
#include "core/geometry/camera.h"
#include "core/geometry/sample_pattern.h"
#include "core/render/frame.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t units_of_sample = 16; // of work

// All samples of the film, so many times.
inline void expect_samples(const Frame &frame, uint64_t times) {
    frame.watch.expect(frame.settings.crop.pixels() * frame.settings.samples * times * units_of_sample);
}

// nullptr for a pixel that is not recorded.
inline PixelRecorder *recorder_of(const Frame &frame, int32_t x, int32_t y) {
    PixelRecorder *const any = frame.recorder;
    return any && (any->every_pixel || (any->trace.x == x && any->trace.y == y)) ? any : nullptr;
}

// Fills job.rgb with the means of radiance(ray, x, y, sample, recorder), and hands on its rows: x and y are the pixel's
// column and row.
template <class Radiance> Status expose_film(const Frame &frame, Radiance &&radiance) {
    const Scene &scene = frame.scene;
    const Crop &crop = frame.settings.crop;
    const uint32_t samples = frame.settings.samples;
    const View view(scene.camera);
    const SamplePattern pattern(samples);
    const Observer &observer = frame.job.observer;
    float *rgb = frame.job.rgb;
    expect_samples(frame, 1);
    for (int32_t y = crop.y0; y < crop.y1; y += crop.step) {
        if (observer.on_row) rgb = frame.job.rgb;
        for (int32_t x = crop.x0; x < crop.x1; x += crop.step) {
            Color sum(Real(0));
            PixelRecorder *const recorder = recorder_of(frame, x, y);
            for (uint32_t i = 0; i < samples; ++i) {
                const Real column = Real(x) + pattern.u(i), row_ = Real(y) + pattern.v(i);
                const Ray ray = view.ray_through(column, row_);
                ++frame.statistics.rays.primary;
                if (is_recording(recorder)) recorder->sample(*recorder, i, column, row_);
                const Color sample = radiance(ray, x, y, i, recorder);
                if (is_recording(recorder)) recorder->sample_end(*recorder, i, sample);
                sum += sample;
            }
            if (!frame.watch.done(uint64_t{samples} * units_of_sample)) return Status::stopped;
            const Color mean = sum / Real(static_cast<int32_t>(samples));
            *rgb++ = to_float_scaled(mean.x, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.y, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.z, scene.radiance_exponent);
            if (is_recording(recorder)) recorder->pixel(*recorder, samples, mean, rgb - 3);
        }
        if (observer.on_row && !observer.on_row(observer.context, (y - crop.y0) / crop.step, frame.job.rgb))
            return Status::stopped;
    }
    return Status::done;
}

} // namespace wisp::WISP_ARITH
