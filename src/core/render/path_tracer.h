// The reference that every other method is measured against: unbiased volumetric path tracing (README).
//
// It shares the density fields, the lights' formulas and the phase function with the rest, and nothing of the photons:
// collisions are found by weighted tracking against local majorants (where photons use exact collisions), draws come
// from a generator in sequence (where photons hash), and light arrives by next-event estimation.
#pragma once
#include "core/shadows/shadows_in_space.h"
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
    const Real *sigma;          // of each cell, x fastest; nullptr: the arena was too small
    int32_t parts;              // of a divided cell, along each edge
    const uint32_t *first_part; // by cell: where its parts begin in sigma_of_part; nullptr: no cell is divided
    const Real *sigma_of_part;  // of the cells that hold smoke
};
// Cells of about the length `edge`, larger where there would be too many. Where smoke fills little of its bounds,
// larger cells are divided that hold smoke.
Majorants make_majorants(const Medium &medium, Real edge, Arena &arena, Watch watch = {});

// The scene, as paths need it.
struct PathTracer {
    const Medium *medium;
    const Light *lights;
    uint32_t light_count;
    Majorants majorants;
    Statistics *statistics;
    const Surfaces *surfaces; // stop paths and hide lights; nullptr: there are none
    Watch watch = {};
};

// A collision of light that flies along a ray, and how much of the light collides.
struct WeightedCollision {
    Real weight; // of a unit of light, from [0, 1]; 0: no collision was found
    Real distance;
    uint32_t smoke;
};
// Draws a collision before `end`, by weighted tracking. Tentative collisions have a rate above the majorant; at each,
// sigma_t / rate of what has not yet collided does. One of these parts is drawn in proportion to its size, and stands
// for their sum. The expectation of weight times any function of the distance is that of delta tracking: the integral
// of the function times sigma_t times the transmittance (README).
WeightedCollision sample_collision(const PathTracer &tracer, const Ray &ray, Real end, Pcg32 &generator);

// Returns `radiance` plus one sample of the radiance of the smoke on the ray's distances 0 to `end`. The expectation of
// the sample is that of S1. A path that meets a surface ends there, because surfaces give no light to smoke.
Color sample_radiance(const PathTracer &tracer, Ray ray, Real end, Color radiance, Pcg32 &generator);

// One sample of what the ray sees of light that was scattered more than once, or emitted and then scattered.
Color sample_multiple_scattering(const PathTracer &tracer, Ray ray, Real end, Pcg32 &generator);

uint64_t majorant_bytes(const Scene &scene); // of the arena, at most
bool make_path_tracer(const Scene &scene, const Medium &medium, const Light *lights, const Surfaces *surfaces,
                      Arena &arena, Statistics &statistics, PathTracer &tracer,
                      Watch watch = {}); // false: the arena was too small

// Each pass of each pixel has its own random numbers: a crop, or some of the passes, has the samples of the whole.
Pcg32 pass_generator(const Settings &settings, uint32_t pass, int32_t x, int32_t y);

} // namespace wisp::WISP_ARITH
