// Packed and unpacked by tinyexr. It believes what a header says of sizes and asserts what it says of types. So the
// header is read here, and tinyexr sees no other than a checked one: each chunk lies within the file, is that of its
// rows, and unpacks to the bytes that its rows have; all rows together are what a file of its size can hold. So a
// hostile file takes memory in proportion to its own size.
#include "host/base/byte_reader.h"
#include "host/base/memory.h"
#include "host/images/exr.h"
#include <array>
#include <map>
#include <memory>
#include <tinyexr.h>
#include <zlib.h>

namespace wisp {

namespace {

constexpr unsigned char magic[] = {0x76, 0x2f, 0x31, 0x01};
constexpr size_t attributes_begin = 8; // behind the magic number and the version

// How pixels may be packed: rows a chunk, and how many times the packed bytes there may be.
struct Packing {
    int rows;
    uint64_t ratio;
};
constexpr Packing packings[] = {{1, 1}, {1, 64}, {1, 1032}, {16, 1032}}; // none, RLE, ZIPS, ZIP

constexpr size_t most_channels = 1024;

struct Header {
    std::vector<EXRChannelInfo> channels; // empty: not found
    std::optional<int> packing;
    std::optional<EXRBox2i> window;
    size_t table = 0; // where the chunks' offsets begin

