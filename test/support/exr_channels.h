// All channels of an .exr, as tinyexr reads them.
#pragma once
#include "host/base/files.h"
#include <doctest/doctest.h>
#include <map>
#include <tinyexr.h>
#include <vector>

namespace wisp {

inline std::map<std::string, std::vector<float>> exr_channels(const Bytes &bytes) {
    EXRVersion version;
    EXRHeader header;
    EXRImage image;
    InitEXRHeader(&header);
    InitEXRImage(&image);
    REQUIRE(ParseEXRVersionFromMemory(&version, bytes.data(), bytes.size()) == TINYEXR_SUCCESS);
    REQUIRE(ParseEXRHeaderFromMemory(&header, &version, bytes.data(), bytes.size(), nullptr) == TINYEXR_SUCCESS);
    REQUIRE(LoadEXRImageFromMemory(&image, &header, bytes.data(), bytes.size(), nullptr) == TINYEXR_SUCCESS);
    std::map<std::string, std::vector<float>> channels;
    std::string before;
    for (int i = 0; i < header.num_channels; ++i) {
        CHECK(header.pixel_types[i] == TINYEXR_PIXELTYPE_FLOAT);
        const std::string name = header.channels[i].name;
        CHECK(before < name); // as the format wants them
        before = name;
        const auto *values = reinterpret_cast<const float *>(image.images[i]);
        channels[name].assign(values, values + static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    }
    FreeEXRImage(&image);
    FreeEXRHeader(&header);
    return channels;
}

} // namespace wisp
