// The door of the library. plan() says what a scene needs, render() makes its picture, in float, double or fixed point.
// Nothing is checked: wisp/c_api.h, for C and C++, checks scenes and settings, and takes lengths of any unit.
//
//     const wisp::Renderer &renderer = wisp::f32::renderer;
//     const wisp::Plan plan = renderer.plan(scene, settings);
//     wisp::Arena arena(block, size);                              // size: at least plan.arena_bytes
//     wisp::Statistics statistics;
//     wisp::Job job = {scene, settings, arena, statistics, {}, picture}; // 3 floats a pixel of settings.crop
//     const wisp::Status status = renderer.render(job);
#pragma once
#include "wisp/arena.h"
#include "wisp/photon_sums.h"
#include "wisp/pixel_sums.h"
#include "wisp/progress.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include "wisp/statistics.h"

namespace wisp {

// To which of the seconds in --stats the time of a stage belongs.
enum class StageGroup : uint8_t { trees, photons, irradiance, render };

// What is known of a stage before anything runs.
struct PlanRow {
    const char *name; // as `wisp plan`, --stats and the progress print it
    const char *room; // folder below src/core that has the stage's code
    StageGroup group;
    bool needed;
    const char *reason; // why it is needed, or why not
    uint64_t bytes;     // of the arena, at most; 0 where the stage is not needed
};

// What a scene needs, stage by stage.
struct Plan {
    PlanRow rows[stage_count];
    uint64_t arena_bytes; // the sum of the bytes of all rows
    bool smoke;           // there are particles, density grids or boxes
    bool surfaces;        // there are triangles
    bool photons;         // some light is scattered more than once
    // Of photons; none: all smoke scatters evenly; to_eye: only what is scattered to it, so the sums are of one view.
    enum class Directions : uint8_t { none, flux, harmonics, to_eye } photon_directions;
    bool photon_powers;       // photons keep their powers: they differ
    uint64_t photon_capacity; // of the photon map; 0 where there is none
    uint64_t bricks;          // of 8 x 8 x 8 cells of resampled smoke; 0 where densities are exact
    uint64_t map_sums;        // numbers in the photon sums of a particle map, at most
    uint64_t max_photons;     // that such sums are sure to hold
    uint32_t layers;          // of settings.layers, those that there are: bits as of wisp/layers.h
    const char *missing;      // what it needs of the core and the program was built without (parts.h); or nullptr

    const PlanRow &operator[](Stage stage) const { return rows[static_cast<uint32_t>(stage)]; }
};

// What lives from frame to frame, at the beginning of the arena: trees of static triangles, what shadows have learnt,
// smoke with its depths. Empty at first, the caller's to hand on with the same arena. Other settings begin anew.
struct CachedFrame; // the core's own
struct FrameCache {
    CachedFrame *frame;
    bool same_smoke; // set by the caller: smoke and lights are bit for bit those of the frame before
};

// A frame to render. `settings.goal` says what is made:
// - Goal::picture: `rgb` is filled with width() * height() linear radiances of the crop, three floats each, top row
//   first; if the observer takes rows, with one at a time. `photons` may hold the sums of a particle map: they are
//   traced when `count` is 0, and used otherwise. Without `photons` the arena has room for them.
// - Goal::photons: the photons of `batches` are added to the sums in `photons`. Sums of all batches together are those
//   that a picture traces. Unless the status is done, the sums are of no use.
// - Goal::reference: passes are added to `pixels`, one a pixel, top row first, in units of 2^scene.radiance_exponent.
struct Job {
    const Scene &scene;
    const Settings &settings;
    Arena &arena; // of plan().arena_bytes; with less the status is out_of_memory and the picture is not touched
    Statistics &statistics; // counters are added to
    Observer observer = {};
    float *rgb = nullptr;
    PhotonSums *photons = nullptr;
    FrameCache *cache = nullptr; // nullptr: nothing lives on after this frame
    Batches batches = {};
    PixelSums *pixels = nullptr;
    float *layers = nullptr; // of settings.layers: planes, as wisp/layers.h says
};

// The library in one arithmetic. `plan` takes no more than a few operations a particle.
struct Renderer {
    const char *name; // "f32", "f64" or "fixed"
    Plan (*plan)(const Scene &scene, const Settings &settings);
    Status (*render)(const Job &job);
};

namespace f32 {
extern const Renderer renderer;
}
namespace f64 {
extern const Renderer renderer;
}
namespace fixed {
extern const Renderer renderer;
}

} // namespace wisp
