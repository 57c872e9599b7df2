// The stages of the papers, in order: trees, photons, picture.
#include "core/geometry/camera.h"
#include "core/geometry/sample_pattern.h"
#include "core/march/grid_march.h"
#include "core/march/particle_march.h"
#include "core/numbers/double_bits.h"
#include "core/numbers/sample_sums.h"
#include "core/render/path_tracer.h"
#include "core/render/traced_render.h"
#include "core/render/whitted.h"
#include "core/shadows/shadows.h"
#include "wisp/wisp.h"
#include "core/smoke/resampling.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

uint64_t march_bytes(const Scene &scene) { return 2 * Arena::bytes<Real>(scene.smoke_count); }

// So many smoothing lengths of the finest smoke.
Real step_length(const Scene &scene, double lengths) { return smallest_smoothing_length(scene) * to_real<Real>(lengths); }

// So many lights are seen in smoke: none where it is black.
uint32_t lights_in_smoke(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        if (!scene.smokes[i].empty() && any_above_zero(scene.smokes[i].albedo)) return scene.light_count;
    }
    return 0;
}

// Smoke, and what is kept over it for the march: it depends on nothing but the smoke and the lights.
struct SmokeStructures {
    Medium medium;
    const Surfaces *surfaces; // that stop photons; nullptr: there are none
    SparseGrid march_grid;    // for what is kept, where the smoke is not resampled
    const SparseGrid *bricks; // those, or the medium's; nullptr: none are needed
    OpticalDepthGrid depths;
    bool has_depths;
    EmissionDistribution starts; // of photons of resampled smoke
    uint64_t bytes;      // of the medium
};

// What rays meet.
struct FrameScene {
    const Light *lights;
    Surfaces *surfaces;      // nullptr: there are none
    const SmokeStructures *smoke; // nullptr: there are surfaces alone
};

// All that the rays of one frame have in common.
struct Frame {
    const Scene &scene;
    const Settings &settings;
    const SmokeStructures &smoke;
    const Medium &medium; // the smoke's
    const Light *lights;
    const Whitted *surfaces; // how they are shaded; nullptr: there are none
    Shadows *in_smoke;       // that they cast into smoke, or nullptr
    const Observer &observer;
    Arena &arena;
    float *rgb;
    Statistics &statistics;
    PixelRecorder *recorder; // of one pixel, or nullptr
};

// The picture of radiance(ray, x, y, sample, recorder): x and y are the pixel's column and row. The recorder is nullptr
// for all pixels but the one that is traced.
template <class Radiance> Status fill(const Frame &frame, Radiance &&radiance) {
    const Scene &scene = frame.scene;
    const Settings &settings = frame.settings;
    const Observer &observer = frame.observer;
    Statistics &statistics = frame.statistics;
    float *rgb = frame.rgb;
    const View view(scene.camera);
    const Crop &crop = settings.crop;
    const uint32_t samples = settings.samples;
    const SamplePattern pattern(samples);
    for (int32_t y = crop.y0; y < crop.y1; ++y) {
        const uint64_t row = static_cast<uint64_t>(y - crop.y0);
        if (!observer(Stage::render, row, static_cast<uint64_t>(crop.y1 - crop.y0))) return Status::stopped;
        for (int32_t x = crop.x0; x < crop.x1; ++x) {
            Color sum(Real(0));
            const bool traced = frame.recorder && frame.recorder->trace.x == x && frame.recorder->trace.y == y;
            PixelRecorder *const recorder = traced ? frame.recorder : nullptr;
            for (uint32_t i = 0; i < samples; ++i) {
                const Real column = Real(x) + pattern.u(i), row_ = Real(y) + pattern.v(i);
                const Ray ray = view.ray_through(column, row_);
                ++statistics.rays.primary;
                if (is_recording(recorder)) recorder->sample(*recorder, i, column, row_);
                const Color seen = radiance(ray, x, y, i, recorder);
                if (is_recording(recorder)) recorder->sample_end(*recorder, i, seen);
                sum += seen;
            }
            const Color mean = sum / Real(static_cast<int32_t>(samples));
            *rgb++ = to_float_scaled(mean.x, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.y, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.z, scene.radiance_exponent);
            if (is_recording(recorder)) recorder->pixel(*recorder, samples, mean, rgb - 3);
        }
    }
    return Status::done;
}

