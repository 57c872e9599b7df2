// The stages of surfaces: triangle trees, shadows, shading (C).
#include "core/render/stages.h"

namespace wisp::WISP_ARITH::stages {

Status build_triangle_trees(Frame &frame) {
    frame.state.surfaces = make_surfaces(frame.scene, frame.settings.tree, frame.arena, frame.watch);
    return frame.state.surfaces.ready ? Status::done : Status::out_of_memory;
}

Status place_triangle_trees(Frame &frame) {
    place_surfaces(frame.scene, frame.arena, frame.state.surfaces, frame.watch);
    return frame.state.surfaces.ready ? Status::done : Status::out_of_memory;
}

Status make_lights(Frame &frame) {
    frame.state.lights = WISP_ARITH::make_lights(frame.scene, frame.arena);
    return frame.state.lights ? Status::done : Status::out_of_memory;
}

Status make_shadow_memory(Frame &frame) {
    return WISP_ARITH::make_shadow_memory(frame.scene, frame.settings, frame.arena, frame.state.shadow_memory,
                                          frame.watch)
               ? Status::done
               : Status::out_of_memory;
}

Status begin_shadows(Frame &frame) {
    frame.shadows = {&frame.scene,
                     &frame.state.surfaces,
                     frame.state.lights,
                     &frame.statistics,
                     shadow_technique(frame.scene, frame.settings),
                     frame.state.shadow_memory,
                     frame.watch};
    if (!begin_frame(frame.shadows, frame.settings, frame.arena)) return Status::out_of_memory;
    return Status::done;
}

Status build_light_cuts(Frame &frame) {
    return make_light_cuts(frame.state.lights, frame.scene.light_count, frame.arena, frame.light_cuts, frame.watch)
               ? Status::done
               : Status::out_of_memory;
}

Status make_shading(Frame &frame) {
    const Scene &scene = frame.scene;
    const SurfaceMaterial *materials = make_surface_materials(scene, frame.arena);
    RayLevel *levels = frame.arena.make<RayLevel>(size_t{frame.settings.depth} + 1);
    if (!materials || !levels) return Status::out_of_memory;
    frame.whitted = {&scene,
                     &frame.state.surfaces,
                     materials,
                     frame.state.lights,
                     &frame.shadows,
                     vec_of(scene.background),
                     frame.settings.depth,
                     length(vec_of(scene.camera.down)),
                     &frame.statistics,
                     levels,
                     frame.decisions.light_cuts ? &frame.light_cuts : nullptr};
    frame.whitted.watch = frame.watch;
    return Status::done;
}

} // namespace wisp::WISP_ARITH::stages
