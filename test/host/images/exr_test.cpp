// EXR keeps every bit, as the format's description says and not as tinyexr reads it; what others write is read; what is
// broken or hostile is refused in one line.
#include "host/base/error.h"
#include "host/images/exr.h"
#include "support/exr_channels.h"
#include "support/refusal.h"
#include <cstring>
#include <doctest/doctest.h>
#include <limits>
#include <zlib.h>

using namespace wisp;

namespace {

uint32_t bits_of(float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, 4);
    return bits;
}

bool same_bits(const Picture &a, const Picture &b) {
    return a.width == b.width && a.height == b.height && a.rgb.size() == b.rgb.size() &&
           std::memcmp(a.rgb.data(), b.rgb.data(), 4 * a.rgb.size()) == 0;
}

// Smooth in places, noisy in others, with numbers of every kind.
Picture picture_of(int width, int height) {
    Picture picture{width, height, {}};
    const uint32_t odd[] = {0x80000000, 1,          0x807fffff, 0x7f800000, 0xff800000,
                            0x7fc00001, 0xffc12345, 0x7f800001, 0x7f7fffff};
    uint32_t state = 1;
    for (int i = 0; i < 3 * width * height; ++i) {
        state = state * 1664525 + 1013904223;
        float value = i % 1000 < 500 ? static_cast<float>(i % 500) / 500 : static_cast<float>(state >> 8) / 16777216;
        if (i % 7 == 0) std::memcpy(&value, &odd[i / 7 % 9], 4);
        picture.rgb.push_back(value);
    }
    return picture;
}

std::string integer(uint64_t value, int bytes = 4) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
    return text;
}

std::string attribute(const std::string &name, const std::string &type, const std::string &value) {
    return name + '\0' + type + '\0' + integer(value.size()) + value;
}

std::string channel(const std::string &name, int type, int sampling = 1) {
    return name + '\0' + integer(static_cast<uint64_t>(type)) + integer(0) + integer(static_cast<uint64_t>(sampling)) +
           integer(1);
}

// An EXR put together by hand: rows that are not packed, but as the parts say.
struct Parts {
    uint32_t version = 2;
    std::string channels = channel("B", 2) + channel("G", 2) + channel("R", 2);
    int packing = 0;
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    std::vector<std::string> rows = {integer(0x40400000) + integer(0x40000000) + integer(0x3f800000)}; // 3, 2, 1
    std::string more;                                                                                  // attributes
    bool from_the_bottom = false;

    std::string header() const {
        std::string window;
        for (const int end : {x0, y0, x1, y1}) window += integer(static_cast<uint32_t>(end));
        return "\x76\x2f\x31\x01" + integer(version) + more + attribute("channels", "chlist", channels + '\0') +
               attribute("compression", "compression", std::string(1, static_cast<char>(packing))) +
               attribute("dataWindow", "box2i", window) + attribute("lineOrder", "lineOrder", std::string(1, '\1')) +
               '\0';
    }
    Bytes bytes() const {
        std::string file = header();
        const size_t table = file.size();
        file += std::string(8 * rows.size(), '\0');
        for (size_t i = 0; i < rows.size(); ++i) {
            const size_t row = from_the_bottom ? rows.size() - 1 - i : i;
            file.replace(table + 8 * row, 8, integer(file.size(), 8));
            file += integer(static_cast<uint64_t>(y0 + static_cast<int>(row))) + integer(rows[row].size()) + rows[row];
        }
        return Bytes(file.begin(), file.end());
    }
};

std::string refusal(const Bytes &bytes) {
    return refusal_of([&] { parse_exr(bytes, "x"); });
}

uint64_t number_at(const Bytes &bytes, size_t at, size_t size) {
    uint64_t number = 0;
    for (size_t i = 0; i < size; ++i) number |= uint64_t{bytes.at(at + i)} << (8 * i);
    return number;
}