// The picture of surfaces.
Status render_surfaces(const Frame &frame, Whitted &tracer) {
    return fill(frame, [&tracer](const Ray &ray, int32_t x, int32_t y, uint32_t sample, PixelRecorder *recorder) {
        tracer.recorder = recorder;
        begin_sample(*tracer.shadows, x, y, sample);
        return trace(tracer, ray);
    });
}

// What comes along the ray to the eye, through the smoke of a marcher, in front of the background or of surfaces.
template <class Marcher> Status render_frame(const Frame &frame, Marcher &marcher) {
    if (!frame.surfaces) {
        const Color background = vec_of(frame.scene.background);
        return fill(frame, [&](const Ray &ray, int32_t, int32_t, uint32_t, PixelRecorder *recorder) {
            if (is_recording(recorder)) recorder->ray(*recorder, RayKind::camera, 0, ray, Color(Real(1)), Real(1));
            const Segment smoke = march(marcher, ray, infinite_distance, recorder);
            const Color radiance = smoke.radiance + background * smoke.transmittance;
            if (is_recording(recorder))
                recorder->ray_end(*recorder, false, smoke.radiance, smoke.transmittance, background, radiance);
            return radiance;
        });
    }
    Whitted tracer = *frame.surfaces;
    tracer.medium = &frame.medium;
    tracer.marcher = &marcher;
    tracer.march = [](void *any, const Ray &ray, Real end, PixelRecorder *recorder) {
        return march(*static_cast<Marcher *>(any), ray, end, recorder);
    };
    return render_surfaces(frame, tracer);
}

// The cells of the bricks in smoothing lengths, 0 where no bricks are needed, and how far apart the points of the
// fields over them are, in cells.
struct GridSpacing {
    double cell;
    int32_t light, irradiance;
};
int32_t spacing_within(double cell, double step) {
    int32_t stride = 1;
    for (double wider = rounded_product(cell, 2); stride < brick_cells && total_order_key(wider) <= total_order_key(step);
         wider = rounded_product(wider, 2))
        stride *= 2;
    return stride;
}
// A grid whose cells stay its own samples, or halves of them; a box has none.
bool keeps_samples(const Scene &scene) {
    bool samples = false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        samples = samples || (!scene.smokes[i].empty() && scene.smokes[i].grid.density);
    return samples && is_aligned_grid(scene);
}
GridSpacing grid_spacing(const Scene &scene, const Settings &settings) {
    const double density = can_resample(scene) ? settings.density_step : 0;
    const bool irradiance = settings.irradiance != IrradianceMap::none;
    double cell = density;
    if (total_order_key(density) > 0) {
        if (keeps_samples(scene)) cell = subdivision_for(density) == 1 ? 1 : 0.5;
    } else {
        cell = settings.light_step;
        if (irradiance && !(total_order_key(cell) > 0 && total_order_key(cell) < total_order_key(settings.irradiance_step)))
            cell = settings.irradiance_step;
    }
    return {cell, spacing_within(cell, settings.light_step), spacing_within(cell, settings.irradiance_step)};
}

// How the march asks the lights.
SingleScatterer ask_lights(const Frame &frame) {
    return {frame.lights, lights_in_smoke(frame.scene), frame.smoke.has_depths ? &frame.smoke.depths : nullptr,
            frame.in_smoke};
}

// Adaptive bricks are given as many points as keep what lies between them within this part of the brick's brightest.
Real irradiance_tolerance(const Settings &settings) {
    return settings.irradiance == IrradianceMap::adaptive ? Real(0.02) : Real(0);
}

IrradianceRequest request_irradiance(const Frame &frame) {
    const GridSpacing steps = grid_spacing(frame.scene, frame.settings);
    return {&frame.medium,
            frame.smoke.bricks,
            steps.irradiance,
            irradiance_tolerance(frame.settings),
            photon_needs(frame.scene, frame.settings).directions,
            frame.surfaces ? ViewBounds() : ViewBounds(View(frame.scene.camera), frame.settings.crop)};
}

