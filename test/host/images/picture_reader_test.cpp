// A picture is read as what it is, whatever its name: PFM to the bit, PNG by the exact inverse of how it is written.
#include "host/base/error.h"
#include "host/images/exr.h"
#include "host/images/picture_reader.h"
#include "support/refusal.h"
#include <doctest/doctest.h>
#include <zlib.h>

using namespace wisp;

namespace {

void put(Bytes &bytes, uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<uint8_t>(word >> shift));
}

void put_chunk(Bytes &png, const std::string &type, const Bytes &data) {
    put(png, static_cast<uint32_t>(data.size()));
    const size_t start = png.size();
    png.insert(png.end(), type.begin(), type.end());
    png.insert(png.end(), data.begin(), data.end());
    put(png, static_cast<uint32_t>(crc32(0, &png[start], static_cast<uInt>(png.size() - start))));
}

// A PNG of 8-bit RGB as another program packs it, or a header that promises what is not there.
Bytes png_of(uint32_t width, uint32_t height, const Bytes &rows) {
    Bytes png = {137, 'P', 'N', 'G', 13, 10, 26, 10}, header;
    put(header, width);
    put(header, height);
    for (const uint8_t byte : {8, 2, 0, 0, 0}) header.push_back(byte);
    put_chunk(png, "IHDR", header);
    uLongf size = compressBound(rows.size());
    Bytes packed(size);
    REQUIRE(compress2(packed.data(), &size, rows.data(), rows.size(), 9) == Z_OK);
    packed.resize(size);
    put_chunk(png, "IDAT", packed);
    put_chunk(png, "IEND", {});
    return png;
}

std::string refusal(const Bytes &bytes) {
    return refusal_of([&] { parse_picture(bytes, "x"); });
}

} // namespace

TEST_CASE("picture reader: every byte of a PNG is read as the light that is written as that byte") {
    Picture picture{16, 16, {}};
    for (int k = 0; k < 256; ++k)
        for (const int value : {k, 255 - k, k / 2})
            picture.rgb.push_back(static_cast<float>(srgb_to_linear(value / 255.0)));
    const Bytes png = png_bytes(picture);
    const Picture again = parse_picture(png, "x");
    CHECK(again.width == 16);
    CHECK(again.height == 16);
    CHECK(again.rgb == picture.rgb);
    CHECK(png_bytes(again) == png);
}

TEST_CASE("picture reader: the kind is that of the first bytes") {
    const Picture two{1, 2, {1, 0, 1, 0, 1, 0}};
    for (const Bytes &bytes : {pfm_bytes(two), png_bytes(two), exr_bytes(two)})
        CHECK(parse_picture(bytes, "x").rgb == two.rgb);
    const std::string other = "x: byte 0: not a picture, expected a PFM, a PNG or an EXR";
    CHECK(refusal({}) == other);
    CHECK(refusal({'P'}) == other);
    CHECK(refusal({'P', '6', '\n'}) == other);
    CHECK(refusal({'P', 'F', '\n'}) == "x: byte 3: the file ends, expected a width from 1 to 1000000");
}

TEST_CASE("picture reader: a large PNG of one colour, packed as well as DEFLATE can") {
    constexpr uint32_t side = 4800; // more than the texels that a texture may have
    const Picture black = parse_picture(png_of(side, side, Bytes(side * (3 * side + 1))), "x");
    CHECK(black.rgb.size() == 3 * side * side);
}

TEST_CASE("picture reader: a broken PNG is refused in one line, before it takes memory") {
    const Bytes rows(4 * 13), sound = png_of(4, 4, rows);
    CHECK(refusal(sound) == "no error");
    CHECK(refusal(png_of(65536, 65536, rows)) ==
          "x: byte 24: 65536 x 65536 pixels, expected no more than 1032 times the file's bytes");
    CHECK(refusal(png_of(65537, 1, rows)) == "x: byte 16: 65537, expected a width from 1 to 65536");
    CHECK(refusal(png_of(4, 0, rows)) == "x: byte 20: 0, expected a height from 1 to 65536");
    CHECK(refusal(png_of(4, 5, rows)) == "x: byte 8: 'not enough pixels', expected the chunks of a PNG");
    for (size_t size = 8; size < sound.size(); ++size) {
        const std::string line = refusal(Bytes(sound.begin(), sound.begin() + static_cast<ptrdiff_t>(size)));
        CHECK(line.rfind("x: byte ", 0) == 0);
        CHECK(line.find(", expected ") != std::string::npos);
    }
}
