// PFM keeps every bit and puts the bottom row first; PNG puts the top row first and rounds the sRGB curve half up; a
// PFM that is not one is refused with a reason.
#include "host/base/error.h"
#include "host/base/sha256.h"
#include "host/images/picture.h"
#include "support/temporary_folder.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <limits>
#include <zlib.h>

using namespace wisp;

namespace {

// An F, on in red; green tells the column and blue the row, from 0 at the left and the top.
Picture letter_f() {
    const char *rows[5] = {"#####.", "#.....", "####..", "#.....", "#....."};
    Picture picture{6, 5, {}};
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 6; ++x)
            for (float value : {rows[y][x] == '#' ? 1.0f : 0.0f, x / 8.0f, y / 8.0f}) picture.rgb.push_back(value);
    return picture;
}

bool same_bits(const Picture &a, const Picture &b) {
    return a.width == b.width && a.height == b.height && a.rgb.size() == b.rgb.size() &&
           std::memcmp(a.rgb.data(), b.rgb.data(), 4 * a.rgb.size()) == 0;
}

Bytes bytes_of(const std::string &text) { return Bytes(text.begin(), text.end()); }

// The line of the InputError for these bytes as x.pfm.
std::string refusal(const std::string &text) {
    try {
        parse_pfm(bytes_of(text), "x.pfm");
    } catch (const InputError &error) {
        return error.what();
    }
    return "accepted";
}

uint32_t big_endian(const uint8_t *b) { return uint32_t{b[0]} << 24 | b[1] << 16 | b[2] << 8 | b[3]; }

// Undoes a row's filter (PNG 9.2), `above` being the finished row over it.
void unfilter(int filter, uint8_t *row, const uint8_t *above, int size) {
    for (int i = 0; i < size; ++i) {
        const int a = i >= 3 ? row[i - 3] : 0, b = above[i], c = i >= 3 ? above[i - 3] : 0, p = a + b - c;
        const int pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
        const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
        const int predictions[5] = {0, a, b, (a + b) / 2, paeth};
        row[i] = static_cast<uint8_t>(row[i] + predictions[filter]);
    }
}

// The pixels of an 8-bit RGB PNG with one IDAT chunk; checks signature, chunk order, header and checksums.
Bytes decode_png(const Bytes &png, uint32_t &width, uint32_t &height) {
    const uint8_t signature[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10};
    REQUIRE(png.size() > 8);
    REQUIRE(std::memcmp(png.data(), signature, 8) == 0);
    std::string order;
    Bytes rows;
    for (size_t at = 8; at < png.size();) {
        const uint32_t size = big_endian(&png[at]);
        REQUIRE(at + 12 + size <= png.size());
        const std::string name(png.begin() + at + 4, png.begin() + at + 8);
        const uint8_t *data = &png[at] + 8;
        CHECK(crc32(0, &png[at + 4], size + 4) == big_endian(data + size));
        order += name;
        if (name == "IHDR") {
            width = big_endian(data), height = big_endian(data + 4);
            const uint8_t rgb8[5] = {8, 2, 0, 0, 0}; // depth, colour type, compression, filter, interlace
            CHECK(std::memcmp(data + 8, rgb8, 5) == 0);
        } else if (name == "IDAT") {
            uLongf room = uLongf{3} * width * height + height;
            rows.resize(room);
            REQUIRE(uncompress(rows.data(), &room, data, size) == Z_OK);
            REQUIRE(room == rows.size());
        }
        at += 12 + size;
    }
    CHECK(order == "IHDRIDATIEND");
    const int size = static_cast<int>(3 * width);
    Bytes pixels, above(size, 0);
    for (uint32_t y = 0; y < height; ++y) {
        uint8_t *row = &rows[y * (size + 1)];
        REQUIRE(row[0] <= 4);
        unfilter(row[0], row + 1, above.data(), size);
        above.assign(row + 1, row + 1 + size);
        pixels.insert(pixels.end(), above.begin(), above.end());
    }
    return pixels;
}

