// One frame on its way through the table of stages: what it is asked for, and what each stage has made.
#pragma once
#include "core/march/grid_march.h"
#include "core/march/particle_march.h"
#include "core/march/ray_march.h"
#include "core/photons/exact_fluence.h"
#include "core/photons/fluence_grid.h"
#include "core/render/decisions.h"
#include "core/render/layers.h"
#include "core/render/path_tracer.h"
#include "core/render/whitted.h"
#include "wisp/wisp.h"

namespace wisp {

// What the opaque pointer in FrameCache leads to. A cache of another arithmetic is not used.
struct CachedFrame {
    const Renderer *renderer;
};

namespace WISP_ARITH {

// The smoke, and the fields over it. They depend on nothing but the smoke and the lights.
struct SmokeStructures {
    Medium medium;
    SparseGrid march_grid;    // where densities are exact
    const SparseGrid *bricks; // that, or the medium's; nullptr: there is no sparse grid
    OpticalDepthGrid depths;
    EmissionDistribution emission; // of PhotonStore::fluence_grid
};

// How long what a stage makes lives: as long as the animation, as long as the smoke stays the same, or for one frame.
enum class Lifetime : uint8_t { sequence, smoke, frame };

struct Frame;

// What lives from frame to frame. It stands at the beginning of the arena.
struct FrameState : CachedFrame {
    Frame *frame;                       // room for each in turn, which would be much of a small stack
    uint32_t light_count, static_count; // other numbers: all is made anew
    Settings settings;                  // those of the frame before
    Light *lights;
    Surfaces surfaces;
    void *shadow_memory; // of the shadow technique
    SmokeStructures smoke;
    bool has_smoke;                 // `smoke` is made
    size_t sequence_end, smoke_end; // marks of the arena
    uint64_t used[2][stage_count];  // bytes that stages hold, by the first two lifetimes
};

struct Frame {
    const Job &job;
    const Decisions &decisions;
    FrameState &state;
    PixelRecorder *recorder;       // of one pixel, of all for their layers, or nullptr
    const FlightRecorder *flights; // of photons, or nullptr

    const Scene &scene = job.scene;
    const Settings &settings = job.settings;
    Arena &arena = job.arena;
    Statistics &statistics = job.statistics;
    Work work = {job.observer};
    const Watch watch = Watch(work);

    // Surfaces
    Shadows shadows = {};
    LightCuts light_cuts = {};
    Whitted whitted = {};
    // Photons: one of the stores
    const PhotonMap *photon_maps = nullptr; // one a smoke, of photons or of elements
    PackedMap particle_map = {};
    FluenceSums fluence = {};
    // How they are read
    Gather gather = {};
    const Real *gather_radius = nullptr; // one a smoke
    Irradiance irradiance = {};
    bool has_irradiance = false;
    const Color *const *sources = nullptr; // one array a smoke
    // How rays pass through the smoke
    PathTracer paths = {};
    Marcher marcher = {};
    ParticleMarcher particle_marcher = {};
    GridMarcher grid_marcher = {};

    const Medium &medium() const { return state.smoke.medium; }
    const Surfaces *surfaces() const { return decisions.surfaces ? &state.surfaces : nullptr; }
};

} // namespace WISP_ARITH
} // namespace wisp
