// Exact counters of one frame: the same on every machine.
#pragma once
#include <cstdint>

namespace wisp {

struct Statistics {
    struct {
        uint64_t primary;
    } rays = {};
    // emitted = absorbed + escaped + blocked + capped, photon by photon.
    struct {
        uint64_t emitted, collisions, stored, absorbed, escaped, blocked, capped;
        bool store_full; // tracing ended before a batch that might not have fitted
    } photons = {};
    struct {
        uint64_t particles, density_evaluations, march_samples, gathers, gathered;
    } smoke = {};
    struct {
        uint64_t particle_tree, photon_map, arena_peak, arena_size;
    } bytes = {};
};

} // namespace wisp
