// Any bytes read as a PFM give an InputError, or a picture that can be written, compared and shown.
#include "host/base/error.h"
#include "host/images/compare.h"
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    wisp::Picture picture;
    try {
        picture = wisp::parse_pfm(wisp::Bytes(data, data + size), "fuzz.pfm");
    } catch (const wisp::InputError &) {
        return 0;
    }

    const wisp::Picture again = wisp::parse_pfm(wisp::pfm_bytes(picture), "again.pfm");
    const wisp::Difference difference = wisp::compare(picture, again);
    if (difference.differing_pixels != 0 || difference.mean_flip != 0) std::abort();
    if (wisp::png_bytes(picture).empty()) std::abort();
    return 0;
}
