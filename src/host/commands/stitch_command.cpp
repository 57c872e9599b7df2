#include "host/commands/arguments.h"
#include "host/commands/commands.h"
#include "host/commands/output.h"
#include "host/results/stitch.h"

namespace wisp {

namespace {

const std::vector<std::string> &stitch_options() {
    static const std::vector<std::string> names = {"output", "exposure", "digest", "quiet", "verbose"};
    return names;
}

} // namespace

std::string stitch_help() { return help_lines(scene_options(), stitch_options()); }

int stitch_command(const std::vector<std::string> &arguments) {
    const CommandLine line = parse_arguments("stitch", scene_options(), arguments, stitch_options());
    Options options;
    for (const auto &[name, value] : line.options) set_option(options, name, value);
    if (line.files.empty()) throw Error(exit_usage, "found no part to stitch, expected .pfm or .exr files of --crop");
    for (const std::string &part : line.files)
        if (!ends_in(part, ".pfm") && !ends_in(part, ".exr"))
            throw Error(exit_usage, "found '" + part + "' to stitch, expected a .pfm or .exr file of --crop");
    for (const std::string &output : options.outputs)
        if (!ends_in(output, ".pfm") && !ends_in(output, ".exr") && !ends_in(output, ".png"))
            throw Error(exit_usage, "option 'output': found '" + output + "', expected .pfm, .exr or .png of stitch");
    if (options.outputs.empty() && !options.digest)
        throw Error(exit_usage, "found nothing to make of the parts, expected --output or --digest");
    check_outputs(options, {}, line.files);
    const Picture picture = stitch(line.files);
    write_outputs(options, picture, pfm_bytes(picture), nullptr, 0);
    return exit_done;
}

} // namespace wisp
