// NanoVDB files, version 32.3 and 32.4: a header, the description of each grid, then the grids, with or without zip.
//
//     header       "NanoVDB0"  u32 version  u16 grids  u16 codec
//     description  176 bytes (below), then the name
//     grid         as NanoVDB has it in memory, in blocks of up to 2^30 bytes; with zip a u64 size before each
//
// PNanoVDB.h reads a grid. Its reads are checked against the end of the grid (PNANOVDB_BUF_BOUNDS_CHECK): whatever a
// file says, no other memory is read.
#define PNANOVDB_C
#define PNANOVDB_BUF_BOUNDS_CHECK
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-variable"
#include <nanovdb/PNanoVDB.h>
#pragma GCC diagnostic pop

#include "core/smoke/grid_samples.h"
#include "host/base/byte_reader.h"
#include "host/base/double3_algebra.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/formats/volume_readers.h"
#include <algorithm>
#include <cmath>
#include <map>
#include <zlib.h>

namespace wisp {
namespace {

constexpr std::string_view magic = "NanoVDB0";
enum Codec : uint64_t { plain = 0, zip = 1, blosc = 2 };

struct Description {
    uint64_t grid_bytes, type, grid_class;
    std::string name;
};

Description read_description(ByteReader &in) {
    Description grid;
    grid.grid_bytes = in.packed_bits(Scalar::u64);
    in.bytes(24); // the size in the file, a hash of the name, the number of voxels
    grid.type = in.packed_bits(Scalar::u32);
    grid.grid_class = in.packed_bits(Scalar::u32);
    in.bytes(96); // boxes, and the size of a voxel
    const uint64_t name_bytes = in.packed_bits(Scalar::u32);
    in.bytes(36);
    const std::string_view name = in.bytes(name_bytes);
    grid.name = std::string(name.substr(0, name.find('\0')));
    return grid;
}

bool is_density(const Description &grid) {
    const bool number = grid.type == PNANOVDB_GRID_TYPE_FLOAT ||
                        (grid.type >= PNANOVDB_GRID_TYPE_FP4 && grid.type <= PNANOVDB_GRID_TYPE_FPN);
    return number && grid.grid_class != PNANOVDB_GRID_CLASS_LEVEL_SET;
}

// The grid of this name; without a name `density`, or the only one that can be smoke.
size_t choose(const ByteReader &in, const std::vector<Description> &grids, const std::string &wanted) {
    std::string names;
    size_t densities = 0, last = 0;
    for (size_t i = 0; i < grids.size(); ++i) {
        names += (i ? ", " : "") + ByteReader::quoted(grids[i].name);
        if (wanted.empty() ? grids[i].name == "density" : grids[i].name == wanted) return i;
        if (is_density(grids[i])) ++densities, last = i;
    }
    if (wanted.empty() && densities == 1) return last;
    if (wanted.empty() && grids.size() == 1) return 0; // refused with the reason
    in.fail((wanted.empty() ? "no grid 'density'" : "no grid '" + wanted + "'") + std::string(", expected one of ") +
            (names.empty() ? "some" : names));
}

void refuse_unless_density(const ByteReader &in, const Description &grid) {
    if (grid.grid_class == PNANOVDB_GRID_CLASS_LEVEL_SET)
        in.fail("grid " + ByteReader::quoted(grid.name) +
                " is a level set: distances to a surface, expected a fog volume of densities");
    if (!is_density(grid))
        in.fail("grid " + ByteReader::quoted(grid.name) + " does not hold floats, expected a float grid");
}

// The bytes of a grid. `keep`: else they are passed over, and the result is empty.
std::vector<uint64_t> read_grid(ByteReader &in, const Description &grid, uint64_t codec, bool keep) {
    constexpr uint64_t block = uint64_t{1} << 30;
    std::vector<uint64_t> words;
    if (keep) {
        // A byte of zip is at most 1,032 bytes of a grid.
        if (grid.grid_bytes / (codec == zip ? 1100 : 1) > in.left())
            in.fail("a grid of " + std::to_string(grid.grid_bytes) + " bytes, expected no more than the file has");
        require_memory(in.name(), "the grid", grid.grid_bytes);
        words.resize(static_cast<size_t>((grid.grid_bytes + 7) / 8));
    }
    auto *to = reinterpret_cast<unsigned char *>(words.data());
    for (uint64_t done = 0; done < grid.grid_bytes; done += block) {
        const uint64_t size = std::min(block, grid.grid_bytes - done);
        const std::string_view raw = in.bytes(codec == zip ? in.packed_bits(Scalar::u64) : size);
        if (!keep) continue;
        uLongf unpacked = static_cast<uLongf>(size);
        if (codec == plain)
            std::copy(raw.begin(), raw.end(), to + done);
        else if (uncompress(to + done, &unpacked, reinterpret_cast<const Bytef *>(raw.data()),
                            static_cast<uLong>(raw.size())) != Z_OK ||
                 unpacked != size)
            in.fail("compressed data is damaged, expected zip");
    }
    return words;
}

// A grid in memory.
struct Grid {
    explicit Grid(std::vector<uint64_t> &words)
        : bytes(words.size() * 8), buffer(pnanovdb_make_buf(reinterpret_cast<uint32_t *>(words.data()), bytes / 4)),
          type(pnanovdb_grid_get_grid_type(buffer, grid)), tree(pnanovdb_grid_get_tree(buffer, grid)) {}

