#include "host/passes.h"
#include "host/byte_reader.h"
#include "host/options.h"
#include "host/sha256.h"
#include <cmath>

namespace wisp {

namespace {

constexpr uint64_t pixel_bytes = 3 * 4 * 8;

double to_double(const WideSum &sum) {
    return std::ldexp(static_cast<double>(sum.high), 64) + static_cast<double>(sum.low);
}

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
            picture.rgb.push_back(static_cast<float>(std::ldexp(value(channel), passes.exponent - 32)));
    return picture;
}

std::string ranges_text(const Passes &passes) {
    std::string text;
    for (const auto &[first, last] : passes.ranges) text += " " + std::to_string(first) + ":" + std::to_string(last);
    return text;
}

} // namespace

Picture mean_picture(const Passes &passes) {
    const double n = number_of(passes);
    return picture_of(passes, [n](const PixelSums::Channel &channel) { return to_double(channel.sum) / n; });
}

Picture error_picture(const Passes &passes) {
    const double n = number_of(passes);
    return picture_of(passes, [n](const PixelSums::Channel &channel) {
        const double sum = to_double(channel.sum);
        const double variance = n > 1 ? (to_double(channel.square) - sum * sum / n) / (n - 1) : 0;
        return std::sqrt(std::max(variance, 0.0) / n);
    });
}

void add_passes(Passes &passes, const Passes &more, const std::string &name) {
    if (more.scene != passes.scene || more.width != passes.width || more.height != passes.height ||
        more.samples != passes.samples || more.exponent != passes.exponent)
        throw InputError(name +
                         ": passes of another scene, size, seed, arithmetic or version, expected all of the same");
    for (const auto &[first, last] : more.ranges) {
        for (const auto &[low, high] : passes.ranges)
            if (first < high && low < last)
                throw InputError(name + ": passes" + ranges_text(more) + ", expected none of" + ranges_text(passes) +
                                 ", which are there already");
    }
    passes.ranges.insert(passes.ranges.end(), more.ranges.begin(), more.ranges.end());
    std::sort(passes.ranges.begin(), passes.ranges.end());
    for (size_t i = 1; i < passes.ranges.size();) { // ranges that touch become one: the same passes, the same file
        if (passes.ranges[i - 1].second < passes.ranges[i].first) {
            ++i;
            continue;
        }
        passes.ranges[i - 1].second = passes.ranges[i].second;
        passes.ranges.erase(passes.ranges.begin() + static_cast<ptrdiff_t>(i));
    }
    for (size_t i = 0; i < passes.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            PixelSums::Channel &to = passes.pixels[i].channels[c];
            const PixelSums::Channel &from = more.pixels[i].channels[c];
            to.sum.add(from.sum.high, from.sum.low);
            to.square.add(from.square.high, from.square.low);
        }
}

Bytes passes_bytes(const Passes &passes) {
    Bytes sums;
    sums.reserve(passes.pixels.size() * pixel_bytes);
    const auto put = [&sums](uint64_t word) {
        for (int i = 0; i < 8; ++i) sums.push_back(static_cast<uint8_t>(word >> (8 * i)));
    };
    for (const PixelSums &pixel : passes.pixels)
        for (const PixelSums::Channel &channel : pixel.channels)
            for (uint64_t word : {channel.sum.low, channel.sum.high, channel.square.low, channel.square.high})
                put(word);
    const std::string about = "scene " + passes.scene + "\nsize " + std::to_string(passes.width) + " " +
                              std::to_string(passes.height) + "\nsamples " + std::to_string(passes.samples) +
                              "\nexponent " + std::to_string(passes.exponent) + "\npasses" + ranges_text(passes) + "\n";
    Sha256 digest;
    digest.update(about.data(), about.size());
    digest.update(sums.data(), sums.size());
    const std::string head = std::string("wisp passes 1\nsha256 ") + digest.finish().text + "\n" + about;
    Bytes bytes(head.begin(), head.end());
    bytes.insert(bytes.end(), sums.begin(), sums.end());
    return bytes;
}

Passes parse_passes(const Bytes &bytes, const std::string &name) {
    ByteReader reader(name, bytes.data(), bytes.size());
    if (reader.peek(14) != "wisp passes 1\n")
        throw InputError(name + ":1: not a file of passes, expected 'wisp passes 1'");
    reader.line();
    if (reader.word("sha256") != "sha256") reader.fail("expected 'sha256'");
    const std::string digest(reader.word("a SHA-256"));
    reader.end_line();
    const std::string_view rest = reader.peek(reader.left());
    if (digest != sha256(rest.data(), rest.size()).text)
        throw InputError(name + ":2: the file is damaged: its SHA-256 is another, expected " + digest);

    // What follows is as it was written.
    const auto number = [&reader](const char *what, int64_t low = 1) {
        const auto value = to_integer(std::string(reader.word(what)));
        if (!value || *value < low || *value > 0x7fffffff) reader.fail(std::string("expected ") + what);
        return *value;
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
    while (reader.find_word_in_line()) {
        const std::string range(reader.word("A:B"));
        const size_t colon = range.find(':');
        const auto first = to_integer(range.substr(0, colon));
        const auto last = colon == std::string::npos ? std::nullopt : to_integer(range.substr(colon + 1));
        if (!first || !last || *first < 0 || *first >= *last || *last > int64_t{1} << 31)
            reader.fail("'" + range + "', expected a range A:B of passes");
        if (!passes.ranges.empty() && *first <= int64_t{passes.ranges.back().second})
            reader.fail("'" + range + "', expected a range behind the one before, apart from it");
        passes.ranges.emplace_back(static_cast<uint32_t>(*first), static_cast<uint32_t>(*last));
    }
    reader.end_line();
    if (passes.ranges.empty()) reader.fail("no passes, expected some");
    const uint64_t pixels = static_cast<uint64_t>(passes.width) * static_cast<uint64_t>(passes.height);
    reader.set_encoding(Encoding::little_endian);
    reader.require(pixels, pixel_bytes, "pixels");
    if (reader.left() != pixels * pixel_bytes)
        reader.fail(std::to_string(reader.left()) + " bytes of sums, expected " + std::to_string(pixels * pixel_bytes));
    passes.pixels.resize(pixels);
    const auto word = [&reader] {
        const std::string_view eight = reader.bytes(8);
        uint64_t value = 0;
        for (int i = 7; i >= 0; --i) value = value << 8 | static_cast<uint8_t>(eight[static_cast<size_t>(i)]);
        return value;
    };
    for (PixelSums &pixel : passes.pixels)
        for (PixelSums::Channel &channel : pixel.channels)
            for (uint64_t *to : {&channel.sum.low, &channel.sum.high, &channel.square.low, &channel.square.high})
                *to = word();
    return passes;
}

} // namespace wisp
