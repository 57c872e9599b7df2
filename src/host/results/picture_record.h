// Proofs: what a picture's file shows, and that it is whole. Of a .png in a chunk of its own (tEXt `wisp`), of a .pfm,
// which holds pixels alone, in a second file FILE.pfm.wisp. A later run keeps what it would make again; `wisp stitch`
// learns where parts belong.
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
    Crop crop = {};                   // the part in the file
    std::optional<double> exposure{}; // of a .png, in stops
};

// Writes a picture and its proof; first the one, so that no proof ever speaks of what is not there.
void write_recorded(const std::string &path, const Bytes &picture, const PictureRecord &proof);

// The bytes of the picture at `path` without its proof, if that is `proof` and speaks of these very bytes.
std::optional<Bytes> recorded_bytes(const std::string &path, const PictureRecord &proof);

// What FILE.pfm.wisp says, for bytes with this SHA-256. Throws InputError for a file that is none, is damaged or was
// cut, and for a crop beyond the picture.
struct PfmRecord {
    PictureRecord proof;
    std::string sha256;
};
PfmRecord parse_record(const Bytes &bytes, const std::string &name);
std::string record_path(const std::string &path);

// `text` in a tEXt chunk of this keyword before the last chunk, IEND.
Bytes add_png_text(const Bytes &png, const std::string &keyword, const std::string &text);

} // namespace wisp
