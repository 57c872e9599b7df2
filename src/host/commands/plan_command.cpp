#include "host/base/error.h"
#include "host/base/json_object.h"
#include "host/base/memory.h"
#include "host/commands/arguments.h"
#include "host/commands/commands.h"
#include "host/commands/max_error.h"
#include "host/commands/memory_check.h"
#include "host/commands/request.h"
#include "host/commands/run_warnings.h"
#include "host/prepare/particle_report.h"
#include "host/results/fingerprint.h"
#include "host/scene/shadow_words.h"
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

// What the numbers of the scene and the options add to a row of the core's plan.
class RowText {
  public:
    RowText(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan)
        : request_(request), prepared_(prepared), scene_(prepared.scene), settings_(settings), plan_(plan) {}

    std::string of(Stage stage) const {
        switch (stage) {
        case Stage::triangle_trees: return triangle_trees();
        case Stage::lights: return number(scene_.light_count) + " lights";
        case Stage::shadows:
            return std::string(shadow_method_descriptions[static_cast<int>(settings_.shadows)]) + ", " +
                   number(scene_.light_count) + " lights";
        case Stage::shading: return shading();
        case Stage::particle_tree: return density();
        case Stage::bricks:
            return plan_.bricks > 0 ? density() + " resampled to " + number(plan_.bricks) + " bricks of 8 x 8 x 8 cells"
                                    : std::string();
        case Stage::light_depths: return "at most; around smoke";
        case Stage::photons: return photons();
        case Stage::gather:
            if (settings_.method == Method::map) return "up to " + number(settings_.gather) + " nearest particles";
            return "up to " + number(settings_.gather) +
                   " nearest photons, the paper's estimate: up to 1.4 times too bright where they are far";
        case Stage::irradiance: return "at most, and what making it takes; bricks around smoke";
        case Stage::camera_rays: return camera_rays();
        default: return "";
        }
    }

  private:
    static std::string number(uint64_t n) { return std::to_string(n); }

    std::string triangle_trees() const {
        uint64_t visible = 0;
        for (uint32_t i = 0; i < scene_.instance_count; ++i) visible += scene_.instances[i].visible;
        return number(scene_.static_count) + " triangles in one tree, built once" +
               (scene_.instance_count
                    ? "; " + number(scene_.instance_triangle_count) + " in those of " + number(scene_.instance_count) +
                          " bodies (" + number(visible) + " visible), built once and placed in each frame"
                    : "") +
               (scene_.deforming_count ? "; " + number(scene_.deforming_count) + " in one for each frame" : "");
    }

    std::string shading() const {
        bool mirrors = false, passes = false;
        for (uint32_t i = 0; i < scene_.material_count; ++i) {
            const Material &m = scene_.materials[i];
            mirrors |= m.specular.x > 0 || m.specular.y > 0 || m.specular.z > 0;
            passes |= m.transmission > 0;
        }
        uint64_t texels = 0;
        for (uint32_t i = 0; i < scene_.texture_count; ++i)
            texels +=
                static_cast<uint64_t>(scene_.textures[i].width) * static_cast<uint64_t>(scene_.textures[i].height);
        const std::string textures = scene_.texture_count
                                         ? number(scene_.texture_count) +
                                               (scene_.texture_count == 1 ? " texture of " : " textures of ") +
                                               number(texels) + " texels; "
                                         : "";
        if (!mirrors && !passes) return textures + "nothing mirrors or lets light through";
        return textures + (mirrors ? "reflected" : "") + (mirrors && passes ? " and " : "") +
               (passes ? "refracted" : "") + " rays, at most " + number(settings_.depth) + " in a chain";
    }

    std::string density() const {
        uint64_t particles = 0, samples = 0;
        for (const auto &smoke : prepared_.particles) particles += smoke.size();
        for (const SmokeDescription &smoke : prepared_.smokes) samples += smoke.grid.count();
        return (particles ? number(particles) + " particles" : "") + (particles && samples ? ", " : "") +
               (samples ? number(samples) + " samples of grids" : "");
    }

