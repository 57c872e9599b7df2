#include "host/base/sha256.h"
#include "host/results/checksummed_file.h"
#include "host/results/picture_record.h"
#include "host/base/text.h"
#include <cstdio>
#include <zlib.h>

namespace wisp {

namespace {

constexpr const char *first_line = "wisp picture 1";
constexpr const char *keyword = "wisp";
constexpr int longest_side = 65536; // as of --size
constexpr size_t chunk_frame = 12;  // bytes of a chunk beside its data: length, name, CRC; all of IEND

Bytes record_bytes(const PictureRecord &proof, const Bytes &picture) {
    const auto number = [](int n) { return " " + std::to_string(n); };
    std::string about = "scene " + proof.scene + "\nsize" + number(proof.width) + number(proof.height) + "\ncrop" +
                        number(proof.crop.x0) + number(proof.crop.y0) + number(proof.crop.x1) + number(proof.crop.y1) +
                        "\npicture " + sha256(picture.data(), picture.size()).text + "\n";
    if (proof.exposure) {
        char digits[40];
        std::snprintf(digits, sizeof digits, "%.17g", *proof.exposure);
        about += std::string("exposure ") + digits + "\n";
    }
    return seal(first_line, about, {});
}

Bytes with_record(const Bytes &png, const PictureRecord &proof) {
    const Bytes text = record_bytes(proof, png);
    return add_png_text(png, keyword, std::string(text.begin(), text.end()));
}

void put_big_endian(Bytes &bytes, uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<uint8_t>(word >> shift));
}

} // namespace

std::string record_path(const std::string &path) { return path + ".wisp"; }

Bytes add_png_text(const Bytes &png, const std::string &word, const std::string &text) {
    const std::string chunk = "tEXt" + word + '\0' + text;
    const uint8_t *data = reinterpret_cast<const uint8_t *>(chunk.data());
    Bytes bytes(png.begin(), png.end() - chunk_frame);
    put_big_endian(bytes, static_cast<uint32_t>(chunk.size() - 4));
    bytes.insert(bytes.end(), data, data + chunk.size());
    put_big_endian(bytes, static_cast<uint32_t>(crc32(0, data, static_cast<uInt>(chunk.size()))));
    bytes.insert(bytes.end(), png.end() - chunk_frame, png.end());
    return bytes;
}

void write_recorded(const std::string &path, const Bytes &picture, const PictureRecord &proof) {
    if (proof.exposure) {
        write_file(path, with_record(picture, proof));
        return;
    }
    write_file(path, picture);
    write_file(record_path(path), record_bytes(proof, picture));
}

// Nothing is parsed: the proof is made again, and must be what is there.
std::optional<Bytes> recorded_bytes(const std::string &path, const PictureRecord &proof) {
    try {
        Bytes bytes = read_plain_file(path);
        if (!proof.exposure) {
            if (read_plain_file(record_path(path)) != record_bytes(proof, bytes)) return std::nullopt;
            return bytes;
        }
        const Bytes whole = bytes;
        const size_t size = with_record(Bytes(chunk_frame), proof).size() - chunk_frame; // of the chunk
        if (whole.size() < size + chunk_frame) return std::nullopt;
        bytes.erase(bytes.end() - static_cast<ptrdiff_t>(size + chunk_frame), bytes.end() - chunk_frame);
        if (whole != with_record(bytes, proof)) return std::nullopt;
        return bytes;
    } catch (const InputError &) {
        return std::nullopt; // it is not there, or cannot be read
    }
}

PfmRecord parse_record(const Bytes &bytes, const std::string &name) {
    ByteReader reader(name, bytes.data(), bytes.size());
    unseal(reader, first_line, "proof of a picture");
    const auto key = [&reader](const std::string &word) {
        if (reader.word(word.c_str()) != word) reader.fail("expected '" + word + "'");
    };
    const auto number = [&reader](const char *what, int64_t low, int64_t high) {
        return static_cast<int>(read_integer(reader, what, low, high));
    };
    PfmRecord of;
    PictureRecord &proof = of.proof;
    key("scene");
    proof.scene = reader.word("a SHA-256");
    key("size");
    proof.width = number("a width", 1, longest_side);
    proof.height = number("a height", 1, longest_side);
    key("crop");
    const char *within = "a crop within the picture";
    proof.crop.x0 = number(within, 0, proof.width - 1);
    proof.crop.y0 = number(within, 0, proof.height - 1);
    proof.crop.x1 = number(within, proof.crop.x0 + int64_t{1}, proof.width);
    proof.crop.y1 = number(within, proof.crop.y0 + int64_t{1}, proof.height);
    key("picture");
    of.sha256 = reader.word("a SHA-256");
    reader.end_line();
    if (reader.left() > 0) reader.fail("more behind the proof of a .pfm, expected the end");
    return of;
}

} // namespace wisp
