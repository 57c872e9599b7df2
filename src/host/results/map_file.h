// Particle maps in `.map` files: traced once for many views, or in batches on many machines and merged.
#pragma once
#include "host/results/checksummed_file.h"
#include "wisp/statistics.h"

namespace wisp {

struct MapFile {
    std::string scene;               // fingerprint_of_map()
    uint64_t photons = 0;            // in all batches, traced or not
    Ranges batches;                  // those that were traced
    Statistics::Photons counts = {}; // how many of their photons collided, escaped, ...
    std::vector<int64_t> sums;       // what they deposited (PhotonSums)
};

// Adds the batches of `more`. Throws InputError with `name` in front, and changes nothing, unless both are of the same
// map, without a common batch.
void add_map(MapFile &map, const MapFile &more, const std::string &name);

// Throws InputError, with `name` in front, unless `map` is that of `scene`, has all batches, and has at most `max_sums`
// sums, and at least one unless that is 0. `to_eye`: maps of this scene are of one view.
void check_map(const MapFile &map, const std::string &scene, bool to_eye, uint64_t max_sums, const std::string &name);

// A checksummed file `wisp map 1` of the lines scene, photons, batches, counts (emitted, collisions, stored, absorbed,
// escaped, blocked, capped) and sums (their number), then the sums as words. parse_map() throws InputError for another
// file, a damaged or truncated one, and for impossible numbers.
Bytes map_bytes(const MapFile &map);
MapFile parse_map(const Bytes &bytes, const std::string &name);
bool is_map(const Bytes &bytes); // by its first line

} // namespace wisp