// The rows of an EXR's chunk, unpacked as the format says of ZIP, which leaves what it would make longer.
Bytes unzipped(const uint8_t *packed, size_t size, size_t room) {
    if (size == room) return Bytes(packed, packed + size);
    Bytes halves(room), rows(room);
    uLongf length = room;
    REQUIRE(uncompress(halves.data(), &length, packed, size) == Z_OK);
    REQUIRE(length == room);
    for (size_t i = 1; i < room; ++i) halves[i] = static_cast<uint8_t>(halves[i - 1] + halves[i] - 128);
    for (size_t i = 0; i < room; ++i) rows[i] = halves[i / 2 + (i % 2) * ((room + 1) / 2)];
    return rows;
}

} // namespace

TEST_CASE("exr: every bit is kept, and the same picture gives the same bytes") {
    for (const auto &[width, height] : {std::pair(1, 1), {3, 16}, {61, 47}, {5, 17}}) {
        const Picture picture = picture_of(width, height);
        const Bytes bytes = exr_bytes(picture);
        CHECK(same_bits(parse_exr(bytes, "x"), picture));
        CHECK(exr_bytes(picture) == bytes);
    }
}

TEST_CASE("exr: channels B, G and R of floats, packed as ZIP in 16 rows, as the format says") {
    const Picture picture = picture_of(21, 35);
    const Bytes bytes = exr_bytes(picture);
    const std::string text(bytes.begin(), bytes.end());
    Parts parts;
    CHECK(text.find(attribute("channels", "chlist", parts.channels + '\0')) == 8);
    CHECK(text.find(attribute("compression", "compression", "\3")) != std::string::npos);
    const std::string last = attribute("screenWindowWidth", "float", integer(0x3f800000)) + '\0';
    const size_t table = text.find(last) + last.size();
    int packed = 0;
    for (size_t chunk = 0; chunk < 3; ++chunk) {
        const size_t at = number_at(bytes, table + 8 * chunk, 8), rows = chunk < 2 ? 16 : 3;
        CHECK(number_at(bytes, at, 4) == 16 * chunk);
        const size_t size = number_at(bytes, at + 4, 4), room = 12 * 21 * rows;
        packed += size < room;
        const Bytes unpacked = unzipped(&bytes[at + 8], size, room);
        size_t wrong = 0;
        for (size_t y = 0; y < rows; ++y)
            for (size_t c = 0; c < 3; ++c)
                for (size_t x = 0; x < 21; ++x)
                    wrong += number_at(unpacked, 4 * ((3 * y + c) * 21 + x), 4) !=
                             bits_of(picture.rgb[3 * ((16 * chunk + y) * 21 + x) + 2 - c]);
        CHECK(wrong == 0);
    }
    CHECK(packed > 0);
}

TEST_CASE("exr: layers are channels in the order of their names, and every bit of them is kept") {
    const Picture picture = picture_of(7, 20), other = picture_of(5, 28);
    PictureLayers layers;
    layers.names = {layer_names()[0], layer_names()[8], layer_names()[7]}; // emission.R ..., Z, N.X ...
    layers.values.assign(other.rgb.begin(), other.rgb.end());
    for (int i = 0; i < 4 * 7 * 20; ++i) layers.values.push_back(static_cast<float>(i));
    const Bytes bytes = exr_bytes(picture, layers);
    const auto channels = exr_channels(bytes);
    CHECK(channels.size() == 10);
    size_t plane = 0;
    for (const char *name : {"emission.R", "emission.G", "emission.B", "Z", "N.X", "N.Y", "N.Z"})
        CHECK(std::memcmp(channels.at(name).data(), &layers.values[140 * plane++], 4 * 140) == 0);
    CHECK(same_bits(parse_exr(bytes, "layers.exr"), picture)); // others are ignored
}