// 255 times the sRGB curve (IEC 61966-2-1), rounded half up.
int exact_srgb(long double linear) {
    const long double curve = linear <= 0.0031308L ? 12.92L * linear : 1.055L * std::pow(linear, 1 / 2.4L) - 0.055L;
    return static_cast<int>(std::floor(255 * curve + 0.5L));
}

int shown(float value, double exposure = 0) { return srgb_bytes(Picture{1, 1, {value, value, value}}, exposure)[0]; }

} // namespace

TEST_CASE("picture: PFM of a letter F, bottom row first, with a known SHA-256") {
    const Bytes bytes = pfm_bytes(letter_f());
    const std::string header = "PF\n6 5\n-1.0\n";
    REQUIRE(bytes.size() == header.size() + 6 * 5 * 12);
    CHECK(std::string(bytes.begin(), bytes.begin() + header.size()) == header);
    // Bottom left pixel: red on, column 0, row 4 of 8ths = 0.5.
    CHECK(Bytes(bytes.begin() + 12, bytes.begin() + 24) == Bytes{0, 0, 0x80, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0x3f});
    // Top right pixel, the last one: red off, column 5 of 8ths = 0.625, row 0.
    CHECK(Bytes(bytes.end() - 12, bytes.end()) == Bytes{0, 0, 0, 0, 0, 0, 0x20, 0x3f, 0, 0, 0, 0});
    // Computed by another program from the same definition.
    CHECK(std::string(sha256(bytes.data(), bytes.size()).text) ==
          "a0041c064991fa739c2a84c8fbe58073bef4eaa67e7e85aa087309a00f02bea3");
}

TEST_CASE("picture: planes become a PFM of grey, or of three channels") {
    const float planes[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}; // of 2 x 2 pixels
    CHECK(pfm_bytes(2, 2, planes, 3) == pfm_bytes({2, 2, {1, 5, 9, 2, 6, 10, 3, 7, 11, 4, 8, 12}}));
    const Bytes grey = pfm_bytes(2, 2, planes, 1);
    CHECK(grey.size() == std::string("Pf\n2 2\n-1.0\n").size() + 4 * 4);
    CHECK(parse_pfm(grey, "grey.pfm").rgb == std::vector<float>{1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4});
}

TEST_CASE("picture: PFM round trip keeps every bit") {
    Picture picture = letter_f();
    const uint32_t odd[] = {0x80000000, 1,          0x807fffff, 0x7f800000, 0xff800000,
                            0x7fc00001, 0xffc12345, 0x7f800001, 0x7f7fffff};
    for (size_t i = 0; i < std::size(odd); ++i) std::memcpy(&picture.rgb[7 * i], &odd[i], 4);
    CHECK(same_bits(parse_pfm(pfm_bytes(picture), "x.pfm"), picture));

    TemporaryFolder folder;
    write_file(folder.file("x.pfm"), pfm_bytes(picture));
    CHECK(same_bits(read_pfm(folder.file("x.pfm")), picture));
}

TEST_CASE("picture: PFM of other programs: both byte orders, grey, other ways to write the scale") {
    const Picture two = parse_pfm(bytes_of(std::string("PF\n1 2\n1\n") + std::string("\x3f\x80\0\0"
                                                                                     "\x40\0\0\0"
                                                                                     "\x40\x40\0\0"
                                                                                     "\x40\x80\0\0"
                                                                                     "\x40\xa0\0\0"
                                                                                     "\x40\xc0\0\0",
                                                                                     24)),
                                  "x.pfm");
    CHECK(two.width == 1);
    CHECK(two.height == 2);
    CHECK(two.rgb == std::vector<float>{4, 5, 6, 1, 2, 3}); // the file's last row is the top

    const std::string single_channel = std::string("\0\0\x80\x3f"
                                                   "\0\0\0\x40"
                                                   "\0\0\x40\x40"
                                                   "\0\0\x80\x40",
                                                   16);
    for (const char *header :
         {"Pf\n2 2\n-1.0\n", "Pf 2 2 -1\n", "Pf\n2 2\n-1.\n", "Pf\n2\n2\n-1.000000\n", "Pf\r\n2 2\r\n-1.0\n"}) {
        const Picture picture = parse_pfm(bytes_of(header + single_channel), "x.pfm");
        CHECK(picture.rgb == std::vector<float>{3, 3, 3, 4, 4, 4, 1, 1, 1, 2, 2, 2});
    }
}

