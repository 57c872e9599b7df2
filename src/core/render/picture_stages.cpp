// The stages of a picture: how rays pass through the smoke (S1), and the camera's rays.
#include "core/numbers/sample_sums.h"
#include "core/render/film.h"
#include "core/render/stages.h"

namespace wisp::WISP_ARITH::stages {

namespace {

// How a march asks the lights.
SingleScatterer lights_of_march(Frame &frame) {
    return {frame.state.lights, frame.decisions.lights_in_smoke,
            frame.decisions.light_depths ? &frame.state.smoke.depths : nullptr,
            frame.decisions.surfaces ? &frame.shadows : nullptr};
}

// A march for emission and single scattering, and random paths for the rest.
template <class AnyMarcher> struct MarchAndPaths {
    AnyMarcher &marcher;
    const PathTracer &paths;
    uint32_t count; // of paths from a ray
    Pcg32 generator;
};

void add_channels(PixelSums::Channel &to, const Color &sample) {
    add_sample(to, sample.x, 0);
    add_sample(to, sample.y, 0);
    add_sample(to, sample.z, 0);
}

template <class AnyMarcher>
Segment march(MarchAndPaths<AnyMarcher> &both, const Ray &ray, Real end, PixelRecorder *recorder) {
    Segment seen = march(both.marcher, ray, end, recorder);
    auto &counted = both.paths.statistics->paths;
    Color sum(Real(0));
    for (uint32_t i = 0; i < both.count && both.paths.watch.go_on(1); ++i) {
        const Color path = sample_multiple_scattering(both.paths, ray, end, both.generator);
        add_channels(counted.each, path);
        sum += path;
    }
    const Color mean = sum / Real(static_cast<int32_t>(both.count));
    add_channels(counted.of_rays, mean);
    seen.radiance += mean;
    return seen;
}

// Rays that pass through nothing.
struct NoSmoke {};
Segment march(NoSmoke &, const Ray &, Real, PixelRecorder *) { return empty_segment(); }

// What a sample of a pixel draws at random is a function of its place alone.
template <class AnyMarcher> void begin_sample(AnyMarcher &, const Settings &, int32_t, int32_t, uint32_t) {}
template <class AnyMarcher>
void begin_sample(MarchAndPaths<AnyMarcher> &both, const Settings &settings, int32_t x, int32_t y, uint32_t sample) {
    both.generator = pass_generator(settings, sample, x, y);
}

// Radiance of smoke in front of the background.
template <class AnyMarcher> Status trace_smoke(Frame &frame, AnyMarcher &marcher) {
    const Color background = vec_of(frame.scene.background);
    return expose_film(frame, [&](const Ray &ray, int32_t x, int32_t y, uint32_t sample, PixelRecorder *recorder) {
        begin_sample(marcher, frame.settings, x, y, sample);
        if (is_recording(recorder)) recorder->ray(*recorder, RayKind::camera, 0, ray, Color(Real(1)), Real(1));
        const Segment smoke = march(marcher, ray, infinite_distance, recorder);
        const Color radiance = smoke.radiance + background * smoke.transmittance;
        frame.statistics.rays.saturated += is_saturated(radiance);
        if (is_recording(recorder))
            recorder->ray_end(*recorder, {false, smoke.radiance, smoke.transmittance, background, radiance, 0});
        return radiance;
    });
}

template <class AnyMarcher> Status trace_surfaces(Frame &frame, AnyMarcher &marcher) {
    Whitted &whitted = frame.whitted;
    return expose_film(frame, [&](const Ray &ray, int32_t x, int32_t y, uint32_t sample, PixelRecorder *recorder) {
        begin_sample(marcher, frame.settings, x, y, sample);
        whitted.recorder = recorder;
        begin_sample(frame.shadows, x, y, sample);
        return trace(whitted, ray);
    });
}

// Camera rays through the smoke of a marcher: up to the background, or among surfaces. Not inlined: a small stack would
// hold what each marcher needs.
template <class AnyMarcher> __attribute__((noinline)) Status trace_through(Frame &frame, AnyMarcher &marcher) {
    if (!frame.decisions.surfaces) return trace_smoke(frame, marcher);
    frame.whitted.medium = &frame.medium();
    frame.whitted.marcher = &marcher;
    frame.whitted.march = [](void *any, const Ray &ray, Real end, PixelRecorder *recorder) {
        return march(*static_cast<AnyMarcher *>(any), ray, end, recorder);
    };
    return trace_surfaces(frame, marcher);
}

// With random paths, where decide() wants them.
template <class AnyMarcher> Status trace_picture(Frame &frame, AnyMarcher &marcher) {
    if (!frame.decisions.paths) return trace_through(frame, marcher);
    MarchAndPaths<AnyMarcher> both = {marcher, frame.paths, frame.settings.paths, Pcg32(0)};
    return trace_through(frame, both);
}

// The samples of the reference's passes, added to job.pixels.
Status trace_paths(Frame &frame) {
    const Scene &scene = frame.scene;
    const Settings &settings = frame.settings;
    const Medium &medium = frame.medium();
    struct Sampler {
        const PathTracer &paths;
        Pcg32 generator;
    } sampler = {frame.paths, Pcg32(0)};
    frame.paths.medium = &medium; // without smoke no stage has set it
    Whitted &whitted = frame.whitted;
    if (frame.decisions.surfaces && !medium.empty()) {
        whitted.medium = &medium;
        whitted.marcher = &sampler;
        whitted.march = [](void *any, const Ray &part, Real end, PixelRecorder *) {
            Sampler &own = *static_cast<Sampler *>(any);
            return Segment{sample_radiance(own.paths, part, end, Color(Real(0)), own.generator),
                           exp(-optical_depth(*own.paths.medium, part, end))};
        };
    }
    const auto sample = [&](const Ray &ray, PixelRecorder *recorder) {
        whitted.recorder = recorder;
        if (frame.decisions.surfaces) return trace(whitted, ray);
        if (is_recording(recorder)) {
            recorder->ray(*recorder, RayKind::camera, 0, ray, Color(Real(1)), Real(1));
            recorder->ray_end(*recorder, {false, Color(Real(0)), exp(-optical_depth(medium, ray, infinite_distance)),
                                          Color(Real(0)), Color(Real(0)), 0});
        }
        Color behind = vec_of(scene.background);
        if (largest(behind) > Real(0)) behind = behind * exp(-optical_depth(medium, ray, infinite_distance));
        return sample_radiance(frame.paths, ray, infinite_distance, behind, sampler.generator);
    };
    const View view(scene.camera);
    const SamplePattern pattern(settings.samples);
    const Crop &crop = settings.crop;
    const uint32_t passes = settings.last_pass - settings.first_pass;
    expect_samples(frame, passes);
    for (uint32_t pass = 0; pass < passes; ++pass) {
        PixelSums *pixel = frame.job.pixels;
        // What rays meet first is the same in every pass.
        PixelRecorder *const recorder = pass == 0 && frame.job.layers ? frame.recorder : nullptr;
        for (int32_t y = crop.y0; y < crop.y1; y += crop.step) {
            for (int32_t x = crop.x0; x < crop.x1; x += crop.step, ++pixel) {
                sampler.generator = pass_generator(settings, settings.first_pass + pass, x, y);
                Pcg32 rounding(~uint64_t{Pcg32(sampler.generator)()}); // its numbers are not those of the paths
                for (uint32_t i = 0; i < settings.samples; ++i) {
                    const Real column = Real(x) + pattern.u(i), row = Real(y) + pattern.v(i);
                    if (is_recording(recorder)) recorder->sample(*recorder, i, column, row);
                    const Color color = sample(view.ray_through(column, row), recorder);
                    if (is_recording(recorder)) recorder->sample_end(*recorder, i, color);
                    add_sample(pixel->channels[0], color.x, rounding());
                    add_sample(pixel->channels[1], color.y, rounding());
                    add_sample(pixel->channels[2], color.z, rounding());
                    ++frame.statistics.rays.primary;
                }
                if (is_recording(recorder)) {
                    constexpr float unknown[3] = {}; // it is the mean of all passes
                    recorder->pixel(*recorder, settings.samples, Color(Real(0)), unknown);
                }
                if (!frame.watch.done(uint64_t{settings.samples} * units_of_sample)) return Status::stopped;
            }
        }
    }
    return Status::done;
}

} // namespace

Status find_majorants(Frame &frame) {
    return make_path_tracer(frame.scene, frame.medium(), frame.state.lights, frame.surfaces(), frame.arena,
                            frame.statistics, frame.paths, frame.watch)
               ? Status::done
               : Status::out_of_memory;
}

uint64_t march_bytes(const Scene &scene, const Settings &, const Decisions &d, const Sizes &) {
    return d.march == MarchKind::steps       ? Arena::bytes<Real>(scene.smoke_count)
           : d.march == MarchKind::particles ? window_bytes(scene)
           : d.march == MarchKind::grid      ? march_room_bytes()
                                             : 0;
}

Status make_march(Frame &frame) {
    const Decisions &decisions = frame.decisions;
    const Medium &medium = frame.medium();
    const Irradiance *irradiance = frame.has_irradiance ? &frame.irradiance : nullptr;
    const StepLengths steps = step_lengths(frame.scene, medium, to_real<Real>(frame.settings.step));
    if (has(parts::resampled) && decisions.march == MarchKind::grid) {
        GridMarchRoom *room = make_march_room(frame.arena);
        if (!room) return Status::out_of_memory;
        frame.grid_marcher = {
            &medium,      &frame.state.smoke.depths, irradiance,        decisions.surfaces ? &frame.shadows : nullptr,
            steps.finest, frame.fluence.straight,    &frame.statistics, frame.watch,
            room};
    } else if (has(parts::exact) && decisions.march == MarchKind::particles) {
        ParticleMarcher &marcher = frame.particle_marcher;
        if (!make_window(frame.scene, frame.arena, marcher)) return Status::out_of_memory;
        marcher.sources = frame.sources;
        marcher.irradiance = irradiance;
        marcher.lights = lights_of_march(frame);
        marcher.medium = &medium;
        marcher.steps = steps;
        marcher.statistics = &frame.statistics;
        marcher.watch = frame.watch;
    } else if (has(parts::exact)) {
        Real *extinctions = frame.arena.make<Real>(frame.scene.smoke_count);
        if (!extinctions) return Status::out_of_memory;
        frame.marcher = {&medium,     lights_of_march(frame), frame.photon_maps, irradiance, steps, frame.gather_radius,
                         extinctions, frame.gather,           &frame.statistics, frame.watch};
    }
    return Status::done;
}

Status make_layers(Frame &frame) {
    if (!frame.job.layers || frame.recorder) return Status::done;
    frame.recorder =
        make_layer_recorder(frame.scene, frame.decisions.layers, frame.whitted.materials, frame.settings.depth,
                            frame.job.layers, frame.settings.crop.pixels(), frame.arena);
    return frame.recorder ? Status::done : Status::out_of_memory;
}

Status trace_camera_rays(Frame &frame) {
    using namespace parts;
    const MarchKind march = frame.decisions.march;
    if (has(resampled) && march == MarchKind::grid) return trace_picture(frame, frame.grid_marcher);
    if (has(exact) && march == MarchKind::particles) return trace_picture(frame, frame.particle_marcher);
    if (has(exact) && march == MarchKind::steps) return trace_picture(frame, frame.marcher);
    if (has(paths) && frame.decisions.goal == Goal::reference) return trace_paths(frame);
    NoSmoke nothing;
    if (frame.decisions.surfaces) return trace_surfaces(frame, nothing);
    return trace_smoke(frame, nothing);
}

} // namespace wisp::WISP_ARITH::stages
