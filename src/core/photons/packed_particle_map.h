// The particle map as it is read: after tracing, one packed entry an element, and what is made of them for the march.
#pragma once
#include "core/photons/particle_map.h"
#include "core/photons/photon_map.h"

namespace wisp::WISP_ARITH {

// One smoke's elements (particles by slot, or samples of the grid): 4 bytes each, or 8 where it does not scatter
// evenly.
struct MapEntries {
    // In photons, relative to 2^exponent: a packed colour, or of equal photons their number as a fraction of 2^32.
    uint32_t *power;
    // A packed flux relative to the power, or a unit vector; 0: from all sides; nullptr where the smoke scatters
    // evenly.
    uint32_t *direction;
    uint32_t count;
    int32_t exponent;
};

struct PackedMap {
    MapEntries *per_smoke; // one a smoke; nullptr where nothing scatters twice
    uint32_t count;       // of smokes
    bool one_channel;     // all photons are alike
    Color photon_color;   // ... and of this colour
    PhotonUnit unit;
    Direction kept;
};

// Room for the entries, made before what tracing leaves behind, which `pack_map` needs no longer. False: the arena was
// too small.
bool make_packed_map(const Scene &scene, const PhotonNeeds &needs, Direction kept, Arena &arena, PackedMap &packed);
uint64_t packed_map_bytes(const Scene &scene, const PhotonNeeds &needs);
uint64_t bytes_of(const PackedMap &map); // of the entries
void pack_map(const ParticleMap &map, PackedMap &packed);

// The light of an element, phi / (4 pi) and flux.
FluenceAndFlux light_of_element(const PackedMap &map, const SmokeVolume &smoke, uint32_t index, uint32_t element);

// The source function of every element towards the eye, per unit of sigma_t: what is scattered there for the second
// time and more, and emission. One array a smoke; nullptr: the arena was too small.
const Color *const *make_sources(const Scene &scene, const Medium &medium, const PackedMap &map, const Vec3 &eye,
                                 Arena &arena);
uint64_t source_bytes(const Scene &scene);

// The paper's own gather instead: the elements that carry power as photon maps, one a smoke (nullptr where nothing
// scatters twice), of which an estimate takes the nearest. False: the arena was too small.
bool make_element_maps(const Medium &medium, const PackedMap &map, Arena &arena, const PhotonMap *&maps);
uint64_t element_map_bytes(const Scene &scene);

} // namespace wisp::WISP_ARITH
