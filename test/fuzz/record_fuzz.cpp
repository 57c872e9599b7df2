// Any bytes read as the record of a .pfm give an error of one line, or a crop within its picture. The bytes behind
// the first two lines are also read with their right SHA-256, which random bytes would never have.
#include "host/base/error.h"
#include "host/base/sha256.h"
#include "host/results/picture_record.h"
#include "wisp/settings.h"
#include <cstdlib>
#include <cstring>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

void read(const wisp::Bytes &bytes) {
    wisp::SavedRecord pfm;
    try {
        pfm = wisp::parse_record(bytes, "name");
    } catch (const wisp::InputError &error) {
        const std::string line = error.what();
        promise(line.rfind("name:", 0) == 0);
        promise(line.find('\n') == std::string::npos);
        return;
    }
    const wisp::Crop &crop = pfm.record.crop;
    promise(0 <= crop.x0 && crop.x0 < crop.x1 && crop.x1 <= pfm.record.width && pfm.record.width <= 65536);
    promise(0 <= crop.y0 && crop.y0 < crop.y1 && crop.y1 <= pfm.record.height && pfm.record.height <= 65536);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    read(wisp::Bytes(data, data + size));
    const std::string head = "wisp picture 1\nsha256 ";
    const size_t begin = head.size() + 64 + 1;
    if (size < begin) return 0;
    const std::string text = head + wisp::sha256(data + begin, size - begin).text + "\n";
    wisp::Bytes bytes(text.begin(), text.end());
    bytes.insert(bytes.end(), data + begin, data + size);
    read(bytes);
    return 0;
}
