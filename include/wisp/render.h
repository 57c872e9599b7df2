// The core's door: what a scene needs, and its picture, in any of the three arithmetics.
#pragma once
#include "wisp/arena.h"
#include "wisp/pixel_sums.h"
#include "wisp/scene.h"
#include "wisp/statistics.h"

namespace wisp {

enum class Stage : uint8_t { trees, photons, irradiance, render };

enum class Status : uint8_t { done, stopped, out_of_memory };

// Hears of the work as it goes: once as a stage begins (done = 0), then as parts of it are done. Returning false
// stops the work. It may look at a clock; the core does not.
struct Observer {
    void *context;
    bool (*heard)(void *context, Stage stage, uint64_t done, uint64_t total);

    bool operator()(Stage stage, uint64_t done, uint64_t total) const {
        return !heard || heard(context, stage, done, total);
    }
};

// The stages that a scene needs, and upper bounds of their bytes.
struct Plan {
    bool smoke;             // there are particles
    bool photons;           // some light is scattered more than once
    bool photon_directions; // ... and not evenly
    bool photon_powers;     // ... and photons differ in power
    uint64_t photon_capacity;
    struct {
        uint64_t particle_tree, photon_map, gather, particle_map, sources, light_depths, irradiance;
        uint64_t arena; // everything, in one block
    } bytes;
};

// `plan` adds no more than a few operations a particle; `render` fills `rgb` with (x1 - x0) * (y1 - y0) linear
// radiances of the crop, three floats each, top row first. The arena must have plan().bytes.arena bytes; with less
// the status is out_of_memory and `rgb` is not touched.
//
// With settings.reference, `render_reference` takes its place: it adds the samples of the passes to the crop's `sums`,
// top row first; a sample's unit is 2^scene.radiance_exponent.
#define WISP_DECLARE_ENTRY(arithmetic)                                                                                 \
    namespace arithmetic {                                                                                             \
    Plan plan(const Scene &scene, const Settings &settings);                                                           \
    Status render(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,    \
                  Statistics &statistics);                                                                             \
    Status render_reference(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer,      \
                            PixelSums *sums, Statistics &statistics);                                                  \
    }
WISP_DECLARE_ENTRY(f32)
WISP_DECLARE_ENTRY(f64)
WISP_DECLARE_ENTRY(fixed)
#undef WISP_DECLARE_ENTRY

} // namespace wisp