// All of a march but its photons. False: the arena was too small.
bool make_marcher(const Frame &frame, Marcher &marcher) {
    const Scene &scene = frame.scene;
    marcher = {};
    marcher.medium = &frame.medium;
    marcher.lights = ask_lights(frame);
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
    const PhotonMaps maps = trace_photons(frame.medium, frame.smoke.surfaces, frame.lights, scene.light_count, settings, photons,
                                          frame.observer, frame.arena, frame.statistics);
    if (maps.status != Status::done) return maps.status;
    marcher.photon_maps = maps.per_smoke;
    Irradiance irradiance;
    if (settings.irradiance != IrradianceMap::none && maps.per_smoke) {
        if (!frame.observer(Stage::irradiance, 0, 1)) return Status::stopped;
        irradiance = make_irradiance(request_irradiance(frame), maps.per_smoke, marcher.gather_radius, marcher.gather,
                                     frame.arena, frame.statistics);
        if (!irradiance.ready) return Status::out_of_memory;
        frame.statistics.bytes.irradiance = bytes_of(irradiance);
        marcher.irradiance = &irradiance;
    }
    return render_frame(frame, marcher);
}

// The paper's way to read the particle map: the nearest particles at every step.
Status render_nearest_elements(const Frame &frame, const PackedMap &map) {
    Marcher marcher;
    if (!make_marcher(frame, marcher) || !make_element_maps(frame.medium, map, frame.arena, marcher.photon_maps) ||
        !make_gather(frame.settings.gather, frame.arena, marcher.gather))
        return Status::out_of_memory;
    return render_frame(frame, marcher);
}

// S4-3: photons are kept on the particles, which become sources that every ray adds up, or an irradiance map.
Status render_map(const Frame &frame, PhotonSums &sums) {
    const Scene &scene = frame.scene;
    const ParticleMapPlan plan = plan_particle_map(scene, frame.settings);
    PackedMap packed;
    if (!make_packed_map(scene, plan.needs, frame.settings.direction, frame.arena, packed))
        return Status::out_of_memory;
    const size_t after = frame.arena.mark();
    frame.statistics.bytes.particle_map = bytes_of(packed);
    const Batches batches = sums.count == 0 ? all_batches(frame.settings) : Batches{0, 0};
    ParticleMap map;
    const Status status = trace_particle_map(scene, frame.medium, frame.smoke.surfaces, frame.lights, frame.settings, plan.needs, batches,
                                             frame.observer, frame.arena, sums, frame.statistics, map);
    if (status != Status::done) return status;
    pack_map(map, packed);
    frame.arena.rewind(after);

    ParticleMarcher marcher = {};
    Irradiance irradiance;
    if (frame.settings.irradiance != IrradianceMap::none && packed.per_smoke) {
        if (!frame.observer(Stage::irradiance, 0, 1)) return Status::stopped;
        irradiance = make_irradiance(request_irradiance(frame), packed, frame.arena);
        if (!irradiance.ready) return Status::out_of_memory;
        frame.statistics.bytes.irradiance = bytes_of(irradiance);
        marcher.irradiance = &irradiance;
        packed.per_smoke = nullptr; // the sources hold emission alone
    }
    if (!frame.observer(Stage::render, 0, 1)) return Status::stopped;
    if (frame.settings.estimate == Estimate::knn) return render_nearest_elements(frame, packed);
    marcher.sources = make_sources(scene, frame.medium, packed, vec_of(scene.camera.origin), frame.arena);
    if (!marcher.sources || !make_window(scene, frame.arena, marcher)) return Status::out_of_memory;
    marcher.lights = ask_lights(frame);
    marcher.medium = &frame.medium;
    marcher.step = step_length(scene, frame.settings.step);
    marcher.statistics = &frame.statistics;
    return render_frame(frame, marcher);
}

// What the photons of `batches` leave on resampled smoke, with what is in `sums`.
Status trace_bricks(const Scene &scene, const SmokeStructures &smoke, const Settings &settings, const Batches &batches,
                    const Observer &observer, Arena &arena, PhotonSums &sums, Statistics &statistics,
                    FluenceSums &deposits) {
    const PhotonNeeds needs = photon_needs(scene, settings);
    if (!needs.traced) return sums.count == 0 ? Status::done : Status::size_mismatch;
    return trace_fluence(smoke.medium, smoke.surfaces, smoke.depths, smoke.starts, settings, needs,
                               grid_spacing(scene, settings).irradiance, batches, observer, arena, sums, statistics,
                               deposits);
}

