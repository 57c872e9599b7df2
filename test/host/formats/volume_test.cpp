// Density grids: every field of a VOL file is read, and each that is wrong gives one clear line.
#include "host/base/files.h"
#include "host/formats/volume.h"
#include "support/data.h"
#include "support/refusal.h"
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <filesystem>
#include <limits>
#include <numeric>

extern "C" int fuzz_volume(const uint8_t *data, size_t size); // test/fuzz/volume_fuzz.cpp

using namespace wisp;

namespace {

constexpr size_t header_size = 48;
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

// What a file says of itself, true or not; by default a sound file.
struct Header {
    std::string magic = "VOL";
    unsigned char version = 3;
    int32_t encoding = 1, nx = 2, ny = 3, nz = 1, channels = 1;
    float box[6] = {-1.5f, 0.25f, -3, 4, 0.5f, 1e30f};
};

std::string packed(uint32_t bits) {
    std::string bytes;
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(bits >> shift & 0xff);
    return bytes;
}
std::string packed(int32_t number) { return packed(static_cast<uint32_t>(number)); }
std::string packed(float number) {
    uint32_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    return packed(bits);
}

// By default as many samples as Header's dimensions ask for: 0, the least, the greatest, ...
const std::vector<float> sound_samples = {0, 1e-45f, 3.4028235e38f, 0.1f, 1, 0.75f};

std::string vol(const Header &header = Header(), const std::vector<float> &samples = sound_samples) {
    std::string bytes = header.magic + static_cast<char>(header.version);
    for (int32_t number : {header.encoding, header.nx, header.ny, header.nz, header.channels}) bytes += packed(number);
    for (float number : header.box) bytes += packed(number);
    for (float number : samples) bytes += packed(number);
    return bytes;
}

const unsigned char *data_of(const std::string &bytes) { return reinterpret_cast<const unsigned char *>(bytes.data()); }

bool begins_like_volume(const std::string &bytes) { return is_volume(data_of(bytes), bytes.size()); }

Volume parse(const std::string &bytes) { return parse_volume("file", data_of(bytes), bytes.size()); }

std::string error_of(const std::string &bytes) {
    return refusal_of([&] { parse(bytes); });
}

std::string error_of(const Header &header) { return error_of(vol(header)); }

Header with_box(size_t index, float number) {
    Header header;
    header.box[index] = number;
    return header;
}

Header with_cells(int32_t nx, int32_t ny, int32_t nz) {
    Header header;
    header.nx = nx;
    header.ny = ny;
    header.nz = nz;
    return header;
}

} // namespace

TEST_CASE("volume: every field is read") {
    REQUIRE(vol().size() == header_size + 4 * sound_samples.size());
    const Volume volume = parse(vol());
    CHECK(volume.nx == 2);
    CHECK(volume.ny == 3);
    CHECK(volume.nz == 1);
    CHECK(volume.low == std::array<double, 3>{-1.5, 0.25, -3});
    CHECK(volume.high == std::array<double, 3>{4, 0.5, 1e30f});
    CHECK(volume.density == sound_samples);
}

TEST_CASE("volume: the least grid and each long side are read") {
    const Volume least = parse(vol(with_cells(1, 1, 1), {0.5f}));
    CHECK(least.density == std::vector<float>{0.5f});
    const std::vector<float> many(300, 0.25f); // 300 takes two bytes of a dimension
    CHECK(parse(vol(with_cells(300, 1, 1), many)).nx == 300);
    CHECK(parse(vol(with_cells(1, 300, 1), many)).ny == 300);
    CHECK(parse(vol(with_cells(1, 1, 300), many)).nz == 300);
}

TEST_CASE("volume: a file is known by its first bytes") {
    CHECK(begins_like_volume(vol()));
    CHECK(begins_like_volume("VOL"));
    CHECK_FALSE(begins_like_volume(""));
    CHECK_FALSE(begins_like_volume("VO"));
    CHECK_FALSE(begins_like_volume("VOX\3"));
    CHECK_FALSE(begins_like_volume("vol\3"));
    CHECK_FALSE(begins_like_volume(" VOL"));
}

