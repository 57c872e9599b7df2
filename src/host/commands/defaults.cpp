#include "core/photons/direction_limits.h"
#include "core/render/kept_at_nodes.h"
#include "core/smoke/grid_samples.h"
#include "host/base/error.h"
#include "host/base/renderers.h"
#include "host/commands/defaults.h"
#include "host/prepare/core_units.h"
#include "host/results/picture_bytes.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"
#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

bool is_anisotropic(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (scene.smokes[i].asymmetry != 0) return true;
    return false;
}

// Bricks of smoke may take so many bytes, or so many for each particle or sample: particles in a spray, or of unlike
// radii, take less memory and time one by one.
constexpr uint64_t max_brick_bytes = uint64_t{5} << 26, max_brick_bytes_of_element = 5120;

uint64_t most_brick_bytes(const Scene &scene) {
    uint64_t elements = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        elements += scene.smokes[i].grid.density ? stored_samples(scene.smokes[i].grid) : scene.smokes[i].count;
    return std::max(max_brick_bytes, max_brick_bytes_of_element * elements);
}

// Photons leave their power at points that far apart, in smoothing lengths. The deepest of their cells may have this
// optical depth at hard faces: then the light that is scattered more than once erred by 5 % at most there, and the
// picture by 2 %. Deeper cells erred by up to 1/8 of their depth, which is 9 % of 0.7 (README of photons).
constexpr double max_depth_of_photon_cell = 0.7, max_error_at_faces = 0.09;
// The same of photons that no lines gather again: those that are kept as scattered to the eye, and those of smoke that
// glows, whose light falls towards its faces. A box of g = 0.57 and albedo 0.7 is 3 to 4 % too dark in cells 0.66 deep,
// 7 % in a sixteenth; in cells 0.33 deep 1 and 4 %. One that glows is 3 to 5 % too bright in cells 0.63 deep, 1.3 % in
// cells 0.31 deep.
constexpr double max_depth_of_ungathered_cell = 0.4, max_error_of_ungathered = 0.045;
// The same where diffuse light enters the samples of a density grid, which may be thin there and deep inside. Grids of
// a hundred samples across err by 1 to 1.5 %, of ten by 2 % (even phase) to 3 % (g = 0.5).
constexpr double max_depth_of_lit_photon_cell = 0.35;
// Particles fade: there smaller cells would show more noise of photons than they take away of the error.
constexpr double max_depth_of_soft_photon_cell = 2;
// The same of particles and samples that keep their power themselves.
constexpr double max_depth_of_element = 0.4;

// The same around a light in the smoke, whose light varies within them. One that lights a grid of 12 x 12 x 12 samples
// alone errs by 1 to 2 % where cells are 0.25 deep, by 2 to 5 % at 0.5, and by 9 to 12 % at 1 (README of photons).
constexpr double max_depth_of_cell_at_light = 0.35;

// Below this phase the flux of photons gives too much light: 1.5 times as much that is scattered more than once at
// -0.8, 5 times at -0.95.
constexpr double least_asymmetry_of_photons = -0.6;

// Smaller errors of the flux and of harmonics are not said: other errors are as large.
constexpr double least_error_of_flux = 0.03;

double greatest_asymmetry(const Scene &scene) {
    double most = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty()) most = std::max(most, std::abs(scene.smokes[i].asymmetry));
    return most;
}

bool has_samples(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (scene.smokes[i].grid.density) return true;
    return false;
}

// Few particles, whose smoke is of so many cells or fewer, are resampled to finer ones: that costs little, and the
// errors of few particles do not even out. Thin smoke of 1, 3, 10, 30 and 100 of them at random places errs by 20,
// 11, 8, 6 and 4 % in cells of 0.55 smoothing lengths, and in these by 2 % of one, and of more by 1 % or less.
constexpr double few_cells = 16000;
// The same where few of many take most of the light, as one small particle among wide faint ones: all smoke may be of
// so many cells.
constexpr double few_cells_of_all = 256000;
constexpr double finest_cell = 0.1; // of one particle these are 64,000
constexpr double widest_cell = 0.55;

