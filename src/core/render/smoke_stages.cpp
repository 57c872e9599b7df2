// The stages of smoke: density, light depths, photons, and how photons are read (S2, S3, S4-1 to S4-4).
#include "core/render/stages.h"

namespace wisp::WISP_ARITH::stages {

namespace {

// Adaptive bricks have as few points as keep every other point within this fraction of the brick's brightest.
Real irradiance_tolerance(const Settings &settings) {
    return settings.irradiance == IrradianceMap::adaptive ? Real(0.02) : Real(0);
}

IrradianceRequest irradiance_request(const Frame &frame) {
    const ViewBounds all;
    return {&frame.medium(),
            frame.state.smoke.bricks,
            frame.decisions.spacing.irradiance,
            irradiance_tolerance(frame.settings),
            frame.decisions.photon_needs.directions,
            frame.decisions.surfaces ? all : ViewBounds(View(frame.scene.camera), frame.settings.crop)};
}

// The sums that photons are added to: the caller's, or the arena's for this picture alone.
Status find_photon_sums(Frame &frame, uint64_t count, PhotonSums &own, PhotonSums *&sums) {
    sums = frame.job.photons;
    if (sums) return Status::done;
    own = {frame.arena.make<int64_t>(count), count, 0};
    sums = &own;
    return own.values ? Status::done : Status::out_of_memory;
}

Batches batches_to_trace(const Frame &frame, const PhotonSums &sums) {
    if (frame.decisions.goal == Goal::photons) return frame.job.batches;
    return sums.count == 0 ? all_batches(frame.settings) : Batches{0, 0};
}

PhotonTracing tracing_of(Frame &frame, const Batches &batches) {
    return {frame.medium(), frame.surfaces(), frame.settings,   frame.decisions.photon_needs,      batches,
            frame.watch,    frame.arena,      frame.statistics, vec_of(frame.scene.camera.origin), frame.flights};
}

Status trace_to_photon_map(Frame &frame) {
    const PhotonMaps maps =
        WISP_ARITH::trace_photons(tracing_of(frame, all_batches(frame.settings)), frame.state.lights,
                                  frame.scene.light_count, plan_photons(frame.scene, frame.settings).capacity);
    frame.photon_maps = maps.per_smoke;
    return maps.status;
}

// The packed map is made first. What tracing leaves behind it is given back.
Status trace_to_particle_map(Frame &frame) {
    const bool picture = frame.decisions.goal == Goal::picture;
    if (picture && !make_packed_map(frame.scene, frame.decisions.photon_needs, frame.settings.direction, frame.arena,
                                    frame.particle_map))
        return Status::out_of_memory;
    const size_t after = frame.arena.mark();
    frame.statistics.bytes.particle_map = bytes_of(frame.particle_map);
    PhotonSums own, *sums;
    Status status = find_photon_sums(frame, plan_particle_map(frame.scene, frame.settings).sums, own, sums);
    if (status != Status::done) return status;
    ParticleMap map;
    status = trace_particle_map(tracing_of(frame, batches_to_trace(frame, *sums)), frame.scene, frame.state.lights,
                                *sums, map);
    if (status != Status::done || !picture) return status;
    if (!pack_map(map, frame.particle_map, frame.watch)) return Status::stopped;
    frame.arena.rewind(after);
    return Status::done;
}

Status trace_to_fluence_grid(Frame &frame) {
    const SmokeStructures &smoke = frame.state.smoke;
    const int32_t spacing = frame.decisions.spacing.irradiance;
    PhotonSums own, *sums;
    const Status status =
        find_photon_sums(frame, sums_of_fluence(frame.decisions.photon_needs, smoke.bricks->count, spacing), own, sums);
    if (status != Status::done) return status;
    const PhotonTracing tracing = tracing_of(frame, batches_to_trace(frame, *sums));
    if (has(parts::photons) && frame.decisions.resampled)
        return trace_fluence(tracing, smoke.depths, smoke.emission, spacing, *sums, frame.fluence);
    if (has(parts::exact_photons))
        return trace_exact_fluence(tracing, *smoke.bricks, spacing, frame.state.lights, frame.scene.light_count, *sums,
                                   frame.fluence);
    return Status::done;
}

} // namespace

Status build_exact_density(Frame &frame) {
    frame.state.smoke.medium = make_medium(frame.scene, 0, frame.arena, frame.watch);
    return frame.medium().ready ? Status::done : Status::out_of_memory;
}

Status build_sparse_grid(Frame &frame) {
    SmokeStructures &smoke = frame.state.smoke;
    if (frame.decisions.resampled) {
        smoke.medium = make_medium(frame.scene, frame.settings.density_step, frame.arena, frame.watch);
        smoke.bricks = smoke.medium.bricks;
        smoke.depths = {&smoke.medium, frame.state.lights, 0, smoke.bricks, frame.decisions.spacing.light, nullptr,
                        false};
        return smoke.medium.ready ? Status::done : Status::out_of_memory;
    }
    smoke.march_grid = make_sparse_grid(frame.scene, frame.decisions.spacing.cell, frame.arena, frame.watch);
    smoke.bricks = &smoke.march_grid;
    return smoke.march_grid.ready ? Status::done : Status::out_of_memory;
}

Status find_light_depths(Frame &frame) {
    SmokeStructures &smoke = frame.state.smoke;
    return make_optical_depth_grid(smoke.medium, frame.state.lights, frame.decisions.lights_in_smoke, *smoke.bricks,
                                   frame.decisions.spacing.light, frame.arena, &frame.statistics.rays.shadow,
                                   smoke.depths, frame.watch)
               ? Status::done
               : Status::out_of_memory;
}

Status distribute_emission(Frame &frame) {
    SmokeStructures &smoke = frame.state.smoke;
    if (frame.decisions.photons != PhotonStore::fluence_grid || !frame.decisions.resampled) return Status::done;
    return make_emission_distribution(frame.scene, smoke.medium, smoke.depths, frame.arena, smoke.emission, frame.watch)
               ? Status::done
               : Status::out_of_memory;
}

uint64_t photon_bytes(const Scene &scene, const Settings &settings, const Decisions &d, const Sizes &sizes) {
    const uint64_t bricks = sizes.grid.count;
    if (d.photons == PhotonStore::fluence_grid)
        return (has(parts::photons) && d.resampled
                    ? fluence_bytes(scene, d.photon_needs, bricks, d.spacing.irradiance)
                    : exact_fluence_bytes(scene, d.photon_needs, bricks, d.spacing.irradiance)) +
               (d.surfaces ? cut_cell_bytes(bricks, d.spacing.irradiance) : 0);
    if (has(parts::exact_photons) && d.photons == PhotonStore::photon_map) return plan_photons(scene, settings).bytes;
    if (has(parts::exact_photons) && d.photons == PhotonStore::particle_map)
        return plan_particle_map(scene, settings).bytes + packed_map_bytes(scene, d.photon_needs);
    return 0;
}

Status trace_photons(Frame &frame) {
    const PhotonStore store = frame.decisions.photons;
    if (store == PhotonStore::fluence_grid) return trace_to_fluence_grid(frame);
    if (has(parts::exact_photons) && store == PhotonStore::photon_map) return trace_to_photon_map(frame);
    if (has(parts::exact_photons) && store == PhotonStore::particle_map) return trace_to_particle_map(frame);
    return Status::done;
}

uint64_t gather_bytes(const Scene &scene, const Settings &settings, const Decisions &d, const Sizes &) {
    return WISP_ARITH::gather_bytes(settings.gather) + Arena::bytes<Real>(scene.smoke_count) +
           (d.photons == PhotonStore::particle_map ? element_map_bytes(scene) : 0);
}

// S4-2: the nearest photons are gathered; of a particle map, its nearest elements.
Status make_gather(Frame &frame) {
    Real *radius = frame.arena.make<Real>(frame.scene.smoke_count);
    if (!radius || !WISP_ARITH::make_gather(frame.settings.gather, frame.arena, frame.gather))
        return Status::out_of_memory;
    for (uint32_t i = 0; i < frame.scene.smoke_count; ++i)
        radius[i] = to_real<Real>(frame.scene.smokes[i].largest_h) * to_real<Real>(frame.settings.gather_radius);
    frame.gather_radius = radius;
    if (frame.decisions.photons != PhotonStore::particle_map) return Status::done;
    return make_element_maps(frame.medium(), frame.particle_map, frame.arena, frame.photon_maps, frame.watch)
               ? Status::done
               : Status::out_of_memory;
}

// S4-4. Where photons were wanted and none came there is nothing to keep.
Status make_irradiance(Frame &frame) {
    if (frame.decisions.photons == PhotonStore::fluence_grid) {
        // Four times as many photons have half the noise. Twice as many lines are needed to err as little.
        const LineGather lines = {frame.decisions.sweeps ? &frame.state.smoke.depths : nullptr,
                                  vec_of(frame.scene.camera.origin), frame.settings.photons < 1000000 ? 1 : 2,
                                  frame.settings.seed};
        frame.irradiance = WISP_ARITH::make_irradiance(frame.medium(), frame.fluence, lines,
                                                       irradiance_tolerance(frame.settings), frame.arena, frame.watch);
    } else if (has(parts::exact_photons) && frame.decisions.photons == PhotonStore::photon_map) {
        if (!frame.photon_maps) return Status::done;
        frame.irradiance =
            WISP_ARITH::make_irradiance(irradiance_request(frame), frame.photon_maps, frame.gather_radius, frame.gather,
                                        frame.arena, frame.statistics, frame.watch);
    } else if (has(parts::exact_photons)) {
        if (!frame.particle_map.per_smoke) return Status::done;
        frame.irradiance =
            WISP_ARITH::make_irradiance(irradiance_request(frame), frame.particle_map, frame.arena, frame.watch);
        frame.particle_map.per_smoke = nullptr; // the sources hold emission alone
    }
    if (!frame.irradiance.ready) return Status::out_of_memory;
    frame.statistics.bytes.irradiance = bytes_of(frame.irradiance);
    frame.has_irradiance = true;
    return Status::done;
}

Status make_sources(Frame &frame) {
    frame.sources = WISP_ARITH::make_sources(frame.scene, frame.medium(), frame.particle_map,
                                             vec_of(frame.scene.camera.origin), frame.arena, frame.watch);
    return frame.sources ? Status::done : Status::out_of_memory;
}

} // namespace wisp::WISP_ARITH::stages
