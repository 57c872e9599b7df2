// Particle maps in files: batches that add up alike in any order, and files that are read only as written.
#include "core/numbers/random.h"
#include "host/results/map_file.h"
#include "support/checksummed.h"
#include "support/refusal.h"
#include "wisp/photon_sums.h"
#include <algorithm>
#include <doctest/doctest.h>

using namespace wisp;

namespace {

const std::string scene_name(64, 'a');
constexpr uint64_t photons = 7 * batch_photons + 1000; // eight batches, the last not full

// What nobody traced: batch b leaves sums and fates that are hashed from b.
MapFile map_of(const Ranges &batches) {
    MapFile map;
    map.scene = scene_name;
    map.photons = photons;
    map.batches = batches;
    map.sums.resize(5);
    for (const auto &[first, last] : batches)
        for (uint32_t b = first; b < last; ++b) {
            const uint64_t emitted = b == 7 ? 1000 : batch_photons;
            map.counts.emitted += emitted;
            map.counts.collisions += 9000 + 7 * b;
            map.counts.stored += 5000 + 11 * b;
            map.counts.absorbed += 100 + b;
            map.counts.blocked += 17;
            map.counts.capped += b % 2;
            map.counts.escaped += emitted - 100 - b - 17 - b % 2;
            for (size_t i = 0; i < map.sums.size(); ++i)
                map.sums[i] += static_cast<int64_t>((b + 1) * (i + 1) * 0x9e3779b97f4a7c15u) >> 8;
        }
    return map;
}

bool same(const MapFile &a, const MapFile &b) { return map_bytes(a) == map_bytes(b); }

std::string error_of(const std::string &file) {
    return refusal_of([&] { parse_map(bytes_of(file), "m.map"); });
}

struct About {
    std::string scene = "scene " + scene_name, photons = "photons 10000", batches = "batches 0:1 2:3",
                counts = "counts 5904 7000 6000 900 5000 3 1", sums = "sums 2";
};
const std::string no_sums(2 * 8, '\0');

std::string error_of(const About &about, const std::string &sums = no_sums) {
    return error_of(checksummed("wisp map 1", about.scene + "\n" + about.photons + "\n" + about.batches + "\n" +
                                                  about.counts + "\n" + about.sums + "\n" + sums));
}

} // namespace

TEST_CASE("map file: a file gives back what was written") {
    MapFile map = map_of({{0, 2}, {5, 6}, {7, 8}});
    map.sums = {INT64_MIN, INT64_MAX, -1, 0, 0x0123456789abcdef};
    const Bytes bytes = map_bytes(map);
    CHECK(text_of(bytes).rfind("wisp map 1\nsha256 ", 0) == 0);
    const MapFile again = parse_map(bytes, "m.map");
    CHECK(again.scene == map.scene);
    CHECK(again.photons == photons);
    CHECK(again.batches == map.batches);
    CHECK(again.sums == map.sums);
    CHECK(again.counts.emitted == 3 * batch_photons + 1000);
    CHECK(again.counts.collisions == map.counts.collisions);
    CHECK(again.counts.stored == map.counts.stored);
    CHECK(again.counts.absorbed == map.counts.absorbed);
    CHECK(again.counts.escaped == map.counts.escaped);
    CHECK(again.counts.blocked == map.counts.blocked);
    CHECK(again.counts.capped == map.counts.capped);
    CHECK(same(again, map));
    CHECK(text_of(bytes).substr(bytes.size() - 8) == "\xef\xcd\xab\x89\x67\x45\x23\x01"); // little-endian

    MapFile empty; // of a scene that needs no photons
    empty.scene = scene_name;
    CHECK(same(parse_map(map_bytes(empty), "m.map"), empty));
    CHECK(error_of(About()) == "no error"); // what the refusals below begin with is sound
}

TEST_CASE("map file: a bit that changed anywhere, and a cut anywhere, are refused") {
    check_damage_is_refused(text_of(map_bytes(map_of({{0, 1}}))),
                            [](const std::string &file) { return error_of(file); });
}

TEST_CASE("map file: errors name the file and what is wrong") {
    for (const char *other : {"", "PF\n1 1\n", "wisp passes 1\n", "wisp map 2\n", "wisp map 1"})
        CHECK(error_of(std::string(other)) == "m.map:1: not a particle map, expected 'wisp map 1'");
    CHECK(error_of(std::string("wisp map 1\n")).rfind("m.map:2: the file ends, expected ", 0) == 0);
    std::string file = text_of(map_bytes(map_of({{0, 1}})));
    const std::string digest = file.substr(18, 64);
    file.back() = static_cast<char>(file.back() ^ 1);
    CHECK(error_of(file) == "m.map:2: the file is damaged: its SHA-256 is another, expected " + digest);
}

