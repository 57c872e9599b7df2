#include "core/smoke/resampling.h"
#include "host/base/error.h"
#include "host/commands/defaults.h"
#include "wisp/settings.h"
#include <algorithm>
#include <vector>

namespace wisp {

namespace {

// The volume of the cells of edge `cell` in which there are particles.
double occupied_volume(const SmokeDescription &smoke, double cell) {
    std::vector<uint64_t> cells;
    cells.reserve(smoke.count);
    const auto index = [cell](double x) { // coordinates are within coordinate_limit, cells at least 2 wide
        return static_cast<uint64_t>(x / cell + (1 << 20));
    };
    for (uint32_t i = 0; i < smoke.count; ++i) {
        const Double3 &p = smoke.particles[i].position;
        cells.push_back(index(p.x) << 42 | index(p.y) << 21 | index(p.z));
    }
    std::sort(cells.begin(), cells.end());
    const auto end = std::unique(cells.begin(), cells.end());
    return static_cast<double>(end - cells.begin()) * cell * cell * cell;
}

} // namespace

double volume_of(const SmokeDescription &smoke) {
    const Double3 &half = smoke.grid.half;
    return smoke.is_grid() ? 8 * half.x * half.y * half.z : occupied_volume(smoke, 2 * smoke.largest_h);
}

double depth_of_length(const Scene &scene) {
    double finest = 0, deepest = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty())
            finest = finest > 0 ? std::min(finest, scene.smokes[i].smallest_h) : scene.smokes[i].smallest_h;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        deepest = std::max(deepest, smoke.total_area / volume_of(smoke) * finest);
    }
    return deepest;
}

// On the smoke of fixtures/table2.aff these are the fastest steps whose pictures err by no more than the photons'
// noise.
void choose_defaults(const Options &options, const Scene &scene, Settings &settings) {
    const bool resamples = can_resample(scene), nearest = options.estimate == Estimate::knn;
    const bool maps = !options.map_in.empty() || !options.map_out.empty() || options.batches || options.remap;
    settings.method = options.method.value_or((resamples && !nearest) || maps ? Method::map : Method::direct);
    settings.irradiance = options.irradiance.value_or(nearest ? IrradianceMap::none : IrradianceMap::uniform);
    if (settings.method == Method::map && nearest && settings.irradiance != IrradianceMap::none)
        throw Error(exit_usage, "option 'irradiance': found a map, expected none with --estimate knn of --smoke map");
    if (settings.method == Method::volume && options.density_step == 0.0)
        throw Error(exit_usage, "option 'density-step': found 0, expected cells with --smoke volume");
    // A particle map on particles needs their exact densities.
    const bool on_particles =
        settings.method == Method::map && (nearest || options.deposit || options.direction == Direction::mean ||
                                           settings.irradiance == IrradianceMap::none);
    if (on_particles && options.density_step.value_or(0) > 0)
        throw Error(exit_usage, "option 'density-step': found resampled smoke, expected 0 with --deposit, --direction "
                                "mean, --estimate knn or --irradiance none of --smoke map");
    // The particles' radiance is towards the eye, and mirrors see other directions of it.
    bool anisotropic = false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) anisotropic |= scene.smokes[i].asymmetry != 0;
    if (scene.triangle_count() > 0 && anisotropic && on_particles && !nearest &&
        settings.irradiance == IrradianceMap::none)
        throw Error(exit_usage,
                    "option 'irradiance': found none, expected a map beside surfaces where the phase is not "
                    "0");
    // Cells of 0.55 smoothing lengths, and smaller ones in smoke that is deep within them.
    const double finest = resamples ? 0.55 * std::clamp(0.14 / depth_of_length(scene), 0.4, 1.0) : 0.55;
    settings.density_step =
        options.density_step.value_or(settings.method == Method::direct || on_particles ? 0 : finest);
    const bool kept = settings.density_step > 0 && resamples;
    const double cell = settings.density_step > 0 ? settings.density_step : finest;
    settings.light_step = options.light_step.value_or(kept ? cell : 0);
    settings.step = options.step.value_or(kept && settings.method == Method::map ? 2 * cell : 0.5);
    settings.irradiance_step = options.irradiance_step.value_or(2 * cell);
    settings.deposit = options.deposit.value_or(Deposit::exact);
    settings.direction = options.direction;
    settings.estimate = options.estimate.value_or(Estimate::kernel);
}

} // namespace wisp
