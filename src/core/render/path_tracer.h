// The reference that every other method is measured against: unbiased volumetric path tracing (README).
//
// It shares the density fields, the lights' formulas and the phase function with the rest, and nothing of the photons:
// free paths are Woodcock's delta tracking against local majorants (where photons use exact collisions), draws come
// from a generator in sequence (where photons hash), and light arrives by next-event estimation. Slow and simple.
#pragma once
#include "core/shadows/shadows.h"
#include "core/smoke/medium.h"
#include "core/numbers/random.h"
#include "wisp/arena.h"
#include "wisp/photon_sums.h"
#include "wisp/progress.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include "wisp/statistics.h"

namespace wisp::WISP_ARITH {

// Upper bounds of the medium's sigma_t, one a cell.
struct Majorants {
    Lattice lattice;
    const Real *sigma; // of each cell, x fastest; nullptr: the arena was too small
};
// Cells of about the length `edge`, larger where there would be too many.
Majorants make_majorants(const Medium &medium, Real edge, Arena &arena, Watch watch = {});

// The scene, as paths need it.
struct PathTracer {
    const Medium *medium;
    const Light *lights;
    uint32_t light_count;
    Majorants majorants;
    Statistics *statistics;
    Shadows *shadows; // of surfaces; nullptr: there are none
    Watch watch = {};
};

// Draws the first collision along the ray before `end`, by delta tracking: its distance, and which smoke is hit.
// Tentative collisions have the rate sigma_m of the majorants; each is real with probability sigma_t / sigma_m. This is
// unbiased.
MediumCollision track(const PathTracer &tracer, const Ray &ray, Real end, Pcg32 &generator);

// Returns `radiance` plus one sample of the radiance of the smoke on the ray's distances 0 to `end`. The expectation of
// the sample is that of S1. A path that meets a surface ends there, because surfaces give no light to smoke.
Color sample_radiance(const PathTracer &tracer, Ray ray, Real end, Color radiance, Pcg32 &generator);

// One sample of what the ray sees of light that was scattered more than once, or emitted and then scattered.
Color sample_multiple_scattering(const PathTracer &tracer, Ray ray, Real end, Pcg32 &generator);

uint64_t majorant_bytes(const Scene &scene); // of the arena, at most
bool make_path_tracer(const Scene &scene, const Medium &medium, const Light *lights, Shadows *shadows, Arena &arena,
                      Statistics &statistics, PathTracer &tracer, Watch watch = {}); // false: the arena was too small

// Each pass of each pixel has its own random numbers: a crop, or some of the passes, has the samples of the whole.
Pcg32 pass_generator(const Settings &settings, uint32_t pass, int32_t x, int32_t y);

} // namespace wisp::WISP_ARITH