    uint64_t bytes;
    pnanovdb_buf_t buffer;
    pnanovdb_grid_handle_t grid = {pnanovdb_address_null()};
    pnanovdb_grid_type_t type;
    pnanovdb_tree_handle_t tree;
};

// `level`: of the node that has it: 0 for a leaf node.
float value_at(const Grid &grid, pnanovdb_readaccessor_t &accessor, const pnanovdb_coord_t &at,
               pnanovdb_uint32_t &level) {
    const pnanovdb_address_t address =
        pnanovdb_readaccessor_get_value_address_and_level(grid.type, grid.buffer, &accessor, &at, &level);
    switch (grid.type) {
    case PNANOVDB_GRID_TYPE_FP4: return pnanovdb_root_fp4_read_float(grid.buffer, address, &at, level);
    case PNANOVDB_GRID_TYPE_FP8: return pnanovdb_root_fp8_read_float(grid.buffer, address, &at, level);
    case PNANOVDB_GRID_TYPE_FP16: return pnanovdb_root_fp16_read_float(grid.buffer, address, &at, level);
    case PNANOVDB_GRID_TYPE_FPN: return pnanovdb_root_fpn_read_float(grid.buffer, address, &at, level);
    default: return pnanovdb_read_float(grid.buffer, address);
    }
}

// Where voxels lie: sample i is at index first + i along each axis.
struct Indices {
    int64_t first[3], count[3];
};

// The box of the active voxels, and one more on each side, where the density falls to 0.
Indices find_indices(const ByteReader &in, const Grid &grid, pnanovdb_root_handle_t root) {
    const pnanovdb_coord_t low = pnanovdb_root_get_bbox_min(grid.buffer, root),
                           high = pnanovdb_root_get_bbox_max(grid.buffer, root);
    Indices box;
    const int64_t lows[3] = {low.x, low.y, low.z}, highs[3] = {high.x, high.y, high.z};
    double voxels = 1;
    for (int a = 0; a < 3; ++a) {
        if (lows[a] > highs[a]) in.fail("no active voxel, expected some");
        box.first[a] = lows[a] - 1;
        box.count[a] = highs[a] - lows[a] + 3;
        voxels *= static_cast<double>(box.count[a]);
    }
    // Each block of 512 voxels has a place. A file that is small beside its box is no smoke.
    const double most = std::min(0x1p36, 0x1p29 + 0x1p15 * static_cast<double>(grid.bytes));
    if (voxels > most)
        in.fail("active voxels lie in a box of " + std::to_string(box.count[0]) + " x " + std::to_string(box.count[1]) +
                " x " + std::to_string(box.count[2]) + ", expected " + std::to_string(static_cast<uint64_t>(most)) +
                " voxels at most in so small a file");
    return box;
}

// Sets the axes and corners by the map from indices to the scene, whose columns are steps along the axes.
void place(const ByteReader &in, const Grid &grid, const Indices &box, Volume &volume) {
    const pnanovdb_map_handle_t map = pnanovdb_grid_get_map(grid.buffer, grid.grid);
    const auto row = [&](uint32_t r, uint32_t c) { return pnanovdb_map_get_matd(grid.buffer, map, 3 * r + c); };
    const Double3 origin = {pnanovdb_map_get_vecd(grid.buffer, map, 0), pnanovdb_map_get_vecd(grid.buffer, map, 1),
                            pnanovdb_map_get_vecd(grid.buffer, map, 2)};
    Double3 step[3];
    double edge[3];
    for (uint32_t a = 0; a < 3; ++a) {
        step[a] = {row(0, a), row(1, a), row(2, a)};
        edge[a] = length(step[a]);
        if (!(edge[a] > 1e-30 && edge[a] < 1e30 && length(origin) < 1e30))
            in.fail("the transform of the grid is not finite or flat, expected an edge for each voxel");
    }
    for (int a = 0; a < 3; ++a)
        if (std::fabs(dot(step[a], step[(a + 1) % 3])) > 1e-5 * edge[a] * edge[(a + 1) % 3])
            in.fail("the transform of the grid shears, expected rotation, scale and translation");
    for (size_t a = 0; a < 3; ++a) {
        volume.axis[a] = unit(step[a]); // exactly 1 and 0 of a grid that is not turned: can_resample() asks
        const double start = dot(origin, volume.axis[a]) + (static_cast<double>(box.first[a]) - 0.5) * edge[a];
        volume.low[a] = start;
        volume.high[a] = start + static_cast<double>(box.count[a]) * edge[a];
    }
}

// Blocks of the samples are leaf nodes of the grid, or constant parts of its other nodes.
class SampleReader {
  public:
    SampleReader(const ByteReader &in, const Grid &grid, pnanovdb_root_handle_t root, const Indices &box,
                 Volume &volume)
        : in_(in), grid_(grid), box_(box), volume_(volume) {
        pnanovdb_readaccessor_init(&accessor_, root);
        volume.nx = static_cast<uint32_t>(box.count[0]);
        volume.ny = static_cast<uint32_t>(box.count[1]);
        volume.nz = static_cast<uint32_t>(box.count[2]);
        for (size_t a = 0; a < 3; ++a) {
            volume.skipped[a] = static_cast<int32_t>(box.first[a] & (block_edge - 1));
            blocks_[a] = blocks_for(box.count[a], volume.skipped[a]);
        }
    }

