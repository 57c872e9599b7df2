// `wisp compare`: arguments in, figures out, the answer in the exit status.
#include "host/base/error.h"
#include "host/images/compare.h"
#include "host/scene/options.h"
#include <cstdio>
#include <optional>

namespace wisp {
namespace {

struct Request {
    std::vector<std::string> pictures; // A and B
    std::optional<double> tolerance;   // of the relative RMSE; without it bits must match
    std::string error;                 // B's standard errors; empty: not known
    std::string json, diff;            // file names, empty: not wanted
};

[[noreturn]] void fail_usage(const std::string &what) { throw Error(exit_usage, what); }

void set_option(Request &request, const std::string &name, const std::string &value) {
    if (name == "--tolerance") {
        request.tolerance = to_number(value);
        if (!request.tolerance || *request.tolerance < 0)
            fail_usage("option '--tolerance' is '" + value + "', expected a number of at least 0");
    } else if (name == "--error") {
        request.error = value;
    } else if (name == "--json") {
        if (value.empty()) fail_usage("option '--json' is empty, expected a file name or -");
        request.json = value;
    } else {
        if (!ends_in(value, ".png"))
            fail_usage("option '--diff' is '" + value + "', expected a file name that ends in .png");
        request.diff = value;
    }
}

Request parse(const std::vector<std::string> &args) {
    Request request;
    for (size_t i = 0; i < args.size(); ++i) {
        if (args[i].size() < 2 || args[i][0] != '-') {
            request.pictures.push_back(args[i]);
            continue;
        }
        const size_t equals = args[i].find('=');
        const std::string name = args[i].substr(0, equals);
        if (name != "--tolerance" && name != "--error" && name != "--json" && name != "--diff")
            fail_usage("there is no option '" + name + "', expected --tolerance, --error, --json or --diff");
        if (equals != std::string::npos) {
            set_option(request, name, args[i].substr(equals + 1));
        } else if (++i < args.size()) {
            set_option(request, name, args[i]);
        } else {
            fail_usage("option '" + name + "' needs a value");
        }
    }
    if (request.pictures.size() != 2)
        fail_usage("'wisp compare' has " + std::to_string(request.pictures.size()) + " files, expected two pictures");
    return request;
}

} // namespace

int compare_command(const std::vector<std::string> &args) {
    const Request request = parse(args);
    const std::string &name_a = request.pictures[0], &name_b = request.pictures[1];
    const Picture a = read_pfm(name_a), b = read_pfm(name_b);
    Difference difference = compare(a, b, name_a, name_b);
    if (!request.error.empty()) weigh_noise(difference, b, read_pfm(request.error), name_b, request.error);

    const std::string json = difference_json(difference);
    if (!request.json.empty() && request.json != "-") write_file(request.json, json);
    if (!request.diff.empty()) write_file(request.diff, png_bytes(difference_picture(a, b)));
    const std::string &printed = request.json == "-" ? json : difference_text(difference);
    std::fwrite(printed.data(), 1, printed.size(), stdout);

    const bool allowed = request.tolerance && difference.relative_rmse <= *request.tolerance; // NaN is not
    return difference.differing_pixels == 0 || allowed ? exit_done : exit_difference;
}

} // namespace wisp
