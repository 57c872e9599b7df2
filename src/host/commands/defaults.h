// Settings that the options leave open.
#pragma once
#include "host/prepare/extinction.h"
#include "host/scene/options.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"

namespace wisp {

// As many as photons, if paths from so many rays take their place.
uint32_t paths_for(uint64_t photons, uint64_t rays);

// Sets the method and the spacings of grids and samples. So many random paths from each ray take the place of photons
// where these would err by more. The goal, the photons, the samples, the crop, the layers and the shadows are set
// already. Returns why paths are chosen; nullptr: they are not. Throws Error(exit_usage) for options that exclude each
// other.
const char *choose_defaults(const Options &options, const Scene &scene, uint32_t paths, Settings &settings);

// The places where photons leave the light that is scattered more than once: the deepest one, as an optical depth, and
// how deep it may be for that light to err by `largest_error` at most: 3 %, at hard faces 9 % (4.5 % where photons are
// kept towards the eye), on particles and samples that keep their power 10 %.
struct PhotonCells {
    double depth, most, largest_error;
    bool fit() const { return depth <= most; }
    // Errors are in proportion to the depth, or less: a box of albedo 0.5 errs by 31 and 50 % at 2.5 and 5, a plume of
    // particles (fixtures/demo.aff) by 0.9, 4.1 and 7 % at 2.2, 8.9 and 18.
    double error() const { return largest_error * depth / most; }
};
PhotonCells photon_cells(const Scene &scene, const SmokeDensity &density, const Settings &settings);
// The edge of these cells, of smoke in the scene.
double width_of_photon_cells(const Scene &scene, const Settings &settings);

// The largest g of all smoke, or 0.
double most_forward(const Scene &scene);

// Whether photons that are kept towards the eye do without the peak of the phase function (lights/README, Forward
// peak).
bool takes_peaks_off(const Scene &scene, const Settings &settings, const Plan &plan);

// What photons err by at most, relative to the picture, where their flux, or that and a few harmonics, say whence light
// comes: beside mirrors and glass, in smoke of several phases, or on particles and samples. 0 where that is little.
double error_of_flux(const Scene &scene, const Settings &settings, const Plan &plan);

// Whether the phase is so far backward that the flux does not tell whence light comes: it flows both ways.
bool scatters_far_backward(const Scene &scene);

} // namespace wisp
