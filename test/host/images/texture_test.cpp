// Textures: every PPM that the format allows, and PNG, is read, sRGB becomes linear light, each level is the average of
// the one before it, and what is no such file gives one clear line.
#include "host/images/picture.h"
#include "host/images/texture.h"
#include "support/data.h"
#include "support/random_input.h"
#include "support/refusal.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <stb/stb_image_write.h>

extern "C" int fuzz_texture(const uint8_t *data, size_t size); // test/fuzz/texture_fuzz.cpp

using namespace wisp;

namespace {

Bytes bytes_of(const std::string &text) { return Bytes(text.begin(), text.end()); }

TexturePyramid parse(const std::string &text) { return parse_texture(bytes_of(text), "file"); }

std::string error_of(const std::string &text) {
    return refusal_of([&] { parse(text); });
}

const std::string texels = "abcdefghijklmnopqr"; // of 3 x 2

std::string random_picture(size_t width, size_t height, Random &random) {
    std::string text = "P6 " + std::to_string(width) + " " + std::to_string(height) + " 255\n";
    for (size_t i = 0; i < 3 * width * height; ++i) text += static_cast<char>(random.bits() % 256);
    return text;
}

// 65535 times the linear light of a byte, by the standard's formula.
double linear(double byte) {
    const double s = byte / 255;
    return 65535 * (s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

// A PNG of 8 bits a sample.
Bytes png(int width, int height, int channels, const Bytes &samples) {
    Bytes bytes;
    stbi_write_png_to_func(
        [](void *to, void *data, int size) {
            const auto *begin = static_cast<const uint8_t *>(data);
            static_cast<Bytes *>(to)->insert(static_cast<Bytes *>(to)->end(), begin, begin + size);
        },
        &bytes, width, height, channels, samples.data(), width * channels);
    return bytes;
}

} // namespace

TEST_CASE("texture: every byte becomes the nearest linear value, and the same byte again where pictures are shown") {
    std::string text = "P6 256 1 255\n";
    for (int i = 0; i < 256; ++i) text += std::string(3, static_cast<char>(i));
    const TexturePyramid texture = parse(text);
    Picture picture{256, 1, {}};
    for (size_t i = 0; i < 3 * 256; ++i) {
        CHECK(texture.texels[i] == std::lround(linear(static_cast<double>(i / 3))));
        picture.rgb.push_back(texture.texels[i] / 65535.0f);
    }
    CHECK(texture.texels[0] == 0);
    CHECK(texture.texels[3 * 255] == 65535);
    const Bytes shown = srgb_bytes(picture);
    for (size_t i = 0; i < shown.size(); ++i) CHECK(shown[i] == i / 3);
}

TEST_CASE("texture: rows from the top, R G B, and averages in linear light") {
    // 0 and 255 alone are 0 and 65535.
    const TexturePyramid texture =
        parse(std::string("P6\n4 2\n255\n") + std::string("\xff\0\0\0\xff\0\0\0\xff\0\0\0", 12) +
              std::string("\xff\0\0\0\0\0\xff\xff\xff\xff\xff\xff", 12));
    CHECK(texture.width == 4);
    CHECK(texture.height == 2);
    CHECK(texture.levels == 3);
    const uint16_t one = 65535, half = 32768, quarter = 16384, three_eighths = 24576; // rounded up
    const std::vector<uint16_t> expected = {one,
                                            0,
                                            0,
                                            0,
                                            one,
                                            0,
                                            0,
                                            0,
                                            one,
                                            0,
                                            0,
                                            0, //
                                            one,
                                            0,
                                            0,
                                            0,
                                            0,
                                            0,
                                            one,
                                            one,
                                            one,
                                            one,
                                            one,
                                            one, //
                                            half,
                                            quarter,
                                            0,
                                            half,
                                            half,
                                            49151, //
                                            half,
                                            three_eighths,
                                            three_eighths};
    CHECK(texture.texels == expected);
    const Texture view = texture.view();
    CHECK(view.texels == texture.texels.data());
    CHECK(view.width == 4);
    CHECK(view.height == 2);
    CHECK(view.levels == 3);
}

TEST_CASE("texture: where a side is odd, texels are shared out by area") {
    // Of 5 texels each of the 2 averages covers two and a half.
    const std::string w(3, '\xff'), b(3, '\0');
    const auto row = [&](const std::string &text) { return parse("P6 5 1 255\n" + text).texels[3 * 5]; };
    CHECK(row(w + b + b + b + b) == 26214); // 2/5
    CHECK(row(b + w + b + b + b) == 26214);
    CHECK(row(b + b + w + b + b) == 13107); // 1/5
    CHECK(row(b + b + b + w + w) == 0);
    const TexturePyramid column = parse("P6 1 3 255\n" + w + b + b);
    CHECK(column.levels == 2);
    CHECK(column.texels[3 * 3] == 21845);
    CHECK(column.texels.size() == 3 * 4);
    const TexturePyramid corner = parse("P6 3 3 255\n" + w + b + b + b + b + b + b + b + b);
    CHECK(corner.texels[3 * 9] == 7282); // 65535 / 9 = 7281.7
}

TEST_CASE("texture: levels have half the side, down to one texel, and the mean of the picture") {
    Random random;
    const std::pair<size_t, size_t> sizes[] = {{1, 1},   {2, 1},   {1, 7},   {3, 3},    {7, 5},  {64, 64},
                                               {63, 65}, {127, 1}, {1, 100}, {33, 200}, {96, 31}};
    for (const auto &[width, height] : sizes) {
        const std::string text = random_picture(width, height, random);
        CHECK(fuzz_texture(reinterpret_cast<const uint8_t *>(text.data()), text.size()) == 0);
        const TexturePyramid texture = parse(text);
        int levels = 1;
        for (size_t side = std::max(width, height); side > 1; side /= 2) ++levels;
        CHECK(texture.levels == levels);
        size_t start = 0;
        double mean[3] = {0, 0, 0};
        for (int level = 0; level < levels; ++level) {
            const size_t count = std::max<size_t>(1, width >> level) * std::max<size_t>(1, height >> level);
            for (size_t channel = 0; channel < 3; ++channel) {
                double sum = 0;
                for (size_t i = 0; i < count; ++i) sum += texture.texels[start + 3 * i + channel];
                if (level == 0) mean[channel] = sum / static_cast<double>(count);
                // Each level rounds each texel once.
                CHECK(std::fabs(sum / static_cast<double>(count) - mean[channel]) <= 0.5 * level + 1e-9);
            }
            start += 3 * count;
        }
        CHECK(start == texture.texels.size());
    }
}

TEST_CASE("texture: one colour stays what it is") {
    for (size_t side : {1, 2, 3, 31, 100}) {
        std::string text = "P6 " + std::to_string(side) + " " + std::to_string(side + 1) + " 255\n";
        for (size_t i = 0; i < side * (side + 1); ++i) text += "\xf0\x10\x80";
        const TexturePyramid texture = parse(text);
        for (size_t i = 3; i < texture.texels.size(); ++i) CHECK(texture.texels[i] == texture.texels[i - 3]);
    }
}

TEST_CASE("texture: comments and blanks of any kind stand in the header alone") {
    const std::vector<uint16_t> expected = parse("P6 3 2 255 " + texels).texels;
    for (const char *header : {"P6\n3 2\n255\n", "P6\t3\v2\f255\r", "P6 \r\n 3\r\n\r\n2 255\n", "P6# a\n3 2\n255\n",
                               "P6\n# 9 9 9\n#\n3 2\n255\n", "P6\n3# a\n2#b\r255\n", "P6 3 2 # a\n # b\n 255 ",
                               "P6 3 2 255# a\n", "P6 003 2 255\n"})
        CHECK(parse(header + texels).texels == expected);
    // The texels begin behind a single blank, whatever they look like.
    const TexturePyramid blanks = parse("P6 1 1 255\n\n# ");
    CHECK(blanks.texels[0] == std::lround(linear('\n')));
    CHECK(blanks.texels[1] == std::lround(linear('#')));
    CHECK(blanks.texels[2] == std::lround(linear(' ')));
    CHECK(parse("P6 3 2 255 " + texels + "more").texels == expected);
}

TEST_CASE("texture: another format is refused by name") {
    CHECK(error_of("") == "file: byte 0: not a PPM or PNG picture, expected 'P6' or the signature of PNG at its start");
    CHECK(error_of("P") ==
          "file: byte 0: not a PPM or PNG picture, expected 'P6' or the signature of PNG at its start");
    CHECK(error_of("PF\n1 1\n1.0\n") ==
          "file: byte 0: not a PPM or PNG picture, expected 'P6' or the signature of PNG at its start");
    CHECK(error_of(" P6 3 2 255\n" + texels) ==
          "file: byte 0: not a PPM or PNG picture, expected 'P6' or the signature of PNG at its start");
    CHECK(error_of("P3 1 1 255\n1 2 3\n") == "file: byte 0: P3 (a picture as text), expected P6 (PPM, binary)");
    CHECK(error_of("P5 1 1 255\na") == "file: byte 0: P5 (a grey picture), expected P6 (PPM, binary)");
    CHECK(error_of("P7\n") == "file: byte 0: P7 (a PAM picture), expected P6 (PPM, binary)");
    CHECK(error_of("P63 2 255\n" + texels) == "file: byte 2: more than 'P6', expected a blank");
}

TEST_CASE("texture: sides that are none are refused before memory is taken") {
    const std::string width = ", expected a width from 1 to 16384", height = ", expected a height from 1 to 16384";
    CHECK(error_of("P6") == "file: byte 2: the file ends" + width);
    CHECK(error_of("P6 # 3 2 255") == "file: byte 12: the file ends" + width);
    CHECK(error_of("P6 3 ") == "file: byte 5: the file ends" + height);
    CHECK(error_of("P6 0 2 255\n") == "file: byte 3: 0" + width);
    CHECK(error_of("P6 3 0 255\n") == "file: byte 5: 0" + height);
    CHECK(error_of("P6 16385 2 255\n") == "file: byte 3: 16385" + width);
    CHECK(error_of("P6 3 16385 255\n") == "file: byte 5: 16385" + height);
    CHECK(error_of("P6 18446744073709551616 2 255\n") == "file: byte 3: '18446744073709551616'" + width);
    CHECK(error_of("P6 -3 2 255\n" + texels) == "file: byte 3: '-3'" + width);
    CHECK(error_of("P6 3.0 2 255\n" + texels) == "file: byte 3: '3.0'" + width);
    CHECK(error_of("P6\n3 x\x01 255\n" + texels) == "file: byte 5: 'x\\x01'" + height);
    CHECK(error_of("P6 16384 16384 255\nabc") ==
          "file: byte 19: 3 bytes of texels, expected 16384 x 16384 texels of 3 bytes");
    CHECK(parse("P6 16384 1 255\n" + std::string(3 * 16384, 'a')).levels == 15);
}

TEST_CASE("texture: other depths and missing texels are refused") {
    CHECK(error_of("P6 3 2") == "file: byte 6: the file ends, expected a maxval of 255");
    CHECK(error_of("P6 3 2 15\n" + texels) == "file: byte 7: a maxval of 15, expected 255");
    CHECK(error_of("P6 3 2 65535\n" + texels + texels) ==
          "file: byte 7: a maxval of 65535 (two bytes a value), expected 255");
    CHECK(error_of("P6 3 2 255x" + texels) == "file: byte 7: '255xabcdefghijklmnop', expected a maxval of 255");
    CHECK(error_of("P6 3 2 255") == "file: byte 10: the file ends, expected a blank and the texels");
    CHECK(error_of("P6 3 2 255#" + texels) == "file: byte 29: the file ends, expected a blank and the texels");
    CHECK(error_of("P6 3 2 255\n") == "file: byte 11: 0 bytes of texels, expected 3 x 2 texels of 3 bytes");
    CHECK(error_of("P6 3 2 255\n" + texels.substr(1)) ==
          "file: byte 11: 17 bytes of texels, expected 3 x 2 texels of 3 bytes");
}

TEST_CASE("texture: a PNG of 1, 2, 3 or 4 channels has the texels of the PPM with the same bytes") {
    Random random;
    for (const int channels : {1, 2, 3, 4}) {
        const int width = 13, height = 7;
        std::string ppm = "P6 13 7 255\n";
        Bytes samples;
        for (int i = 0; i < width * height; ++i) {
            uint8_t sample[4];
            for (uint8_t &value : sample) value = static_cast<uint8_t>(random.bits());
            samples.insert(samples.end(), sample, sample + channels); // the last of 2 and 4 is the opacity
            for (int c = 0; c < 3; ++c) ppm += static_cast<char>(sample[channels < 3 ? 0 : c]);
        }
        CHECK(parse_texture(png(width, height, channels, samples), "file").texels == parse(ppm).texels);
    }
}

TEST_CASE("texture: empty chunks of a PNG's data change nothing") {
    const Bytes whole = png(2, 2, 3, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
    const uint8_t empty[] = {0, 0, 0, 0, 'I', 'D', 'A', 'T', 0x35, 0xaf, 0x06, 0x1e};
    Bytes more = whole;
    for (const ptrdiff_t at : {static_cast<ptrdiff_t>(whole.size()) - 12, ptrdiff_t{33}}) // after the data, and before
        more.insert(more.begin() + at, std::begin(empty), std::end(empty));
    CHECK(parse_texture(more, "file").texels == parse_texture(whole, "file").texels);

    Bytes none(whole.begin(), whole.begin() + 33);
    none.insert(none.end(), std::begin(empty), std::end(empty));
    none.insert(none.end(), whole.end() - 12, whole.end());
    CHECK(refusal_of([&] { parse_texture(none, "file"); }) == "file: byte 8: 'no IDAT', expected the chunks of a PNG");
}

TEST_CASE("texture: a PNG that is damaged gives one line or a texture") {
    Random random;
    Bytes samples;
    for (int i = 0; i < 5 * 4 * 3; ++i) samples.push_back(static_cast<uint8_t>(random.bits() % 4));
    const Bytes whole = png(5, 4, 3, samples);
    const auto error_of_changed = [&](size_t at, std::initializer_list<uint8_t> bytes) {
        Bytes changed = whole;
        std::copy(bytes.begin(), bytes.end(), changed.begin() + static_cast<std::ptrdiff_t>(at));
        return refusal_of([&] { parse_texture(changed, "file"); });
    };
    CHECK(error_of_changed(0, {0x89}) == "no error");
    CHECK(error_of_changed(8, {0, 0, 0, 12}) == "file: byte 8: a chunk of 12 bytes, expected the 13 of a header");
    CHECK(error_of_changed(12, {'i'}) == "file: byte 12: chunk 'iHDR', expected 'IHDR'");
    CHECK(error_of_changed(16, {0, 0, 0x40, 1}) == "file: byte 16: 16385, expected a width from 1 to 16384");
    CHECK(error_of_changed(20, {0, 0, 0, 0}) == "file: byte 20: 0, expected a height from 1 to 16384");
    CHECK(error_of_changed(24, {16}) == "file: byte 24: 16 bits a value, expected at most 8");
    CHECK(error_of_changed(16, {0, 0, 0x40, 0, 0, 0, 0x40, 0}) ==
          "file: byte 24: 16384 x 16384 texels, expected no more than 256 times the file's bytes");
    CHECK(error_of_changed(25, {7}) == "file: byte 29: a check sum that is wrong, expected that of chunk 'IHDR'");
    CHECK(error_of_changed(33, {0x40, 0, 0, 0})
              .rfind("file: byte 33: 1073741832 bytes of a chunk, expected at most ", 0) == 0);
    CHECK(error_of_changed(whole.size() - 8, {'X'}) ==
          "file: byte " + std::to_string(whole.size() - 4) +
              ": a check sum that is wrong, expected that of chunk 'XEND'");

    for (size_t size = 0; size <= whole.size(); ++size) CHECK(fuzz_texture(whole.data(), size) == 0);
    for (int round = 0; round < 20000; ++round) {
        Bytes changed = whole;
        for (size_t changes = 1 + random.bits() % 3; changes > 0; --changes)
            changed[random.bits() % changed.size()] = static_cast<uint8_t>(random.bits());
        CHECK(fuzz_texture(changed.data(), changed.size()) == 0);
    }
}

TEST_CASE("texture: a damaged file gives one line or a texture") {
    Random random;
    const std::string whole = "P6\n# a\n3 2\n255\n" + texels;
    for (size_t size = 0; size <= whole.size(); ++size)
        CHECK(fuzz_texture(reinterpret_cast<const uint8_t *>(whole.data()), size) == 0);
    for (int round = 0; round < 20000; ++round) {
        std::string changed = whole;
        for (size_t changes = 1 + random.bits() % 3; changes > 0; --changes)
            changed[random.bits() % changed.size()] = static_cast<char>(random.bits() % 256);
        CHECK(fuzz_texture(reinterpret_cast<const uint8_t *>(changed.data()), changed.size()) == 0);
    }
}

TEST_CASE("texture: real pictures") {
    WISP_NEEDS_DATA("bart");
    const std::string folder = data_path("bart");
    size_t pictures = 0;
    for (const auto &entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.path().extension() != ".ppm") continue;
        CAPTURE(entry.path());
        const TexturePyramid texture = read_texture(entry.path().string());
        const Bytes bytes = read_file(entry.path().string());
        // All have this header, and some a byte behind their texels.
        const std::string header =
            "P6\n" + std::to_string(texture.width) + " " + std::to_string(texture.height) + "\n255\n";
        REQUIRE(std::equal(header.begin(), header.end(), bytes.begin()));
        const size_t size = 3 * static_cast<size_t>(texture.width) * static_cast<size_t>(texture.height);
        for (size_t i : {size_t{0}, size / 2, size - 1})
            CHECK(texture.texels[i] == std::lround(linear(bytes[header.size() + i])));
        CHECK(fuzz_texture(bytes.data(), bytes.size()) == 0);
        ++pictures;
    }
    CHECK(pictures == 52);
}
