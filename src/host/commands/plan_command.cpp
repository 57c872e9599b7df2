#include "host/base/error.h"
#include "host/base/json_object.h"
#include "host/base/memory.h"
#include "host/commands/arguments.h"
#include "host/commands/commands.h"
#include "host/commands/max_error.h"
#include "host/commands/memory_check.h"
#include "host/commands/plan_lines.h"
#include "host/commands/request.h"
#include "host/commands/run_warnings.h"
#include "host/prepare/particle_report.h"
#include "host/results/fingerprint.h"
#include "host/results/picture_bytes.h"
#include <cstdio>

namespace wisp {

namespace {

struct PlanOptions {
    bool json = false;
};

const OptionTable<PlanOptions> &plan_options() {
    static const OptionTable<PlanOptions> table = {
        {"json", nullptr, "JSON instead of text", to_switch(&PlanOptions::json)},
    };
    return table;
}

void print_text(const std::vector<PlanLine> &lines) {
    for (const PlanLine &line : lines)
        std::printf("%-14s %-4s %14llu bytes  %s\n", line.name.c_str(), line.needed ? "yes" : "no",
                    static_cast<unsigned long long>(line.bytes), printable(line.reason).c_str());
}

void print_json(const Plan &plan, const std::vector<PlanLine> &lines, const std::string &arithmetic, uint64_t picture) {
    std::string stages;
    for (const PlanLine &line : lines) {
        Object stage;
        stage.add("name", quoted(line.name)).add("room", quoted(line.room)).add_flag("needed", line.needed);
        stage.add("bytes", line.bytes).add("reason", quoted(line.reason));
        stages += (stages.empty() ? "\n    " : ",\n    ") + stage.text();
    }
    std::printf("{ \"arith\": %s, \"arena\": %llu, \"picture\": %llu,\n  \"stages\": [%s ] }\n",
                quoted(arithmetic).c_str(), static_cast<unsigned long long>(plan.arena_bytes),
                static_cast<unsigned long long>(picture), stages.c_str());
}

} // namespace

std::string plan_help() { return help_lines(plan_options()); }

int plan_command(const std::vector<std::string> &arguments) {
    std::vector<KnownOption> known;
    add_options(known, scene_options());
    add_options(known, plan_options());
    CommandLine command = parse_arguments("plan", known, arguments);
    PlanOptions how;
    take_options(command, plan_options(), how);
    const Request request = read_request(command);
    const Options &options = request.options;
    check_options(request);
    check_max_error(request, false);
    std::optional<EndAtOnce> at_once;
    end_at_once(request, request.frames.first, at_once);
    PreparedScene prepared;
    prepare_scene(request.name, request.file, options, request.frames.first, prepared);
    const Settings settings = settings_of(options, prepared);
    const Plan plan = checked_plan(request, prepared.scene, settings);
    check_memory(request, prepared, settings, plan, available_memory());
    RunWarnings warnings(request);
    warnings.of_light(prepared, settings, plan);
    warnings.of_frame(request.frames.first, prepared, settings, plan);
    const std::string arithmetic = renderer_of(options.arithmetic).name;
    if (!options.map_in.empty())
        saved_map(request, request.frames.first, fingerprint_of_map(request, prepared, settings, plan), plan);

    std::vector<PlanLine> lines = plan_lines(request, prepared, settings, plan);
    const uint64_t picture = picture_bytes(settings, plan);
    std::vector<std::string> remarks;
    if (options.verbose && !how.json) {
        for (const std::string &note : prepared.notes) remarks.push_back(printable(note));
        for (const std::string &line : particle_report(prepared, options.arithmetic)) remarks.push_back(line);
        if (plan.smoke) {
            remarks.push_back("Use the default for pictures, and --max-error E where the error matters.");
            remarks.push_back("Use --reference for truth with error bars, and --smoke direct to see the paper's method "
                              "and its bias.");
        }
    }
    at_once.reset();
    if (how.json) {
        print_json(plan, lines, arithmetic, picture);
        return exit_done;
    }
    lines.push_back({"arena", "", true, plan.arena_bytes, "all of it, in " + arithmetic});
    lines.push_back(
        {"picture", "", !options.batches, picture,
         std::to_string(settings.crop.width()) + " x " + std::to_string(settings.crop.height()) + " pixels" +
             (options.layers ? " and " + std::to_string(layer_planes(settings, plan)) + " channels of layers" : "") +
             ", beside the arena"});
    print_text(lines);
    for (const std::string &remark : remarks) std::printf("%s\n", remark.c_str());
    return exit_done;
}

} // namespace wisp
