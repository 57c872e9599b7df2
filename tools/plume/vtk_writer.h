// Legacy VTK: a line of text in front of each array of big-endian values.
#pragma once
#include "host/base/files.h"
#include <cstring>
#include <string>

namespace wisp {

inline void append(Bytes &bytes, const std::string &text) { bytes.insert(bytes.end(), text.begin(), text.end()); }
inline void append(Bytes &bytes, uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<uint8_t>(word >> shift));
}
inline void append(Bytes &bytes, double value) {
    const float rounded = static_cast<float>(value);
    uint32_t bits;
    std::memcpy(&bits, &rounded, sizeof bits);
    append(bytes, bits);
}
template <class Vector> void append_position(Bytes &bytes, const Vector &v) {
    for (const double x : {v.x, v.y, v.z}) append(bytes, x);
}

// The head of a file of `count` points, up to their positions.
inline Bytes vtk_head(const std::string &title, size_t count) {
    Bytes bytes;
    append(bytes, "# vtk DataFile Version 4.1\n" + title + "\nBINARY\nDATASET POLYDATA\nPOINTS " +
                      std::to_string(count) + " float\n");
    return bytes;
}

} // namespace wisp
