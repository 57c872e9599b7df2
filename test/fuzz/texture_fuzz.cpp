// Any bytes read as a texture give an error of one line, or a picture whose mipmap holds averages down to one texel.
#include "host/base/error.h"
#include "host/images/texture.h"
#include "host/images/texture_readers.h"
#include <algorithm>
#include <cstdlib>
#include <zlib.h>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

struct Level {
    uint64_t texels = 0, sum = 0;
    uint16_t low = 65535, high = 0;
};

Level level_of(const uint16_t *values, uint64_t texels, size_t channel) {
    Level level{texels};
    for (size_t i = channel; i < 3 * texels; i += 3) {
        level.sum += values[i];
        level.low = std::min(level.low, values[i]);
        level.high = std::max(level.high, values[i]);
    }
    return level;
}

void check(const wisp::TexturePyramid &pyramid, const wisp::Bytes &bytes) {
    const wisp::Texture texture = pyramid.view();
    promise(texture.width >= 1 && texture.width <= wisp::max_texture_side);
    promise(texture.height >= 1 && texture.height <= wisp::max_texture_side);
    promise(wisp::is_png(bytes) ||
            3 * static_cast<size_t>(texture.width) * static_cast<size_t>(texture.height) < bytes.size());
    const int longest = std::max(texture.width, texture.height);
    promise(longest >> (texture.levels - 1) == 1);
    size_t start = 0;
    Level before[3];
    for (int i = 0; i < texture.levels; ++i) {
        const uint64_t texels = static_cast<uint64_t>(std::max(1, texture.width >> i)) *
                                static_cast<uint64_t>(std::max(1, texture.height >> i));
        promise(start + 3 * texels <= pyramid.texels.size());
        for (size_t channel = 0; channel < 3; ++channel) {
            const Level level = level_of(texture.texels + start, texels, channel);
            if (i > 0) {
                const Level &last = before[channel];
                promise(last.low <= level.low && level.high <= last.high);
                // The means differ by 1/2 at most.
                const uint64_t a = level.sum * last.texels, b = last.sum * level.texels;
                promise(2 * (a > b ? a - b : b - a) <= level.texels * last.texels);
            }
            before[channel] = level;
        }
        start += 3 * texels;
    }
    promise(start == pyramid.texels.size());
}

void parse(const wisp::Bytes &bytes) {
    try {
        check(wisp::parse_texture(bytes, "name"), bytes);
    } catch (const wisp::InputError &error) {
        const std::string line = error.what();
        promise(line.rfind("name: byte ", 0) == 0);
        promise(line.find(", expected ") != std::string::npos);
        promise(line.find('\n') == std::string::npos);
    }
}

// The check sums of a PNG's chunks made right, so that changed bytes are decoded.
void repair(wisp::Bytes &bytes) {
    const auto u32 = [&](size_t at) {
        return uint32_t{bytes[at]} << 24 | uint32_t{bytes[at + 1]} << 16 | uint32_t{bytes[at + 2]} << 8 | bytes[at + 3];
    };
    for (size_t at = 8; at + 12 <= bytes.size();) {
        const size_t size = u32(at);
        if (size > bytes.size() - at - 12) return;
        const auto sum = crc32(0, bytes.data() + at + 4, static_cast<uInt>(size + 4));
        for (size_t i = 0; i < 4; ++i) bytes[at + 8 + size + i] = static_cast<uint8_t>(sum >> (24 - 8 * i));
        at += size + 12;
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    wisp::Bytes bytes(data, data + size);
    parse(bytes);
    if (wisp::is_png(bytes)) {
        repair(bytes);
        parse(bytes);
    }
    return 0;
}
