// Ray marching (S1): the radiance that reaches the eye through smoke.
#pragma once
#include "wisp/photon_map.h"

namespace wisp::WISP_ARITH {

// All that a ray asks of the scene; one for the whole picture.
struct Marcher {
    const Medium *medium;
    const Light *lights;
    uint32_t light_count;
    const PhotonMap *photon_maps; // one a smoke, or nullptr
    Color background;
    Real step;                 // length of a step
    const Real *gather_radius; // one a smoke
    Real *extinctions;         // workspace, one a smoke
    Gather gather;
    Statistics *statistics;
};

// Radiance along the ray from where it comes: emission, single scattering from every light, multiple scattering from
// the photon maps, and the attenuated background. Extinction and the lights are sampled in the middle of each step,
// within which they count as constant: their integral over the step is exact for any depth (S1, numerics E4).
Color march(Marcher &marcher, const Ray &ray);

} // namespace wisp::WISP_ARITH
