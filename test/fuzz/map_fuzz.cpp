// Any bytes read as a particle map give an error of one line, or a map that is written as the same bytes. The
// bytes behind the first two lines are also read with their right SHA-256, which random bytes would never have.
#include "core/numbers/random.h"
#include "host/base/error.h"
#include "host/base/sha256.h"
#include "host/results/map_file.h"
#include "wisp/photon_sums.h"
#include <cstdlib>
#include <cstring>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

// Whether an action succeeds. An error must be one line that names the file.
template <class Action> bool done(Action &&action) {
    try {
        action();
        return true;
    } catch (const wisp::InputError &error) {
        const std::string line = error.what();
        promise(line.rfind("name:", 0) == 0);
        promise(line.find('\n') == std::string::npos);
        return false;
    }
}

void read(const wisp::Bytes &bytes) {
    wisp::MapFile map;
    if (!done([&] { map = wisp::parse_map(bytes, "name"); })) return;
    uint64_t photons = 0;
    for (size_t i = 0; i < map.batches.size(); ++i) {
        const auto &[first, last] = map.batches[i];
        promise(first < last && last <= wisp::batch_count(map.photons));
        promise(i == 0 || map.batches[i - 1].second < first);
        photons += uint64_t{last - first} * wisp::batch_photons;
    }
    promise(map.counts.emitted <= photons);
    const wisp::Bytes written = wisp::map_bytes(map);
    promise(wisp::map_bytes(wisp::parse_map(written, "again")) == written);
    promise(!done([&] { wisp::check_map(map, "x", false, map.sums.size(), "name"); }) || map.scene == "x");
    if (done([&] { wisp::check_map(map, map.scene, false, map.sums.size(), "name"); }))
        promise(photons - map.photons < wisp::batch_photons);

    // Added to a map without batches the map gives itself; a second time it is refused.
    wisp::MapFile none = map;
    none.batches.clear();
    none.counts = {};
    for (int64_t &sum : none.sums) sum = 0;
    promise(done([&] { wisp::add_map(none, map, "name"); }));
    promise(wisp::map_bytes(none) == written);
    promise(map.batches.empty() || !done([&] { wisp::add_map(none, map, "name"); }));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    read(wisp::Bytes(data, data + size));
    const size_t head = std::strlen("wisp map 1\nsha256 ") + 64 + 1;
    if (size < head) return 0;
    const std::string text = std::string("wisp map 1\nsha256 ") + wisp::sha256(data + head, size - head).text + "\n";
    wisp::Bytes bytes(text.begin(), text.end());
    bytes.insert(bytes.end(), data + head, data + size);
    read(bytes);
    return 0;
}