TEST_CASE("volume: another format or version is refused") {
    Header header;
    header.magic = "ply";
    CHECK(error_of(header) == "file: byte 0: not a VOL file, expected 'VOL' at its start");
    for (unsigned char version : {0, 2, 4, 255}) {
        header = Header();
        header.version = version;
        CHECK(error_of(header) == "file: byte 3: VOL version " + std::to_string(version) + ", expected 3");
    }
}

TEST_CASE("volume: other encodings and channels are refused by name") {
    const struct {
        int32_t encoding;
        const char *shown;
    } encodings[] = {{0, "0"}, {2, "2 (float16)"}, {3, "3 (uint8)"},        {4, "4 (quantised directions)"},
                     {5, "5"}, {-1, "-1"},         {0x01000000, "16777216"}};
    for (const auto &[encoding, shown] : encodings) {
        Header header;
        header.encoding = encoding;
        CHECK(error_of(header) == std::string("file: byte 4: encoding ") + shown + ", expected 1 (float32)");
    }
    const struct {
        int32_t channels;
        const char *shown;
    } several[] = {{0, "0 channels"}, {2, "2 channels"}, {3, "3 channels (colour)"}, {-1, "-1 channels"}};
    for (const auto &[channels, shown] : several) {
        Header header;
        header.channels = channels;
        CHECK(error_of(header) == std::string("file: byte 20: ") + shown + ", expected 1 (density)");
    }
}

TEST_CASE("volume: a grid without cells is refused") {
    for (int32_t cells : {0, -1, std::numeric_limits<int32_t>::min()}) {
        const std::string wrong = ": " + std::to_string(cells) + " cells along ";
        CHECK(error_of(with_cells(cells, 3, 1)) == "file: byte 8" + wrong + "x, expected 1 or more");
        CHECK(error_of(with_cells(2, cells, 1)) == "file: byte 12" + wrong + "y, expected 1 or more");
        CHECK(error_of(with_cells(2, 3, cells)) == "file: byte 16" + wrong + "z, expected 1 or more");
    }
}

TEST_CASE("volume: a box that is empty or without bounds is refused") {
    const std::string axes = "xyz";
    for (size_t i = 0; i < 6; ++i) {
        const std::string at = "file: byte " + std::to_string(24 + 4 * i) + ": the box is ";
        for (float number : {infinity, -infinity, not_a_number})
            CHECK(error_of(with_box(i, number)) ==
                  at + "not finite along " + axes[i % 3] + ", expected finite numbers");
        if (i < 3) continue;
        const float low = Header().box[i - 3];
        for (float number : {low, low - 1})
            CHECK(error_of(with_box(i, number)) ==
                  at + "empty along " + axes[i % 3] + ", expected its end above its start");
    }
}

TEST_CASE("volume: a sample that is no density is refused with its number and place") {
    for (size_t i = 0; i < sound_samples.size(); ++i) {
        const std::string at = "file: byte " + std::to_string(header_size + 4 * i) + ": sample " + std::to_string(i);
        const auto error_with = [i](float number) {
            std::vector<float> samples = sound_samples;
            samples[i] = number;
            return error_of(vol(Header(), samples));
        };
        for (float number : {-1e-45f, -1.0f}) CHECK(error_with(number) == at + " is negative, expected 0 or more");
        for (float number : {infinity, -infinity, not_a_number})
            CHECK(error_with(number) == at + " is not finite, expected 0 or more");
        CHECK(error_with(-0.0f) == "no error");
    }
}

