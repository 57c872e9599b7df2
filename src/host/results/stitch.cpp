#include "host/base/error.h"
#include "host/base/sha256.h"
#include "host/base/text.h"
#include "host/images/picture_reader.h"
#include "host/results/picture_record.h"
#include "host/results/stitch.h"
#include "wisp/settings.h"
#include <algorithm>

namespace wisp {

namespace {

struct Part {
    std::string name;
    PictureRecord record;
    Picture picture;
};

bool has(const Crop &crop, int x, int y) { return x >= crop.x0 && x < crop.x1 && y >= crop.y0 && y < crop.y1; }

Part read_part(const std::string &name) {
    Bytes bytes;
    const SavedRecord found = read_record(name, bytes);
    const Crop &crop = found.record.crop;
    Part part = {name, found.record, parse_picture(bytes, name)};
    if (sha256(bytes.data(), bytes.size()).text != found.sha256 || part.picture.width != crop.width() ||
        part.picture.height != crop.height())
        throw InputError(name, "not the picture of " + (ends_in(name, ".exr") ? "its record" : record_path(name)) +
                                   ", expected the one as rendered");
    return part;
}

void check_part(const Part &part, const std::vector<Part> &others) {
    const Crop &a = part.record.crop;
    for (const Part &other : others) {
        if (part.record.scene != other.record.scene || part.record.width != other.record.width ||
            part.record.height != other.record.height)
            throw InputError(part.name,
                             "a part of another picture than " + other.name +
                                 ": another scene, frame, size, options, arithmetic or version, expected the same");
        const Crop &b = other.record.crop;
        if (a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1)
            throw InputError(part.name, "pixel " + std::to_string(std::max(a.x0, b.x0)) + "," +
                                            std::to_string(std::max(a.y0, b.y0)) + " is in " + other.name +
                                            " too, expected parts that do not overlap");
    }
}

// Throws for the first missing pixel, in rows from the top. Its column is 0 or the right end of a part, its row 0 or
// the lower end of one.
[[noreturn]] void refuse_gap(const std::vector<Part> &parts) {
    std::vector<int> columns = {0}, rows = {0};
    for (const Part &part : parts) {
        columns.push_back(part.record.crop.x1);
        rows.push_back(part.record.crop.y1);
    }
    std::sort(columns.begin(), columns.end());
    std::sort(rows.begin(), rows.end());
    const PictureRecord &whole = parts[0].record;
    for (int y : rows)
        for (int x : columns) {
            const bool found = std::any_of(parts.begin(), parts.end(),
                                           [x, y](const Part &part) { return has(part.record.crop, x, y); });
            if (!found && x < whole.width && y < whole.height)
                throw InputError(parts[0].name, "of its picture's " + std::to_string(whole.width) + " x " +
                                                    std::to_string(whole.height) + " pixels no part has " +
                                                    std::to_string(x) + "," + std::to_string(y) + ", expected all");
        }
    throw InputError(parts[0].name, "of its picture pixels are missing, expected all");
}

} // namespace

Picture stitch(const std::vector<std::string> &names) {
    std::vector<Part> parts;
    uint64_t covered = 0;
    for (const std::string &name : names) {
        Part part = read_part(name);
        check_part(part, parts);
        covered += part.record.crop.pixels();
        parts.push_back(std::move(part));
    }
    const PictureRecord &whole = parts.at(0).record;
    if (covered != static_cast<uint64_t>(whole.width) * static_cast<uint64_t>(whole.height)) refuse_gap(parts);
    Picture picture;
    picture.width = whole.width;
    picture.height = whole.height;
    picture.rgb.resize(covered * 3); // as many as were read
    const auto row_size = [](int width) { return static_cast<size_t>(width) * 3; };
    for (const Part &part : parts) {
        const Crop &crop = part.record.crop;
        const size_t size = row_size(part.picture.width);
        for (int y = crop.y0; y < crop.y1; ++y)
            std::copy_n(part.picture.rgb.begin() + static_cast<ptrdiff_t>(static_cast<size_t>(y - crop.y0) * size),
                        size,
                        picture.rgb.begin() +
                            static_cast<ptrdiff_t>(static_cast<size_t>(y) * row_size(whole.width) + row_size(crop.x0)));
    }
    return picture;
}

} // namespace wisp
