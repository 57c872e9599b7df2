#include "c_api/settings.h"
#include "c_api/frame.h"
#include "c_api/refusal.h"
#include "core/smoke/resampling.h"
#include <initializer_list>

namespace wisp::c_api {

namespace {

struct Count {
    const char *name;
    uint64_t value;
};

wisp_status read_crop(const wisp_settings &from, const wisp_frame &frame, Crop &crop, wisp_error *error) {
    const uint32_t *c = from.crop;
    const bool whole = c[0] == 0 && c[1] == 0 && c[2] == 0 && c[3] == 0;
    if (!whole && (c[0] >= c[2] || c[1] >= c[3] || c[2] > frame.width || c[3] > frame.height))
        return refuse(error, WISP_WRONG_USAGE, "settings.crop: found ", uint64_t{c[0]}, ",", uint64_t{c[1]}, ",",
                      uint64_t{c[2]}, ",", uint64_t{c[3]}, ", expected pixels of the ", uint64_t{frame.width}, " x ",
                      uint64_t{frame.height}, " picture, x0 < x1, y0 < y1");
    const auto side = [](uint32_t x) { return static_cast<int32_t>(x); };
    crop = whole ? Crop{0, 0, side(frame.width), side(frame.height)}
                 : Crop{side(c[0]), side(c[1]), side(c[2]), side(c[3])};
    if (!whole && from.shadows == WISP_SHADOWS_PAPER)
        return refuse(error, WISP_WRONG_USAGE,
                      "settings.crop: found one with paper shadows, expected the whole picture");
    return WISP_DONE;
}

// What excludes each other, as of the program's options (host/commands/defaults.cpp).
const char *exclusion(const Scene &scene, const Settings &s) {
    bool grids = false, directed = false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        grids = grids || scene.smokes[i].is_grid();
        directed = directed || scene.smokes[i].asymmetry != 0;
    }
    if (s.method == Method::volume && s.density_step == 0)
        return "density_step: found 0, expected cells with the method volume";
    if (s.method != Method::map) return nullptr;
    const bool nearest = s.estimate == Estimate::knn, maps = s.irradiance != IrradianceMap::none;
    if (nearest && grids) return "estimate: found knn for a grid or a box with the method map, expected kernel";
    if (nearest && maps) return "irradiance: found a map, expected none with the estimate knn of the method map";
    const bool on_particles = nearest || s.deposit == Deposit::path || s.deposit == Deposit::kernel ||
                              s.direction == Direction::mean || !maps;
    if (on_particles && s.density_step > 0)
        return "density_step: found resampled smoke, expected 0 with the deposit path or kernel, the direction mean, "
               "the estimate knn or no irradiance map";
    if (!maps && !nearest && directed && scene.triangle_count() > 0)
        return "irradiance: found none, expected a map beside surfaces where the phase is not 0";
    return nullptr;
}

} // namespace

wisp_status check_numbers(const wisp_settings &s, wisp_error *error) {
    const struct {
        const char *name;
        int64_t value, least, most;
    } integers[] = {
        {"arithmetic", s.arithmetic, 0, 2},
        {"samples", s.samples, 1, 65536},
        {"method", s.method, 0, 2},
        {"irradiance", s.irradiance, 0, 2},
        {"estimate", s.estimate, 0, 1},
        {"deposit", s.deposit, 0, 3},
        {"direction", s.direction, 0, 1},
        {"gather", s.gather, 2, 1000000},
        {"paths", s.paths, 0, 1 << 20},
        {"depth", s.depth, 0, 64},
        {"shadows", s.shadows, 0, 6},
        {"lights", s.lights, 0, 1},
        {"tree", s.tree, 0, 1},
        {"layers", s.layers, 0, 1},
    };
    for (const auto &i : integers)
        if (i.value < i.least || i.value > i.most)
            return refuse(error, WISP_WRONG_USAGE, "settings.", i.name, ": found ", i.value < 0 ? "-" : "",
                          static_cast<uint64_t>(i.value < 0 ? -i.value : i.value), ", expected ",
                          static_cast<uint64_t>(i.least), " to ", static_cast<uint64_t>(i.most));
    for (const auto &[name, value] : {Count{"seed", s.seed}, Count{"photons", s.photons}})
        if (value > INT64_MAX)
            return refuse(error, WISP_WRONG_USAGE, "settings.", name, ": found ", value, ", expected below 2^63");
    const struct {
        const char *name;
        double value, least;
        const char *expected;
        bool or_zero;
    } numbers[] = {
        {"gather_radius", s.gather_radius, 1e-30, "above 0, at most 1000", false},
        {"step", s.step, 1e-4, "0.0001 to 1000", false},
        {"density_step", s.density_step, 0.01, "0, or 0.01 to 1000", true},
        {"light_step", s.light_step, 0.01, "0, or 0.01 to 1000", true},
        {"irradiance_step", s.irradiance_step, 0.01, "0.01 to 1000", false},
    };
    for (const auto &n : numbers)
        if (!(n.value >= n.least && n.value <= 1000) && !(n.or_zero && n.value == 0))
            return refuse(error, WISP_WRONG_USAGE, "settings.", n.name, ": expected ", n.expected);
    return WISP_DONE;
}

wisp_status read_settings(const wisp_settings *from, const wisp_frame &frame, Settings &settings, wisp_error *error) {
    if (!from) return refuse(error, WISP_WRONG_USAGE, "settings: found NULL, expected wisp_settings");
    if (const wisp_status status = check_version("settings", from->version, error)) return status;
    if (const wisp_status status = check_numbers(*from, error)) return status;
    settings = {};
    if (const wisp_status status = read_crop(*from, frame, settings.crop, error)) return status;
    settings.samples = from->samples;
    settings.depth = from->depth;
    settings.shadows = static_cast<ShadowMethod>(from->shadows);
    settings.photons = from->photons;
    settings.paths = from->paths;
    settings.seed = from->seed;
    settings.gather = from->gather;
    settings.gather_radius = from->gather_radius;
    settings.step = from->step;
    settings.deposit = static_cast<Deposit>(from->deposit);
    settings.direction = static_cast<Direction>(from->direction);
    settings.estimate = static_cast<Estimate>(from->estimate);
    settings.density_step = from->density_step + 0.0; // -0 is 0
    settings.light_step = from->light_step + 0.0;
    settings.irradiance = static_cast<IrradianceMap>(from->irradiance);
    settings.irradiance_step = from->irradiance_step;
    settings.method = static_cast<Method>(from->method);
    settings.lights = static_cast<LightChoice>(from->lights);
    settings.tree = static_cast<TreeKind>(from->tree);
    settings.layers = from->layers != 0;
    if (const char *what = exclusion(frame.scene, settings)) return refuse(error, WISP_WRONG_USAGE, "settings.", what);
    return WISP_DONE;
}

} // namespace wisp::c_api

wisp_settings wisp_default_settings(void) {
    wisp_settings settings = {};
    settings.version = WISP_C_API_VERSION;
    settings.samples = 4;
    settings.seed = 1;
    settings.photons = 1000000;
    settings.method = WISP_METHOD_MAP;
    settings.irradiance = WISP_IRRADIANCE_UNIFORM;
    settings.deposit = WISP_DEPOSIT_NODES;
    settings.gather = 500;
    settings.gather_radius = 2;
    settings.density_step = settings.light_step = 0.5;
    settings.step = settings.irradiance_step = 1;
    settings.depth = 10;
    settings.shadows = WISP_SHADOWS_EXACT;
    return settings;
}
