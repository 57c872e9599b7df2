#include "core/numbers/sample_sums.h"
#include "host/results/passes.h"
#include <cmath>
#include <limits>

namespace wisp {

namespace {

constexpr uint64_t pixel_bytes = 3 * 4 * 8;
constexpr const char *first_line = "wisp passes 1";

double number_of(const Passes &passes) {
    double number = 0;
    for (const auto &[first, last] : passes.ranges) number += last - first;
    return number * passes.samples;
}

template <class Value> Picture picture_of(const Passes &passes, Value value) {
    Picture picture;
    picture.width = passes.width;
    picture.height = passes.height;
    for (const PixelSums &pixel : passes.pixels)
        for (const PixelSums::Channel &channel : pixel.channels)
            picture.rgb.push_back(radiance_of(value(channel), passes.exponent));
    return picture;
}

} // namespace

Picture mean_picture(const Passes &passes) {
    const double n = number_of(passes);
    return picture_of(passes, [n](const PixelSums::Channel &channel) { return to_double(channel.sum) / n; });
}

Picture error_picture(const Passes &passes) {
    const double n = number_of(passes);
    return picture_of(passes, [n](const PixelSums::Channel &channel) {
        if (n < 2) return std::numeric_limits<double>::infinity();
        const double sum = to_double(channel.sum), variance = (to_double(channel.square) - sum * sum / n) / (n - 1);
        return std::sqrt(std::max(variance, 0.0) / n);
    });
}

void add_passes(Passes &passes, const Passes &more, const std::string &name) {
    if (more.scene != passes.scene || more.width != passes.width || more.height != passes.height ||
        more.samples != passes.samples || more.exponent != passes.exponent)
        throw InputError(name,
                         "passes of another scene, size, crop, seed, arithmetic or version, expected all of the same");
    add_ranges(passes.ranges, more.ranges, "passes", name);
    for (size_t i = 0; i < passes.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            PixelSums::Channel &to = passes.pixels[i].channels[c];
            const PixelSums::Channel &from = more.pixels[i].channels[c];
            add(to.sum, from.sum.high, from.sum.low);
            add(to.square, from.square.high, from.square.low);
        }
}

Bytes passes_bytes(const Passes &passes) {
    Bytes sums;
    sums.reserve(passes.pixels.size() * pixel_bytes);
    for (const PixelSums &pixel : passes.pixels)
        for (const PixelSums::Channel &channel : pixel.channels)
            for (uint64_t word : {channel.sum.low, channel.sum.high, channel.square.low, channel.square.high})
                put_word(sums, word);
    const std::string lines = "scene " + passes.scene + "\nsize " + std::to_string(passes.width) + " " +
                              std::to_string(passes.height) + "\nsamples " + std::to_string(passes.samples) +
                              "\nexponent " + std::to_string(passes.exponent) + "\npasses" +
                              ranges_text(passes.ranges) + "\n";
    return checksummed_bytes(first_line, lines, sums);
}

Passes parse_passes(const Bytes &bytes, const std::string &name) {
    ByteReader reader(name, bytes.data(), bytes.size());
    read_checksum(reader, first_line, "file of passes");

    // The checksum was right, so the keywords need no check.
    const auto number = [&reader](const char *what, int64_t low = 1) {
        return read_integer(reader, what, low, 0x7fffffff);
    };
    Passes passes;
    reader.word("scene");
    passes.scene = reader.word("a SHA-256");
    reader.word("size");
    passes.width = static_cast<int>(number("a width"));
    passes.height = static_cast<int>(number("a height"));
    reader.word("samples");
    passes.samples = static_cast<uint32_t>(number("a number of samples"));
    reader.word("exponent");
    passes.exponent = static_cast<int32_t>(number("an exponent", -100000));
    reader.word("passes");
    passes.ranges = read_ranges(reader, "passes", int64_t{1} << 31);
    if (passes.ranges.empty()) reader.fail("no passes, expected some");
    const uint64_t pixels = static_cast<uint64_t>(passes.width) * static_cast<uint64_t>(passes.height);
    reader.set_encoding(Encoding::little_endian);
    reader.require(pixels, pixel_bytes, "pixels");
    if (reader.left() != pixels * pixel_bytes)
        reader.fail(std::to_string(reader.left()) + " bytes of sums, expected " + std::to_string(pixels * pixel_bytes));
    passes.pixels.resize(pixels);
    for (PixelSums &pixel : passes.pixels)
        for (PixelSums::Channel &channel : pixel.channels)
            for (uint64_t *to : {&channel.sum.low, &channel.sum.high, &channel.square.low, &channel.square.high})
                *to = read_word(reader);
    return passes;
}

bool is_passes(const Bytes &bytes) { return has_first_line(bytes, first_line); }

} // namespace wisp