TEST_CASE("exr: files of other programs: half numbers, more channels, any place and order of rows") {
    Parts parts;
    CHECK(parse_exr(parts.bytes(), "x").rgb == std::vector<float>{1, 2, 3});
    for (const int packing : {1, 2, 3}) { // what packing would make longer is not packed
        parts.packing = packing;
        CHECK(parse_exr(parts.bytes(), "x").rgb == std::vector<float>{1, 2, 3});
    }
    Parts half;
    half.channels = channel("A", 1) + channel("B", 1) + channel("G", 2) + channel("R", 1) + channel("z", 0);
    half.x0 = -3, half.x1 = -2, half.y0 = 5, half.y1 = 7;
    half.rows.clear();
    Picture expected{2, 3, {}};
    for (uint32_t row = 0; row < 3; ++row) { // of two pixels
        const std::string opaque = integer(0x3c003c00), infinity_and_minus_0 = integer(0x80007c00),
                          two_and_three = integer(0x40000000) + integer(0x40400000);
        half.rows.push_back(opaque + infinity_and_minus_0 + two_and_three + integer(0x00013c00 + row) + integer(7, 8));
        for (const float value :
             {1 + static_cast<float>(row) / 1024, 2.0f, std::numeric_limits<float>::infinity(), 0x1p-24f, 3.0f, -0.0f})
            expected.rgb.push_back(value);
    }
    for (const bool bottom : {false, true}) {
        half.from_the_bottom = bottom;
        CHECK(same_bits(parse_exr(half.bytes(), "x"), expected));
    }
    half.version |= 0x400; // long names
    half.more = attribute("owner", "string", "") + attribute("a name of more than thirty-one letters", "none", "x");
    CHECK(same_bits(parse_exr(half.bytes(), "x"), expected));
}

TEST_CASE("exr: what is broken or hostile is refused in one line") {
    const auto of = [](auto change) {
        Parts parts;
        change(parts);
        return refusal(parts.bytes());
    };
    CHECK(refusal({}) == "x: byte 0: this is not an EXR, expected its magic number");
    CHECK(of([](Parts &p) { p.version = 1; }) ==
          "x: byte 4: version and flags 1, expected version 2 of one picture in rows: no tiles, no depths, no further "
          "parts");
    for (const uint32_t flag : {0x200, 0x800, 0x1000})
        CHECK(of([&](Parts &p) { p.version |= flag; }).find("expected version 2") != std::string::npos);
    CHECK(of([](Parts &p) { p.packing = 4; }) ==
          "x: byte 111: pixels packed as kind 4, expected 0 to 3: none, RLE, ZIPS or ZIP");
    CHECK(of([](Parts &p) { p.channels = channel("G", 2) + channel("B", 2); }) ==
          "x: byte 8: no channel R of half or float, expected R, G and B");
    CHECK(of([](Parts &p) { p.channels = channel("R", 0) + channel("G", 2) + channel("B", 2); }) ==
          "x: byte 8: no channel R of half or float, expected R, G and B");
    CHECK(of([](Parts &p) { p.channels = channel("R", 3); }) ==
          "x: byte 30: numbers of kind 3, expected 0, 1 or 2: 32-bit integers, half or float");
    CHECK(of([](Parts &p) { p.channels = channel("R", 2, 2); }) ==
          "x: byte 38: a sample for 2 pixels, expected for each");
    CHECK(of([](Parts &p) {
              for (int i = 0; i < 1100; ++i) p.channels += channel("c", 2);
          }).find("more channels than expected, 1024") != std::string::npos);
    CHECK(of([](Parts &p) { p.channels.clear(); }).find("expected channels, compression and dataWindow") !=
          std::string::npos);
    CHECK(of([](Parts &p) { p.more = attribute("dataWindow", "box2i", std::string(17, '\0')); }) ==
          "x: byte 41: an attribute 'dataWindow' of another size, expected that before it");
    CHECK(of([](Parts &p) { p.more = std::string(300, 'n'); }) ==
          "x: byte 4: a name without an end, expected at most 255 letters and a 0");
    CHECK(of([](Parts &p) { p.x1 = -1; }).find("0 x 1 pixels, expected sides from 1 to 1000000") != std::string::npos);
    CHECK(of([](Parts &p) { p.y1 = INT32_MAX; }).find("a pixel at 2147483647, expected from -1000000 to 1000000") !=
          std::string::npos);
    CHECK(of([](Parts &p) {
              p.x0 = p.y0 = -1000000;
              p.x1 = p.y1 = 1000000;
          }).find("2000001 x 2000001 pixels, expected sides from 1 to 1000000") != std::string::npos);
    CHECK(of([](Parts &p) { p.x1 = p.y1 = 999999; }).find("1000000 offsets of chunks, expected at most 3") !=
          std::string::npos);
    CHECK(of([](Parts &p) {
              p.packing = 3;
              p.x1 = 999999;
              p.y1 = 15;
          }).find("1000000 x 16 pixels, expected no more than 1032 times the file's bytes") != std::string::npos);
    CHECK(of([](Parts &p) { p.rows[0] += "x"; }).find("13 bytes of a chunk, expected from 12 to 12") !=
          std::string::npos);
    CHECK(of([](Parts &p) {
              p.packing = 3;
              p.rows[0].clear();
          }).find("0 bytes of a chunk, expected from 1 to 12") != std::string::npos);
    CHECK(of([](Parts &p) {
              p.packing = 3;
              p.rows[0] = "no zlib";
          }).find("a chunk that cannot be unpacked, expected ZIP of 12 bytes") != std::string::npos);
    CHECK(of([](Parts &p) {
              p.packing = 3;
              p.x1 = 15;
              p.rows[0].resize(compressBound(12)); // whole, but of one pixel
              uLongf size = p.rows[0].size();
              const std::string pixel(12, '\1');
              compress(reinterpret_cast<Bytef *>(p.rows[0].data()), &size,
                       reinterpret_cast<const Bytef *>(pixel.data()), pixel.size());
              p.rows[0].resize(size);
          }).find("a chunk that cannot be unpacked, expected ZIP of 192 bytes") != std::string::npos);
    CHECK(of([](Parts &p) {
              p.packing = 1;
              p.rows[0] = std::string("\x7f\1\x7f\1", 4); // more than there is room for
          }).find("chunks that cannot be unpacked") != std::string::npos);
    // A chunk of another row, and offsets that lead elsewhere.
    const Parts one;
    Bytes bytes = one.bytes();
    const size_t table = one.header().size();
    bytes[table + 8] = 1;
    CHECK(refusal(bytes) == "x: byte " + std::to_string(table + 8) + ": a chunk of row 1, expected row 0");
    for (const uint8_t high : {uint8_t{0x10}, uint8_t{0xff}}) {
        bytes[table + 7] = high;
        CHECK(refusal(bytes) ==
              "x: byte " + std::to_string(table) + ": a chunk that is not in the file, expected one behind the header");
    }
}