    void read() {
        const uint64_t places =
            static_cast<uint64_t>(blocks_[0]) * static_cast<uint64_t>(blocks_[1]) * static_cast<uint64_t>(blocks_[2]);
        require_memory(in_.name(), "the places of the grid's blocks", places * sizeof(uint32_t));
        volume_.blocks.assign(static_cast<size_t>(places), no_block);
        uint64_t count = 0;
        for_each_block([&](uint32_t &number, const int64_t(&low)[3]) {
            if (!may_have_smoke(low)) return;
            number = 0; // until it is read
            ++count;
        });
        // A file that is small beside its voxels is no smoke: leaves of 512 voxels take 300 bytes and more.
        const uint64_t voxels = count * samples_of_block,
                       most = std::min(uint64_t{1} << 31, (uint64_t{1} << 24) + 16 * grid_.bytes);
        if (voxels > most)
            in_.fail(std::to_string(voxels) + " voxels are not 0, expected " + std::to_string(most) +
                     " at most: wisp keeps all of them");
        require_memory(in_.name(), "the grid", voxels * sizeof(float));
        volume_.density.reserve(static_cast<size_t>(voxels));
        for_each_block([&](uint32_t &number, const int64_t(&low)[3]) {
            float samples[samples_of_block];
            if (number == no_block) return;
            number = no_block;
            if (!read_block(low, samples)) return;
            number = static_cast<uint32_t>(volume_.density.size() / samples_of_block);
            volume_.density.insert(volume_.density.end(), samples, samples + samples_of_block);
        });
    }

  private:
    template <class Visit> void for_each_block(Visit &&visit) {
        uint32_t *number = volume_.blocks.data();
        for (int64_t z = 0; z < blocks_[2]; ++z)
            for (int64_t y = 0; y < blocks_[1]; ++y)
                for (int64_t x = 0; x < blocks_[0]; ++x) {
                    const int64_t block[3] = {x, y, z};
                    int64_t low[3];
                    for (size_t a = 0; a < 3; ++a) low[a] = box_.first[a] - volume_.skipped[a] + block[a] * block_edge;
                    visit(*number++, low);
                }
    }

    // Leaf nodes, and constant parts that are not 0.
    bool may_have_smoke(const int64_t (&low)[3]) {
        const pnanovdb_coord_t at = {static_cast<int32_t>(low[0]), static_cast<int32_t>(low[1]),
                                     static_cast<int32_t>(low[2])};
        pnanovdb_uint32_t level = 0;
        const float first = value_at(grid_, accessor_, at, level);
        return level == 0 || first != 0;
    }

