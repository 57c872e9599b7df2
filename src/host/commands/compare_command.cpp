#include "host/commands/arguments.h"
#include "host/commands/commands.h"
#include "host/commands/output.h"
#include "host/images/compare.h"
#include "host/images/picture_reader.h"
#include <cstdio>

namespace wisp {

namespace {

struct CompareOptions {
    Limits limits;
    std::string error;      // B's standard errors; empty: not known
    std::string json, diff; // file names; empty: not wanted
};

const OptionTable<CompareOptions> &compare_options() {
    static const OptionTable<CompareOptions> table = {
        {"tolerance", "REL",
         "allows that relative RMSE, with --error beyond the noise; without this and the next two bits must match",
         [](CompareOptions &options, const std::string &value) {
             options.limits.relative_rmse = number_that(
                 value, [](double x) { return x >= 0; }, "a number of at least 0");
         }},
        {"max-flip", "F", "allows that mean FLIP",
         [](CompareOptions &options, const std::string &value) {
             options.limits.mean_flip = number_that(
                 value, [](double x) { return x >= 0 && x <= 1; }, "a number from 0 to 1");
         }},
        {"max-ulps", "N", "allows values that many float32 numbers apart; of several limits all hold",
         [](CompareOptions &options, const std::string &value) {
             options.limits.ulps = static_cast<uint64_t>(count_in(value, 0, nan_ulps - 1));
         }},
        {"error", "FILE", "the standard errors of B, as .pfm", to_text(&CompareOptions::error)},
        {"json", "FILE", "the figures as JSON; -: on standard output instead",
         [](CompareOptions &options, const std::string &value) {
             if (value.empty()) throw OptionError{"a file name or -"};
             options.json = value;
         }},
        {"diff", "FILE", "a .png of the difference",
         [](CompareOptions &options, const std::string &value) {
             if (!ends_in(value, ".png")) throw OptionError{"a file name that ends in .png"};
             options.diff = value;
         }},
    };
    return table;
}

} // namespace

std::string compare_help() { return help_lines(compare_options()); }

int compare_command(const std::vector<std::string> &arguments) {
    CommandLine line = parse_arguments("compare", compare_options(), arguments);
    CompareOptions options;
    take_options(line, compare_options(), options);
    if (line.files.size() != 2)
        throw Error(exit_usage,
                    "'wisp compare' has " + std::to_string(line.files.size()) + " files, expected two pictures");
    const std::string &name_a = line.files[0], &name_b = line.files[1];
    const bool files_json = !options.json.empty() && options.json != "-";
    std::vector<std::string> read = line.files;
    if (!options.error.empty()) read.push_back(options.error);
    if (files_json) {
        check_not_read("json", options.json, read);
        check_writable(options.json);
    }
    if (!options.diff.empty()) {
        check_not_read("diff", options.diff, read);
        check_writable(options.diff);
    }
    const Picture a = read_picture(name_a), b = read_picture(name_b);
    Difference difference = compare(a, b, name_a, name_b);
    if (!options.error.empty()) weigh_noise(difference, b, read_pfm(options.error), name_b, options.error);
    judge(difference, options.limits);

    const std::string json = difference_json(difference);
    if (files_json) write_file(options.json, json);
    if (!options.diff.empty()) write_file(options.diff, png_bytes(difference_picture(a, b)));
    const std::string &printed = options.json == "-" ? json : difference_text(difference);
    std::fwrite(printed.data(), 1, printed.size(), stdout);
    return *difference.verdict == Verdict::different ? exit_difference : exit_done;
}

} // namespace wisp
