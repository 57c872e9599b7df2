// Any bytes read as a file of passes give an error of one line, or passes that are written as the same bytes. The
// bytes behind the first two lines are also read with their right SHA-256, which random bytes would never have.
#include "host/base/error.h"
#include "host/base/sha256.h"
#include "host/results/passes.h"
#include <cstdlib>
#include <cstring>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

void read(const wisp::Bytes &bytes) {
    wisp::Passes passes;
    try {
        passes = wisp::parse_passes(bytes, "name");
    } catch (const wisp::InputError &error) {
        const std::string line = error.what();
        promise(line.rfind("name:", 0) == 0);
        promise(line.find('\n') == std::string::npos);
        return;
    }
    promise(passes.width > 0 && passes.height > 0 && passes.samples > 0 && passes.samples <= INT32_MAX);
    promise(passes.pixels.size() / static_cast<size_t>(passes.width) == static_cast<size_t>(passes.height));
    promise(!passes.ranges.empty());
    for (size_t i = 0; i < passes.ranges.size(); ++i) {
        promise(passes.ranges[i].first < passes.ranges[i].second);
        promise(i == 0 || passes.ranges[i - 1].second < passes.ranges[i].first);
    }
    const wisp::Bytes written = wisp::passes_bytes(passes);
    promise(wisp::passes_bytes(wisp::parse_passes(written, "again")) == written);
    promise(wisp::mean_picture(passes).rgb.size() == 3 * passes.pixels.size());
    promise(wisp::error_picture(passes).rgb.size() == 3 * passes.pixels.size());
    try {
        wisp::add_passes(passes, passes, "name");
        promise(false);
    } catch (const wisp::InputError &) {
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    read(wisp::Bytes(data, data + size));
    const size_t head = std::strlen("wisp passes 1\nsha256 ") + 64 + 1;
    if (size < head) return 0;
    const std::string text = std::string("wisp passes 1\nsha256 ") + wisp::sha256(data + head, size - head).text + "\n";
    wisp::Bytes bytes(text.begin(), text.end());
    bytes.insert(bytes.end(), data + head, data + size);
    read(bytes);
    return 0;
}
