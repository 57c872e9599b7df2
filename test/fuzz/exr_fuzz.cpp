// Any bytes read as an EXR give an error of one line, or a picture that is written and read again with every bit; and a
// text that is taken out of them can be put back.
#include "host/base/error.h"
#include "host/images/exr.h"
#include <cstdlib>
#include <cstring>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

void promise_line(const wisp::InputError &error) {
    const std::string line = error.what();
    promise(line.rfind("name: byte ", 0) == 0);
    promise(line.find(", expected ") != std::string::npos);
    promise(line.find('\n') == std::string::npos);
}

void parse(const wisp::Bytes &bytes) {
    try {
        const wisp::Picture picture = wisp::parse_exr(bytes, "name");
        promise(picture.width >= 1 && picture.width <= wisp::max_side);
        promise(picture.height >= 1 && picture.height <= wisp::max_side);
        const size_t values = 3 * static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height);
        promise(picture.rgb.size() == values);
        const wisp::Picture again = wisp::parse_exr(wisp::exr_bytes(picture), "again");
        promise(again.width == picture.width && again.height == picture.height);
        promise(std::memcmp(again.rgb.data(), picture.rgb.data(), values * sizeof(float)) == 0);
    } catch (const wisp::InputError &error) {
        promise_line(error);
    }
}

void take_text(const wisp::Bytes &bytes) {
    wisp::Bytes rest = bytes;
    try {
        const auto text = wisp::take_exr_text(rest, "wisp", "name");
        promise(text ? wisp::add_exr_text(rest, "wisp", *text) == bytes : rest == bytes);
    } catch (const wisp::InputError &error) {
        promise_line(error);
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const wisp::Bytes bytes(data, data + size);
    parse(bytes);
    take_text(bytes);
    return 0;
}