    int64_t width() const { return int64_t{window->max_x} - window->min_x + 1; }
    int64_t height() const { return int64_t{window->max_y} - window->min_y + 1; }
    int64_t rows() const { return packings[*packing].rows; }
    uint64_t chunks() const { return static_cast<uint64_t>((height() + rows() - 1) / rows()); }
    uint64_t row_bytes() const {
        uint64_t bytes = 0;
        for (const EXRChannelInfo &channel : channels) bytes += channel.pixel_type == TINYEXR_PIXELTYPE_HALF ? 2 : 4;
        return bytes * static_cast<uint64_t>(width());
    }
    // Of the chunk, unpacked.
    uint64_t chunk_bytes(uint64_t chunk) const {
        const int64_t first = static_cast<int64_t>(chunk) * rows();
        return row_bytes() * static_cast<uint64_t>(std::min(rows(), height() - first));
    }
};

int read_int(ByteReader &in) { return static_cast<int>(in.number(Scalar::i32)); }

// A name, and the 0 behind it.
std::string read_name(ByteReader &in) {
    constexpr size_t longest = 255;
    const std::string_view text = in.peek(longest + 1);
    const size_t size = text.find('\0');
    if (size == text.npos) in.fail("a name without an end, expected at most 255 letters and a 0");
    in.bytes(size + 1);
    return std::string(text.substr(0, size));
}

void read_start(ByteReader &in, const Bytes &bytes) {
    if (!is_exr(bytes)) in.fail("this is not an EXR, expected its magic number");
    in.bytes(sizeof magic);
    constexpr uint32_t long_names = 0x400;
    const auto version = static_cast<uint32_t>(in.number(Scalar::u32));
    if ((version & ~long_names) != 2)
        in.fail("version and flags " + std::to_string(version) +
                ", expected version 2 of one picture in rows: no tiles, no depths, no further parts");
}

std::vector<EXRChannelInfo> read_channels(ByteReader &in) {
    std::vector<EXRChannelInfo> channels;
    for (std::string name = read_name(in); !name.empty(); name = read_name(in)) {
        EXRChannelInfo channel = {};
        name.copy(channel.name, sizeof channel.name - 1);
        channel.pixel_type = read_int(in);
        if (channel.pixel_type < TINYEXR_PIXELTYPE_UINT || channel.pixel_type > TINYEXR_PIXELTYPE_FLOAT)
            in.fail("numbers of kind " + std::to_string(channel.pixel_type) +
                    ", expected 0, 1 or 2: 32-bit integers, half or float");
        in.bytes(4); // nothing that changes a value
        for (int *sampling : {&channel.x_sampling, &channel.y_sampling}) {
            *sampling = read_int(in);
            if (*sampling != 1) in.fail("a sample for " + std::to_string(*sampling) + " pixels, expected for each");
        }
        if (channels.size() == most_channels) in.fail("more channels than expected, " + std::to_string(most_channels));
        channels.push_back(channel);
    }
    return channels;
}

int read_packing(ByteReader &in) {
    const int packing = static_cast<int>(in.number(Scalar::u8));
    if (packing >= static_cast<int>(std::size(packings)))
        in.fail("pixels packed as kind " + std::to_string(packing) + ", expected 0 to 3: none, RLE, ZIPS or ZIP");
    return packing;
}

EXRBox2i read_window(ByteReader &in) {
    std::array<int, 4> ends; // least and greatest pixel
    for (int &end : ends) {
        end = read_int(in);
        if (end < -max_side || end > max_side)
            in.fail("a pixel at " + std::to_string(end) + ", expected from " + std::to_string(-max_side) + " to " +
                    std::to_string(max_side));
    }
    const int64_t width = int64_t{ends[2]} - ends[0] + 1, height = int64_t{ends[3]} - ends[1] + 1;
    if (width < 1 || height < 1 || width > max_side || height > max_side)
        in.fail(std::to_string(width) + " x " + std::to_string(height) + " pixels, expected sides from 1 to " +
                std::to_string(max_side));
    return {ends[0], ends[1], ends[2], ends[3]};
}

// Reads one attribute; those that say nothing about pixels are passed over. False at the end of the header.
bool read_attribute(ByteReader &in, Header &header) {
    const std::string name = read_name(in);
    if (name.empty()) return false;
    read_name(in); // its type
    const auto size = static_cast<uint32_t>(in.number(Scalar::u32));
    in.require(size, 1, "bytes of an attribute");
    const size_t left = in.left() - size;
    if (name == "channels")
        header.channels = read_channels(in);
    else if (name == "compression")
        header.packing = read_packing(in);
    else if (name == "dataWindow")
        header.window = read_window(in);
    else
        in.bytes(size);
    if (in.left() != left) in.fail("an attribute '" + name + "' of another size, expected that before it");
    return true;
}

Header read_header(const Bytes &bytes, const std::string &name) {
    ByteReader in(name, bytes.data(), bytes.size(), Encoding::little_endian);
    read_start(in, bytes);
    Header header;
    while (read_attribute(in, header)) continue;
    if (header.channels.empty() || !header.packing || !header.window)
        in.fail("the header ends, expected channels, compression and dataWindow");
    header.table = bytes.size() - in.left();
    in.require(header.chunks(), 8, "offsets of chunks");
    return header;
}

[[noreturn]] void fail_at(const std::string &name, size_t byte, const std::string &what) {
    throw InputError(name + ": byte " + std::to_string(byte), what);
}

// tinyexr leaves rows black that a chunk does not have.
void check_zip(const Bytes &bytes, const std::string &name, size_t at, size_t size, size_t unpacked) {
    Bytes rows(unpacked);
    uLongf length = unpacked;
    const int status = uncompress(rows.data(), &length, bytes.data() + at, size);
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    if (status != Z_OK || length != unpacked)
        fail_at(name, at, "a chunk that cannot be unpacked, expected ZIP of " + std::to_string(unpacked) + " bytes");
}

// The chunk's offset, row, size and bytes.
void check_chunk(const Bytes &bytes, const std::string &name, const Header &header, uint64_t chunk) {
    const size_t entry = header.table + 8 * chunk, first = header.table + 8 * header.chunks();
    ByteReader table(name, bytes.data() + entry, 8, Encoding::little_endian);
    const uint64_t offset = table.packed_bits(Scalar::u64);
    if (offset < first || offset > bytes.size() - 8)
        fail_at(name, entry, "a chunk that is not in the file, expected one behind the header");
    const size_t at = static_cast<size_t>(offset);
    ByteReader in(name, bytes.data() + at, bytes.size() - at, Encoding::little_endian);
    const int64_t row = read_int(in), expected = header.window->min_y + static_cast<int64_t>(chunk) * header.rows();
    if (row != expected)
        fail_at(name, at, "a chunk of row " + std::to_string(row) + ", expected row " + std::to_string(expected));
    const int64_t size = read_int(in);
    const auto most = static_cast<int64_t>(header.chunk_bytes(chunk)), least = *header.packing == 0 ? most : 1;
    if (size < least || size > most || static_cast<uint64_t>(size) > in.left())
        fail_at(name, at + 4,
                std::to_string(size) + " bytes of a chunk, expected from " + std::to_string(least) + " to " +
                    std::to_string(most) + ", and no more than are left");
    if (*header.packing >= TINYEXR_COMPRESSIONTYPE_ZIPS && size < most)
        check_zip(bytes, name, at + 8, static_cast<size_t>(size), static_cast<size_t>(most));
}

// Throws what parse_exr() throws, before anything is unpacked.
void check_pixels(const Bytes &bytes, const std::string &name, const Header &header) {
    const uint64_t unpacked = header.row_bytes() * static_cast<uint64_t>(header.height()),
                   ratio = packings[*header.packing].ratio;
    if (unpacked > ratio * bytes.size())
        fail_at(name, header.table,
                std::to_string(header.width()) + " x " + std::to_string(header.height()) +
                    " pixels, expected no more than " + std::to_string(ratio) + " times the file's bytes");
    // As channels, where half becomes float, as rows that are unpacked, and as the picture.
    const uint64_t pixels = static_cast<uint64_t>(header.width() * header.height());
    require_memory(name, "the picture", 2 * unpacked + 2 * header.chunk_bytes(0) + 3 * sizeof(float) * pixels);
    for (uint64_t chunk = 0; chunk < header.chunks(); ++chunk) check_chunk(bytes, name, header, chunk);
}

// The places of R, G and B among the channels.
std::array<size_t, 3> find_colours(const std::string &name, const Header &header) {
    std::array<size_t, 3> colours;
    for (size_t i = 0; i < 3; ++i) {
        const std::string colour(1, "RGB"[i]);
        const auto found = std::find_if(header.channels.begin(), header.channels.end(),
                                        [&](const EXRChannelInfo &channel) { return colour == channel.name; });
        if (found == header.channels.end() || found->pixel_type == TINYEXR_PIXELTYPE_UINT)
            fail_at(name, attributes_begin, "no channel " + colour + " of half or float, expected R, G and B");
        colours[i] = static_cast<size_t>(found - header.channels.begin());
    }
    return colours;
}

// tinyexr's view of what was read.
struct Unpacked {
    EXRHeader header;
    EXRImage image;
    std::vector<int> types, wanted; // of the channels' numbers, as they are and as they are to be

