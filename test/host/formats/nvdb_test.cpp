// NanoVDB files that NanoVDB's own code writes: values, places, names, compressions; and damaged ones.
#include "host/formats/volume.h"
#include "core/smoke/grid_samples.h"
#include "host/base/double3_algebra.h"
#include "host/commands/file_facts.h"
#include "host/prepare/prepare.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"
#include <cmath>
#include <doctest/doctest.h>
#include <fstream>
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>
#include <sstream>
#include <string>
#include <vector>
#include <zlib.h>

using namespace wisp;

namespace {

using Handle = nanovdb::GridHandle<nanovdb::HostBuffer>;

// A density of its own for each voxel of a box that crosses the corners of several leaves and of an upper node.
constexpr int low[3] = {-5, 3, 4090}, count[3] = {12, 7, 9};
float density_at(int x, int y, int z) { return 0.25f + static_cast<float>((x + 7 * y + 3 * z) & 63); }

// The map from indices to the scene: its columns are the steps along the axes.
struct Map {
    Double3 column[3] = {{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}}, origin = {1, 2, 3};
    nanovdb::Map nano() const {
        const double m[3][3] = {{column[0].x, column[0].y, column[0].z}, // NanoVDB takes the rows of points times m
                                {column[1].x, column[1].y, column[1].z},
                                {column[2].x, column[2].y, column[2].z}};
        const double inverse[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; // nobody reads it
        nanovdb::Map map;
        map.set(m, inverse, nanovdb::Vec3d(origin.x, origin.y, origin.z), 1.0);
        return map;
    }
    Double3 operator()(double x, double y, double z) const {
        return origin + column[0] * x + column[1] * y + column[2] * z;
    }
};

template <class Build = float>
Handle grid(const std::string &name, const Map &map = {}, nanovdb::GridClass kind = nanovdb::GridClass::FogVolume,
            float first = density_at(low[0], low[1], low[2]), float background = 0) {
    nanovdb::GridBuilder<float, Build> builder(background, kind);
    auto voxels = builder.getAccessor();
    for (int z = 0; z < count[2]; ++z)
        for (int y = 0; y < count[1]; ++y)
            for (int x = 0; x < count[0]; ++x)
                voxels.setValue(nanovdb::Coord(low[0] + x, low[1] + y, low[2] + z),
                                x + y + z == 0 ? first : density_at(low[0] + x, low[1] + y, low[2] + z));
    Handle handle = builder.getHandle(map.nano(), name);
    const nanovdb::Vec3d here = handle.template grid<Build>()->map().applyMap(nanovdb::Vec3d(2, -7, 11));
    const Double3 expected = map(2, -7, 11);
    if (std::isfinite(expected.x)) CHECK(length(Double3{here[0], here[1], here[2]} - expected) < 1e-9);
    return handle;
}

// The bytes of a file of these grids. NanoVDB writes zip only if it is built so; this is the same layout.
std::string file_of(const std::vector<Handle> &grids, bool zipped = false) {
    nanovdb::io::Segment header(zipped ? nanovdb::io::Codec::ZIP : nanovdb::io::Codec::NONE);
    std::string body;
    for (const Handle &grid : grids) {
        header.add(grid);
        std::string packed(reinterpret_cast<const char *>(grid.data()), grid.size());
        if (zipped) {
            uLongf size = compressBound(packed.size());
            std::string out(size, '\0');
            REQUIRE(compress(reinterpret_cast<Bytef *>(out.data()), &size, grid.data(), grid.size()) == Z_OK);
            out.resize(size);
            const uint64_t bytes = size;
            packed = std::string(reinterpret_cast<const char *>(&bytes), 8) + out;
        }
        header.meta.back().fileSize = packed.size();
        body += packed;
    }
    std::ostringstream out;
    header.write(out);
    return out.str() + body;
}

Volume parse(const std::string &file, const std::string &name = "") {
    return parse_volume("f", reinterpret_cast<const unsigned char *>(file.data()), file.size(), name);
}
std::string refusal(const std::string &file, const std::string &name = "") {
    return refusal_of([&] { parse(file, name); });
}
bool contains(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

// All samples of the box, from blocks.
std::vector<float> samples_of(const Volume &volume) {
    GridDescription grid = {};
    volume.describe_samples(grid);
    std::vector<float> samples(static_cast<size_t>(samples_of_box(grid)), 0.0f);
    for_each_run(grid, [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t n) {
        std::copy(densities, densities + n, samples.begin() + (int64_t{z} * grid.ny + y) * grid.nx + x);
        return true;
    });
    return samples;
}

// Checks every sample: its value, and that it lies where the map says.
void check(const Volume &volume, const Map &map, float tolerance) {
    const uint32_t n[3] = {volume.nx, volume.ny, volume.nz};
    const std::vector<float> samples = samples_of(volume);
    for (int a = 0; a < 3; ++a) REQUIRE(n[a] == static_cast<uint32_t>(count[a] + 2));
    for (uint32_t z = 0; z < n[2]; ++z)
        for (uint32_t y = 0; y < n[1]; ++y)
            for (uint32_t x = 0; x < n[0]; ++x) {
                const bool border = x == 0 || y == 0 || z == 0 || x == n[0] - 1 || y == n[1] - 1 || z == n[2] - 1;
                const int i = low[0] - 1 + static_cast<int>(x), j = low[1] - 1 + static_cast<int>(y),
                          k = low[2] - 1 + static_cast<int>(z);
                const float density = samples[(z * n[1] + y) * n[0] + x];
                CHECK(std::fabs(density - (border ? 0 : density_at(i, j, k))) <= tolerance);
                Double3 at = {0, 0, 0};
                const uint32_t index[3] = {x, y, z};
                for (size_t a = 0; a < 3; ++a) {
                    const double edge = (volume.high[a] - volume.low[a]) / n[a];
                    at = at + volume.axis[a] * (volume.low[a] + (index[a] + 0.5) * edge);
                }
                CHECK(length(at - map(i, j, k)) < 1e-9 * (1 + length(at)));
            }
}

} // namespace

TEST_CASE("nvdb: every voxel has its value and its place, with zeros around") {
    for (const bool zipped : {false, true}) {
        std::vector<Handle> grids;
        grids.push_back(grid("density"));
        check(parse(file_of(grids, zipped)), {}, 0);
    }
}

TEST_CASE("nvdb: a background that is not 0 is refused") {
    std::vector<Handle> grids;
    grids.push_back(grid("fog", {}, nanovdb::GridClass::FogVolume, 1, 0.5f));
    CHECK(contains(refusal(file_of(grids)), "grid 'fog' has a background of 0.5, expected 0: smoke that ends nowhere"));
}

TEST_CASE("nvdb: grids of one name are told apart by a number") {
    std::vector<Handle> grids;
    for (const float first : {1.0f, 2.0f, 3.0f})
        grids.push_back(grid("density", {}, nanovdb::GridClass::FogVolume, first));
    const std::string file = file_of(grids);
    CHECK(parse(file).names == std::vector<std::string>{"density", "density[1]", "density[2]"});
    for (const auto &[name, first] : {std::pair("", 1.0f), std::pair("density", 1.0f), std::pair("density[1]", 2.0f),
                                      std::pair("density[2]", 3.0f)}) {
        const Volume volume = parse(file, name);
        const std::vector<float> samples = samples_of(volume);
        CHECK(samples[(volume.ny + 1) * volume.nx + 1] == first);
    }
}

TEST_CASE("nvdb: voxels may be turned, stretched and mirrored; a shear is refused") {
    const double c = 0.8, s = 0.6;
    for (const Map &map :
         {Map{{{c * 0.1, s * 0.1, 0}, {-s * 0.3, c * 0.3, 0}, {0, 0, 2}}, {-4, 5, 6}},
          Map{{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}, Map{{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}, {0, 0, 0}}}) {
        std::vector<Handle> grids;
        grids.push_back(grid("density", map));
        check(parse(file_of(grids)), map, 0);
    }
    for (const Map &map :
         {Map{{{1, 0.1, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}, Map{{{1, 0, 0}, {0, 0, 0}, {0, 0, 1}}, {0, 0, 0}},
          Map{{{NAN, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}}) {
        std::vector<Handle> grids;
        grids.push_back(grid("density", map));
        CHECK(contains(refusal(file_of(grids)), "the transform of the grid "));
    }
}

TEST_CASE("nvdb: info says the names of a file's grids, and the box of a turned one in the scene") {
    std::vector<Handle> grids;
    grids.push_back(grid("flames"));
    grids.push_back(grid("density", {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}, {0, 0, 0}})); // y z x of the voxels
    const std::string file = file_of(grids);
    Facts facts;
    add_grid_file(facts, "file", Bytes(file.begin(), file.end()));
    CHECK(contains(facts.text(), "grids             flames, density\n"));
    CHECK(contains(facts.json(),
                   "\"grid\": \"density\", \"grids\": [\"flames\", \"density\"], \"cells\": [14, 9, 11], "
                   "\"low\": [1.5, 4088.5, -6.5], \"high\": [10.5, 4099.5, 7.5], \"cell_size\": [1, 1, 1], "
                   "\"turned\": true"));
}

// Or bricks would not do for it, and it would be rendered a hundred times slower. 49 (1 / 49) is not 1.
TEST_CASE("nvdb: the axes of a grid that is not turned are exactly those of the scene, whatever its voxels measure") {
    for (const double edge : {49.0, 0.015463917525773196, 0.1, 1e-7}) {
        CAPTURE(edge);
        std::vector<Handle> grids;
        grids.push_back(grid("density", {{{edge, 0, 0}, {0, edge, 0}, {0, 0, edge}}, {1, 2, 3}}));
        const Volume volume = parse(file_of(grids));
        CHECK(volume.axis[0].x == 1);
        CHECK(volume.axis[1].y == 1);
        CHECK(volume.axis[2].z == 1);
    }
}

TEST_CASE("nvdb: quantised floats are within their steps") {
    std::vector<Handle> coarse, fine;
    coarse.push_back(grid<nanovdb::Fp8>("density"));
    check(parse(file_of(coarse)), {}, 64.0f / 255);
    fine.push_back(grid<nanovdb::Fp16>("density"));
    check(parse(file_of(fine)), {}, 64.0f / 65535);
}

TEST_CASE("nvdb: a grid is chosen by name, 'density' without one, or the only one that can be smoke") {
    Map moved;
    moved.origin = {70, 0, 0};
    std::vector<Handle> grids;
    grids.push_back(grid("flames", moved));
    grids.push_back(grid("density"));
    for (const bool zipped : {false, true}) {
        const std::string file = file_of(grids, zipped);
        check(parse(file), {}, 0);
        check(parse(file, "density"), {}, 0);
        check(parse(file, "flames"), moved, 0);
        CHECK(parse(file).name == "density");
        CHECK(parse(file).names == std::vector<std::string>{"flames", "density"});
        CHECK(contains(refusal(file, "smoke"), "no grid 'smoke', expected one of 'flames', 'density'"));
    }
    std::vector<Handle> others;
    others.push_back(grid("surface", {}, nanovdb::GridClass::LevelSet));
    CHECK(contains(refusal(file_of(others)), "grid 'surface' is a level set: distances to a surface, expected a fog "
                                             "volume"));
    others.push_back(grid("smoke", moved));
    check(parse(file_of(others)), moved, 0);
    others.push_back(grid("heat"));
    CHECK(contains(refusal(file_of(others)), "no grid 'density', expected one of 'surface', 'smoke', 'heat'"));
}

TEST_CASE("nvdb: voxels far apart take the memory of their blocks") {
    nanovdb::GridBuilder<float> builder(0.0f, nanovdb::GridClass::FogVolume);
    auto voxels = builder.getAccessor();
    voxels.setValue(nanovdb::Coord(-3, 5, 17), 0.5f);
    voxels.setValue(nanovdb::Coord(1990, 1500, 1800), 0.75f);
    voxels.setValue(nanovdb::Coord(1992, 1500, 1800), 0.25f); // in the next block
    voxels.setValue(nanovdb::Coord(700, 600, 500), 0.0f);     // active, but no smoke
    std::vector<Handle> grids;
    grids.push_back(builder.getHandle(Map().nano(), "density"));
    const Volume volume = parse(file_of(grids));
    CHECK(volume.nx == 1998);
    CHECK(volume.ny == 1498);
    CHECK(volume.nz == 1786);
    CHECK(volume.density.size() == 3 * samples_of_block);
    GridDescription grid = {};
    volume.describe_samples(grid);
    std::vector<std::array<int32_t, 3>> places;
    std::vector<float> values;
    for_each_run(grid, [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t n) {
        for (int32_t i = 0; i < n; ++i)
            if (densities[i] != 0) places.push_back({x + i - 4, y + 4, z + 16}), values.push_back(densities[i]);
        return true;
    });
    CHECK(places == std::vector<std::array<int32_t, 3>>{{-3, 5, 17}, {1990, 1500, 1800}, {1992, 1500, 1800}});
    CHECK(values == std::vector<float>{0.5f, 0.75f, 0.25f});
}

TEST_CASE("nvdb: a constant part of a grid that has no leaves is smoke as others are") {
    nanovdb::GridBuilder<float> builder(0.0f, nanovdb::GridClass::FogVolume);
    builder([](const nanovdb::Coord &) { return 0.5f; },
            nanovdb::CoordBBox(nanovdb::Coord(0, 0, 0), nanovdb::Coord(63, 31, 15)));
    std::vector<Handle> grids;
    grids.push_back(builder.getHandle(Map().nano(), "density"));
    const auto *tree = &grids[0].grid<float>()->tree();
    CHECK(tree->nodeCount(0) < 64); // of 8 x 4 x 2 leaves, some are constant parts of the node above
    const Volume volume = parse(file_of(grids));
    const std::vector<float> samples = samples_of(volume);
    CHECK(volume.nx == 66);
    CHECK(static_cast<int>(std::count(samples.begin(), samples.end(), 0.5f)) == 64 * 32 * 16);
    CHECK(static_cast<int>(std::count(samples.begin(), samples.end(), 0.0f)) ==
          static_cast<int>(samples.size()) - 64 * 32 * 16);
}

TEST_CASE("nvdb: densities below 0 and beyond all numbers are refused, with their voxel") {
    for (const float bad : {-1.0f, NAN, INFINITY}) {
        std::vector<Handle> grids;
        grids.push_back(grid("density", {}, nanovdb::GridClass::FogVolume, bad));
        CHECK(contains(refusal(file_of(grids)), std::string("the voxel at -5 3 4090 is ") +
                                                    (bad < 0 ? "negative" : "not finite") + ", expected 0 or more"));
    }
}

TEST_CASE("nvdb: files that are cut off or damaged end in one line") {
    std::vector<Handle> grids;
    grids.push_back(grid("density"));
    for (const bool zipped : {false, true}) {
        const std::string file = file_of(grids, zipped);
        for (size_t size = 8; size < file.size(); size += 1 + size / 7) {
            const std::string line = refusal(file.substr(0, size));
            CHECK(line.rfind("f: byte ", 0) == 0);
            CHECK(contains(line, ", expected "));
        }
        uint32_t state = 5;
        const auto random = [&state] { return (state = state * 1664525u + 1013904223u) >> 8; };
        for (int i = 0; i < 400; ++i) {
            std::string damaged = file;
            // Half of them in the headers of the file, the grid, the tree and the root.
            for (uint32_t k = 0; k < 1 + random() % 4; ++k)
                damaged[i % 2 ? random() % std::min<size_t>(file.size(), 1200) : random() % file.size()] =
                    static_cast<char>(random());
            const std::string line = refusal(damaged);
            CHECK(line.find('\n') == std::string::npos);
        }
    }
}

TEST_CASE("nvdb: a grid that is turned lies where a scene's transform turns it to") {
    TemporaryFolder folder;
    const auto prepare = [&](const Map &map, const std::string &more, PreparedScene &prepared) {
        std::vector<Handle> grids;
        grids.push_back(grid("density", map));
        std::ofstream(folder.file("g.nvdb"), std::ios::binary) << file_of(grids);
        const SceneFile scene =
            parse_scene(folder.file("s.aff"), "v from 0 0 9000 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 40 40\n"
                                              "lp 6 8 5 400 380 340\nsmoke g.nvdb {\n grid density\n" +
                                                  more + "}\n");
        prepare_scene("s", scene, {}, 0, prepared);
    };
    const Map plain = {{{0.5, 0, 0}, {0, 0.25, 0}, {0, 0, 1}}, {1, 2, 3}};
    const Map turned = {{{0, 0.5, 0}, {-0.25, 0, 0}, {0, 0, 1}}, {-2, 1, 3}}; // by 90 degrees about z
    PreparedScene by_file, by_scene;
    prepare(turned, "", by_file);
    prepare(plain, " transform 1 1 1 0 0 1 90 0 0 0\n", by_scene);
    const GridDescription &a = by_file.smokes[0].grid, &b = by_scene.smokes[0].grid;
    CHECK(samples_of_box(a) == samples_of_box(b));
    CHECK(by_file.volumes[0].density == by_scene.volumes[0].density);
    CHECK(by_file.volumes[0].blocks == by_scene.volumes[0].blocks);
    CHECK(length(a.center - b.center) < 1e-9);
    CHECK(length(a.half - b.half) < 1e-9);
    for (int i = 0; i < 3; ++i) CHECK(length(a.axis[i] - b.axis[i]) < 1e-9);
}
