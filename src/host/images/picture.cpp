// Floats move as bits wherever they are stored, so that NaN payloads and -0 survive and byte order never matters.
#include "core/numbers/elementary.h"
#include "host/base/byte_reader.h"
#include "host/base/error.h"
#include "host/images/pfm_writer.h"
#include "host/images/picture.h"
#include <algorithm>
#include <array>
#include <cstring>
#include <stb/stb_image_write.h>

namespace wisp {
namespace {

int read_side(ByteReader &reader, const char *what) {
    const std::string expected = std::string("a ") + what + " from 1 to " + std::to_string(max_side);
    const uint64_t side = reader.count(expected.c_str());
    if (side < 1 || side > max_side) reader.fail(std::to_string(side) + ", expected " + expected);
    return static_cast<int>(side);
}

// 1 or -1, written as 1, -1.0, -1.000000 ...: other scales have no agreed meaning.
bool read_little_endian(ByteReader &reader) {
    const std::string_view scale = reader.word("a scale of 1.0 or -1.0");
    const bool negative = scale[0] == '-';
    const std::string_view size = scale.substr(negative ? 1 : 0);
    const bool is_one = size == "1" || (size.substr(0, 2) == "1." && size.find_first_not_of('0', 2) == size.npos);
    if (!is_one) reader.fail(ByteReader::quoted(scale) + ", expected a scale of 1.0 or -1.0");
    return negative;
}

// As write_pfm().
template <class Value> Bytes pfm_of(int width, int height, size_t channels, Value value) {
    Bytes bytes;
    bytes.reserve(64 + 4 * channels * static_cast<size_t>(width) * static_cast<size_t>(height));
    write_pfm(width, height, channels, value,
              [&bytes](const char *data, size_t size) { bytes.insert(bytes.end(), data, data + size); });
    return bytes;
}

// The linear value from which byte k + 1 is shown instead of k, for k = 0..254: there 255 sRGB(L) = k + 1/2.
std::array<double, 255> srgb_thresholds() {
    std::array<double, 255> thresholds;
    for (int k = 0; k < 255; ++k) thresholds[k] = srgb_to_linear((k + 0.5) / 255);
    return thresholds;
}

// 2^x, exact for whole x.
double power_of_two(double x) {
    const int whole = static_cast<int>(x);
    return scale_pow2(exp((x - whole) * 0.69314718055994531), whole); // ln 2
}

} // namespace

Bytes pfm_bytes(const Picture &picture) {
    return pfm_of(picture.width, picture.height, 3, [&](size_t i) { return picture.rgb[i]; });
}

Bytes pfm_bytes(int width, int height, const float *planes, size_t channels) {
    const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    return pfm_of(width, height, channels, [=](size_t i) { return planes[i % channels * pixels + i / channels]; });
}

Picture parse_pfm(const Bytes &bytes, const std::string &name) {
    ByteReader reader(name, bytes.data(), bytes.size(), Encoding::little_endian); // binary: errors name the byte
    if (!is_pfm(bytes)) reader.fail("this is not a PFM picture, expected PF or Pf");
    const std::string_view kind = reader.peek(2);
    reader.bytes(kind.size());
    Picture picture;
    picture.width = read_side(reader, "width");
    picture.height = read_side(reader, "height");
    const bool little = read_little_endian(reader);
    reader.bytes(1); // the end of the line

    const size_t channels = kind == "PF" ? 3 : 1;
    const size_t row = channels * picture.width;
    const uint64_t expected = uint64_t{4} * row * picture.height;
    const std::string_view rows = reader.bytes(reader.left());
    if (rows.size() != expected)
        reader.fail(std::to_string(rows.size()) + " bytes of pixels, expected " + std::to_string(expected));
    const uint8_t *source = reinterpret_cast<const uint8_t *>(rows.data());

    const size_t values = size_t{3} * picture.width; // of a row in memory
    picture.rgb.resize(values * picture.height);
    for (size_t i = 0; i < picture.rgb.size(); ++i) {
        const size_t from_bottom = picture.height - 1 - i / values;
        const uint8_t *b = source + 4 * (from_bottom * row + i % values * channels / 3);
        uint32_t bits = 0;
        for (int k = 0; k < 4; ++k) bits |= uint32_t{b[k]} << (little ? 8 * k : 24 - 8 * k);
        std::memcpy(&picture.rgb[i], &bits, 4);
    }
    return picture;
}

bool is_pfm(const Bytes &bytes) { return bytes.size() >= 2 && bytes[0] == 'P' && (bytes[1] == 'F' || bytes[1] == 'f'); }

Picture read_pfm(const std::string &path) { return parse_pfm(read_file(path), path); }

double srgb_to_linear(double s) { return s <= 0.04045 ? s / 12.92 : exp(2.4 * log((s + 0.055) / 1.055)); }

Bytes srgb_bytes(const Picture &picture, double exposure) {
    const std::array<double, 255> thresholds = srgb_thresholds();
    const double scale = power_of_two(exposure);
    Bytes bytes(picture.rgb.size());
    for (size_t pixel = 0; pixel < bytes.size(); pixel += 3) {
        bool has_nan = false;
        for (size_t i = pixel; i < pixel + 3; ++i) {
            const double shown = std::clamp(scale * picture.rgb[i], 0.0, 1.0);
            const auto passed = std::upper_bound(thresholds.begin(), thresholds.end(), shown) - thresholds.begin();
            bytes[i] = static_cast<uint8_t>(passed);
            has_nan = has_nan || shown != shown;
        }
        if (has_nan) std::copy(nan_color, nan_color + 3, bytes.begin() + pixel);
    }
    return bytes;
}

Bytes png_bytes(const Picture &picture, double exposure) {
    if (picture.rgb.size() > size_t{1} << 29) // stb_image_write counts bytes in int and doubles its buffers
        throw Error(exit_output, "a picture of " + std::to_string(picture.width) + " x " +
                                     std::to_string(picture.height) + " pixels is too large for PNG");
    const Bytes pixels = srgb_bytes(picture, exposure);
    Bytes png;
    const auto append_piece = [](void *context, void *data, int size) {
        const uint8_t *piece = static_cast<const uint8_t *>(data);
        Bytes *out = static_cast<Bytes *>(context);
        out->insert(out->end(), piece, piece + size);
    };
    if (!stbi_write_png_to_func(append_piece, &png, picture.width, picture.height, 3, pixels.data(), 0))
        throw std::bad_alloc(); // its only error
    return png;
}

} // namespace wisp
