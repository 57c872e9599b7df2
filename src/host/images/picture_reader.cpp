#include "host/base/error.h"
#include "host/images/exr.h"
#include "host/images/picture_reader.h"
#include "host/images/texture_readers.h"
#include <array>

namespace wisp {

namespace {

// Sides as of --size, and as much as DEFLATE can pack at best.
constexpr PngLimits picture_limits = {65536, 1032, "pixels"};

std::array<float, 256> linear_values() {
    std::array<float, 256> values;
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<float>(srgb_to_linear(static_cast<double>(i) / 255));
    return values;
}

Picture picture_of(const Texels &texels) {
    static const std::array<float, 256> linear = linear_values();
    Picture picture{texels.width, texels.height, {}};
    picture.rgb.reserve(texels.rgb.size());
    for (const uint8_t value : texels.rgb) picture.rgb.push_back(linear[value]);
    return picture;
}

} // namespace

Picture parse_picture(const Bytes &bytes, const std::string &name) {
    if (is_png(bytes)) return picture_of(read_png(bytes, name, picture_limits));
    if (is_exr(bytes)) return parse_exr(bytes, name);
    if (is_pfm(bytes)) return parse_pfm(bytes, name);
    throw InputError(name + ": byte 0", "not a picture, expected a PFM, a PNG or an EXR");
}

Picture read_picture(const std::string &path) { return parse_picture(read_file(path), path); }

} // namespace wisp
