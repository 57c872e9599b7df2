// The table of stages: what a render consists of, why a scene needs it, how many bytes it takes, and how it is run.
// plan() and render() both go through it.
#pragma once
#include "core/render/frame.h"

namespace wisp::WISP_ARITH {

struct Need {
    bool needed;
    const char *reason;
};

// What the bytes of several stages have in common. It takes a few operations a particle to find.
struct Sizes {
    SparseGridPlan grid; // of the bricks; nothing where there are none
};

struct StageRow {
    Stage stage;
    const char *name, *room;
    StageGroup group;
    Need (*need)(const Scene &, const Settings &, const Decisions &);
    uint64_t (*bytes)(const Scene &, const Settings &, const Decisions &, const Sizes &); // nullptr: none
    // What the stage makes, by its lifetime; nullptr: nothing.
    struct {
        Status (*sequence)(Frame &), (*smoke)(Frame &), (*frame)(Frame &);
    } run;
};

// One row for each Stage, in that order.
extern const StageRow stage_rows[stage_count];

// Their functions, by subject.
namespace stages {

Status build_triangle_trees(Frame &), place_triangle_trees(Frame &);
Status make_lights(Frame &);
Status make_shadow_memory(Frame &), begin_shadows(Frame &);
Status build_light_cuts(Frame &);
Status make_shading(Frame &);

Status build_exact_density(Frame &);
Status build_sparse_grid(Frame &);
Status find_light_depths(Frame &);

Status distribute_emission(Frame &), trace_photons(Frame &);
Status make_gather(Frame &);
Status make_irradiance(Frame &);
Status make_sources(Frame &);

Status find_majorants(Frame &);
Status make_march(Frame &);
Status make_layers(Frame &);
Status trace_camera_rays(Frame &);

uint64_t photon_bytes(const Scene &, const Settings &, const Decisions &, const Sizes &);
uint64_t gather_bytes(const Scene &, const Settings &, const Decisions &, const Sizes &);
uint64_t march_bytes(const Scene &, const Settings &, const Decisions &, const Sizes &);

} // namespace stages

// What looks on while stages run, and then at what they have made.
struct Observation {
    PixelRecorder *pixel = nullptr;          // records one pixel
    const FlightRecorder *flights = nullptr; // records photons
    Stage last = Stage::camera_rays;         // the last stage that runs
    void *context = nullptr;
    Status (*on_frame)(void *context, Frame &frame) = nullptr;
};

// Runs the stages that the job needs.
Status run_stages(const Job &job, const Observation &observation);

} // namespace wisp::WISP_ARITH
