// VOL version 3, as Mitsuba's gridvolume reads it. All numbers are little-endian.
//
//     "VOL"  u8 version
//     i32 encoding of the samples
//     i32 cells along x, y, z
//     i32 channels
//     f32 x y z of the lower corner, x y z of the upper corner
//     per sample  f32, x fastest, then y
#include "host/base/byte_reader.h"
#include "host/base/memory.h"
#include "host/formats/volume_readers.h"
#include <cmath>

namespace wisp {
namespace {

constexpr std::string_view magic = "VOL";
constexpr char axes[] = "xyz";

int64_t integer(ByteReader &in, Scalar type = Scalar::i32) { return static_cast<int64_t>(in.number(type)); }

void read_encoding(ByteReader &in) {
    constexpr int64_t float32 = 1;
    constexpr const char *refused[] = {" (float16)", " (uint8)", " (quantised directions)"}; // 2, 3, 4
    const int64_t encoding = integer(in);
    if (encoding == float32) return;
    in.fail("encoding " + std::to_string(encoding) + (encoding >= 2 && encoding <= 4 ? refused[encoding - 2] : "") +
            ", expected 1 (float32)");
}

uint32_t read_cells(ByteReader &in, char axis) {
    const int64_t cells = integer(in);
    if (cells < 1) in.fail(std::to_string(cells) + " cells along " + axis + ", expected 1 or more");
    return static_cast<uint32_t>(cells);
}

void read_channels(ByteReader &in) {
    const int64_t channels = integer(in);
    if (channels != 1)
        in.fail(std::to_string(channels) + " channels" + (channels == 3 ? " (colour)" : "") + ", expected 1 (density)");
}

void read_box(ByteReader &in, Volume &volume) {
    for (auto *corner : {&volume.low, &volume.high})
        for (size_t k = 0; k < 3; ++k) {
            double &coordinate = (*corner)[k];
            coordinate = in.number(Scalar::f32);
            if (!std::isfinite(coordinate))
                in.fail(std::string("the box is not finite along ") + axes[k] + ", expected finite numbers");
            if (corner == &volume.high && coordinate <= volume.low[k])
                in.fail(std::string("the box is empty along ") + axes[k] + ", expected its end above its start");
        }
}

void read_samples(ByteReader &in, Volume &volume) {
    in.bytes(0); // errors speak of the first sample from here on
    // Below 2^64, because the dimensions are below 2^31.
    const uint64_t layer = uint64_t{volume.nx} * volume.ny * size_of(Scalar::f32);
    if (in.left() % layer != 0 || in.left() / layer != volume.nz)
        in.fail(std::to_string(in.left()) + " bytes of samples, expected " + std::to_string(volume.nx) + " x " +
                std::to_string(volume.ny) + " x " + std::to_string(volume.nz) + " samples of 4 bytes");
    require_memory(in.name(), "the grid", in.left());
    volume.density.resize(in.left() / size_of(Scalar::f32));
    for (size_t i = 0; i < volume.density.size(); ++i) {
        const double density = in.number(Scalar::f32);
        if (!std::isfinite(density)) in.fail("sample " + std::to_string(i) + " is not finite, expected 0 or more");
        if (density < 0) in.fail("sample " + std::to_string(i) + " is negative, expected 0 or more");
        volume.density[i] = static_cast<float>(density);
    }
}

} // namespace

bool is_vol(const unsigned char *data, size_t size) {
    return size >= magic.size() && std::memcmp(data, magic.data(), magic.size()) == 0;
}

Volume parse_vol(const std::string &name, const unsigned char *data, size_t size) {
    ByteReader in(name, data, size, Encoding::little_endian);
    if (in.bytes(magic.size()) != magic) in.fail("not a VOL file, expected 'VOL' at its start");
    const int64_t version = integer(in, Scalar::u8);
    if (version != 3) in.fail("VOL version " + std::to_string(version) + ", expected 3");
    Volume volume;
    read_encoding(in);
    volume.nx = read_cells(in, 'x');
    volume.ny = read_cells(in, 'y');
    volume.nz = read_cells(in, 'z');
    read_channels(in);
    read_box(in, volume);
    read_samples(in, volume);
    return volume;
}

} // namespace wisp
