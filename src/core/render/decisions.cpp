#include "core/render/decisions.h"
#include "core/photons/direction_limits.h"
#include "core/render/kept_at_nodes.h"

namespace wisp::WISP_ARITH {

namespace {

bool has_scattering_smoke(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty() && any_above_zero(scene.smokes[i].albedo)) return true;
    return false;
}

// What the phase functions of all smoke allow.
struct PhaseSuits {
    bool lines;       // spherical harmonics tell what the only one scatters well enough for lines (S4-5)
    bool towards_eye; // photons are kept as scattered to the eye
};
PhaseSuits phase_suits(const Scene &scene, bool resampled, bool one_power) {
    const SmokeDescription *first = nullptr;
    bool alike = true;
    int64_t least = 0, most = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        if (!first) first = &smoke;
        const int64_t g = total_order_key(smoke.asymmetry);
        alike = alike && g == total_order_key(first->asymmetry);
        least = min(least, g);
        most = max(most, g);
    }
    if (!first) return {false, false};
    const int64_t limit = total_order_key(max_asymmetry_of_harmonics);
    const bool narrow = most > limit || least < -limit;
    // Exact smoke has no harmonics, and narrow peaks would be noise. Of resampled smoke these are taken off.
    if (!resampled) return {false, !narrow && least != most};
    const bool towards_eye =
        alike && most > total_order_key(one_power ? max_asymmetry_of_lines : max_asymmetry_of_hues);
    return {alike && !narrow && !towards_eye, towards_eye};
}

// Whether surfaces reflect rays or let them through, so that smoke is seen from elsewhere than the eye.
bool sends_rays_on(const Scene &scene) {
    for (uint32_t i = 0; i < scene.material_count; ++i)
        if (any_above_zero(scene.materials[i].specular) ||
            total_order_key(scene.materials[i].transmission) > total_order_key(0.0))
            return true;
    return false;
}

// The largest of 1, 2, 4, 8 cells that is no longer than `step`, or 1.
int32_t spacing_within(double cell, double step) {
    int32_t spacing = 1;
    for (double wider = rounded_product(cell, 2);
         spacing < brick_cells && total_order_key(wider) <= total_order_key(step); wider = rounded_product(wider, 2))
        spacing *= 2;
    return spacing;
}

GridSpacing grid_spacing(const Scene &scene, const Settings &settings) {
    const double density = can_resample(scene) ? settings.density_step : 0;
    double cell = settings.light_step;
    if (total_order_key(density) > 0) {
        cell = cell_of_bricks(scene, density);
    } else if (settings.irradiance != IrradianceMap::none) {
        const bool light = total_order_key(cell) > 0,
                   finer = total_order_key(cell) < total_order_key(settings.irradiance_step);
        if (!(light && finer)) cell = settings.irradiance_step;
    }
    return {cell, spacing_within(cell, settings.light_step), spacing_within(cell, settings.irradiance_step)};
}

// Of a picture, and of photons: the reference needs none of this.
void decide_smoke(const Scene &scene, const Settings &settings, Decisions &d) {
    const bool map = settings.method == Method::map || d.goal == Goal::photons;
    const bool nearest_elements = map && settings.estimate == Estimate::knn;
    d.resampled = is_resampled(scene, settings);
    d.spacing = grid_spacing(scene, settings);
    d.scatters = has_scattering_smoke(scene);
    d.lights_in_smoke = d.scatters ? scene.light_count : 0;
    d.photon_needs = photon_needs(scene, settings);
    d.particle_map = map;
    d.at_nodes = keeps_light_at_nodes(scene, settings);
    if (d.photon_needs.traced)
        d.photons = !map ? PhotonStore::photon_map : d.at_nodes ? PhotonStore::fluence_grid : PhotonStore::particle_map;
    if (d.photons == PhotonStore::fluence_grid) {
        const PhaseSuits suits = phase_suits(scene, d.resampled, !d.photon_needs.powers);
        d.sweeps = d.resampled && suits.lines && !d.surfaces;
        d.photon_needs.harmonics = d.resampled && d.photon_needs.harmonics;
        d.photon_needs.towards_eye = suits.towards_eye && !(d.surfaces && sends_rays_on(scene));
        d.photon_needs.directions = d.photon_needs.directions && !d.photon_needs.towards_eye;
    }
    if (d.goal == Goal::photons) {
        d.light_depths = d.resampled && d.photons == PhotonStore::fluence_grid && d.lights_in_smoke > 0;
        d.march_grid = !d.resampled && d.photons == PhotonStore::fluence_grid;
        return;
    }
    d.paths = settings.paths > 0 && d.scatters;
    d.march = map && d.resampled ? MarchKind::grid : map && !nearest_elements ? MarchKind::particles : MarchKind::steps;
    d.nearest = d.march == MarchKind::steps && d.photons != PhotonStore::none;
    d.irradiance = d.photons == PhotonStore::fluence_grid ||
                   (d.photons != PhotonStore::none && settings.irradiance != IrradianceMap::none && !nearest_elements);
    // Photons start by the depths in resampled smoke, which is marched by them, too.
    d.light_depths = d.lights_in_smoke > 0 && (d.march == MarchKind::grid || total_order_key(settings.light_step) > 0);
    d.march_grid = !d.resampled && (d.light_depths || d.irradiance);
}

