// Particle maps in `.map` files: traced once for many views, or in parts on many machines and merged.
#pragma once
#include "host/results/checksummed_file.h"
#include "wisp/statistics.h"

namespace wisp {

struct MapFile {
    std::string scene;               // SHA-256 of all that the sums depend on but the batches
    uint64_t photons = 0;            // of all batches together
    Ranges batches;                  // of photons, that were traced
    Statistics::Photons counts = {}; // what became of the photons of those
    std::vector<int64_t> sums;       // what they left
};

// Adds batches of the same map that are not in `map` yet. Throws InputError, with `name` in front, for others.
void add_map(MapFile &map, const MapFile &more, const std::string &name);

// Throws InputError, with `name` in front, unless `map` has all batches, is that of `scene`, and has `max_sums`
// numbers at most: none only where that is 0.
void check_map(const MapFile &map, const std::string &scene, uint64_t max_sums, const std::string &name);

// A sealed file `wisp map 1` of the lines scene, photons, batches, counts (emitted, collisions, stored, absorbed,
// escaped, blocked, capped) and sums (their number), then the sums as words. Reading throws InputError for a file that
// is none, is damaged, was cut, or whose numbers cannot be.
Bytes map_bytes(const MapFile &map);
MapFile parse_map(const Bytes &bytes, const std::string &name);

} // namespace wisp
