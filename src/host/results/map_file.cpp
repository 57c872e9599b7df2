#include "core/numbers/random.h"
#include "host/results/map_file.h"
#include "wisp/photon_sums.h"

namespace wisp {

namespace {

constexpr const char *first_line = "wisp map 1";
constexpr int64_t max_batches = 0x7fffffff;

// Every counter of a file, in its order.
constexpr uint64_t Statistics::Photons::*counters[] = {&Statistics::Photons::emitted, &Statistics::Photons::collisions,
                                                       &Statistics::Photons::stored,  &Statistics::Photons::absorbed,
                                                       &Statistics::Photons::escaped, &Statistics::Photons::blocked,
                                                       &Statistics::Photons::capped};

uint64_t photons_of(const MapFile &map) {
    uint64_t photons = 0;
    for (const auto &[first, last] : map.batches)
        photons += std::min(uint64_t{last} * batch_photons, map.photons) - uint64_t{first} * batch_photons;
    return photons;
}

// Each photon of the batches is absorbed, escapes, is blocked or capped; without an emitter there is none.
bool counts_add_up(const MapFile &map) {
    const Statistics::Photons &counts = map.counts;
    uint64_t left = counts.emitted;
    for (uint64_t count : {counts.absorbed, counts.escaped, counts.blocked, counts.capped}) {
        if (count > left) return false;
        left -= count;
    }
    if (left != 0 || counts.stored > counts.collisions) return false;
    return counts.emitted == photons_of(map) || (counts.emitted == 0 && counts.collisions == 0);
}

bool fits(int64_t a, int64_t b) {
    int64_t sum;
    return !__builtin_add_overflow(a, b, &sum);
}

} // namespace

void add_map(MapFile &map, const MapFile &more, const std::string &name) {
    if (more.scene != map.scene || more.photons != map.photons || more.sums.size() != map.sums.size())
        throw InputError(name, "a map of another scene, other settings, arithmetic or version, expected the same");
    bool fit = true;
    for (auto counter : counters)
        fit = fit && fits(static_cast<int64_t>(map.counts.*counter), static_cast<int64_t>(more.counts.*counter));
    for (size_t i = 0; i < map.sums.size(); ++i) fit = fit && fits(map.sums[i], more.sums[i]);
    if (!fit) throw InputError(name, "its sums and those before are too large together, expected 63 bits at most");
    add_ranges(map.batches, more.batches, "batches", name);
    for (auto counter : counters) map.counts.*counter += more.counts.*counter;
    for (size_t i = 0; i < map.sums.size(); ++i) map.sums[i] += more.sums[i];
}

void check_map(const MapFile &map, const std::string &scene, bool to_eye, uint64_t max_sums, const std::string &name) {
    if (map.scene != scene)
        throw InputError(
            name, std::string("a map of another scene, other settings, arithmetic or version, expected the map of this "
                              "smoke and these lights, photons, seed, deposit, direction, cells and arithmetic") +
                      (to_eye ? ", and of this place of the eye: photons are kept as smoke scatters them to it" : ""));
    const uint64_t batches = batch_count(map.photons);
    if (photons_of(map) != map.photons)
        throw InputError(name, "batches" + (map.batches.empty() ? " none" : ranges_text(map.batches)) +
                                   ", expected 0:" + std::to_string(batches) +
                                   "; 'wisp merge' adds those of other files");
    if (map.sums.size() > max_sums || map.sums.empty() != (max_sums == 0))
        throw InputError(name, std::to_string(map.sums.size()) + " sums, expected those of this scene's map");
}

Bytes map_bytes(const MapFile &map) {
    std::string lines = "scene " + map.scene + "\nphotons " + std::to_string(map.photons) + "\nbatches" +
                        ranges_text(map.batches) + "\ncounts";
    for (auto counter : counters) lines += " " + std::to_string(map.counts.*counter);
    lines += "\nsums " + std::to_string(map.sums.size()) + "\n";
    Bytes words;
    words.reserve(map.sums.size() * 8);
    for (int64_t sum : map.sums) put_word(words, static_cast<uint64_t>(sum));
    return checksummed_bytes(first_line, lines, words);
}

MapFile parse_map(const Bytes &bytes, const std::string &name) {
    ByteReader reader(name, bytes.data(), bytes.size());
    read_checksum(reader, first_line, "particle map");
    const auto key = [&reader](const std::string &word) {
        if (reader.word(word.c_str()) != word) reader.fail("expected '" + word + "'");
    };
    const auto number = [&reader](const char *what, int64_t high = INT64_MAX) {
        return static_cast<uint64_t>(read_integer(reader, what, 0, high));
    };
    MapFile map;
    key("scene");
    map.scene = reader.word("a SHA-256");
    key("photons");
    map.photons = number("a number of photons", max_batches * batch_photons);
    key("batches");
    map.batches = read_ranges(reader, "the batches of the photons", static_cast<int64_t>(batch_count(map.photons)));
    key("counts");
    for (auto counter : counters) map.counts.*counter = number("a number of photons or collisions");
    if (!counts_add_up(map)) reader.fail("counts that do not add up, expected those of the batches' photons");
    key("sums");
    const uint64_t count = number("a number of sums");
    reader.end_line();
    reader.set_encoding(Encoding::little_endian);
    reader.require(count, 8, "sums");
    if (reader.left() != count * 8)
        reader.fail(std::to_string(reader.left()) + " bytes of sums, expected " + std::to_string(count * 8));
    map.sums.resize(count);
    for (int64_t &sum : map.sums) sum = static_cast<int64_t>(read_word(reader));
    return map;
}

bool is_map(const Bytes &bytes) { return has_first_line(bytes, first_line); }

} // namespace wisp