TEST_CASE("exr: damaged anywhere, it is read or refused in one line") {
    const Bytes whole = add_exr_text(exr_bytes(picture_of(5, 20)), "wisp", "two\nlines");
    const auto check = [](const Bytes &bytes) {
        const std::string line = refusal(bytes);
        const bool right = line == "no error" || (line.rfind("x: byte ", 0) == 0 && line.find('\n') == line.npos &&
                                                  line.find(", expected ") != line.npos);
        CHECK(right);
        return line;
    };
    for (size_t size = 0; size < whole.size(); ++size)
        CHECK(check(Bytes(whole.begin(), whole.begin() + static_cast<ptrdiff_t>(size))) != "no error");
    for (size_t at = 0; at < whole.size(); ++at)
        for (const int flip : {1, 0x80, 0xff}) {
            Bytes bytes = whole;
            bytes[at] = static_cast<uint8_t>(bytes[at] ^ flip);
            check(bytes);
        }
}

TEST_CASE("exr: a text comes as the first attribute, and is taken out again without a trace") {
    const Picture picture = picture_of(7, 33);
    const Bytes plain = exr_bytes(picture), with = add_exr_text(plain, "wisp", "made of\nlines");
    CHECK(same_bits(parse_exr(with, "x"), picture));
    CHECK(std::string(with.begin() + 8, with.end()).find(attribute("wisp", "string", "made of\nlines")) == 0);
    Bytes bytes = with;
    CHECK(!take_exr_text(bytes, "other", "x"));
    CHECK(bytes == with);
    const auto text = take_exr_text(bytes, "wisp", "x");
    REQUIRE(text);
    CHECK(*text == "made of\nlines");
    CHECK(bytes == plain);
    CHECK(!take_exr_text(bytes, "wisp", "x"));
    Bytes cut(with.begin(), with.begin() + 40);
    CHECK_THROWS_AS(take_exr_text(cut, "wisp", "x"), InputError);
}
