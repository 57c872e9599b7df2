#include "host/commands/single_frame.h"
#include "host/commands/max_error.h"
#include "host/commands/progress_meter.h"

namespace wisp {

void check_single_frame(const Request &request, const std::string &command, bool has_output) {
    const Options &options = request.options;
    if (several_frames(request))
        throw Error(exit_usage, request.name, "found several frames, expected one with --frames");
    check_options(request);
    check_max_error(request, false);
    const auto refuse = [&command](const char *option, const std::string &why) {
        throw Error(exit_usage, std::string("option '") + option + "' does not go with " + command + ": " + why);
    };
    const struct {
        const char *name;
        bool given;
    } of_files[] = {{"output", !has_output && !options.outputs.empty()},
                    {"map-out", !options.map_out.empty()},
                    {"batches", options.batches.has_value()},
                    {"stats", !options.stats.empty()},
                    {"digest", !has_output && options.digest},
                    {"layers", options.layers}};
    for (const auto &option : of_files)
        if (option.given) refuse(option.name, has_output ? "it makes a picture of a stage" : "it makes no picture");
    if (options.reference) refuse("reference", "its pixels are sums of paths");
    if (options.shadows == ShadowMethod::paper) refuse("shadows", "paper's pixels depend on frames before");
}

SingleFrame::SingleFrame(const Request &request) : request_(request), warnings_(request) {
    prepare(request.frames.first);
}

void SingleFrame::prepare(int64_t frame) {
    frame_ = frame;
    end_at_once(request_, frame, at_once_);
    const double scale = prepared.scale;
    prepare_scene(request_.name, request_.file, request_.options, frame, prepared);
    if (prepared.scale != scale) cache = {}; // what it knows is in another unit
    settings = settings_of(request_.options, prepared);
}

void SingleFrame::make_plan(bool shows_light) {
    plan = checked_plan(request_, prepared.scene, settings);
    if (block_.fit(request_, prepared, settings, plan)) cache = {};
    if (shows_light) warnings_.of_light(prepared, settings, plan);
    warnings_.of_frame(frame_, prepared, settings, plan);
    if (!request_.options.map_in.empty())
        map_ = saved_map(request_, frame_, fingerprint_of_map(request_, prepared, settings, plan), plan);
}

void SingleFrame::run(const std::function<Status(Job &job)> &core) {
    at_once_.reset();
    Statistics statistics;
    Arena arena(block_.get(), plan.arena_bytes);
    PhotonSums sums = {map_.sums.data(), map_.sums.size(), map_.sums.size()};
    RunProgress alone;
    ProgressMeter progress(request_.options, frame_, plan, alone);
    Job job = {prepared.scene, settings, arena, statistics, progress.observer()};
    if (!map_.sums.empty()) job.photons = &sums;
    const Status status = core(job);
    progress.finish();
    if (status == Status::stopped) stop(request_, frame_);
    if (status != Status::done) fail(request_, plan, frame_, status);
}

} // namespace wisp
