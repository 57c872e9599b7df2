// The particle map as the march reads it: one packed entry per element, and the source functions made of the entries.
#pragma once
#include "core/photons/packed_light.h"
#include "core/photons/particle_map.h"
#include "core/photons/photon_map.h"

namespace wisp::WISP_ARITH {

// The elements of one smoke: particles by slot, or samples of the grid. An entry has 4 bytes, or 8 where the smoke is
// not isotropic.
struct MapEntries {
    // A packed colour in photons, relative to `scale`. Where all photons carry the same power: their number as a
    // fraction of 2^32, relative to the scale's strongest 2^exponent.
    uint32_t *power;
    // A packed flux relative to the power, or a unit vector; 0: light from all sides; nullptr where the smoke is
    // isotropic.
    uint32_t *direction;
    uint32_t count;
    ColorScale scale;
};

struct PackedMap {
    MapEntries *per_smoke; // one per smoke; nullptr where nothing scatters twice
    uint32_t count;        // of smokes
    bool one_channel;      // all photons carry the same power
    Color photon_color;    // ... of this colour
    PhotonUnit unit;
    Direction direction_kind;
};

// Makes room for the entries. This comes before tracing, so that the sums can be freed after pack_map(). False: the
// arena was too small.
bool make_packed_map(const Scene &scene, const PhotonNeeds &needs, Direction direction_kind, Arena &arena,
                     PackedMap &packed);
uint64_t packed_map_bytes(const Scene &scene, const PhotonNeeds &needs);
uint64_t bytes_of(const PackedMap &map); // of the entries
// Packs the sums. The power errs by less than 2^-9 of its largest channel, or 2^-32 of the largest power of the smoke
// where there is one channel; each component of a flux by at most 1/1022.
// False: the work is stopped.
bool pack_map(const ParticleMap &map, PackedMap &packed, Watch watch = {});

// The fluence and flux at an element.
FluenceAndFlux light_of_element(const PackedMap &map, const SmokeVolume &smoke, uint32_t index, uint32_t element);

// The source function of every element towards the eye, per unit of sigma_t: multiple scattering and emission. One
// array per smoke; nullptr: the arena was too small.
const Color *const *make_sources(const Scene &scene, const Medium &medium, const PackedMap &map, const Vec3 &eye,
                                 Arena &arena, Watch watch = {});
uint64_t source_bytes(const Scene &scene);

// For the paper's own gather: makes a photon map per smoke of the elements that carry power, from which an estimate
// takes the nearest. `maps` is nullptr where nothing scatters twice. False: the arena was too small.
bool make_element_maps(const Medium &medium, const PackedMap &map, Arena &arena, const PhotonMap *&maps,
                       Watch watch = {});
uint64_t element_map_bytes(const Scene &scene);

} // namespace wisp::WISP_ARITH
