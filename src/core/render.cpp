// The stages of the papers, in order: trees, photons, picture.
#include "wisp/camera.h"
#include "wisp/particle_march.h"
#include "wisp/reference.h"

namespace wisp::WISP_ARITH {

namespace {

uint64_t march_bytes(const Scene &scene) {
    return Arena::bytes<Light>(scene.light_count) + 2 * Arena::bytes<Real>(scene.smoke_count);
}

// So many smoothing lengths of the finest smoke.
Real step_length(const Scene &scene, double lengths) { return finest_length(scene) * to_real<Real>(lengths); }

// All that the rays of one frame have in common.
struct Frame {
    const Scene &scene;
    const Settings &settings;
    const Medium &medium;
    const Light *lights;
    const Observer &observer;
    Arena &arena;
    float *rgb;
    Statistics &statistics;
};

template <class Marcher> Status render_frame(const Frame &frame, Marcher &marcher) {
    const View view(frame.scene.camera);
    const Crop &crop = frame.settings.crop;
    const uint32_t samples = frame.settings.samples;
    const Pattern pattern(samples);
    float *rgb = frame.rgb;
    for (int32_t y = crop.y0; y < crop.y1; ++y) {
        const uint64_t row = static_cast<uint64_t>(y - crop.y0);
        if (!frame.observer(Stage::render, row, static_cast<uint64_t>(crop.y1 - crop.y0))) return Status::stopped;
        for (int32_t x = crop.x0; x < crop.x1; ++x) {
            Color sum(Real(0));
            for (uint32_t i = 0; i < samples; ++i) {
                sum += march(marcher, view.ray_through(Real(x) + pattern.u(i), Real(y) + pattern.v(i)));
                ++frame.statistics.rays.primary;
            }
            const Color mean = sum / Real(static_cast<int32_t>(samples));
            *rgb++ = to_float_scaled(mean.x, frame.scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.y, frame.scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.z, frame.scene.radiance_exponent);
        }
    }
    return Status::done;
}

// How the march asks the lights. False: the arena was too small.
bool ask_lights(const Frame &frame, LightDepths &depths, SingleScatterer &lights) {
    lights = {frame.lights, frame.scene.light_count, nullptr};
    if (!(frame.settings.light_step > 0) || lights.light_count == 0 || frame.medium.empty()) return true;
    lights.depths = &depths;
    return make_light_depths(frame.medium, frame.lights, lights.light_count,
                             step_length(frame.scene, frame.settings.light_step), frame.arena,
                             &frame.statistics.rays.shadow, depths);
}

// All of a march but its lights and its photons. False: the arena was too small.
bool make_marcher(const Frame &frame, Marcher &marcher) {
    const Scene &scene = frame.scene;
    marcher = {};
    marcher.medium = &frame.medium;
    marcher.background = vec_of(scene.background);
    marcher.step = step_length(scene, frame.settings.step);
    marcher.statistics = &frame.statistics;
    Real *radius = frame.arena.make<Real>(scene.smoke_count);
    marcher.extinctions = frame.arena.make<Real>(scene.smoke_count);
    if (!radius || !marcher.extinctions) return false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        radius[i] = to_real<Real>(scene.smokes[i].largest_h) * to_real<Real>(frame.settings.gather_radius);
    marcher.gather_radius = radius;
    return true;
}

// S4-2: photons are kept in a photon map, from which every step of the march gathers the nearest.
Status render_direct(const Frame &frame) {
    const Scene &scene = frame.scene;
    const Settings &settings = frame.settings;
    Marcher marcher;
    if (!make_marcher(frame, marcher)) return Status::out_of_memory;
    const PhotonPlan photons = plan_photons(scene, settings);
    if (photons.traced && !make_gather(settings.gather, frame.arena, marcher.gather)) return Status::out_of_memory;
    LightDepths depths;
    if (!ask_lights(frame, depths, marcher.lights)) return Status::out_of_memory;
    const PhotonMaps maps = trace_photons(frame.medium, frame.lights, scene.light_count, settings, photons,
                                          frame.observer, frame.arena, frame.statistics);
    if (maps.status != Status::done) return maps.status;
    marcher.photon_maps = maps.of_smoke;
    return render_frame(frame, marcher);
}

// The paper's way to read the particle map: the nearest particles at every step.
Status render_nearest_elements(const Frame &frame, const PackedMap &map) {
    Marcher marcher;
    LightDepths depths;
    if (!make_marcher(frame, marcher) || !make_element_maps(frame.medium, map, frame.arena, marcher.photon_maps) ||
        !make_gather(frame.settings.gather, frame.arena, marcher.gather) || !ask_lights(frame, depths, marcher.lights))
        return Status::out_of_memory;
    return render_frame(frame, marcher);
}

// S4-3: photons are kept on the particles, which become sources that every ray adds up.
Status render_map(const Frame &frame) {
    const Scene &scene = frame.scene;
    const ParticleMapPlan plan = plan_particle_map(scene, frame.settings);
    PackedMap packed;
    const size_t before = frame.arena.mark();
    if (!make_packed_map(scene, plan.needs, frame.settings.direction, frame.arena, packed))
        return Status::out_of_memory;
    const size_t after = frame.arena.mark();
    frame.statistics.bytes.particle_map = after - before;
    ParticleMap map;
    const Status status = trace_particle_map(scene, frame.medium, frame.lights, frame.settings, plan.needs,
                                             frame.observer, frame.arena, frame.statistics, map);
    if (status != Status::done) return status;
    pack_map(map, packed);
    frame.arena.rewind(after);

    if (!frame.observer(Stage::render, 0, 1)) return Status::stopped;
    if (frame.settings.estimate == Estimate::knn) return render_nearest_elements(frame, packed);
    ParticleMarcher marcher = {};
    marcher.sources = make_sources(scene, frame.medium, packed, vec_of(scene.camera.origin), frame.arena);
    LightDepths depths;
    if (!marcher.sources || !make_window(scene, frame.arena, marcher) || !ask_lights(frame, depths, marcher.lights))
        return Status::out_of_memory;
    marcher.medium = &frame.medium;
    marcher.background = vec_of(scene.background);
    marcher.step = step_length(scene, frame.settings.step);
    marcher.statistics = &frame.statistics;
    return render_frame(frame, marcher);
}

} // namespace

Plan plan(const Scene &scene, const Settings &settings) {
    Plan plan = {};
    for (uint32_t i = 0; i < scene.smoke_count; ++i) plan.smoke |= !scene.smokes[i].empty();
    plan.bytes.particle_tree = medium_bytes(scene);
    if (settings.reference) {
        plan.bytes.arena = reference_bytes(scene);
        return plan;
    }
    const PhotonNeeds needs = photon_needs(scene, settings);
    plan.photons = needs.traced;
    plan.photon_directions = needs.directions;
    plan.photon_powers = needs.powers;
    plan.bytes.light_depths = light_depth_bytes(scene, settings.light_step);
    plan.bytes.arena = plan.bytes.particle_tree + plan.bytes.light_depths + march_bytes(scene);
    if (settings.method == Method::map) {
        plan.bytes.particle_map = plan_particle_map(scene, settings).bytes + packed_map_bytes(scene, needs);
        const bool nearest = settings.estimate == Estimate::knn;
        plan.bytes.sources = nearest ? 0 : source_bytes(scene);
        plan.bytes.gather = nearest ? element_map_bytes(scene) + gather_bytes(settings.gather) : 0;
        plan.bytes.arena += plan.bytes.particle_map + plan.bytes.sources + plan.bytes.gather + window_bytes(scene);
        return plan;
    }
    const PhotonPlan photons = plan_photons(scene, settings);
    plan.photon_capacity = photons.capacity;
    plan.bytes.photon_map = photons.bytes;
    plan.bytes.gather = photons.traced ? gather_bytes(settings.gather) : 0;
    plan.bytes.arena += plan.bytes.photon_map + plan.bytes.gather;
    return plan;
}

Status render(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,
              Statistics &statistics) {
    statistics.bytes.arena_size = arena.size();
    if (!observer(Stage::trees, 0, 1)) return Status::stopped;
    const Medium medium = make_medium(scene, arena);
    const Light *lights = make_lights(scene, arena);
    if (!medium.ready || !lights) return Status::out_of_memory;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) statistics.smoke.particles += scene.smokes[i].count;
    statistics.bytes.particle_tree = arena.mark();

    const Frame frame = {scene, settings, medium, lights, observer, arena, rgb, statistics};
    const Status status = settings.method == Method::map ? render_map(frame) : render_direct(frame);
    statistics.bytes.arena_peak = arena.peak();
    return status;
}

} // namespace wisp::WISP_ARITH
