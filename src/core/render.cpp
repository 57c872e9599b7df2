// The stages of the papers, in order: trees, photons, picture.
#include "wisp/camera.h"
#include "wisp/ray_march.h"
#include "wisp/reference.h"

namespace wisp::WISP_ARITH {

namespace {

uint64_t march_bytes(const Scene &scene) {
    return Arena::bytes<Light>(scene.light_count) + 2 * Arena::bytes<Real>(scene.smoke_count);
}

bool make_marcher(const Scene &scene, const Settings &settings, const Medium &medium, const Light *lights, Arena &arena,
                  Marcher &marcher) {
    marcher.medium = &medium;
    marcher.lights = lights;
    marcher.light_count = scene.light_count;
    marcher.background = vec_of(scene.background);
    Real *radius = arena.make<Real>(scene.smoke_count);
    marcher.gather_radius = radius;
    marcher.extinctions = arena.make<Real>(scene.smoke_count);
    if (!marcher.gather_radius || !marcher.extinctions) return false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeSource &smoke = scene.smokes[i];
        radius[i] = to_real<Real>(smoke.largest_h) * to_real<Real>(settings.gather_radius);
        if (smoke.empty()) continue;
        const Real step = to_real<Real>(smoke.smallest_h) * to_real<Real>(settings.step);
        marcher.step = marcher.step == Real(0) ? step : min(marcher.step, step);
    }
    return true;
}

Status render_frame(const Scene &scene, const Settings &settings, Marcher &marcher, const Observer &observer,
                    float *rgb) {
    const View view(scene.camera);
    const Crop &crop = settings.crop;
    const Pattern pattern(settings.samples);
    for (int32_t y = crop.y0; y < crop.y1; ++y) {
        const uint64_t row = static_cast<uint64_t>(y - crop.y0);
        if (!observer(Stage::render, row, static_cast<uint64_t>(crop.y1 - crop.y0))) return Status::stopped;
        for (int32_t x = crop.x0; x < crop.x1; ++x) {
            Color sum(Real(0));
            for (uint32_t i = 0; i < settings.samples; ++i) {
                sum += march(marcher, view.ray_through(Real(x) + pattern.u(i), Real(y) + pattern.v(i)));
                ++marcher.statistics->rays.primary;
            }
            const Color mean = sum / Real(static_cast<int32_t>(settings.samples));
            *rgb++ = to_float_scaled(mean.x, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.y, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.z, scene.radiance_exponent);
        }
    }
    return Status::done;
}

} // namespace

Plan plan(const Scene &scene, const Settings &settings) {
    Plan plan = {};
    for (uint32_t i = 0; i < scene.smoke_count; ++i) plan.smoke |= !scene.smokes[i].empty();
    if (settings.reference) {
        plan.bytes.particle_tree = medium_bytes(scene);
        plan.bytes.arena = reference_bytes(scene);
        return plan;
    }
    const PhotonPlan photons = plan_photons(scene, settings);
    plan.photons = photons.traced;
    plan.photon_directions = photons.directions;
    plan.photon_powers = photons.powers;
    plan.photon_capacity = photons.capacity;
    plan.bytes.particle_tree = medium_bytes(scene);
    plan.bytes.photon_map = photons.bytes;
    plan.bytes.gather = photons.traced ? gather_bytes(settings.gather) : 0;
    plan.bytes.arena = plan.bytes.particle_tree + plan.bytes.photon_map + plan.bytes.gather + march_bytes(scene);
    return plan;
}

Status render(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,
              Statistics &statistics) {
    Marcher marcher = {};
    marcher.statistics = &statistics;
    statistics.bytes.arena_size = arena.size();

    if (!observer(Stage::trees, 0, 1)) return Status::stopped;
    const Medium medium = make_medium(scene, arena);
    Light *lights = arena.make<Light>(scene.light_count);
    if (!medium.ready || !lights || !make_marcher(scene, settings, medium, lights, arena, marcher))
        return Status::out_of_memory;
    for (uint32_t i = 0; i < scene.light_count; ++i) lights[i] = make_light(scene.lights[i]);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) statistics.smoke.particles += scene.smokes[i].count;
    statistics.bytes.particle_tree = arena.mark();

    const PhotonPlan photons = plan_photons(scene, settings);
    if (photons.traced && !make_gather(settings.gather, arena, marcher.gather)) return Status::out_of_memory;
    const PhotonMaps maps =
        trace_photons(medium, lights, scene.light_count, settings, photons, observer, arena, statistics);
    if (maps.status != Status::done) return maps.status;
    marcher.photon_maps = maps.of_smoke;

    const Status status = render_frame(scene, settings, marcher, observer, rgb);
    statistics.bytes.arena_peak = arena.peak();
    return status;
}

} // namespace wisp::WISP_ARITH
