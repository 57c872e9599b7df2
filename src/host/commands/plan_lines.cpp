#include "host/commands/plan_lines.h"
#include "core/render/kept_at_nodes.h"
#include "core/smoke/grid_samples.h"
#include "host/scene/shadow_words.h"

namespace wisp {

namespace {

// What the numbers of the scene and the options add to a row of the core's plan.
class RowText {
  public:
    RowText(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan)
        : request_(request), prepared_(prepared), scene_(prepared.scene), settings_(settings), plan_(plan) {
        if (settings.paths == 0 && !request.options.memory) return;
        Options without_limit = request.options;
        without_limit.memory.reset();
        const Settings more = settings_of(without_limit, prepared, &why_paths_);
        if (settings.paths > more.paths) why_paths_ = "there is no room for bricks or photons within --memory";
        lacks_bricks_ = settings.density_step < more.density_step;
    }

    // Of a row that is not needed.
    std::string why_not(Stage stage) const {
        const std::string reason = plan_[stage].reason;
        const bool of_photons = stage == Stage::photons || stage == Stage::irradiance;
        if (of_photons && why_paths_ && plan_[Stage::majorants].needed) return reason + ": " + why_paths_;
        if (stage == Stage::bricks && lacks_bricks_) return reason + ": there is no room for bricks within --memory";
        return reason;
    }

    // Of a row that is needed; empty: its reason says all.
    std::string of(Stage stage) const {
        switch (stage) {
        case Stage::triangle_trees: return triangle_trees();
        case Stage::lights: return lights();
        case Stage::shadows:
            return std::string(shadow_method_descriptions[static_cast<int>(settings_.shadows)]) + ", " + lights() +
                   (!request_.options.shadows && settings_.shadows == ShadowMethod::trace
                        ? ": what proofs keep does not fit in --memory"
                        : "");
        case Stage::shading: return shading();
        case Stage::particle_tree: return density();
        case Stage::bricks:
            return plan_.bricks > 0
                       ? density() + " resampled to " + number(plan_.bricks) + " bricks of 8 x 8 x 8 cells" +
                             step("density-step", cell_of_bricks(scene_, settings_.density_step))
                       : std::string();
        case Stage::light_depths: return "at most; around smoke" + step("light-step", settings_.light_step);
        case Stage::photons: return photons();
        case Stage::gather:
            if (settings_.method == Method::map) return "up to " + number(settings_.gather) + " nearest particles";
            return "up to " + number(settings_.gather) +
                   " nearest photons, the paper's estimate: too bright where they are far";
        case Stage::irradiance:
            return "at most, and what making it takes; bricks around smoke" +
                   step("irradiance-step", settings_.irradiance_step);
        case Stage::march: return std::string(plan_[stage].reason) + step("step", settings_.step);
        case Stage::camera_rays: return camera_rays();
        default: return "";
        }
    }

  private:
    static std::string number(uint64_t n) { return std::to_string(n); }
    static std::string step(const char *option, double value) {
        return std::string(", --") + option + " " + six_digits(value);
    }

    std::string lights() const { return number(scene_.light_count) + (scene_.light_count == 1 ? " light" : " lights"); }

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
        uint64_t particles = 0, samples = 0, boxes = 0;
        for (const auto &smoke : prepared_.particles) particles += smoke.size();
        for (const SmokeDescription &smoke : prepared_.smokes) {
            const uint64_t stored = stored_samples(smoke.grid);
            (stored == 1 ? boxes : samples) += stored;
        }
        std::string text;
        const auto add = [&](uint64_t count, const std::string &one, const std::string &many) {
            if (count > 0) text += (text.empty() ? "" : ", ") + number(count) + (count == 1 ? one : many);
        };
        add(particles, " particle", " particles");
        add(samples, "", " samples of grids");
        add(boxes, " box", " boxes");
        return text;
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
        const bool at_nodes = keeps_light_at_nodes(scene_, settings_);
        const std::string packed = at_nodes                                            ? ""
                                   : plan_.photon_directions != Plan::Directions::none ? ": packed to 8 bytes each"
                                                                                       : ": packed to 4 bytes each";
        return number(settings_.photons) + origin +
               (at_nodes ? ", kept at the bricks' nodes: " : ", kept on the particles: ") +
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
        const bool by_paths = settings_.paths > 0 && plan_[Stage::majorants].needed;
        return number(samples) + " a pixel" + (by_paths ? ", " + number(settings_.paths) + " random paths from each" : "");
    }

    const Request &request_;
    const PreparedScene &prepared_;
    const Scene &scene_;
    const Settings &settings_;
    const Plan &plan_;
    const char *why_paths_ = nullptr; // take the place of photons
    bool lacks_bricks_ = false;       // because of --memory
};

} // namespace

std::vector<PlanLine> plan_lines(const Request &request, const PreparedScene &prepared, const Settings &settings,
                                 const Plan &plan) {
    const RowText text(request, prepared, settings, plan);
    std::vector<PlanLine> lines;
    for (uint32_t i = 0; i < stage_count; ++i) {
        const PlanRow &row = plan.rows[i];
        const Stage stage = static_cast<Stage>(i);
        const std::string words = row.needed ? text.of(stage) : text.why_not(stage);
        lines.push_back({row.name, row.room, row.needed, row.bytes, words.empty() ? row.reason : words});
    }
    return lines;
}

} // namespace wisp
