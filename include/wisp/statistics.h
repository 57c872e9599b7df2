// Exact counters of one frame: the same on every machine.
#pragma once
#include "wisp/pixel_sums.h"
#include "wisp/progress.h"

namespace wisp {

// What rays ask of the trees of surfaces. Leaves are nodes too; triangles are tested in groups, but counted each.
struct TreeCounts {
    uint64_t node_visits, triangle_tests;
};

struct Statistics {
    struct {
        uint64_t primary, reflected, refracted, saturated; // saturated: brighter than Fixed holds
        uint64_t shadow;        // one for each light that a step through smoke, or a point of a surface, may be lit by
        uint64_t shadow_culled; // of these, known without asking any triangle
        uint64_t shadow_dynamic_only; // of these, asked of moving triangles alone
    } rays = {};
    struct {
        TreeCounts traced;     // what shadow rays ask
        TreeCounts proofs;     // what it takes to know without
        uint64_t extra_tests;  // of triangles outside the trees: C2's, and occluders that are tried first
        bool checked;          // by tracing: the paper's method
        uint64_t wrong_pixels; // then: those with a shadow that tracing decides otherwise
    } shadow = {};
    // emitted = absorbed + escaped + blocked + capped, photon by photon.
    struct Photons {
        uint64_t emitted, collisions, stored, absorbed, escaped, blocked, capped, lost; // lost: no kernel reached it
        uint32_t thinning; // of a photon map: it holds one of 2^thinning collisions, so that they fit
        WideSum variance;  // of all rays and channels, by photons at nodes: a bound, in units of 2^-32
    } photons = {};
    struct { uint64_t particles, density_evaluations, march_samples, gathers, gathered; } smoke = {};
    struct { PixelSums::Channel each, of_rays; } paths = {}; // Settings::paths, all channels; of_rays: of a ray's mean
    struct {
        uint64_t particle_tree, photon_map, particle_map, irradiance, triangle_trees;
        uint64_t mode_words; // of ShadowMethod::paper
        uint64_t arena_peak, arena_size;
        uint64_t stages[stage_count]; // the most that each held at a time, with what lives on from earlier frames
    } bytes = {};                     // that were used
};

} // namespace wisp