    std::string photons() const {
        const Options &options = request_.options;
        if (settings_.method != Method::map)
            return number(settings_.photons) + " to emit, at most " + number(plan_.photon_capacity) +
                   " stored: positions" +
                   (plan_.photon_directions != Plan::Directions::none ? ", directions"
                                                                      : ", no directions (isotropic)") +
                   (plan_.photon_powers ? ", powers" : ", no powers (all are equal)");
        std::string origin = " photons to emit";
        if (options.batches)
            origin += ", of them batches " + number(options.batches->first) + ":" + number(options.batches->last);
        if (!options.map_in.empty()) origin = " photons of " + numbered(options.map_in, request_.frames.first);
        const std::string packed = plan_.bricks > 0                                    ? ""
                                   : plan_.photon_directions != Plan::Directions::none ? ": packed to 8 bytes each"
                                                                                       : ": packed to 4 bytes each";
        return number(settings_.photons) + origin +
               (plan_.bricks > 0 ? ", kept at the bricks' nodes: " : ", kept on the particles: ") +
               (plan_.photon_powers ? "power in R G B" : "one power (all are equal)") +
               (plan_.photon_directions == Plan::Directions::to_eye ? ", as scattered to the eye"
                : plan_.photon_directions == Plan::Directions::none ? ", no flux (isotropic)"
                : settings_.direction == Direction::mean            ? ", mean direction"
                : plan_.photon_directions == Plan::Directions::flux ? ", flux"
                                                                    : ", flux and spherical harmonics of directions") +
               packed;
    }

    std::string camera_rays() const {
        uint64_t samples = settings_.samples;
        if (settings_.goal == Goal::reference) samples *= settings_.last_pass - settings_.first_pass;
        return number(samples) + " a pixel";
    }

    const Request &request_;
    const PreparedScene &prepared_;
    const Scene &scene_;
    const Settings &settings_;
    const Plan &plan_;
};

struct Line {
    std::string name, room;
    bool needed;
    uint64_t bytes;
    std::string reason;
};

void print_text(const std::vector<Line> &lines) {
    for (const Line &line : lines)
        std::printf("%-14s %-4s %14llu bytes  %s\n", line.name.c_str(), line.needed ? "yes" : "no",
                    static_cast<unsigned long long>(line.bytes), printable(line.reason).c_str());
}

void print_json(const Plan &plan, const std::vector<Line> &lines, const std::string &arithmetic, uint64_t picture) {
    std::string stages;
    for (const Line &line : lines) {
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
    RunWarnings(request).of_frame(request.frames.first, prepared, settings, plan);
    const std::string arithmetic = renderer_of(options.arithmetic).name;
    if (!options.map_in.empty())
        saved_map(request, request.frames.first, fingerprint_of_map(request, prepared, settings, plan), plan);

    const RowText text(request, prepared, settings, plan);
    std::vector<Line> lines;
    for (uint32_t i = 0; i < stage_count; ++i) {
        const PlanRow &row = plan.rows[i];
        const std::string numbers = row.needed ? text.of(static_cast<Stage>(i)) : std::string();
        lines.push_back({row.name, row.room, row.needed, row.bytes, numbers.empty() ? row.reason : numbers});
    }
    const uint64_t picture = picture_bytes(options, settings);
    std::vector<std::string> remarks;
    if (options.verbose && !how.json) {
        for (const std::string &note : prepared.notes) remarks.push_back(printable(note));
        for (const std::string &line : particle_report(prepared, options.arithmetic)) remarks.push_back(line);
    }
    at_once.reset();
    if (how.json) {
        print_json(plan, lines, arithmetic, picture);
        return exit_done;
    }
    lines.push_back({"arena", "", true, plan.arena_bytes, "all of it, in " + arithmetic});
    lines.push_back({"picture", "", !options.batches, picture,
                     std::to_string(settings.crop.width()) + " x " + std::to_string(settings.crop.height()) +
                         " pixels, beside the arena"});
    print_text(lines);
    for (const std::string &remark : remarks) std::printf("%s\n", remark.c_str());
    return exit_done;
}

} // namespace wisp