TEST_CASE("picture: what is not a PFM is refused with the byte and the reason") {
    const std::string twelve(12, '\0');
    CHECK(refusal("") == "x.pfm: byte 0: this is not a PFM picture, expected PF or Pf");
    CHECK(refusal("P") == "x.pfm: byte 0: this is not a PFM picture, expected PF or Pf");
    CHECK(refusal("P6\n1 1\n255\nabc") == "x.pfm: byte 0: this is not a PFM picture, expected PF or Pf");
    CHECK(refusal("PF") == "x.pfm: byte 2: the file ends, expected a width from 1 to 1000000");
    CHECK(refusal("PF\n1\n") == "x.pfm: byte 5: the file ends, expected a height from 1 to 1000000");
    CHECK(refusal("PF\n1 1") == "x.pfm: byte 6: the file ends, expected a scale of 1.0 or -1.0");
    CHECK(refusal("PF\n# made by hand\n1 1\n-1.0\n" + twelve) ==
          "x.pfm: byte 3: '#', expected a width from 1 to 1000000");
    CHECK(refusal("PF\n-1 1\n-1.0\n" + twelve) == "x.pfm: byte 3: '-1', expected a width from 1 to 1000000");
    CHECK(refusal("PF\n1 0\n-1.0\n") == "x.pfm: byte 5: 0, expected a height from 1 to 1000000");
    CHECK(refusal("PF\n1000001 1\n-1.0\n") == "x.pfm: byte 3: 1000001, expected a width from 1 to 1000000");
    CHECK(refusal("PF\n1 99999999999999999999\n-1.0\n") ==
          "x.pfm: byte 5: '99999999999999999999', expected a height from 1 to 1000000");
    CHECK(refusal("PF\n1.5 1\n-1.0\n" + twelve) == "x.pfm: byte 3: '1.5', expected a width from 1 to 1000000");
    CHECK(refusal("PF\n1 1\n-2.0\n" + twelve) == "x.pfm: byte 7: '-2.0', expected a scale of 1.0 or -1.0");
    for (const char *scale : {"0", "-", "-.", "1.01", "--1", "nan", "1e0", "-10"})
        CHECK(refusal(std::string("PF\n1 1\n") + scale + "\n" + twelve) ==
              std::string("x.pfm: byte 7: '") + scale + "', expected a scale of 1.0 or -1.0");
    CHECK(refusal("PF\n1 1\n-1.0\n" + twelve.substr(1)) == "x.pfm: byte 12: 11 bytes of pixels, expected 12");
    CHECK(refusal("PF\n1 1\n-1.0\n" + twelve + "\n") == "x.pfm: byte 12: 13 bytes of pixels, expected 12");
    CHECK(refusal("PF\n1 1\n-1.0\n") == "x.pfm: byte 12: 0 bytes of pixels, expected 12");
    // Must not be believed: 12 TB.
    CHECK(refusal("PF\n1000000 1000000\n-1.0\n" + twelve) ==
          "x.pfm: byte 24: 12 bytes of pixels, expected 12000000000000");
    CHECK(refusal("PF\n1 1\n-1.0\n" + twelve) == "accepted");
}

