// What a scene needs, decided once: every stage asks the Decisions, and no stage decides again.
#pragma once
#include "core/numbers/parts.h"
#include "core/photons/photon_tracing.h"
#include "wisp/layers.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

// Where photons leave their power (S4-2, S4-3).
enum class PhotonStore : uint8_t {
    none,         // no photon is traced
    photon_map,   // a point for each collision (S2)
    particle_map, // sums on particles, or on samples of grids (S4-3)
    fluence_grid  // sums at the nodes of a sparse grid (S4-1, S4-3)
};

// How camera rays pass through smoke (S1).
enum class MarchKind : uint8_t {
    none,      // there is no smoke
    steps,     // step by step through exact densities: Marcher
    particles, // particles gathered for many steps at a time: ParticleMarcher
    grid,      // brick by brick through resampled smoke: GridMarcher
    paths      // random paths instead of a march: PathTracer
};

// The cells of the sparse grid in smoothing lengths of the finest smoke, 0 where there is none, and the distance
// between the points of the fields over it, in cells.
struct GridSpacing {
    double cell;
    int32_t light, irradiance;
};

struct Decisions {
    Goal goal;
    bool smoke;                      // there are particles, density grids or boxes
    Needs<parts::surfaces> surfaces; // there are triangles
    Needs<parts::surfaces> shaded;   // ... which rays see

    Needs<parts::resampled> resampled; // densities are those of the sparse grid's nodes, not exact
    Needs<parts::exact> march_grid;    // densities are exact, and there is a sparse grid for the fields over it
    GridSpacing spacing;
    bool scatters;            // some smoke is not black
    uint32_t lights_in_smoke; // lights that smoke scatters: none where it is black
    bool light_depths;

    PhotonNeeds photon_needs;
    PhotonStore photons;
    Needs<parts::paths> paths;           // light scattered more than once is followed along random paths from each ray
    bool particle_map;                   // sums of a particle map are read and written, if there are photons
    bool at_nodes;                       // ... and these are at the nodes of a sparse grid
    Needs<parts::exact_photons> nearest; // the nearest photons or particles are gathered at every step
    bool irradiance;
    Needs<parts::photons> sweeps; // light of photons is gathered again, along lines
    Needs<parts::light_cuts> light_cuts;
    MarchKind march;
    uint32_t layers;     // bits of Layer
    const char *missing; // a part that the scene needs and the program does not have (parts.h), or nullptr
};

Decisions decide(const Scene &scene, const Settings &settings);

} // namespace wisp::WISP_ARITH