// S4-3 and S4-4 on resampled smoke: photons leave their power at the nodes of the bricks, from which the irradiance map
// is made.
Status render_bricks(const Frame &frame, PhotonSums &sums) {
    const Scene &scene = frame.scene;
    const Settings &settings = frame.settings;
    FluenceSums deposits = {};
    const Batches batches = sums.count == 0 ? all_batches(settings) : Batches{0, 0};
    const Status status = trace_bricks(scene, frame.smoke, settings, batches, frame.observer, frame.arena, sums,
                                       frame.statistics, deposits);
    if (status != Status::done) return status;
    Irradiance irradiance = {};
    if (deposits.bricks) {
        if (!frame.observer(Stage::irradiance, 0, 1)) return Status::stopped;
        irradiance = make_irradiance(frame.medium, deposits, irradiance_tolerance(settings), frame.arena);
        if (!irradiance.ready) return Status::out_of_memory;
        frame.statistics.bytes.irradiance = bytes_of(irradiance);
    }
    GridMarcher marcher = {&frame.medium,
                            &frame.smoke.depths,
                            deposits.bricks ? &irradiance : nullptr,
                            frame.in_smoke,
                            step_length(scene, settings.step),
                            &frame.statistics};
    return render_frame(frame, marcher);
}

// Numbers of a particle map.
uint64_t count_of_sums(const Scene &scene, const Settings &settings, const Medium &medium) {
    if (!medium.bricks) return plan_particle_map(scene, settings).sums;
    const int32_t stride = grid_spacing(scene, settings).irradiance;
    return plan_fluence(scene, settings, medium.bricks->count, stride).sums;
}

bool has_smoke(const Scene &scene) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty()) return true;
    return false;
}

// False: the arena was too small. `marched`: smoke is marched through, not photons traced alone.
bool make_smoke(const Scene &scene, const Settings &settings, bool marched, const Light *lights, Arena &arena,
                Statistics &statistics, SmokeStructures &smoke) {
    const size_t mark = arena.mark();
    smoke.medium = make_medium(scene, settings.reference ? 0 : settings.density_step, arena);
    smoke.bytes = arena.mark() - mark;
    smoke.bricks = smoke.medium.bricks;
    smoke.has_depths = false;
    if (!smoke.medium.ready || settings.reference) return smoke.medium.ready;
    const GridSpacing steps = grid_spacing(scene, settings);
    if (!smoke.bricks && total_order_key(steps.cell) > 0 && marched) {
        smoke.march_grid = make_sparse_grid(scene, steps.cell, arena);
        if (!smoke.march_grid.ready) return false;
        smoke.bricks = &smoke.march_grid;
    }
    // Photons start by the depths in resampled smoke, which is marched by them, too.
    const uint32_t count = lights_in_smoke(scene);
    const bool starts = settings.method == Method::map && smoke.medium.bricks;
    smoke.has_depths = starts || (marched && total_order_key(settings.light_step) > 0 && count > 0 && !smoke.medium.empty());
    if (smoke.has_depths && !make_optical_depth_grid(smoke.medium, lights, count, *smoke.bricks, steps.light, arena,
                                               &statistics.rays.shadow, smoke.depths))
        return false;
    return !starts || !photon_needs(scene, settings).traced ||
           make_emission_distribution(scene, smoke.medium, smoke.depths, arena, smoke.starts);
}

// Smoke of the frame before, or made; behind what is kept of surfaces. False: the arena was too small.
bool update_smoke(const Scene &scene, const Settings &settings, bool marched, FrameScene &world, Arena &arena,
                Statistics &statistics, FrameCache &kept) {
    SmokeStructures *smoke = static_cast<SmokeStructures *>(kept.smoke);
    if (!smoke || !kept.same_smoke) {
        kept.smoke = nullptr;
        smoke = arena.make<SmokeStructures>(1);
        if (!smoke || !make_smoke(scene, settings, marched, world.lights, arena, statistics, *smoke)) return false;
        kept.smoke = smoke;
        kept.smoke_end = arena.mark();
    }
    arena.rewind(kept.smoke_end);
    smoke->surfaces = world.surfaces;
    smoke->depths.lights = world.lights;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) smoke->medium.smokes[i].source = &scene.smokes[i];
    for (uint32_t i = 0; i < scene.smoke_count; ++i) statistics.smoke.particles += scene.smokes[i].count;
    statistics.bytes.particle_tree = smoke->bytes;
    world.smoke = smoke;
    return true;
}