// Light is kept at the nodes of as fine cells as so many photons each have little noise in. A cube of 4 x 4 x 4 even
// samples around a lamp, 2 deep, errs by 8 % where light is kept a sample apart, by 50 % at its rim; in halves,
// quarters and eighths by 1.6, 0.5 and 0.2 %, and by 10, 3 and 2 %. Of 8 x 8 x 8 own samples and halves err by 2.2 and
// 0.3 %. Two balls of 400 particles between two lamps err by 2.7 % where light is kept two cells apart, and by 0.7 % at
// each node.
constexpr double photons_of_cell = 12;

bool has_few_cells(const Scene &scene, const SmokeDensity &density, const Settings &settings, double cell) {
    if (settings.method != Method::map) return false;
    const double edge = cell * density.length,
                 cells = keeps_samples(scene)
                             ? static_cast<double>(stored_samples(aligned_grid(scene)->grid)) / (cell * cell * cell)
                             : density.volume / (edge * edge * edge);
    return photons_of_cell * cells <= static_cast<double>(settings.photons);
}

// Halves cells, down to eighths, as long as there are few.
double halved_to_few(const Scene &scene, const SmokeDensity &density, const Settings &settings, double cell) {
    while (cell > 0.125 && has_few_cells(scene, density, settings, 0.5 * cell)) cell *= 0.5;
    return cell;
}

// The cells of the scene's smoke, where those of many particles are of `lengths` smoothing lengths.
double cell_for(const Scene &scene, const SmokeDensity &density, double lengths, const Settings &settings) {
    const auto is_few = [&](double cell) {
        const double edge = cell * density.length, volume = edge * edge * edge;
        return few_cells * volume >= density.even_volume && few_cells_of_all * volume >= density.volume;
    };
    if (keeps_samples(scene)) {
        const double part = halved_to_few(scene, density, settings, 0.5);
        return part < 0.5 ? part : std::max(lengths, part);
    }
    if (aligned_grid(scene)) return lengths;
    double cell = lengths;
    while (cell > finest_cell && is_few(cell)) cell = std::max(0.9 * cell, finest_cell);
    return cell;
}

// The spacings of fields over bricks of these cells, or of `usual` where densities are exact; and the steps. Samples
// of grids differ more from one to the next than sums of particles: in steps of one sample single scattering of the
// density grid of the benchmarks errs by 0.39 % where there is smoke, in steps of half a sample by 0.07 %, for 8 % of
// its time. Photons that leave their light two samples apart err by 2.7 % there, one sample apart by 1.3 %. The finer
// cells of few particles leave steps as they are for many, or make them half as long.
void choose_spacings(const Options &options, const Scene &scene, const SmokeDensity &density, double usual,
                     Settings &settings) {
    const bool kept = is_resampled(scene, settings), samples = kept && keeps_samples(scene);
    const double cell = kept ? settings.density_step : usual;
    settings.light_step = options.light_step.value_or(kept ? cell : 0);
    const double twice = kept && !options.density_step ? std::max(2 * cell, usual) : 2 * cell;
    const double step = samples ? std::min(cell, usual) : twice;
    settings.step = options.step.value_or(kept && settings.method == Method::map ? step : 0.5);
    double places = samples ? std::max(cell, 1.0) : twice;
    if (!kept) places = halved_to_few(scene, density, settings, places);
    if (kept && has_few_cells(scene, density, settings, cell)) places = cell;
    settings.irradiance_step = options.irradiance_step.value_or(places);
}

// Whether the eye is in a density grid that keeps its samples and whose phase is not even. Light that is scattered to
// it then differs much within a sample near to it: in a grid of 2 x 2 x 2 with g = 0.58 own samples lose 7 % of all
// light, halves 2 %.
bool is_seen_from_within(const Scene &scene) {
    if (!keeps_samples(scene)) return false;
    const SmokeDescription &smoke = *aligned_grid(scene);
    const Double3 &eye = scene.camera.origin, &center = smoke.grid.center, &half = smoke.grid.half;
    return smoke.asymmetry != 0 && std::abs(eye.x - center.x) <= half.x && std::abs(eye.y - center.y) <= half.y &&
           std::abs(eye.z - center.z) <= half.z;
}

