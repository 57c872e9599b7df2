// Pictures of every kind that is written.
#pragma once
#include "host/images/picture.h"

namespace wisp {

// The picture in these bytes, whose beginning decides its kind. A PFM as parse_pfm() reads it. A PNG of at most 8 bits
// a value: its sRGB values k become the linear light srgb_to_linear(k / 255), which png_bytes() writes as k again;
// opacities and gamma are ignored, grey is R = G = B. An EXR as parse_exr() reads it. Throws InputError `NAME: byte N:
// ...`, and Error(exit_memory).
Picture parse_picture(const Bytes &bytes, const std::string &name);

// parse_picture() of the file's bytes.
Picture read_picture(const std::string &path);

} // namespace wisp
