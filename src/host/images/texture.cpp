// A PPM is "P6", width, height and maxval as decimal numbers, a single blank, and rows of R G B from the top. Before
// each number, and before that last blank, stand any number of comments: from '#' to the end of the line.
#include "host/base/byte_reader.h"
#include "host/images/picture.h"
#include "host/images/texture.h"
#include <algorithm>
#include <array>

namespace wisp {
namespace {

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// The character that is next, or 0 at the end.
char next(const ByteReader &in) { return in.left() ? in.peek(1)[0] : '\0'; }

// Up to the end of the line, which is a blank like any.
void skip_comment(ByteReader &in) {
    if (next(in) == '#')
        while (in.left() && next(in) != '\n' && next(in) != '\r') in.bytes(1);
}

uint64_t read_number(ByteReader &in, const std::string &expected) {
    while (is_blank(next(in)) || next(in) == '#') {
        skip_comment(in);
        in.find_word();
    }
    in.bytes(0); // errors speak of the number from here on
    const std::string_view text = in.peek(20);
    uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const size_t size = static_cast<size_t>(end - text.data());
    if (text.empty()) in.fail("the file ends, expected " + expected);
    const bool ends = size == text.size() || is_blank(text[size]) || text[size] == '#';
    if (error != std::errc() || !ends) {
        const auto stop = std::find_if(text.begin(), text.end(), is_blank);
        in.fail(ByteReader::quoted(std::string(text.begin(), stop)) + ", expected " + expected);
    }
    in.bytes(size);
    return number;
}

int32_t read_side(ByteReader &in, const char *what) {
    const std::string expected = std::string("a ") + what + " from 1 to " + std::to_string(max_texture_side);
    const uint64_t side = read_number(in, expected);
    if (side < 1 || side > max_texture_side) in.fail(std::to_string(side) + ", expected " + expected);
    return static_cast<int32_t>(side);
}

void read_magic(ByteReader &in) {
    const std::string_view magic = in.peek(2);
    if (magic.size() < 2 || magic[0] != 'P' || magic[1] < '1' || magic[1] > '7')
        in.fail("not a PPM picture, expected 'P6' at its start");
    constexpr const char *kinds[] = {"a black and white picture as text",
                                     "a grey picture as text",
                                     "a picture as text",
                                     "a black and white picture",
                                     "a grey picture",
                                     "",
                                     "a PAM picture"};
    if (magic != "P6") in.fail(std::string(magic) + " (" + kinds[magic[1] - '1'] + "), expected P6 (PPM, binary)");
    in.bytes(2);
    if (in.left() && !is_blank(next(in)) && next(in) != '#') {
        in.bytes(0);
        in.fail("more than 'P6', expected a blank");
    }
}

void read_maxval(ByteReader &in) {
    const uint64_t maxval = read_number(in, "a maxval of 255");
    if (maxval != 255)
        in.fail("a maxval of " + std::to_string(maxval) + (maxval > 255 ? " (two bytes a value)" : "") +
                ", expected 255");
    skip_comment(in);
    if (!in.left()) {
        in.bytes(0);
        in.fail("the file ends, expected a blank and the texels");
    }
    in.bytes(1);
}

std::array<uint16_t, 256> linear_values() {
    std::array<uint16_t, 256> values;
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<uint16_t>(65535 * srgb_to_linear(static_cast<double>(i) / 255) + 0.5);
    return values;
}

// How much of the texels around it a texel of the next level covers, along one side, in texels of 1 / (next side).
struct Share {
    size_t first, count;
    std::array<uint64_t, 3> weights; // their sum is `side`
};

Share share_of(size_t i, size_t side) {
    const size_t half = side / 2;
    if (side == 1) return {0, 1, {1, 0, 0}};
    if (side % 2 == 0) return {2 * i, 2, {half, half, 0}};
    return {2 * i, 3, {half - i, half, i + 1}};
}

size_t halved(size_t side) { return std::max<size_t>(1, side / 2); }

// Appends the averages of the last level, width x height texels from `start` on.
void append_averages(std::vector<uint16_t> &texels, size_t start, size_t width, size_t height) {
    const uint64_t area = uint64_t{width} * height; // the sum of all weights: below 2^28, values below 2^16
    for (size_t y = 0; y < halved(height); ++y) {
        const Share rows = share_of(y, height);
        for (size_t x = 0; x < halved(width); ++x) {
            const Share columns = share_of(x, width);
            for (size_t channel = 0; channel < 3; ++channel) {
                uint64_t sum = 0;
                for (size_t j = 0; j < rows.count; ++j)
                    for (size_t i = 0; i < columns.count; ++i)
                        sum += rows.weights[j] * columns.weights[i] *
                               texels[start + 3 * ((rows.first + j) * width + columns.first + i) + channel];
                texels.push_back(static_cast<uint16_t>((sum + area / 2) / area));
            }
        }
    }
}

} // namespace

TexturePyramid parse_texture(const Bytes &bytes, const std::string &name) {
    ByteReader in(name, bytes.data(), bytes.size(), Encoding::little_endian); // binary: errors name the byte
    read_magic(in);
    TexturePyramid texture;
    texture.width = read_side(in, "width");
    texture.height = read_side(in, "height");
    read_maxval(in);
    const size_t width = static_cast<size_t>(texture.width), height = static_cast<size_t>(texture.height);
    const size_t size = 3 * width * height;
    if (in.left() < size) {
        in.bytes(0);
        in.fail(std::to_string(in.left()) + " bytes of texels, expected " + std::to_string(width) + " x " +
                std::to_string(height) + " texels of 3 bytes");
    }

    size_t whole = size;
    texture.levels = 1;
    for (size_t w = width, h = height; w > 1 || h > 1; ++texture.levels) {
        w = halved(w);
        h = halved(h);
        whole += 3 * w * h;
    }
    texture.texels.reserve(whole);
    const std::array<uint16_t, 256> linear = linear_values();
    for (char byte : in.bytes(size)) texture.texels.push_back(linear[static_cast<uint8_t>(byte)]);
    size_t start = 0;
    for (size_t w = width, h = height; w > 1 || h > 1;) {
        append_averages(texture.texels, start, w, h);
        start += 3 * w * h;
        w = halved(w);
        h = halved(h);
    }
    return texture;
}

TexturePyramid read_texture(const std::string &path) { return parse_texture(read_file(path), path); }

} // namespace wisp