// Whether light that is scattered more than once finds a density grid's own samples fine enough. Bricks of half samples
// halve the error of the benchmarks' grid in six times the time; more photons do that sooner. Single scattering by
// itself, which has no photons' noise, errs there by 0.08 %, and in own samples by 0.24 %.
bool own_samples_suffice(const Options &options, const Scene &scene, const SmokeDensity &density,
                         const Settings &settings) {
    const bool finer = options.irradiance_step.value_or(1) < 1 || options.light_step.value_or(1) < 1;
    if (!keeps_samples(scene) || finer) return false;
    if (settings.method != Method::map || settings.density_step <= 0 || settings.photons == 0) return false;
    if (has_few_cells(scene, density, settings, 0.5)) return false;
    return density.depth_where_lit <= max_depth_of_lit_photon_cell && !is_seen_from_within(scene);
}

// Particles of which one smoothing length may be deeper are summed one by one, and samples of grids are interpolated.
// Light enters them where they are thin, in a rim that cells of bricks are too coarse for: single scattering of
// particles is 4 % too bright at a depth of 850, and 13 % at 2,400.
constexpr double max_depth_in_bricks = 100;

// Whether a picture fits in --memory in its own arithmetic, by rays for shadows where those are left open.
bool fits_in_memory(const Options &options, const Scene &scene, Settings settings) {
    if (!options.memory) return true;
    if (!options.shadows) settings.shadows = ShadowMethod::trace;
    return needed_bytes(settings, renderer_of(options.arithmetic).plan(scene, settings)) <= *options.memory;
}

// What smoke takes of a plan's arena.
uint64_t smoke_bytes(const Plan &plan) {
    uint64_t sum = 0;
    for (Stage stage = Stage::particle_tree; stage <= Stage::majorants; stage = Stage(static_cast<int>(stage) + 1))
        sum += plan[stage].bytes;
    return sum;
}

constexpr uint64_t fewest_bricks = 8; // larger cells have as many: the bricks around one corner

// Where bricks would be too large, those of a box become coarser, and particles are summed one by one. Where --memory
// has no room for bricks, those of particles become as coarse as those of many may be; then all densities are exact.
// Without --memory the choice must not depend on the arithmetic: its plan is that of f64. `usual`: as of
// choose_spacings().
void shrink_bricks(const Options &options, const Scene &scene, const SmokeDensity &density, double usual,
                   Settings &settings) {
    const bool samples = has_samples(scene), particles = has_particles(scene);
    const bool solid = (particles || samples) && density.greatest_depth > max_depth_in_bricks;
    const uint64_t most = most_brick_bytes(scene);
    while (settings.density_step > 0) {
        const bool fits = fits_in_memory(options, scene, settings);
        const Plan plan = f64::renderer.plan(scene, settings);
        if (!solid && fits && (smoke_bytes(plan) <= most || plan.bricks <= fewest_bricks)) return;
        const bool as_coarse_as_samples = samples && settings.density_step >= 1;
        if (particles && !solid && !fits && settings.density_step < widest_cell) {
            settings.density_step = std::min(1.125 * settings.density_step, widest_cell);
        } else if (particles || solid || (!fits && (!samples || as_coarse_as_samples))) {
            settings.density_step = 0;
            settings.irradiance = IrradianceMap::none;
        } else if (as_coarse_as_samples) {
            return;
        } else {
            settings.density_step = samples ? 1 : 1.125 * settings.density_step;
        }
        choose_spacings(options, scene, density, settings.density_step > 0 ? usual : 1, settings);
    }
}

// Exact densities have bricks for photons alone. Where these would be too large, their cells become coarser.
void shrink_photon_cells(const Options &options, const Scene &scene, Settings &settings) {
    if (options.irradiance_step || is_resampled(scene, settings) || !keeps_light_at_nodes(scene, settings)) return;
    while (settings.irradiance_step < 1000 &&
           (smoke_bytes(f64::renderer.plan(scene, settings)) > most_brick_bytes(scene) ||
            !fits_in_memory(options, scene, settings)))
        settings.irradiance_step *= 2;
}