TEST_CASE("picture: PNG of a letter F, top row first") {
    const Picture f = letter_f();
    uint32_t width = 0, height = 0;
    const Bytes pixels = decode_png(png_bytes(f), width, height);
    CHECK(width == 6);
    CHECK(height == 5);
    // k/8 on the sRGB curve, times 255: 0, 99.0, 136.9, 165.6, 187.5, 207.0
    const uint8_t eighths[6] = {0, 99, 137, 165, 188, 207};
    REQUIRE(pixels.size() == 90);
    for (int i = 0; i < 30; ++i) {
        CHECK(pixels[3 * i] == (f.rgb[3 * i] == 1 ? 255 : 0));
        CHECK(pixels[3 * i + 1] == eighths[i % 6]);
        CHECK(pixels[3 * i + 2] == eighths[i / 6]);
    }
}

TEST_CASE("picture: PNG of a larger picture holds the bytes of srgb_bytes") {
    Picture picture{61, 47, {}};
    uint32_t state = 1;
    for (int i = 0; i < 3 * 61 * 47; ++i) { // smooth in places, noisy in others: every filter of PNG is used
        state = state * 1664525 + 1013904223;
        picture.rgb.push_back(i % 1000 < 500 ? (i % 500) / 500.0f : (state >> 8) / 16777216.0f);
    }
    uint32_t width = 0, height = 0;
    CHECK(decode_png(png_bytes(picture, -0.5), width, height) == srgb_bytes(picture, -0.5));
    CHECK(width == 61);
    CHECK(height == 47);
}

TEST_CASE("picture: each of the 255 steps of the sRGB curve lies between two neighbouring floats") {
    for (int k = 0; k < 255; ++k) {
        const long double s = (k + 0.5L) / 255;
        const long double exact = s <= 0.04045L ? s / 12.92L : std::pow((s + 0.055L) / 1.055L, 2.4L);
        const float nearest = static_cast<float>(exact);
        const float below = nearest < exact ? nearest : std::nextafterf(nearest, 0);
        const float above = std::nextafterf(below, 1);
        CHECK(exact_srgb(below) == k);
        CHECK(exact_srgb(above) == k + 1);
        CHECK(shown(below) == k);
        CHECK(shown(above) == k + 1);
    }
    CHECK(shown(0) == 0);
    CHECK(shown(1) == 255);
}

TEST_CASE("picture: exposure scales by 2^EV, exactly for whole EV") {
    CHECK(shown(0.25f, 1) == exact_srgb(0.5L));
    CHECK(shown(0.25f, 0.5) == exact_srgb(0.25L * std::sqrt(2.0L)));
    CHECK(shown(0.25f, -2.5) == exact_srgb(0.0625L / std::sqrt(2.0L)));
    CHECK(shown(1, 1) == 255);
    for (int k = 17; k < 255; k += 17) { // a step stays where it is when light and exposure cancel
        const long double exact = std::pow(((k + 0.5L) / 255 + 0.055L) / 1.055L, 2.4L);
        const float nearest = static_cast<float>(exact);
        const float below = nearest < exact ? nearest : std::nextafterf(nearest, 0);
        CHECK(shown(std::ldexp(below, 20), -20) == k);
        CHECK(shown(std::ldexp(std::nextafterf(below, 1), -20), 20) == k + 1);
    }
    CHECK(shown(std::numeric_limits<float>::denorm_min(), 149) == 255);
    CHECK(shown(std::numeric_limits<float>::max(), -1000) == 0);
    CHECK(shown(0, 1000) == 0);
}

TEST_CASE("picture: srgb_to_linear at known points") {
    CHECK(srgb_to_linear(0) == 0);
    CHECK(srgb_to_linear(1) == 1);
    CHECK(srgb_to_linear(0.04045) == doctest::Approx(0.04045 / 12.92).epsilon(1e-15));
    CHECK(srgb_to_linear(0.5) == doctest::Approx(0.21404114048223255).epsilon(1e-14));
}
