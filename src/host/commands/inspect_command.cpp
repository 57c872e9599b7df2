#include "host/commands/commands.h"
#include "host/commands/inspection.h"
#include "host/commands/single_frame.h"

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
    check_single_frame(request, "inspect", false);
    SingleFrame frame(request);
    const PreparedScene &prepared = frame.prepared;
    Inspection inspection;
    inspection.scene = request.name;
    inspection.arithmetic = renderer_of(options.arithmetic).name;
    inspection.frame = request.frames.first;
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
    Crop &crop = frame.settings.crop;
    if (inspection.x < crop.x0 || inspection.x >= crop.x1 || inspection.y < crop.y0 || inspection.y >= crop.y1)
        throw Error(exit_usage, "option 'crop' does not have the pixel " + inspect.x + " " + inspect.y);
    if (!options.crop) crop = {inspection.x, inspection.y, inspection.x + 1, inspection.y + 1};
    // The pixels after this one do not change it.
    crop.y1 = inspection.y + 1;

    frame.make_plan();
    std::vector<float> rgb(crop.pixels() * 3);
    const PixelTrace trace = inspection.trace();
    frame.run([&](Job &job) {
        job.rgb = rgb.data();
        constexpr decltype(&f32::inspect) inspectors[] = {f32::inspect, f64::inspect, fixed::inspect};
        return inspectors[static_cast<int>(options.arithmetic)](job, trace);
    });
    const std::string text = inspect.options.json ? inspection_json(inspection) : inspection_text(inspection);
    std::fwrite(text.data(), 1, text.size(), stdout);
    return exit_done;
}

} // namespace wisp