// With cells of photons as fine as those of the bricks, or half as wide over exact densities, where they are not given
// and there is room.
Settings with_finest_photon_cells(const Options &options, const Scene &scene, const Settings &settings) {
    if (options.irradiance_step || !keeps_light_at_nodes(scene, settings)) return settings;
    Settings finest = settings;
    finest.irradiance_step = is_resampled(scene, settings) ? settings.density_step : 0.5 * settings.irradiance_step;
    return fits_in_memory(options, scene, finest) ? finest : settings;
}

// About the relative RMSE of a picture by so many paths from each ray. Of fixtures/demo.aff it is 0.75 times that where
// paths are 4 a pixel, and 1.5 times where they are 100.
double noise_of_paths(uint32_t paths, const Settings &settings) {
    return 1 / std::sqrt(static_cast<double>(paths) * settings.samples);
}

// The same where the phase is narrower than harmonics hold: boxes of g = 0.75 in a spot's light, beside a mirror or a
// matt floor, are 3.3 to 5 times as noisy.
double noise_of_paths_in(const Scene &scene, uint32_t paths, const Settings &settings) {
    return (greatest_asymmetry(scene) > max_asymmetry_of_harmonics ? 4 : 1) * noise_of_paths(paths, settings);
}

// How wide the cells of photons are at most, in smoothing lengths or edges of samples.
double photon_step(const Scene &scene, const Settings &settings) {
    if (!keeps_light_at_nodes(scene, settings)) return 1;
    if (!is_resampled(scene, settings)) return settings.irradiance_step;
    return std::max(settings.irradiance_step, cell_of_bricks(scene, settings.density_step));
}

// Whether resampled smoke has photons as scattered to the eye.
bool keeps_towards_eye(const Scene &scene, const Settings &settings) {
    return is_anisotropic(scene) && is_resampled(scene, settings) &&
           f64::renderer.plan(scene, settings).photon_directions == Plan::Directions::to_eye;
}

// Whether some resampled smoke glows and no lines gather its light, as there are surfaces (photons/README, S4-5).
bool glows_ungathered(const Scene &scene, const Settings &settings) {
    const auto is_glowing = [](const SmokeDescription &smoke) { return glows(smoke.emission, smoke.albedo); };
    return std::any_of(scene.smokes, scene.smokes + scene.smoke_count, is_glowing) && is_resampled(scene, settings) &&
           scene.triangle_count() > 0;
}

// The cells of photons, wherever lights stand.
PhotonCells cells_of_smoke(const Scene &scene, const SmokeDensity &density, const Settings &settings) {
    const double step = photon_step(scene, settings);
    const double lit = density.depth_where_lit * step;
    if (keeps_samples(scene) && lit <= max_depth_of_lit_photon_cell) return {lit, max_depth_of_lit_photon_cell, 0.03};
    bool hard = false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) hard |= scene.smokes[i].is_grid();
    const double depth = density.greatest_depth * step;
    if (!hard) return {depth, max_depth_of_soft_photon_cell, 0.03};
    return keeps_towards_eye(scene, settings) || glows_ungathered(scene, settings)
               ? PhotonCells{depth, max_depth_of_ungathered_cell, max_error_of_ungathered}
               : PhotonCells{depth, max_depth_of_photon_cell, max_error_at_faces};
}

// Makes the cells of photons finer where they are too deep, or the eye is among them. Returns whether photons then err
// by little; where all is `free` to choose, by less than paths from rays.
bool fit_photon_cells(const Options &options, const Scene &scene, const SmokeDensity &density, uint32_t paths,
                      bool free, Settings &settings) {
    // Towards the eye finer cells have more noise: a box errs by 8 % (root mean square) in cells 0.66 deep, by 12 % in
    // cells 0.33 deep; of 4,000,000 photons by 5.7 and 6.3 %.
    const auto suffice = [&](const Settings &cells) {
        const PhotonCells found = photon_cells(scene, density, cells);
        const bool are_better =
            free && found.depth <= max_depth_of_photon_cell && found.error() < noise_of_paths(paths, settings);
        return found.fit() || (are_better && keeps_towards_eye(scene, cells));
    };
    if (suffice(settings) && !is_seen_from_within(scene)) return true;
    const Settings finest = with_finest_photon_cells(options, scene, settings);
    if (suffice(finest)) {
        settings = finest;
        return true;
    }
    if (cells_of_smoke(scene, density, finest).fit()) settings = finest; // but for a light in the smoke they suffice
    if (!free) return false;
    for (const Settings &cells : {settings, finest})
        if (photon_cells(scene, density, cells).error() < noise_of_paths(paths, settings) &&
            fits_in_memory(options, scene, cells)) {
            settings = cells;
            return true;
        }
    return false;
}

} // namespace

