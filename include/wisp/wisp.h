// The core's door: what a scene needs, and its picture, in any of the three arithmetics.
#pragma once
#include "wisp/arena.h"
#include "wisp/photon_sums.h"
#include "wisp/pixel_sums.h"
#include "wisp/progress.h"
#include "wisp/pixel_trace.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include "wisp/statistics.h"

namespace wisp {

// The stages that a scene needs, and upper bounds of their bytes.
struct Plan {
    bool smoke;             // there are particles
    bool surfaces;          // there are triangles
    bool photons;           // some light is scattered more than once
    bool photon_directions; // ... and not evenly
    bool photon_harmonics;    // ... and is seen by moments of its directions too (moments.h)
    bool photon_powers;     // ... and photons differ in power
    uint64_t photon_capacity;
    uint64_t bricks;       // of resampled smoke; 0: densities are exact
    uint64_t map_sums;     // numbers of a particle map, at most
    uint64_t max_photons; // that they can hold
    struct {
        uint64_t particle_tree, photon_map, gather, particle_map, sources, light_depths, irradiance;
        uint64_t triangle_trees; // of what never changes its form, and of what does
        uint64_t shadows;        // what finding them keeps from frame to frame
        uint64_t light_cuts;
        uint64_t arena; // everything, in one block
    } bytes;
};

// What lives from frame to frame, at the beginning of the arena: trees of triangles that never change their form, what
// the way of finding shadows has learnt, and the resampled smoke with its light. The caller keeps it
// beside its arena, and gives both to the next frame of the same scene and settings; nothing is kept at first.
struct FrameCache {
    void *surfaces, *shadows, *smoke;
    uint32_t lights; // as many as the scene had
    size_t surfaces_end, smoke_end;
    bool same_smoke; // the caller knows: smoke and lights are bit for bit those of the frame before
};

// `plan` adds no more than a few operations a particle; `render` fills `rgb` with (x1 - x0) * (y1 - y0) linear
// radiances of the crop, three floats each, top row first. The arena must have plan().bytes.arena bytes; with less
// the status is out_of_memory and `rgb` is not touched.
//
// The particle map of Method::map is traced into `sums` when nothing is in them, otherwise taken from there; without
// `sums` it is the arena's, for this picture alone. `trace_map` makes no picture: it adds the photons of some batches
// to the sums, and to the counters. Sums of all batches together are those that `render` traces. Unless the status is
// done, what is in the sums is of no use.
//
// `inspect` renders as `render` does, and passes the events of one pixel of the crop to `trace`. Pixels before it in the
// crop are rendered first, and what they have taught decides how shadows of this pixel are found. A crop of the pixel
// alone is the quickest. A program that does not call `inspect` does not link what records a pixel.
//
// With settings.reference, `render_reference` takes its place: it adds the samples of the passes to the crop's `sums`,
// top row first; a sample's unit is 2^scene.radiance_exponent.
#define WISP_DECLARE_ENTRY(arithmetic)                                                                                 \
    namespace arithmetic {                                                                                             \
    Plan plan(const Scene &scene, const Settings &settings);                                                           \
    Status render(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,    \
                  Statistics &statistics, PhotonSums *sums = nullptr, FrameCache *kept = nullptr);                       \
    Status inspect(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,   \
                   Statistics &statistics, PhotonSums *sums, const PixelTrace &trace);                                 \
    Status trace_map(const Scene &scene, const Settings &settings, const Batches &batches, Arena &arena,               \
                     const Observer &observer, PhotonSums &sums, Statistics &statistics);                                 \
    Status render_reference(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer,      \
                            PixelSums *sums, Statistics &statistics);                                                  \
    }
WISP_DECLARE_ENTRY(f32)
WISP_DECLARE_ENTRY(f64)
WISP_DECLARE_ENTRY(fixed)
#undef WISP_DECLARE_ENTRY

} // namespace wisp