// What rays meet: surfaces, of which the trees of what never changes its form are built by the first frame for all,
// beside room for what shadows learn (C); smoke, where there is any.
Status make_world(const Scene &scene, const Settings &settings, bool marched, Arena &arena, const Observer &observer,
                  Statistics &statistics, FrameCache &kept, FrameScene &world) {
    if (!observer(Stage::trees, 0, 1)) return Status::stopped;
    statistics.bytes.arena_size = arena.size();
    world = {};
    const bool surfaces = scene.triangle_count() > 0;
    if (surfaces && (!kept.surfaces || kept.lights != scene.light_count)) {
        kept = {};
        Surfaces *built = arena.make<Surfaces>(1);
        if (!built) return Status::out_of_memory;
        *built = make_surfaces(scene, arena);
        void *memory;
        if (!built->ready || !make_shadow_memory(scene, settings, arena, memory)) return Status::out_of_memory;
        kept.surfaces = built;
        kept.shadows = memory;
        kept.lights = scene.light_count;
        kept.surfaces_end = arena.mark();
    }
    arena.rewind(kept.surfaces_end);
    world.surfaces = static_cast<Surfaces *>(kept.surfaces);
    world.lights = make_lights(scene, arena);
    if (!world.lights) return Status::out_of_memory;
    if ((!surfaces || has_smoke(scene)) && !update_smoke(scene, settings, marched, world, arena, statistics, kept))
        return Status::out_of_memory;
    if (surfaces) {
        const size_t mark = arena.mark();
        place_surfaces(scene, arena, *world.surfaces);
        if (!world.surfaces->ready) return Status::out_of_memory;
        statistics.bytes.triangle_trees = kept.surfaces_end + (arena.mark() - mark);
    }
    return Status::done;
}

// How the surfaces of a frame are shaded.
struct Shading {
    Shadows shadows, in_smoke;
    LightCuts cuts;
    Whitted tracer;
};
// False: the arena was too small.
bool make_shading(const Scene &scene, const Settings &settings, const FrameScene &world, const FrameCache &kept, Arena &arena,
                  Statistics &statistics, Shading &shading) {
    const SurfaceMaterial *materials = make_surface_materials(scene, arena);
    const bool cut = settings.lights == LightChoice::cuts;
    if (!materials || (cut && !make_light_cuts(world.lights, scene.light_count, arena, shading.cuts))) return false;
    shading.shadows = {&scene, world.surfaces, world.lights, &statistics, shadow_technique(scene, settings), kept.shadows};
    statistics.bytes.mode_words = shadow_bytes(scene, settings);
    if (!begin_frame(shading.shadows, settings, arena)) return false;
    shading.in_smoke = shadows_in_space(shading.shadows);
    shading.tracer = {&scene,           world.surfaces,
                      materials,        world.lights,
                      &shading.shadows, vec_of(scene.background),
                      settings.depth,   length(vec_of(scene.camera.down)),
                      &statistics,      cut ? &shading.cuts : nullptr};
    return true;
}

} // namespace

