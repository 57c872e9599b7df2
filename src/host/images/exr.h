// OpenEXR: linear light as it is. What it holds is https://openexr.com/en/latest/OpenEXRFileLayout.html.
#pragma once
#include "host/images/layers.h"
#include <optional>

namespace wisp {

bool is_exr(const Bytes &bytes); // by its first bytes

// The picture as channels B, G and R of 32-bit floats, which keep every bit, packed as ZIP, among those of its layers.
// The same bits give the same bytes. Throws Error(exit_memory).
Bytes exr_bytes(const Picture &picture, const PictureLayers &layers = {});

// An EXR as exr_bytes() or another program writes it: one part in rows, not packed or as RLE, ZIPS or ZIP, with
// channels R, G and B of half or float numbers; others are ignored. The picture is that of the data window, sides and
// places of at most max_side. Throws InputError `NAME: byte N: ...`, and Error(exit_memory).
Picture parse_exr(const Bytes &bytes, const std::string &name);

// The EXR with `text` as its first attribute, a string of that name.
Bytes add_exr_text(const Bytes &exr, const std::string &attribute, const std::string &text);

// Takes that text out again: `exr` is then what was given to add_exr_text(). Where the first attribute is another,
// nothing, and `exr` stays. Throws InputError for what is no EXR.
std::optional<std::string> take_exr_text(Bytes &exr, const std::string &attribute, const std::string &name);

} // namespace wisp
