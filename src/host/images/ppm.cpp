// A PPM is "P6", width, height and maxval as decimal numbers, a single blank, and rows of R G B from the top. Before
// each number, and before that last blank, stand any number of comments: from '#' to the end of the line. stb_image
// reads PPM as well, but it leaves missing texels uninitialised, takes any maxval, and lets the sides overflow.
#include "host/base/byte_reader.h"
#include "host/images/texture_readers.h"
#include <algorithm>

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
        in.fail("not a PPM or PNG picture, expected 'P6' or the signature of PNG at its start");
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

} // namespace

Texels read_ppm(const Bytes &bytes, const std::string &name) {
    ByteReader in(name, bytes.data(), bytes.size(), Encoding::little_endian); // binary: errors name the byte
    read_magic(in);
    Texels texels;
    texels.width = read_side(in, "width");
    texels.height = read_side(in, "height");
    read_maxval(in);
    const size_t size = 3 * static_cast<size_t>(texels.width) * static_cast<size_t>(texels.height);
    if (in.left() < size) {
        in.bytes(0);
        in.fail(std::to_string(in.left()) + " bytes of texels, expected " + std::to_string(texels.width) + " x " +
                std::to_string(texels.height) + " texels of 3 bytes");
    }
    const std::string_view rgb = in.bytes(size);
    texels.rgb.assign(rgb.begin(), rgb.end());
    return texels;
}

} // namespace wisp
