// PNG (ISO/IEC 15948), decoded by stb_image, whose one place this is. The chunks are checked first, because stb_image
// believes their lengths and does not look at their check sums: each chunk lies within the file, and the sides fit a
// file of its size. So a hostile file takes memory in proportion to its own size, beyond an allowance. Chunks of data
// that are empty are legal (11.2.4) and left out: stb_image would copy the first to no address.
#include "host/base/byte_reader.h"
#include "host/base/memory.h"
#include "host/images/texture_readers.h"
#include <memory>
#include <zlib.h>

#define STBI_MALLOC  wisp::malloc_or_throw
#define STBI_REALLOC wisp::realloc_or_throw
#define STBI_FREE    std::free
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#define STBI_NO_SIMD
#define STBI_NO_LINEAR
#define STBI_MAX_DIMENSIONS 65536
#include <stb/stb_image.h>

namespace wisp {

static_assert(STBI_MAX_DIMENSIONS >= max_texture_side, "what is refused here is no more than what stb_image refuses");

namespace {

constexpr unsigned char signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

// Enough for a picture of one colour with sides of 4729.
constexpr uint64_t allowance = uint64_t{1} << 26;

// Of a texel, while it is decoded: as filtered, with opacity, without, as the caller gets it and as linear light.
constexpr uint64_t most_bytes_of_texel = 25;

uint32_t read_u32(ByteReader &in) { return static_cast<uint32_t>(in.number(Scalar::u32)); }

uint32_t read_side(ByteReader &in, const char *what, const PngLimits &limits) {
    const uint32_t side = read_u32(in);
    if (side < 1 || side > static_cast<uint32_t>(limits.side))
        in.fail(std::to_string(side) + ", expected a " + what + " from 1 to " + std::to_string(limits.side));
    return side;
}

// The header's chunk: sides, bits a value, and four bytes that stb_image looks at.
void check_header(ByteReader &in, const Bytes &bytes, const PngLimits &limits) {
    const uint32_t width = read_side(in, "width", limits), height = read_side(in, "height", limits);
    const double depth = in.number(Scalar::u8);
    if (depth == 16) in.fail("16 bits a value, expected at most 8");
    const uint64_t texels = uint64_t{width} * height;
    if (3 * texels > allowance + limits.ratio * bytes.size())
        in.fail(std::to_string(width) + " x " + std::to_string(height) + " " + limits.what +
                ", expected no more than " + std::to_string(limits.ratio) + " times the file's bytes");
    require_memory(in.name(), "the picture", most_bytes_of_texel * texels);
    in.bytes(4);
}

// The file to the end of its last chunk, without the chunks of data that are empty.
Bytes checked_chunks(const Bytes &bytes, const std::string &name, const PngLimits &limits) {
    ByteReader in(name, bytes.data(), bytes.size(), Encoding::big_endian);
    in.bytes(sizeof signature);
    Bytes chunks(std::begin(signature), std::end(signature));
    for (bool first = true;; first = false) {
        const auto chunk = bytes.end() - static_cast<ptrdiff_t>(in.left());
        const uint32_t size = read_u32(in);
        if (first && size != 13) in.fail("a chunk of " + std::to_string(size) + " bytes, expected the 13 of a header");
        in.require(uint64_t{size} + 8, 1, "bytes of a chunk");
        const std::string_view whole = in.peek(4 + size_t{size}), type = in.bytes(4);
        if (first && type != "IHDR") in.fail("chunk " + ByteReader::quoted(type) + ", expected 'IHDR'");
        if (first)
            check_header(in, bytes, limits);
        else
            in.bytes(size);
        const auto sum = crc32(0, reinterpret_cast<const Bytef *>(whole.data()), static_cast<uInt>(whole.size()));
        if (read_u32(in) != sum)
            in.fail("a check sum that is wrong, expected that of chunk " + ByteReader::quoted(type));
        if (type != "IDAT" || size > 0)
            chunks.insert(chunks.end(), chunk, bytes.end() - static_cast<ptrdiff_t>(in.left()));
        if (type == "IEND") return chunks;
    }
}

} // namespace

bool is_png(const Bytes &bytes) {
    return bytes.size() >= sizeof signature && std::equal(signature, signature + sizeof signature, bytes.begin());
}

Texels read_png(const Bytes &bytes, const std::string &name, const PngLimits &limits) {
    const Bytes chunks = checked_chunks(bytes, name, limits);
    if (chunks.size() > INT32_MAX) throw InputError(name + ": byte 0", "a PNG of more bytes than expected, 2147483647");
    Texels texels;
    int channels;
    const std::unique_ptr<unsigned char, void (*)(void *)> rgb(
        stbi_load_from_memory(chunks.data(), static_cast<int>(chunks.size()), &texels.width, &texels.height, &channels,
                              3),
        stbi_image_free);
    if (!rgb)
        throw InputError(name + ": byte " + std::to_string(sizeof signature),
                         ByteReader::quoted(stbi_failure_reason()) +
                             ", expected the chunks of a PNG"); // may quote bytes
    texels.rgb.assign(rgb.get(),
                      rgb.get() + 3 * static_cast<size_t>(texels.width) * static_cast<size_t>(texels.height));
    return texels;
}

} // namespace wisp