bool has_glowing_smoke(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty() && any_above_zero(scene.smokes[i].emission)) return true;
    return false;
}

// Those that the scene has something for.
void decide_layers(const Scene &scene, Decisions &d) {
    const auto set = [&d](Layer layer, bool there) { d.layers |= there ? bit_of(layer) : 0; };
    const bool lit = d.surfaces && scene.light_count > 0;
    if (d.goal == Goal::picture) {
        set(Layer::emission, d.smoke && has_glowing_smoke(scene));
        set(Layer::single, d.lights_in_smoke > 0);
        set(Layer::multiple, d.photons != PhotonStore::none || d.paths);
        set(Layer::surfaces, d.surfaces);
        set(Layer::background, any_above_zero(scene.background));
        set(Layer::direct, lit);
    }
    set(Layer::albedo, d.surfaces);
    set(Layer::normal, d.surfaces);
    set(Layer::depth, d.surfaces);
    set(Layer::alpha, true);
    set(Layer::shadow, lit);
    set(Layer::node_visits, d.surfaces);
}

// As parts::Part has them.
const char *missing_part(const Scene &scene, const Settings &settings, const Decisions &d) {
    using namespace parts;
    const bool shadowed = d.shaded.needed && scene.light_count > 0;
    const auto any_smoke = [&scene](bool is_grid) {
        for (uint32_t i = 0; i < scene.smoke_count; ++i)
            if (!scene.smokes[i].empty() && scene.smokes[i].is_grid() == is_grid) return true;
        return false;
    };
    const struct {
        Part part;
        bool needed;
        const char *name;
    } rows[] = {
        {surfaces, d.surfaces.needed, "surfaces"},
        {shadow_proofs, shadowed && settings.shadows == ShadowMethod::exact, "shadow_proofs"},
        {other_shadows, shadowed && settings.shadows != ShadowMethod::exact && settings.shadows != ShadowMethod::trace,
         "other_shadows"},
        {kd_trees, d.surfaces.needed && settings.tree == TreeKind::kd, "kd_trees"},
        {light_cuts, d.light_cuts.needed, "light_cuts"},
        {particles, any_smoke(false), "particles"},
        {grids, any_smoke(true), "grids"},
        {resampled, d.resampled.needed, "resampled"},
        {exact, d.smoke && d.goal != Goal::reference && !d.resampled.needed, "exact"},
        {photons, d.photons == PhotonStore::fluence_grid && d.resampled, "photons"},
        {exact_photons, d.photons != PhotonStore::none && !(d.photons == PhotonStore::fluence_grid && d.resampled),
         "exact_photons"},
        {paths, d.paths.needed || d.goal == Goal::reference, "paths"},
        {layers, d.layers != 0, "layers"},
    };
    for (const auto &row : rows)
        if (row.needed && !has(row.part)) return row.name;
    return nullptr;
}

} // namespace

Decisions decide(const Scene &scene, const Settings &settings) {
    Decisions d = {};
    d.goal = settings.goal;
    d.smoke = has_smoke(scene);
    d.surfaces = scene.triangle_count() > 0;
    d.shaded = d.surfaces && d.goal != Goal::photons;
    d.light_cuts = d.shaded && settings.lights == LightChoice::cuts && scene.light_count > 0;
    if (d.smoke && d.goal == Goal::reference)
        d.march = MarchKind::paths;
    else if (d.smoke)
        decide_smoke(scene, settings, d);
    if (settings.layers && d.goal != Goal::photons) decide_layers(scene, d);
    d.missing = missing_part(scene, settings, d);
    return d;
}

} // namespace wisp::WISP_ARITH
