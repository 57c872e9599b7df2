// Any bytes as a texture: one line that says what is wrong, or a picture whose averages are averages down to one texel.
#include "host/base/error.h"
#include "host/images/texture.h"
#include <algorithm>
#include <cstdlib>

namespace {

void promise(bool kept) {
    if (!kept) std::abort();
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

void check(const wisp::TexturePyramid &pyramid, size_t size) {
    const wisp::Texture texture = pyramid.view();
    promise(texture.width >= 1 && texture.width <= wisp::max_texture_side);
    promise(texture.height >= 1 && texture.height <= wisp::max_texture_side);
    promise(3 * static_cast<size_t>(texture.width) * static_cast<size_t>(texture.height) < size);
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

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const wisp::Bytes bytes(data, data + size);
    try {
        check(wisp::parse_texture(bytes, "name"), size);
    } catch (const wisp::InputError &error) {
        const std::string line = error.what();
        promise(line.rfind("name: byte ", 0) == 0);
        promise(line.find(", expected ") != std::string::npos);
        promise(line.find('\n') == std::string::npos);
    }
    return 0;
}