Plan plan(const Scene &scene, const Settings &settings) {
    Plan plan = {};
    plan.smoke = has_smoke(scene);
    plan.surfaces = scene.triangle_count() > 0;
    if (plan.surfaces) {
        plan.bytes.triangle_trees = surface_bytes(scene) + placement_bytes(scene);
        plan.bytes.shadows = shadow_bytes(scene, settings);
        if (settings.lights == LightChoice::cuts) plan.bytes.light_cuts = light_cut_bytes(scene);
        plan.bytes.arena = plan.bytes.triangle_trees + plan.bytes.shadows + plan.bytes.light_cuts +
                           Arena::bytes<Surfaces>(1) + Arena::bytes<SurfaceMaterial>(scene.material_count);
    }
    plan.bytes.arena += Arena::bytes<Light>(scene.light_count);
    if (plan.surfaces && !plan.smoke) return plan;
    const double density_step = settings.reference ? 0 : settings.density_step;
    plan.bytes.arena += Arena::bytes<SmokeStructures>(1);
    plan.bytes.particle_tree = medium_bytes(scene, density_step);
    if (settings.reference) {
        plan.bytes.arena += reference_bytes(scene);
        return plan;
    }
    const PhotonNeeds needs = photon_needs(scene, settings);
    plan.photons = needs.traced;
    plan.photon_directions = needs.directions;
    plan.photon_powers = needs.powers;
    const GridSpacing steps = grid_spacing(scene, settings);
    const SparseGridPlan bricks = total_order_key(steps.cell) > 0 ? plan_sparse_grid(scene, steps.cell) : SparseGridPlan{0, 0, Real(0)};
    const uint32_t lights = lights_in_smoke(scene);
    if (total_order_key(settings.light_step) > 0 && plan.smoke && lights > 0)
        plan.bytes.light_depths = optical_depth_grid_bytes(bricks.count, lights, steps.light);
    const bool resampled = plan.smoke && total_order_key(density_step) > 0 && can_resample(scene);
    plan.bricks = resampled ? bricks.count : 0;
    const bool on_bricks = settings.method == Method::map && resampled;
    plan.photon_harmonics = on_bricks && needs.harmonics;
    if (needs.traced && (on_bricks || settings.irradiance != IrradianceMap::none))
        plan.bytes.irradiance =
            irradiance_bytes(scene, bricks.count, steps.irradiance, needs.directions, plan.photon_harmonics);
    plan.bytes.arena += plan.bytes.particle_tree + plan.bytes.light_depths + plan.bytes.irradiance + march_bytes(scene);
    if (!resampled) plan.bytes.arena += bricks.bytes;
    if (on_bricks) {
        const FluencePlan photons = plan_fluence(scene, settings, bricks.count, steps.irradiance);
        plan.map_sums = photons.sums;
        plan.max_photons = max_fluence_flights(bricks.longest);
        plan.bytes.particle_map = photons.bytes;
        // Depths are kept to start photons by, wanted or not for the march.
        if (plan.bytes.light_depths == 0) {
            const uint64_t bytes = optical_depth_grid_bytes(bricks.count, lights, steps.light);
            if (lights > 0) plan.bytes.light_depths = bytes;
            plan.bytes.arena += bytes;
        }
        plan.bytes.arena += plan.bytes.particle_map;
        return plan;
    }
    if (settings.method == Method::map) {
        const ParticleMapPlan map = plan_particle_map(scene, settings);
        plan.map_sums = map.sums;
        plan.max_photons = max_deposits(settings);
        plan.bytes.particle_map = map.bytes + packed_map_bytes(scene, needs);
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
              Statistics &statistics, PhotonSums *sums, FrameCache *kept) {
    return render_traced(scene, settings, arena, observer, rgb, statistics, sums, kept, nullptr);
}

Status render_traced(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,
                     Statistics &statistics, PhotonSums *sums, FrameCache *kept, PixelRecorder *recorder) {
    FrameCache own = {};
    if (!kept) kept = &own;
    FrameScene world;
    Status status = make_world(scene, settings, true, arena, observer, statistics, *kept, world);
    if (status != Status::done) return status;
    Shading shading;
    if (world.surfaces && !make_shading(scene, settings, world, *kept, arena, statistics, shading))
        return Status::out_of_memory;
    const SmokeStructures none = {}, &smoke = world.smoke ? *world.smoke : none;
    const Medium &medium = smoke.medium;
    const Frame frame = {scene,
                         settings,
                         smoke,
                         medium,
                         world.lights,
                         world.surfaces ? &shading.tracer : nullptr,
                         world.surfaces ? &shading.in_smoke : nullptr,
                         observer,
                         arena,
                         rgb,
                         statistics,
                         recorder};
    if (world.surfaces && medium.empty()) {
        status = render_surfaces(frame, shading.tracer);
    } else if (settings.method != Method::map) {
        status = render_direct(frame);
    } else {
        PhotonSums for_this_picture = {};
        if (!sums) {
            for_this_picture.capacity = count_of_sums(scene, settings, medium);
            for_this_picture.values = arena.make<int64_t>(for_this_picture.capacity);
            if (!for_this_picture.values) return Status::out_of_memory;
            sums = &for_this_picture;
        }
        status = medium.bricks ? render_bricks(frame, *sums) : render_map(frame, *sums);
    }
    if (world.surfaces) end_frame(shading.shadows);
    statistics.bytes.arena_peak = arena.peak();
    return status;
}

Status trace_map(const Scene &scene, const Settings &settings, const Batches &batches, Arena &arena,
                 const Observer &observer, PhotonSums &sums, Statistics &statistics) {
    FrameCache kept = {};
    FrameScene world;
    Status status = make_world(scene, settings, false, arena, observer, statistics, kept, world);
    if (status != Status::done) return status;
    const Medium &medium = world.smoke->medium;
    if (medium.bricks) {
        FluenceSums deposits = {};
        status = trace_bricks(scene, *world.smoke, settings, batches, observer, arena, sums, statistics, deposits);
    } else {
        ParticleMap map;
        status = trace_particle_map(scene, medium, world.surfaces, world.lights, settings, photon_needs(scene, settings), batches,
                                    observer, arena, sums, statistics, map);
    }
    statistics.bytes.arena_peak = arena.peak();
    return status;
}

Status render_reference(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer,
                        PixelSums *sums, Statistics &statistics) {
    FrameCache kept = {};
    FrameScene world;
    const Status status = make_world(scene, settings, true, arena, observer, statistics, kept, world);
    if (status != Status::done) return status;
    const SmokeStructures none = {};
    const Medium &medium = (world.smoke ? *world.smoke : none).medium;
    Shading shading;
    PathTracer paths;
    if ((world.surfaces && !make_shading(scene, settings, world, kept, arena, statistics, shading)) ||
        !make_path_tracer(scene, medium, world.lights, world.surfaces ? &shading.in_smoke : nullptr, arena, statistics,
                          paths))
        return Status::out_of_memory;
    statistics.bytes.arena_peak = arena.peak();

    struct Sampler {
        const PathTracer &paths;
        Pcg32 generator;
    } sampler = {paths, Pcg32(0)};
    Whitted &tracer = shading.tracer;
    if (world.surfaces && !medium.empty()) {
        tracer.medium = &medium;
        tracer.marcher = &sampler;
        tracer.march = [](void *any, const Ray &part, Real end, PixelRecorder *) {
            Sampler &own = *static_cast<Sampler *>(any);
            return Segment{sample_radiance(own.paths, part, end, Color(Real(0)), own.generator),
                           exp(-optical_depth(*own.paths.medium, part, end))};
        };
    }
    const auto sample = [&](const Ray &ray) {
        if (world.surfaces) return trace(tracer, ray);
        Color behind = vec_of(scene.background);
        if (largest(behind) > Real(0)) behind = behind * exp(-optical_depth(medium, ray, infinite_distance));
        return sample_radiance(paths, ray, infinite_distance, behind, sampler.generator);
    };
    const View view(scene.camera);
    const SamplePattern pattern(settings.samples);
    const Crop &crop = settings.crop;
    const uint64_t rows = static_cast<uint64_t>(crop.y1 - crop.y0);
    const uint32_t passes = settings.last_pass - settings.first_pass;
    for (uint32_t pass = 0; pass < passes; ++pass) {
        PixelSums *pixel = sums;
        for (int32_t y = crop.y0; y < crop.y1; ++y) {
            const uint64_t row = static_cast<uint64_t>(y - crop.y0);
            if (!observer(Stage::render, pass * rows + row, passes * rows)) return Status::stopped;
            for (int32_t x = crop.x0; x < crop.x1; ++x, ++pixel) {
                sampler.generator = pass_generator(settings, settings.first_pass + pass, x, y);
                for (uint32_t i = 0; i < settings.samples; ++i) {
                    const Color color = sample(view.ray_through(Real(x) + pattern.u(i), Real(y) + pattern.v(i)));
                    add_sample(pixel->channels[0], color.x);
                    add_sample(pixel->channels[1], color.y);
                    add_sample(pixel->channels[2], color.z);
                    ++statistics.rays.primary;
                }
            }
        }
    }
    return Status::done;
}

} // namespace wisp::WISP_ARITH
