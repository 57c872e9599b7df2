// Replays the inputs of every fuzz target: those that once crashed, and one for each kind of error.
#include "host/base/files.h"
#include <algorithm>
#include <doctest/doctest.h>
#include <filesystem>

extern "C" int fuzz_exr(const uint8_t *data, size_t size);
extern "C" int fuzz_map(const uint8_t *data, size_t size);
extern "C" int fuzz_particles(const uint8_t *data, size_t size);
extern "C" int fuzz_passes(const uint8_t *data, size_t size);
extern "C" int fuzz_pfm(const uint8_t *data, size_t size);
extern "C" int fuzz_record(const uint8_t *data, size_t size);
extern "C" int fuzz_scene(const uint8_t *data, size_t size);
extern "C" int fuzz_texture(const uint8_t *data, size_t size);
extern "C" int fuzz_volume(const uint8_t *data, size_t size);

namespace {

void replay(const std::string &folder, size_t least, int (*target)(const uint8_t *, size_t)) {
    std::vector<std::string> paths;
    for (const auto &entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    CHECK(paths.size() >= least);
    for (const std::string &path : paths) {
        const wisp::Bytes bytes = wisp::read_file(path);
        CAPTURE(path);
        CHECK(target(bytes.data(), bytes.size()) == 0);
    }
}

} // namespace

TEST_CASE("every input of the fuzz corpus of EXR pictures is read or refused") {
    replay("test/corpus/exr", 20, fuzz_exr);
}
TEST_CASE("every input of the fuzz corpus of particle maps is read or refused") {
    replay("test/corpus/map", 30, fuzz_map);
}
TEST_CASE("every input of the fuzz corpus of particle files is read or refused") {
    replay("test/corpus/particles", 30, fuzz_particles);
}
TEST_CASE("every input of the fuzz corpus of passes is read or refused") {
    replay("test/corpus/passes", 20, fuzz_passes);
}
TEST_CASE("every input of the fuzz corpus of pictures is read or refused") { replay("test/corpus/pfm", 10, fuzz_pfm); }
TEST_CASE("every input of the fuzz corpus of records is read or refused") {
    replay("test/corpus/record", 25, fuzz_record);
}
TEST_CASE("every input of the fuzz corpus of scenes is read or refused") { replay("test/corpus/scene", 8, fuzz_scene); }
TEST_CASE("every input of the fuzz corpus of textures is read or refused") {
    replay("test/corpus/texture", 25, fuzz_texture);
}
TEST_CASE("every input of the fuzz corpus of volumes is read or refused") {
    replay("test/corpus/volume", 32, fuzz_volume);
}