// Whoever writes such a file knows how to compute its SHA-256.
TEST_CASE("map file: a file with the right SHA-256 and wrong numbers is refused, and nothing is allocated for them") {
    const auto with = [](std::string About::*line, const std::string &text) {
        About about;
        about.*line = text;
        const std::string error = error_of(about);
        CAPTURE(text);
        CHECK(error.rfind("m.map:", 0) == 0);
        CHECK(error.find('\n') == std::string::npos);
        return error;
    };
    with(&About::scene, "scenes " + scene_name);
    with(&About::scene, "scene");
    for (const char *count : {"", " -1", " 1e4", " 9223372036854775808", " 8796093018113", " 10000 1", " x"})
        with(&About::photons, std::string("photons") + count);
    with(&About::photons, "pho 10000");
    About most; // with a photon more, numbers of batches would not fit
    most.counts = "counts 8192 9000 9000 8192 0 0 0";
    most.photons = "photons 8796093018112";
    CHECK(error_of(most) == "no error");
    most.photons = "photons 8796093018113";
    CHECK(error_of(most).rfind("m.map:4: ", 0) == 0);
    for (const char *batches : {"", "0", "0:", "0:0", "1:0", "-1:1", "0:4", "0:99999999999", "0:1 1:3", "2:3 0:1",
                                "0:2 1:3", "0:1 0:1", "0:1,2:3", "a:b"})
        with(&About::batches, std::string("batches ") + batches);
    CHECK(with(&About::batches, "batches 0:4").rfind("m.map:5: '0:4', expected a range A:B of ", 0) == 0);
    for (const char *counts : {"", "5904", "5904 7000 6000 900 5000 3", "5904 7000 6000 900 5000 3 1 0",
                               "5904 -7000 6000 900 5000 3 1", "5904 7e3 6000 900 5000 3 1"})
        with(&About::counts, std::string("counts ") + counts);
    for (const char *counts :
         {"5903 7000 6000 900 5000 3 0",                                   // a photon less than the batches have
          "5905 7000 6000 901 5000 3 1",                                   // one more
          "5904 7000 6000 901 5000 3 1",                                   // one that ends twice
          "5904 7000 6000 900 4999 3 1",                                   // or never
          "5904 5999 6000 900 5000 3 1",                                   // more is stored than collided
          "5904 7000 6000 9223372036854775807 9223372036854775807 5905 1", // their sum wraps to the number
          "0 1 0 0 0 0 0"}) {
        CHECK(with(&About::counts, std::string("counts ") + counts).rfind("m.map:6: counts that do not add up", 0) ==
              0);
    }
    About idle;
    idle.counts = "counts 0 0 0 0 0 0 0"; // nothing sends photons
    CHECK(error_of(idle) == "no error");
    for (const char *sums : {"", "-1", "1", "3", "2 2", "0", "9223372036854775807", "2305843009213693954", "1e1"})
        with(&About::sums, std::string("sums ") + sums);
    CHECK(with(&About::sums, "sums 2305843009213693954").find("2305843009213693954 sums, expected at most 2") !=
          std::string::npos);
    CHECK(error_of(About(), "").rfind("m.map: byte ", 0) == 0);
    CHECK(error_of(About(), no_sums.substr(1)).rfind("m.map: byte ", 0) == 0);
    CHECK(error_of(About(), no_sums + "x").rfind("m.map: byte ", 0) == 0);
}

TEST_CASE("map file: batches in any order and grouping add up to the same bytes") {
    const Ranges pieces = {{0, 2}, {2, 3}, {3, 5}, {6, 7}, {7, 8}};
    const MapFile whole = map_of({{0, 5}, {6, 8}});
    std::vector<size_t> order = {0, 1, 2, 3, 4};
    do {
        MapFile sum = map_of({pieces[order[0]]});
        for (size_t i = 1; i < order.size(); ++i) add_map(sum, map_of({pieces[order[i]]}), "more");
        CHECK(same(sum, whole));
    } while (std::next_permutation(order.begin(), order.end()));
    // Grouped, and through files.
    MapFile left = map_of({{0, 2}}), right = map_of({{7, 8}});
    add_map(left, map_of({{3, 5}}), "more");
    add_map(right, map_of({{2, 3}, {6, 7}}), "more");
    MapFile sum = parse_map(map_bytes(right), "right");
    add_map(sum, parse_map(map_bytes(left), "left"), "left");
    CHECK(same(sum, whole));
}