    explicit Unpacked(Header &checked) {
        InitEXRHeader(&header);
        InitEXRImage(&image);
        for (const EXRChannelInfo &channel : checked.channels) {
            types.push_back(channel.pixel_type);
            const bool half = channel.pixel_type == TINYEXR_PIXELTYPE_HALF;
            wanted.push_back(half ? TINYEXR_PIXELTYPE_FLOAT : channel.pixel_type);
        }
        header.channels = checked.channels.data();
        header.pixel_types = types.data();
        header.requested_pixel_types = wanted.data();
        header.num_channels = image.num_channels = static_cast<int>(types.size()); // image's: freed after an error
        header.compression_type = *checked.packing;
        header.data_window = *checked.window;
        header.header_len = static_cast<unsigned int>(checked.table - attributes_begin);
    }
};

// By their names, in whose order the format wants them.
using Channels = std::map<std::string, const float *>;

std::array<std::vector<float>, 3> planes_of(const Picture &picture) {
    std::array<std::vector<float>, 3> planes;
    for (size_t c = 0; c < 3; ++c) {
        planes[c].reserve(picture.rgb.size() / 3);
        for (size_t i = c; i < picture.rgb.size(); i += 3) planes[c].push_back(picture.rgb[i]);
    }
    return planes;
}

void put_u32(Bytes &bytes, size_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<uint8_t>(word >> shift));
}

// Where chunks are after the header has grown by so many bytes; modulo 2^64.
void move_chunks(Bytes &exr, const Header &header, uint64_t by) {
    for (size_t entry = header.table; entry < header.table + 8 * header.chunks(); entry += 8) {
        uint64_t offset = by;
        for (size_t i = 0; i < 8; ++i) offset += uint64_t{exr[entry + i]} << (8 * i);
        for (size_t i = 0; i < 8; ++i) exr[entry + i] = static_cast<uint8_t>(offset >> (8 * i));
    }
}

} // namespace

bool is_exr(const Bytes &bytes) {
    return bytes.size() >= sizeof magic && std::equal(magic, magic + sizeof magic, bytes.begin());
}

