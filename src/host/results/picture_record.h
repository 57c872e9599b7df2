// Records of pictures: what a picture's file shows, and the SHA-256 of its bytes. A .png has its record in a chunk
// (tEXt `wisp`), an .exr in an attribute of that name. A .pfm holds pixels alone, so its record is a second file,
// FILE.pfm.wisp. A later run keeps the files that it would make again, and `wisp stitch` reads where each part belongs.
#pragma once
#include "host/base/files.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include <optional>
#include <string>

namespace wisp {

struct PictureRecord {
    std::string scene;                // fingerprint_of_picture()
    int width = 0, height = 0;        // of the whole picture
    Crop crop = {};                   // the pixels in the file
    std::optional<double> exposure{}; // of a .png, in stops
};

// Writes a picture, then its record: a record never describes a file that is not there.
void write_recorded(const std::string &path, const Bytes &picture, const PictureRecord &record);

// The bytes of the picture at `path` without its record; nothing unless its record is `record`, of these very bytes.
std::optional<Bytes> recorded_bytes(const std::string &path, const PictureRecord &record);

// A record as it is in a file, and the SHA-256 of the picture that it describes.
struct SavedRecord {
    PictureRecord record;
    std::string sha256;
};
// The contents of FILE.pfm.wisp. Throws InputError for another file, a damaged or truncated one, and for a crop beyond
// the picture.
SavedRecord parse_record(const Bytes &bytes, const std::string &name);
bool is_record(const Bytes &bytes); // by its first line
std::string record_path(const std::string &path);

// The record in a PNG that read_png() takes, and the bytes of the picture without it; nothing where it has none. Throws
// InputError as parse_record().
struct RecordedPng {
    SavedRecord saved;
    Bytes picture;
};
std::optional<RecordedPng> record_in_png(const Bytes &png, const std::string &name);
// The record in an .exr, which is then without it; nothing where it has none.
std::optional<SavedRecord> take_exr_record(Bytes &exr, const std::string &path);
// The record of the .pfm or .exr at `path`, and the bytes that it is to describe: those of the file without the record.
SavedRecord read_record(const std::string &path, Bytes &picture);

// The PNG with `text` in a tEXt chunk of this keyword, before the last chunk, IEND.
Bytes add_png_text(const Bytes &png, const std::string &keyword, const std::string &text);

} // namespace wisp
