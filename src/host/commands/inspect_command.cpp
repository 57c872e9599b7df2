#include "host/base/memory.h"
#include "host/commands/arguments.h"
#include "host/commands/commands.h"
#include "host/commands/inspection.h"
#include "host/commands/max_error.h"
#include "host/commands/memory_check.h"
#include "host/commands/progress_meter.h"
#include "host/commands/request.h"
#include "host/commands/run_warnings.h"
#include "host/results/fingerprint.h"
#include "wisp/settings.h"

namespace wisp {

namespace {

struct InspectOptions {
    std::string sample; // as it was given, it depends on the scene; empty: all
    bool json = false;
};

const OptionTable<InspectOptions> &inspect_options() {
    static const OptionTable<InspectOptions> table = {
        {"sample", "I", "the rays of that sample alone", to_text(&InspectOptions::sample)},
        {"json", nullptr, "JSON instead of text", to_switch(&InspectOptions::json)},
    };
    return table;
}

struct InspectRequest {
    Request request;
    std::string x, y; // as they were given
    InspectOptions options;
};

// The whole number `value` from 0 to `end` - 1; `name` stands in front of the error.
int number_below(const std::string &name, const std::string &value, int64_t end) {
    const auto number = to_integer(value);
    if (!number || *number < 0 || *number >= end)
        throw Error(exit_usage,
                    name + ": found '" + value + "', expected a whole number from 0 to " + std::to_string(end - 1));
    return static_cast<int>(*number);
}

void refuse(const char *option, const std::string &why) {
    throw Error(exit_usage, std::string("option '") + option + "' does not go with inspect: " + why);
}

void check(const Request &request) {
    const Options &options = request.options;
    check_options(request);
    check_max_error(request, false);
    const struct {
        const char *name;
        bool given;
    } of_files[] = {{"output", !options.outputs.empty()},
                    {"map-out", !options.map_out.empty()},
                    {"batches", options.batches.has_value()},
                    {"stats", !options.stats.empty()},
                    {"digest", options.digest},
                    {"layers", options.layers}};
    for (const auto &option : of_files)
        if (option.given) refuse(option.name, "it makes no picture");
    if (options.reference) refuse("reference", "its pixels are sums of paths");
    if (options.shadows == ShadowMethod::paper) refuse("shadows", "paper's pixels depend on frames before");
    if (several_frames(request))
        throw Error(exit_usage, request.name, "found several frames, expected one with --frames");
}

InspectRequest read_inspect_request(const std::vector<std::string> &arguments) {
    std::vector<KnownOption> known;
    add_options(known, scene_options());
    add_options(known, inspect_options());
    CommandLine line = parse_arguments("inspect", known, arguments);
    InspectRequest inspect;
    take_options(line, inspect_options(), inspect.options);
    if (line.files.size() != 3)
        throw Error(exit_usage, "found " + std::to_string(line.files.size()) +
                                    " words behind 'inspect', expected SCENE X Y; see 'wisp help'");
    inspect.x = line.files[1];
    inspect.y = line.files[2];
    line.files.resize(1);
    inspect.request = read_request(line);
    return inspect;
}

} // namespace

std::string inspect_help() { return help_lines(inspect_options()); }

int inspect_command(const std::vector<std::string> &arguments) {
    const InspectRequest inspect = read_inspect_request(arguments);
    const Request &request = inspect.request;
    const Options &options = request.options;
    check(request);
    const int64_t frame = request.frames.first;
    std::optional<EndAtOnce> at_once;
    end_at_once(request, frame, at_once);
    PreparedScene prepared;
    prepare_scene(request.name, request.file, options, frame, prepared);
    Inspection inspection;
    inspection.scene = request.name;
    inspection.arithmetic = renderer_of(options.arithmetic).name;
    inspection.frame = frame;
    inspection.x = number_below("X", inspect.x, prepared.width);
    inspection.y = number_below("Y", inspect.y, prepared.height);
    inspection.width = prepared.width;
    inspection.height = prepared.height;
    if (!inspect.options.sample.empty())
        inspection.only =
            static_cast<uint32_t>(number_below("option 'sample'", inspect.options.sample, options.samples));
    inspection.center = prepared.center;
    inspection.scale = prepared.scale;
    inspection.radiance_exponent = prepared.scene.radiance_exponent;
    Settings settings = settings_of(options, prepared);
    const Crop &crop = settings.crop;
    if (inspection.x < crop.x0 || inspection.x >= crop.x1 || inspection.y < crop.y0 || inspection.y >= crop.y1)
        throw Error(exit_usage, "option 'crop' does not have the pixel " + inspect.x + " " + inspect.y);
    if (!options.crop) settings.crop = {inspection.x, inspection.y, inspection.x + 1, inspection.y + 1};
    // The pixels after this one do not change it.
    settings.crop.y1 = inspection.y + 1;

    const Plan plan = checked_plan(request, prepared.scene, settings);
    check_memory(request, prepared, settings, plan, available_memory());
    RunWarnings(request).of_frame(frame, prepared, settings, plan);
    MapFile map;
    if (!options.map_in.empty())
        map = saved_map(request, frame, fingerprint_of_map(request, prepared, settings, plan), plan);
    PhotonSums sums = {map.sums.data(), map.sums.size(), map.sums.size()};
    if (map.sums.empty() && uses_map(settings)) {
        map.sums.resize(plan.map_sums);
        sums = {map.sums.data(), map.sums.size(), 0};
    }
    const auto block = make_block(request.name, plan.arena_bytes);
    Arena arena(block.get(), plan.arena_bytes);
    std::vector<float> rgb(settings.crop.pixels() * 3);
    Statistics statistics;
    at_once.reset();
    RunProgress run;
    ProgressMeter progress(options, frame, plan, run);
    const PixelTrace trace = inspection.trace();
    Job job = {prepared.scene, settings, arena, statistics, progress.observer(), rgb.data()};
    if (uses_map(settings)) job.photons = &sums;
    constexpr decltype(&f32::inspect) inspectors[] = {f32::inspect, f64::inspect, fixed::inspect};
    const Status status = inspectors[static_cast<int>(options.arithmetic)](job, trace);
    progress.finish();
    if (status == Status::stopped) stop(request, frame);
    if (status != Status::done) fail(request, plan, frame, status);
    const std::string text = inspect.options.json ? inspection_json(inspection) : inspection_text(inspection);
    std::fwrite(text.data(), 1, text.size(), stdout);
    return exit_done;
}

} // namespace wisp