Bytes exr_bytes(const Picture &picture, const PictureLayers &layers) {
    // Channels, chunks and the file; layers are in planes already.
    require_memory("", "the EXR of a picture", (3 * picture.rgb.size() + 2 * layers.values.size()) * sizeof(float));
    const std::array<std::vector<float>, 3> rgb = planes_of(picture);
    Channels channels = {{"R", rgb[0].data()}, {"G", rgb[1].data()}, {"B", rgb[2].data()}};
    for_each_layer(picture, layers, [&](const LayerNames &names, const float *plane) {
        for (const std::string &name : names.channels) {
            channels[name] = plane;
            plane += rgb[0].size();
        }
    });
    std::vector<EXRChannelInfo> infos;
    std::vector<unsigned char *> images; // tinyexr only reads them
    for (const auto &[name, plane] : channels) {
        EXRChannelInfo info = {};
        name.copy(info.name, sizeof info.name - 1);
        infos.push_back(info);
        images.push_back(reinterpret_cast<unsigned char *>(const_cast<float *>(plane)));
    }
    std::vector<int> types(channels.size(), TINYEXR_PIXELTYPE_FLOAT);
    EXRHeader header;
    EXRImage image;
    InitEXRHeader(&header);
    InitEXRImage(&image);
    header.num_channels = image.num_channels = static_cast<int>(channels.size());
    header.channels = infos.data();
    header.pixel_types = header.requested_pixel_types = types.data();
    header.compression_type = TINYEXR_COMPRESSIONTYPE_ZIP;
    image.images = images.data();
    image.width = picture.width;
    image.height = picture.height;
    unsigned char *file = nullptr;
    const size_t size = SaveEXRImageToMemory(&image, &header, &file, nullptr);
    const std::unique_ptr<unsigned char, void (*)(void *)> freed_at_end(file, std::free);
    if (size == 0) throw Error(exit_output, "a picture that cannot be packed as EXR");
    return Bytes(file, file + size);
}

Picture parse_exr(const Bytes &bytes, const std::string &name) {
    Header header = read_header(bytes, name);
    const std::array<size_t, 3> colours = find_colours(name, header);
    check_pixels(bytes, name, header);
    Unpacked unpacked(header);
    if (LoadEXRImageFromMemory(&unpacked.image, &unpacked.header, bytes.data(), bytes.size(), nullptr) !=
        TINYEXR_SUCCESS)
        fail_at(name, header.table, "chunks that cannot be unpacked, expected pixels as the header says");
    const std::unique_ptr<EXRImage, int (*)(EXRImage *)> freed_at_end(&unpacked.image, FreeEXRImage);
    Picture picture{static_cast<int>(header.width()), static_cast<int>(header.height()), {}};
    picture.rgb.resize(static_cast<size_t>(header.width() * header.height()) * 3);
    for (size_t c = 0; c < 3; ++c) {
        const auto *channel = reinterpret_cast<const float *>(unpacked.image.images[colours[c]]);
        for (size_t i = c; i < picture.rgb.size(); i += 3) picture.rgb[i] = channel[i / 3];
    }
    return picture;
}

Bytes add_exr_text(const Bytes &exr, const std::string &attribute, const std::string &text) {
    const auto begin = exr.begin() + attributes_begin;
    const std::string start = attribute + '\0' + "string" + '\0';
    Bytes bytes(exr.begin(), begin);
    bytes.insert(bytes.end(), start.begin(), start.end());
    put_u32(bytes, text.size());
    bytes.insert(bytes.end(), text.begin(), text.end());
    const size_t added = bytes.size() - attributes_begin;
    bytes.insert(bytes.end(), begin, exr.end());
    move_chunks(bytes, read_header(bytes, "the EXR"), added);
    return bytes;
}

std::optional<std::string> take_exr_text(Bytes &exr, const std::string &attribute, const std::string &name) {
    ByteReader in(name, exr.data(), exr.size(), Encoding::little_endian);
    read_start(in, exr);
    if (read_name(in) != attribute || read_name(in) != "string") return std::nullopt;
    const std::string text(in.bytes(static_cast<uint32_t>(in.number(Scalar::u32))));
    const size_t taken = exr.size() - in.left() - attributes_begin;
    const auto begin = exr.begin() + attributes_begin;
    move_chunks(exr, read_header(exr, name), uint64_t{0} - taken);
    exr.erase(begin, begin + static_cast<ptrdiff_t>(taken));
    return text;
}

} // namespace wisp
