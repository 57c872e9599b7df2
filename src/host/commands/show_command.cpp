#include "host/base/memory.h"
#include "host/commands/commands.h"
#include "host/commands/output.h"
#include "host/commands/show_stages.h"

namespace wisp {

namespace {

const OptionTable<ShowOptions> &show_options() {
    static const OptionTable<ShowOptions> table = {
        {"slice", "T", "where the plane of density, light-depth and nodes cuts the smoke: 0 nearest, 1 farthest (0.5)",
         [](ShowOptions &options, const std::string &value) {
             options.slice = number_that(
                 value, [](double x) { return x >= 0 && x <= 1; }, "a number from 0 to 1");
         }},
        {"light", "I", "the light of light-depth and proofs, in the order of the scene (0)",
         to_count_in(&ShowOptions::light, 0, INT32_MAX)},
        {"row", "Y", "the row of tree (the middle one)",
         [](ShowOptions &options, const std::string &value) {
             options.row = static_cast<int>(integer_in(value, 0, 65535));
         }},
    };
    return table;
}

// Of a drawing: its place, number and cell.
constexpr uint64_t bytes_of_pixel = sizeof(Double3) + 2 * sizeof(double) + sizeof(float) + sizeof(uint64_t);

std::string stage_names() {
    std::string names;
    for (const ShownStage &stage : shown_stages()) names += (names.empty() ? "" : ", ") + std::string(stage.name);
    return names;
}

// Throws Error(exit_usage) for options that change nothing in the stage's drawing.
void check_show_options(const CommandLine &line, const ShownStage &stage) {
    for (const auto &[name, value] : line.options)
        if (find_option(show_options(), name) &&
            std::find(stage.options.begin(), stage.options.end(), name) == stage.options.end())
            throw Error(exit_usage, "option '" + name + "' does nothing in show " + stage.name);
}

const ShownStage &stage_of(const std::string &name) {
    std::vector<std::string> names;
    for (const ShownStage &stage : shown_stages()) {
        if (name == stage.name) return stage;
        names.push_back(stage.name);
    }
    throw Error(exit_usage,
                "there is no stage '" + name + "' to show, expected " + stage_names() + did_you_mean(name, names));
}

} // namespace

std::string show_help() {
    std::string text = " STAGE:\n";
    for (const ShownStage &stage : shown_stages()) text += in_columns(std::string("  ") + stage.name, stage.what);
    return text + " Of these stages:\n" + help_lines(show_options());
}

int show_command(const std::vector<std::string> &arguments) {
    std::vector<KnownOption> known;
    add_options(known, scene_options());
    add_options(known, show_options());
    CommandLine line = parse_arguments("show", known, arguments);
    if (line.files.size() != 2)
        throw Error(exit_usage, "found " + std::to_string(line.files.size()) +
                                    " words behind 'show', expected STAGE SCENE; see 'wisp show --help'");
    const ShownStage &stage = stage_of(line.files[0]);
    line.files.erase(line.files.begin());
    check_show_options(line, stage);
    ShowOptions options;
    take_options(line, show_options(), options);
    const Request request = read_request(line);
    check_single_frame(request, "show", true);
    if (request.options.outputs.empty() && !request.options.digest)
        throw Error(exit_usage, "found nothing to make of the stage, expected --output or --digest");
    if (stage.needed == Stage::photons && !request.options.map_in.empty())
        throw Error(exit_usage,
                    std::string("option 'map-in' does not go with show ") + stage.name + ": no photon is traced");
    check_outputs(request.options, request.frames, files_read(request));
    SingleFrame frame(request);
    frame.settings.layers = stage.of_layers;
    frame.make_plan(stage.needed == Stage::irradiance);
    const PlanRow &row = frame.plan[stage.needed];
    if (!row.needed)
        throw Error(exit_usage, request.name,
                    std::string("there is nothing to show of ") + stage.name + ": " + row.reason);
    require_memory(request.name, "the drawing", frame.settings.crop.pixels() * bytes_of_pixel);
    const uint32_t lights = frame.prepared.scene.light_count;
    if (options.light > 0 && options.light >= lights)
        throw Error(exit_usage, "option 'light': found '" + std::to_string(options.light) +
                                    "', expected a light of the scene, 0 to " + std::to_string(lights - 1));
    const Shown shown = stage.draw({request, options, frame});
    write_outputs(request.options, shown.picture, pfm_bytes(shown.picture), nullptr, request.frames.first);
    if (!request.options.quiet) print_note(std::string(stage.name) + ": " + shown.legend);
    return exit_done;
}

} // namespace wisp