TEST_CASE("map file: batches that are there already, or of another map, are refused and change nothing") {
    MapFile map = map_of({{2, 4}, {6, 7}});
    const Bytes before = map_bytes(map);
    for (const Ranges &batches :
         {Ranges{{2, 4}}, Ranges{{3, 5}}, Ranges{{0, 3}}, Ranges{{0, 8}}, Ranges{{4, 5}, {6, 8}}}) {
        const std::string error = refusal_of([&] { add_map(map, map_of(batches), "b.map"); });
        CHECK(error.rfind("b.map: batches ", 0) == 0);
        CHECK(error.find("expected none of 2:4 6:7, which are there already") != std::string::npos);
        CHECK(map_bytes(map) == before);
    }
    MapFile other = map_of({{4, 6}}), fewer = other, shorter = other;
    other.scene[63] = 'b';
    fewer.photons -= 1;
    shorter.sums.pop_back();
    for (const MapFile *more : {&other, &fewer, &shorter}) {
        CHECK(refusal_of([&] { add_map(map, *more, "b.map"); }) ==
              "b.map: a map of another scene, other settings, arithmetic or version, expected the same");
        CHECK(map_bytes(map) == before);
    }
    CHECK(refusal_of([&] { add_map(map, map_of({{4, 6}}), "b.map"); }) == "no error");
    CHECK(map.batches == Ranges{{2, 7}});
}

TEST_CASE("map file: sums and counts that do not fit together are refused, not wrapped") {
    const std::string refusal = "b.map: its sums and those before are too large together, expected 63 bits at most";
    for (int64_t end : {INT64_MAX, INT64_MIN}) {
        MapFile map = map_of({{0, 1}}), more = map_of({{1, 2}});
        more.sums[4] = end > 0 ? 1 : -1;
        map.sums[4] = end - more.sums[4];
        MapFile fits = map;
        CHECK(refusal_of([&] { add_map(fits, more, "b.map"); }) == "no error");
        CHECK(fits.sums[4] == end);
        map.sums[4] = end;
        const Bytes before = map_bytes(map);
        CHECK(refusal_of([&] { add_map(map, more, "b.map"); }) == refusal);
        CHECK(map_bytes(map) == before);
    }
    MapFile map = map_of({{0, 1}});
    map.counts.collisions = INT64_MAX;
    CHECK(refusal_of([&] { add_map(map, map_of({{1, 2}}), "b.map"); }) == refusal);
}

TEST_CASE("map file: a map is used only for its scene, with all batches and as many sums") {
    const auto error = [](const MapFile &map, uint64_t most) {
        return refusal_of([&] { check_map(map, scene_name, false, most, "m.map"); });
    };
    const MapFile whole = map_of({{0, 8}});
    CHECK(error(whole, 5) == "no error");
    CHECK(error(whole, 6) == "no error"); // at most
    CHECK(error(whole, 4) == "m.map: 5 sums, expected those of this scene's map");
    CHECK(error(map_of({{0, 7}}), 5) == "m.map: batches 0:7, expected 0:8; 'wisp merge' adds those of other files");
    CHECK(error(map_of({{0, 3}, {4, 8}}), 5).rfind("m.map: batches 0:3 4:8, expected 0:8;", 0) == 0);
    CHECK(error(map_of({{1, 8}}), 5).rfind("m.map: batches 1:8, expected 0:8;", 0) == 0);
    CHECK(error(map_of({}), 5).rfind("m.map: batches none, expected 0:8;", 0) == 0);
    MapFile other = whole;
    other.scene[0] = 'b';
    CHECK(error(other, 5).rfind("m.map: a map of another scene, ", 0) == 0);
    MapFile nothing = whole; // a file without sums would be traced into
    nothing.sums.clear();
    CHECK(error(nothing, 5) == "m.map: 0 sums, expected those of this scene's map");
    CHECK(error(nothing, 0) == "no error");
    nothing.photons = 0;
    nothing.batches.clear();
    CHECK(error(nothing, 0) == "no error");
}
