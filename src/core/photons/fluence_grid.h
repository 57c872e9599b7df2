// Photons through resampled smoke (S2), and what they leave at the nodes of the bricks (S4-3 with nodes for particles).
//
// Photons start where light first meets smoke, which resampled densities and kept depths tell for every node: none is
// sent past the smoke, and they are spread evenly over that light. They fly by tracking against each brick's greatest
// density (Woodcock). At every tentative collision, real or not, a photon leaves power / rate, an estimate of the
// length that it flies there, at the corners of the cell around (trilinear): the sums are the fluence.
#pragma once
#include "core/lights/optical_depth_grid.h"
#include "core/photons/particle_map.h"
#include "core/photons/spherical_harmonics.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

// What the nodes received, in integers: the same sums whatever the order.
struct FluenceSums {
    const SparseGrid *bricks;
    int32_t stride;
    int64_t *power; // `channels` of each node, in units of deposits times a unit of length
    int64_t *flux;  // three of each: the sum of direction times (R + G + B); nullptr where all smoke scatters evenly
    int64_t *harmonics; // `harmonic_numbers` at every `harmonic_spacing`: the sums of R + G + B, and of (1 + m) / 2
                        // times it for moments m of directions; nullptr where no smoke takes them
    uint32_t channels;  // one where all photons are alike
    Color photon_color; // of all photons, where they are alike
    PhotonUnit unit;
};

// How many numbers photons leave at most, and the bytes for them and for what tracing needs beside them.
struct FluencePlan {
    PhotonNeeds needs;
    uint64_t sums, bytes;
};
// What directions are beyond the flux varies less from place to place than power does.
constexpr int32_t harmonic_spacing(int32_t stride) { return min(2 * stride, brick_cells / 2); }
constexpr uint32_t harmonic_numbers = 1 + harmonic_count;
FluencePlan plan_fluence(const Scene &scene, const Settings &settings, uint64_t bricks, int32_t stride);

// Flights no longer than `longest` of which the sums hold any one's.
uint64_t max_fluence_flights(Real longest);

// One thing that photons start from: a light's first collisions, or the glow of a smoke.
struct PhotonSource {
    uint32_t light; // or that many lights and more: a smoke
    uint32_t smoke;
    Color color;    // per unit of brightness
    Real brightest; // its largest channel
};

// Where photons start, whatever their number and whatever stands in their way.
struct EmissionDistribution {
    const PhotonSource *sources;
    uint32_t source_count;
    const Real *rate;       // by brick: tentative collisions per unit of length
    int32_t shift;          // brightness is times 2^shift: in fixed point that of a thin smoke keeps its digits
    Real greatest;          // of all nodes' brightness
    const uint64_t *before; // by source and brick: the weights before; one more at the end
};
// False: the arena was too small. `depths`: to all lights, over the medium's bricks.
bool make_emission_distribution(const Scene &scene, const Medium &medium, const OpticalDepthGrid &depths, Arena &arena,
                                EmissionDistribution &starts);

// Adds what the photons of `batches` leave, none perhaps, to `sums`, and makes `deposits` of those as if all were
// there.
Status trace_fluence(const Medium &medium, const Surfaces *surfaces, const OpticalDepthGrid &depths,
                     const EmissionDistribution &starts, const Settings &settings, const PhotonNeeds &needs,
                     int32_t stride, const Batches &batches, const Observer &observer, Arena &arena, PhotonSums &sums,
                     Statistics &statistics, FluenceSums &deposits);

// What all bricks that hold a node received there.
FluenceAndFlux light_at_node(const FluenceSums &deposits, uint32_t brick, const Cell &node);
// The moments relative to the power, at one of the nodes that keep them.
SphericalHarmonics harmonics_at_node(const FluenceSums &deposits, uint32_t brick, const Cell &node);

} // namespace wisp::WISP_ARITH
