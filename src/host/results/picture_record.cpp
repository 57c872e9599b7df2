#include "host/base/sha256.h"
#include "host/images/exr.h"
#include "host/results/checksummed_file.h"
#include "host/results/picture_record.h"
#include <cstdio>
#include <zlib.h>

namespace wisp {

namespace {

constexpr const char *first_line = "wisp picture 1";
constexpr const char *keyword = "wisp";
constexpr int longest_side = 65536; // as of --size
constexpr size_t chunk_frame = 12;  // bytes of a chunk beside its data: length, name, CRC; all of IEND

Bytes record_bytes(const PictureRecord &record, const Bytes &picture) {
    const auto number = [](int n) { return " " + std::to_string(n); };
    std::string lines = "scene " + record.scene + "\nsize" + number(record.width) + number(record.height) + "\ncrop" +
                        number(record.crop.x0) + number(record.crop.y0) + number(record.crop.x1) +
                        number(record.crop.y1) + "\npicture " + sha256(picture.data(), picture.size()).text + "\n";
    if (record.exposure) {
        char digits[40];
        std::snprintf(digits, sizeof digits, "%.17g", *record.exposure);
        lines += std::string("exposure ") + digits + "\n";
    }
    return checksummed_bytes(first_line, lines, {});
}

std::string record_text(const PictureRecord &record, const Bytes &picture) {
    const Bytes text = record_bytes(record, picture);
    return std::string(text.begin(), text.end());
}

Bytes with_record(const Bytes &png, const PictureRecord &record) {
    return add_png_text(png, keyword, record_text(record, png));
}

// The lines of a record up to the SHA-256 of its picture.
SavedRecord read_record(ByteReader &reader) {
    read_checksum(reader, first_line, "record of a picture");
    const auto key = [&reader](const std::string &word) {
        if (reader.word(word.c_str()) != word) reader.fail("expected '" + word + "'");
    };
    const auto number = [&reader](const char *what, int64_t low, int64_t high) {
        return static_cast<int>(read_integer(reader, what, low, high));
    };
    SavedRecord saved;
    PictureRecord &record = saved.record;
    key("scene");
    record.scene = reader.word("a SHA-256");
    key("size");
    record.width = number("a width", 1, longest_side);
    record.height = number("a height", 1, longest_side);
    key("crop");
    const char *within = "a crop within the picture";
    record.crop.x0 = number(within, 0, record.width - 1);
    record.crop.y0 = number(within, 0, record.height - 1);
    record.crop.x1 = number(within, record.crop.x0 + int64_t{1}, record.width);
    record.crop.y1 = number(within, record.crop.y0 + int64_t{1}, record.height);
    key("picture");
    saved.sha256 = reader.word("a SHA-256");
    reader.end_line();
    return saved;
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

void write_recorded(const std::string &path, const Bytes &picture, const PictureRecord &record) {
    if (record.exposure) {
        write_file(path, with_record(picture, record));
        return;
    }
    if (ends_in(path, ".exr")) {
        write_file(path, add_exr_text(picture, keyword, record_text(record, picture)));
        return;
    }
    write_file(path, picture);
    write_file(record_path(path), record_bytes(record, picture));
}

// Nothing is parsed: the record is made again, and compared with the one in the file.
std::optional<Bytes> recorded_bytes(const std::string &path, const PictureRecord &record) {
    try {
        Bytes bytes = read_plain_file(path);
        if (ends_in(path, ".exr")) {
            const auto text = take_exr_text(bytes, keyword, path);
            return text == record_text(record, bytes) ? std::optional(bytes) : std::nullopt;
        }
        if (!record.exposure) {
            if (read_plain_file(record_path(path)) != record_bytes(record, bytes)) return std::nullopt;
            return bytes;
        }
        const Bytes whole = bytes;
        const size_t size = with_record(Bytes(chunk_frame), record).size() - chunk_frame; // of the chunk
        if (whole.size() < size + chunk_frame) return std::nullopt;
        bytes.erase(bytes.end() - static_cast<ptrdiff_t>(size + chunk_frame), bytes.end() - chunk_frame);
        if (whole != with_record(bytes, record)) return std::nullopt;
        return bytes;
    } catch (const InputError &) {
        return std::nullopt; // no such file, or it cannot be read
    }
}

SavedRecord parse_record(const Bytes &bytes, const std::string &name) {
    ByteReader reader(name, bytes.data(), bytes.size());
    const SavedRecord saved = read_record(reader);
    if (reader.left() > 0) reader.fail("more bytes after the record of a .pfm, expected the end");
    return saved;
}

bool is_record(const Bytes &bytes) { return has_first_line(bytes, first_line); }

std::optional<RecordedPng> record_in_png(const Bytes &png, const std::string &name) {
    const std::string start = std::string("tEXt") + keyword + '\0';
    ByteReader chunks(name, png.data(), png.size(), Encoding::big_endian);
    chunks.bytes(8); // the signature
    while (chunks.left() > 0) {
        const size_t from = png.size() - chunks.left(), size = static_cast<size_t>(chunks.number(Scalar::u32));
        const std::string_view chunk = chunks.bytes(4 + size); // type and data
        chunks.bytes(4);                                       // CRC
        if (chunk.substr(0, 4) == "IEND") break;
        if (chunk.substr(0, start.size()) != start) continue;
        const std::string_view text = chunk.substr(start.size());
        ByteReader reader(name, reinterpret_cast<const uint8_t *>(text.data()), text.size());
        RecordedPng recorded = {read_record(reader), png};
        if (reader.word("exposure") != "exposure") reader.fail("expected 'exposure'");
        recorded.saved.record.exposure = reader.number_in_line(Scalar::f64);
        const auto begin = recorded.picture.begin() + static_cast<ptrdiff_t>(from);
        recorded.picture.erase(begin, begin + static_cast<ptrdiff_t>(chunk_frame + size));
        return recorded;
    }
    return std::nullopt;
}

std::optional<SavedRecord> take_exr_record(Bytes &exr, const std::string &path) {
    const auto text = take_exr_text(exr, keyword, path);
    if (!text) return std::nullopt;
    return parse_record(Bytes(text->begin(), text->end()), path + ": attribute " + keyword);
}

SavedRecord read_record(const std::string &path, Bytes &picture) {
    if (!ends_in(path, ".exr")) {
        const std::string beside = record_path(path);
        const SavedRecord record = parse_record(read_file(beside), beside);
        picture = read_file(path);
        return record;
    }
    picture = read_file(path);
    const auto record = take_exr_record(picture, path);
    if (!record) throw InputError(path, "no record of what it shows, expected a picture of --crop as rendered");
    return *record;
}

} // namespace wisp
