#include "host/images/picture.h"
#include "host/images/texture.h"
#include "host/images/texture_readers.h"
#include <algorithm>
#include <array>

namespace wisp {

namespace {

std::array<uint16_t, 256> linear_values() {
    std::array<uint16_t, 256> values;
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<uint16_t>(65535 * srgb_to_linear(static_cast<double>(i) / 255) + 0.5);
    return values;
}

// Which texels a texel of the next level covers along one side, and how much of each, in units of 1 / (next side)
// texel.
struct Coverage {
    size_t first, count;
    std::array<uint64_t, 3> weights; // their sum is `side`
};

Coverage coverage_of(size_t i, size_t side) {
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
        const Coverage rows = coverage_of(y, height);
        for (size_t x = 0; x < halved(width); ++x) {
            const Coverage columns = coverage_of(x, width);
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
    const Texels file = is_png(bytes) ? read_png(bytes, name) : read_ppm(bytes, name);
    TexturePyramid texture;
    texture.width = file.width;
    texture.height = file.height;
    const size_t width = static_cast<size_t>(file.width), height = static_cast<size_t>(file.height);
    size_t whole = file.rgb.size();
    texture.levels = 1;
    for (size_t w = width, h = height; w > 1 || h > 1; ++texture.levels) {
        w = halved(w);
        h = halved(h);
        whole += 3 * w * h;
    }
    texture.texels.reserve(whole);
    const std::array<uint16_t, 256> linear = linear_values();
    for (const uint8_t byte : file.rgb) texture.texels.push_back(linear[byte]);
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
