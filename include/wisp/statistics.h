// Exact counters of one frame: the same on every machine.
#pragma once
#include <cstdint>

namespace wisp {

struct Statistics {
    struct {
        uint64_t primary, shadow; // a shadow ray for each light that a step is lit by
    } rays = {};
    // emitted = absorbed + escaped + blocked + capped, photon by photon.
    struct Photons {
        uint64_t emitted, collisions, stored, absorbed, escaped, blocked, capped;
        uint64_t unclaimed; // collisions that no particle's kernel reached: their power is lost
        bool store_full;    // tracing ended before a batch that might not have fitted
    } photons = {};
    struct {
        uint64_t particles, density_evaluations, march_samples, gathers, gathered;
    } smoke = {};
    struct {
        uint64_t particle_tree, photon_map, particle_map, irradiance, arena_peak, arena_size;
    } bytes = {};
};

} // namespace wisp
