#include "host/commands/arguments.h"
#include "host/base/files.h"
#include "host/commands/commands.h"
#include "host/commands/output.h"
#include "host/results/map_file.h"

namespace wisp {

namespace {

const std::vector<std::string> &merge_options() {
    static const std::vector<std::string> names = {"output", "error-out", "exposure", "digest", "quiet", "verbose"};
    return names;
}

int merge_maps(const std::vector<std::string> &files, const Options &options) {
    if (options.outputs.size() > 1 || !options.error_out.empty() || options.digest || options.exposure != 0)
        throw Error(exit_usage, "maps are merged to a map, expected one --output and no other option with it");
    check_outputs(options);
    MapFile map = parse_map(read_file(files[0]), files[0]);
    for (size_t i = 1; i < files.size(); ++i) add_map(map, parse_map(read_file(files[i]), files[i]), files[i]);
    write_output(options, options.outputs[0], map_bytes(map));
    return exit_done;
}

} // namespace

std::string merge_help() { return help_lines(scene_options(), merge_options()); }

int merge_command(const std::vector<std::string> &arguments) {
    const CommandLine line = parse_arguments("merge", scene_options(), arguments, merge_options());
    Options options;
    for (const auto &[name, value] : line.options) set_option(options, name, value);
    if (line.files.empty()) throw Error(exit_usage, "found no file to merge, expected some .passes or .map");
    for (const std::string &output : options.outputs)
        if (ends_in(output, ".map")) return merge_maps(line.files, options);
    if (options.outputs.empty() && options.error_out.empty() && !options.digest)
        throw Error(exit_usage, "found nothing to make of the passes, expected --output, --error-out or --digest");
    check_outputs(options);
    Passes passes = parse_passes(read_file(line.files[0]), line.files[0]);
    for (size_t i = 1; i < line.files.size(); ++i)
        add_passes(passes, parse_passes(read_file(line.files[i]), line.files[i]), line.files[i]);
    const Picture picture = mean_picture(passes);
    write_outputs(options, picture, pfm_bytes(picture), &passes, 0);
    return exit_done;
}

} // namespace wisp
