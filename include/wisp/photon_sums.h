// What photons leave on a particle map, and the batches in which they are traced.
#pragma once
#include "wisp/settings.h"
#include <cstdint>

namespace wisp {

constexpr uint32_t batch_photons = 4096;
constexpr uint64_t batch_count(uint64_t photons) { return photons / batch_photons + (photons % batch_photons != 0); }

// Batches first <= i < last of `batch_photons` photons each, the last of all perhaps fewer.
struct Batches {
    uint64_t first, last;
};
inline Batches all_batches(const Settings &settings) { return {0, batch_count(settings.photons)}; }

// What photons leave on a particle map: integers, so that batches traced apart add up to the bits of one run. The
// memory is the caller's, of plan().map_sums numbers. `count` of them are in use: 0 before the first photon is traced.
struct PhotonSums {
    int64_t *values;
    uint64_t capacity, count;
};

} // namespace wisp