TEST_CASE("volume: every truncation is refused, and so is what follows the last sample") {
    const std::string whole = vol();
    CHECK(error_of("") == "file: byte 0: the file ends, expected 3 bytes");
    CHECK(error_of(whole.substr(0, 3)) == "file: byte 3: the file ends, expected a number of 1 bytes");
    CHECK(error_of(whole.substr(0, 47)) == "file: byte 44: the file ends, expected a number of 4 bytes");
    for (size_t size = 0; size < header_size; ++size) {
        CAPTURE(size);
        CHECK(error_of(whole.substr(0, size)).find(": the file ends, expected ") != std::string::npos);
    }
    for (size_t size = header_size; size < whole.size() + 30; ++size) {
        if (size == whole.size()) continue;
        std::string changed = whole;
        changed.resize(size);
        CHECK(error_of(changed) == "file: byte 48: " + std::to_string(size - header_size) +
                                       " bytes of samples, expected 2 x 3 x 1 samples of 4 bytes");
    }
}

TEST_CASE("volume: dimensions beyond the file are refused before memory is taken, also where their product overflows") {
    const int32_t most = std::numeric_limits<int32_t>::max(), k64 = 1 << 16, half = 1 << 30;
    const std::vector<float> none;
    const Header headers[] = {with_cells(most, 1, 1),       with_cells(1, most, 1),  with_cells(1, 1, most),
                              with_cells(most, most, most), with_cells(k64, k64, 1), // 2^32 samples
                              with_cells(half, half, 16),                            // 2^64 samples
                              with_cells(half, half, 4),                             // 2^64 bytes
                              with_cells(1, half, half)};
    for (const Header &header : headers) {
        const std::string wanted = std::to_string(header.nx) + " x " + std::to_string(header.ny) + " x " +
                                   std::to_string(header.nz) + " samples of 4 bytes";
        CHECK(error_of(vol(header)) == "file: byte 48: 24 bytes of samples, expected " + wanted);
        CHECK(error_of(vol(header, none)) == "file: byte 48: 0 bytes of samples, expected " + wanted);
    }
}

TEST_CASE("volume: random changes of bytes are an error or the grid that they spell") {
    uint64_t state = 1;
    const auto random = [&state](size_t below) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return static_cast<size_t>((state >> 33) % below);
    };
    const std::string whole = vol();
    for (int round = 0; round < 20000; ++round) {
        std::string changed = whole;
        for (size_t changes = 1 + random(3); changes > 0; --changes)
            changed[random(changed.size())] = static_cast<char>(random(256));
        CHECK(fuzz_volume(data_of(changed), changed.size()) == 0);
    }
}

TEST_CASE("volume: a real file gives the known grid") {
    WISP_NEEDS_DATA("volumes/plume.vol");
    const std::string path = data_path("volumes/plume.vol");
    const Bytes bytes = read_file(path);
    CHECK(is_volume(bytes.data(), bytes.size()));
    const Volume volume = parse_volume(path, bytes.data(), bytes.size());
    CHECK(volume.nx == 64);
    CHECK(volume.ny == 128);
    CHECK(volume.nz == 64);
    CHECK(volume.low == std::array<double, 3>{-0.5, 0, -0.5});
    CHECK(volume.high == std::array<double, 3>{0.5, 2, 0.5});
    REQUIRE(volume.density.size() == 64 * 128 * 64);
    // Read by an independent script.
    const auto at = [&volume](size_t x, size_t y, size_t z) { return volume.density[(z * 128 + y) * 64 + x]; };
    const auto largest = std::max_element(volume.density.begin(), volume.density.end());
    CHECK(*largest == 1);
    CHECK(largest == volume.density.begin() + 279586);
    CHECK(at(34, 16, 34) == 1);
    CHECK(at(32, 20, 32) == 0.42121419310569763f);
    CHECK(at(32, 100, 32) == 0.06611641496419907f);
    CHECK(std::count(volume.density.begin(), volume.density.end(), 0.0f) == 64 * 128 * 64 - 128250);
    CHECK(std::accumulate(volume.density.begin(), volume.density.end(), 0.0) == 5674.272686463163);
}