uint32_t paths_for(uint64_t photons, uint64_t rays) {
    return static_cast<uint32_t>(std::clamp<uint64_t>(photons / rays, 1, 1 << 20));
}

double most_forward(const Scene &scene) {
    double most = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty()) most = std::max(most, scene.smokes[i].asymmetry);
    return most;
}

bool takes_peaks_off(const Scene &scene, const Settings &settings, const Plan &plan) {
    return plan.photon_directions == Plan::Directions::to_eye && is_resampled(scene, settings) &&
           most_forward(scene) > max_asymmetry_of_harmonics;
}

// Measured on a box, particles and samples, lit from behind, from the side and from the front: 20, 31, 43, 60 and 100 %
// at most for g = 0.6, 0.7, 0.8, 0.9 and 0.95. With harmonics, a box and a ball err by 2, 4.3 and 7 % for g = 0.4, 0.5
// and 0.57. Flux and harmonics are those of all channels together: a box between a red and a blue light errs by 6, 11,
// 25, 45 and 57 % for g = 0.12, 0.2, 0.35, 0.5 and 0.57, by the flux alone or with harmonics.
double error_of_flux(const Scene &scene, const Settings &settings, const Plan &plan) {
    const bool flux =
        plan.photon_directions == Plan::Directions::flux || plan.photon_directions == Plan::Directions::harmonics;
    const bool every_step = settings.method != Method::map && settings.irradiance == IrradianceMap::none;
    if (!plan.photons || !flux || every_step) return 0; // photons have all their directions there
    const double most = greatest_asymmetry(scene), forward = most_forward(scene), square = forward * forward,
                 of_hues = 2 * square,
                 of_phase = most > max_asymmetry_of_harmonics ? 0.1 / (1 - most) : 0.9 * square * square,
                 error = plan.photon_powers ? std::max(of_hues, of_phase) : of_phase;
    return error > least_error_of_flux ? std::min(error, 1.0) : 0;
}

bool scatters_far_backward(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (scene.smokes[i].asymmetry < least_asymmetry_of_photons) return true;
    return false;
}

PhotonCells photon_cells(const Scene &scene, const SmokeDensity &density, const Settings &settings) {
    if (settings.irradiance == IrradianceMap::none ||
        (settings.method == Method::map && !keeps_light_at_nodes(scene, settings)))
        return {density.deepest_element, max_depth_of_element, 0.1};
    const PhotonCells cells = cells_of_smoke(scene, density, settings);
    const PhotonCells at_lights = {density.depth_at_lights * photon_step(scene, settings), max_depth_of_cell_at_light,
                                   0.03};
    return cells.error() < at_lights.error() ? at_lights : cells;
}

double width_of_photon_cells(const Scene &scene, const Settings &settings) {
    double least = 0;
    for (const SmokeDescription *smoke = scene.smokes; smoke != scene.smokes + scene.smoke_count; ++smoke)
        if (!smoke->empty()) least = least > 0 ? std::min(least, smoke->smallest_h) : smoke->smallest_h;
    return least * photon_step(scene, settings);
}

