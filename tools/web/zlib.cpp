// The functions of zlib that the program calls: Debian has no zlib for WebAssembly. stb packs and unpacks in its place.
// The page itself inflates files of gzip, so the program sees none.
#include <cstdlib>
#include <cstring>
#include <zlib.h>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
#include <stb/stb_image.h>

// Of stb_image_write, in host/images.
extern "C" unsigned char *stbi_zlib_compress(unsigned char *data, int size, int *packed_size, int quality);

uLong crc32(uLong sum, const Bytef *data, uInt size) {
    uint32_t rest = ~static_cast<uint32_t>(sum);
    for (uInt i = 0; i < size; ++i) {
        rest ^= data[i];
        for (int bit = 0; bit < 8; ++bit) rest = rest >> 1 ^ (rest & 1 ? 0xedb88320 : 0);
    }
    return ~rest;
}

int uncompress(Bytef *to, uLongf *to_size, const Bytef *from, uLong from_size) {
    const int size = stbi_zlib_decode_buffer(reinterpret_cast<char *>(to), static_cast<int>(*to_size),
                                             reinterpret_cast<const char *>(from), static_cast<int>(from_size));
    if (size < 0) return Z_DATA_ERROR;
    *to_size = static_cast<uLong>(size);
    return Z_OK;
}

int compress(Bytef *to, uLongf *to_size, const Bytef *from, uLong from_size) {
    constexpr int quality = 8;
    int size;
    unsigned char *const packed =
        stbi_zlib_compress(const_cast<unsigned char *>(from), static_cast<int>(from_size), &size, quality);
    const bool fits = static_cast<uLong>(size) <= *to_size;
    if (fits) std::memcpy(to, packed, *to_size = static_cast<uLong>(size));
    std::free(packed);
    return fits ? Z_OK : Z_BUF_ERROR;
}
uLong compressBound(uLong size) { return size + size / 8 + 64; }

int inflateInit2_(z_streamp, int, const char *, int) { return Z_OK; }
int inflateReset(z_streamp) { return Z_OK; }
int inflateEnd(z_streamp) { return Z_OK; }
int inflate(z_streamp stream, int) {
    stream->msg = const_cast<char *>("gzip within gzip");
    return Z_DATA_ERROR;
}