    // The voxels of a block that are not in the outermost layer of the box; 0 for the others. False: all are 0.
    bool read_block(const int64_t (&low)[3], float *samples) {
        bool any = false;
        const bool quantised = grid_.type != PNANOVDB_GRID_TYPE_FLOAT;
        for (uint32_t i = 0; i < samples_of_block; ++i) {
            constexpr uint32_t edge = block_edge;
            const int64_t index[3] = {low[0] + i % edge, low[1] + i / edge % edge, low[2] + i / (edge * edge)};
            bool inside = true;
            for (size_t a = 0; a < 3; ++a)
                inside = inside && index[a] > box_.first[a] && index[a] < box_.first[a] + box_.count[a] - 1;
            samples[i] = 0;
            if (!inside) continue;
            const pnanovdb_coord_t at = {static_cast<int32_t>(index[0]), static_cast<int32_t>(index[1]),
                                         static_cast<int32_t>(index[2])};
            pnanovdb_uint32_t level = 0;
            const float density = value_at(grid_, accessor_, at, level);
            if (quantised && density < 0) continue; // by the rounding of its codes
            if (!std::isfinite(density) || density < 0)
                in_.fail("the voxel at " + std::to_string(at.x) + " " + std::to_string(at.y) + " " +
                         std::to_string(at.z) + (density < 0 ? " is negative" : " is not finite") +
                         ", expected 0 or more");
            samples[i] = density;
            any = any || density > 0;
        }
        return any;
    }

    const ByteReader &in_;
    const Grid &grid_;
    const Indices &box_;
    Volume &volume_;
    pnanovdb_readaccessor_t accessor_;
    int64_t blocks_[3];
};

} // namespace

bool is_nvdb(const unsigned char *data, size_t size) {
    return size >= magic.size() && std::memcmp(data, magic.data(), magic.size()) == 0;
}

Volume parse_nvdb(const std::string &name, const unsigned char *data, size_t size, const std::string &wanted) {
    ByteReader in(name, data, size, Encoding::little_endian);
    in.bytes(magic.size());
    const uint64_t version = in.packed_bits(Scalar::u32), major = version >> 21, minor = version >> 10 & 0x7ff;
    if (major != 32 || minor < 3 || minor > 4)
        in.fail("NanoVDB version " + std::to_string(major) + "." + std::to_string(minor) + ", expected 32.3 or 32.4");
    const uint64_t count = in.packed_bits(Scalar::u16), codec = in.packed_bits(Scalar::u16);
    if (codec > zip)
        in.fail(codec == blosc ? "compressed with blosc, expected zip or none: convert it with nanovdb_convert --zip"
                               : "an unknown compression, expected zip or none");
    std::vector<Description> grids;
    std::map<std::string, uint32_t> of_name;
    for (uint64_t i = 0; i < count; ++i) {
        Description grid = read_description(in);
        const uint32_t before = of_name[grid.name]++;
        if (before > 0) grid.name += "[" + std::to_string(before) + "]"; // as OpenVDB tells them apart
        grids.push_back(std::move(grid));
    }
    const size_t chosen = choose(in, grids, wanted);
    refuse_unless_density(in, grids[chosen]);
    for (size_t i = 0; i < chosen; ++i) read_grid(in, grids[i], codec, false);
    std::vector<uint64_t> words = read_grid(in, grids[chosen], codec, true);

    const Grid grid(words);
    if (grid.type != grids[chosen].type) in.fail("the grid's type is not that of its description, expected one");
    const pnanovdb_root_handle_t root = pnanovdb_tree_get_root(grid.buffer, grid.tree);
    if (pnanovdb_root_get_tile_count(grid.buffer, root) > grid.bytes / 32) // a tile takes 32 bytes
        in.fail("more tiles than the grid has room for, expected fewer");
    const float background = pnanovdb_read_float(
        grid.buffer, pnanovdb_address_offset(root.address, PNANOVDB_GRID_TYPE_GET(grid.type, root_off_background)));
    if (background != 0)
        in.fail("grid " + ByteReader::quoted(grids[chosen].name) + " has a background of " +
                six_digits(static_cast<double>(background)) + ", expected 0: smoke that ends nowhere");
    Volume volume;
    volume.name = grids[chosen].name;
    for (const Description &described : grids) volume.names.push_back(described.name);
    const Indices box = find_indices(in, grid, root);
    place(in, grid, box, volume);
    SampleReader(in, grid, root, box, volume).read();
    return volume;
}

} // namespace wisp