// On the smoke of fixtures/table2.aff these are the fastest steps whose pictures err by no more than the photons'
// noise.
const char *choose_defaults(const Options &options, const Scene &scene, uint32_t paths, Settings &settings) {
    const bool resamples = can_resample(scene), nearest = options.estimate == Estimate::knn;
    const bool maps = !options.map_in.empty() || !options.map_out.empty() || options.batches;
    settings.method = !has_smoke(scene) && !maps
                          ? Method::direct
                          : options.method.value_or(nearest && !maps ? Method::direct : Method::map);
    settings.irradiance = options.irradiance.value_or(nearest ? IrradianceMap::none : IrradianceMap::uniform);
    if (settings.method == Method::map && nearest && settings.irradiance != IrradianceMap::none)
        throw Error(exit_usage, "option 'irradiance': found a map, expected none with --estimate knn of --smoke map");
    if (settings.method == Method::volume && options.density_step == 0.0)
        throw Error(exit_usage, "option 'density-step': found 0, expected cells with --smoke volume");
    // A particle map on particles needs their exact densities.
    const bool power_on_particles =
        settings.photons > 0 &&
        (options.deposit.value_or(Deposit::nodes) != Deposit::nodes || options.direction == Direction::mean);
    const bool on_particles =
        settings.method == Method::map && (nearest || power_on_particles || settings.irradiance == IrradianceMap::none);
    if (on_particles && options.density_step.value_or(0) > 0)
        throw Error(exit_usage, "option 'density-step': found resampled smoke, expected 0 with --deposit, --direction "
                                "mean, --estimate knn or --irradiance none of --smoke map");
    if (on_particles && options.deposit == Deposit::nodes)
        throw Error(exit_usage, "option 'deposit': found nodes, expected exact, path or kernel with --direction mean, "
                                "--estimate knn or --irradiance none of --smoke map");
    settings.deposit = options.deposit.value_or(on_particles || resamples ? Deposit::exact : Deposit::nodes);
    // The particles' radiance is towards the eye, and mirrors see other directions of it.
    const bool needs_directions = scene.triangle_count() > 0 && is_anisotropic(scene);
    if (needs_directions && on_particles && !nearest && settings.irradiance == IrradianceMap::none)
        throw Error(exit_usage,
                    "option 'irradiance': found none, expected a map beside surfaces where the phase is not "
                    "0");
    // The usual cells are of 0.55 smoothing lengths, and smaller in smoke that is deep within them.
    const SmokeDensity density = density_of(scene);
    const double usual = resamples ? widest_cell * std::clamp(0.14 / density.mean_depth, 0.4, 1.0) : widest_cell;
    const std::optional<double> asked_step = resamples ? options.density_step : std::nullopt;
    const double cell = resamples ? cell_for(scene, density, usual, settings) : usual;
    settings.density_step = asked_step.value_or(settings.method == Method::direct || on_particles ? 0 : cell);
    if (!asked_step && own_samples_suffice(options, scene, density, settings)) settings.density_step = 1;
    choose_spacings(options, scene, density, usual, settings);
    settings.direction = options.direction;
    settings.estimate = options.estimate.value_or(Estimate::kernel);
    const bool free = !asked_step && !options.irradiance; // to choose other bricks, or none
    const bool in_bricks = settings.density_step > 0;
    if (free && settings.method == Method::map && !(needs_directions && maps))
        shrink_bricks(options, scene, density, usual, settings);
    shrink_photon_cells(options, scene, settings);
    const bool asked_for = settings.method != Method::map && (options.method || nearest);
    if (asked_for || on_particles || maps || settings.goal != Goal::picture || settings.photons == 0) return nullptr;
    const bool fits = fit_photon_cells(options, scene, density, paths, free, settings),
               lacks_directions = needs_directions && in_bricks && settings.density_step == 0;
    if (!free || (options.irradiance_step && !lacks_directions)) return nullptr;
    const char *why = lacks_directions ? "photons on exact densities lack the directions that surfaces see"
                      : scatters_far_backward(scene) ? "the phase is too far backward for photons"
                      : !fits                        ? "the smoke is too dense for the cells of photons"
                      : is_anisotropic(scene) && error_of_flux(scene, settings, f64::renderer.plan(scene, settings)) >=
                                                     noise_of_paths_in(scene, paths, settings)
                          ? "the phase is too uneven for the directions that photons keep"
                          : nullptr;
    if (why) settings.paths = paths;
    return why;
}

} // namespace wisp
