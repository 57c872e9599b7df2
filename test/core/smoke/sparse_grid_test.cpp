// Sparse grids: which bricks exist, who holds a node, and pictures that are marched through them.
#include "wisp/wisp.h"
#include "support/blocked_grid.h"
#include "support/built_sparse_grid.h"
#include "support/compared_pictures.h"
#include "support/mixture.h"
#include "wisp/settings.h"
#include <array>
#include <cstring>
#include <map>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

bool same_bits(const Vec3 &a, const Vec3 &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

bool holds(const Box &box, const Vec3 &x) {
    return x.x >= box.low.x && x.y >= box.low.y && x.z >= box.low.z && x.x <= box.high.x && x.y <= box.high.y &&
           x.z <= box.high.z;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": there is a brick wherever there is smoke") {
    const SmokeLists all;
    for (const auto &list : all.lists)
        for (double lengths : {0.3, 1.0}) {
            const BuiltSparseGrid built(list, lengths);
            const BuiltMedium exact(list);
            const SparseGrid &bricks = built.bricks;
            const Vec3 size = bricks.bounds.high - bricks.bounds.low;
            Sequence next{7};
            int met = 0;
            for (int i = 0; i < 8000; ++i) {
                const Vec3 u = vec(1.2 * next() - 0.1, 1.2 * next() - 0.1, 1.2 * next() - 0.1);
                const Vec3 x = bricks.bounds.low + u * size;
                Real sigma = Real(0);
                for (uint32_t s = 0; s < exact.medium.count; ++s) sigma += extinction(exact.medium.smokes[s].field, x);
                if (!(sigma > Real(0))) continue;
                ++met;
                const Cell cell = cell_at(bricks.lattice, x);
                const uint32_t brick = brick_at(bricks, cell);
                if (holds(bricks.bounds, x) && brick != no_brick) {
                    const Vec3 p = position_in(bricks, brick, x);
                    const double past = 1e4 * unit_error;
                    CHECK(holds({vec(-past, -past, -past), vec(8 + past, 8 + past, 8 + past)}, p));
                    continue;
                }
                CAPTURE(lengths);
                CAPTURE(&list - all.lists.data());
                FAIL_CHECK("smoke outside of bricks");
            }
            CHECK(met > 20);
        }
}

TEST_CASE(WISP_ARITH_NAME ": of particles there are no other bricks than those that a support reaches") {
    const std::vector<Particle> particles = cloud(20, 14, 1, 1, 5);
    for (double lengths : {0.3, 0.6}) {
        const BuiltSparseGrid built({smoke_of(particles)}, lengths);
        const Lattice &lattice = built.bricks.lattice;
        for (int32_t z = 0; z < lattice.count.z; ++z)
            for (int32_t y = 0; y < lattice.count.y; ++y)
                for (int32_t x = 0; x < lattice.count.x; ++x) {
                    double nearest = 1e9;
                    for (const Particle &p : particles) {
                        double squares = 0;
                        const double center[3] = {p.position.x, p.position.y, p.position.z};
                        const int32_t cell[3] = {x, y, z};
                        for (int k = 0; k < 3; ++k) {
                            const double low = at(lattice.low[k]) + cell[k] * at(lattice.edge[k]);
                            const double gap = std::max({low - center[k], center[k] - low - at(lattice.edge[k]), 0.0});
                            squares += gap * gap;
                        }
                        nearest = std::min(nearest, std::sqrt(squares));
                    }
                    if (std::fabs(nearest - 2) < 1e-4) continue;
                    CHECK((brick_at(built.bricks, {x, y, z}) != no_brick) == (nearest < 2));
                }
        CHECK(built.bricks.count < number_of(lattice.count) / 2);
    }
}

TEST_CASE(WISP_ARITH_NAME ": bricks take what their plan says, and say so when they have less") {
    const SmokeLists all;
    for (const auto &list : all.lists) {
        const BuiltSparseGrid built(list, 0.6);
        const uint64_t lattice = number_of(built.bricks.lattice.count), count = built.bricks.count;
        CHECK(built.plan.count == count);
        CHECK(built.plan.bytes == lattice * sizeof(uint32_t) + count * sizeof(Cell) + 2 * 64);
        uint64_t listed = 0;
        for (uint64_t i = 0; i < lattice; ++i) {
            const uint32_t brick = built.bricks.index[i];
            if (brick == no_brick) continue;
            CHECK(brick == listed++);
            CHECK(index_of(built.bricks.lattice.count, built.bricks.position[brick]) == static_cast<int64_t>(i));
        }
        CHECK(listed == count);

        std::vector<unsigned char> memory(built.plan.bytes + 64);
        for (size_t offset : {0, 1, 63}) {
            Arena arena(memory.data() + offset, built.plan.bytes);
            CHECK(make_sparse_grid(built.scene, 0.6, arena).ready);
        }
        const uint64_t smallest = built.plan.bytes - 2 * 64;
        for (uint64_t bytes : {uint64_t{0}, lattice * sizeof(uint32_t) - 1, lattice * sizeof(uint32_t), smallest - 1}) {
            Arena arena(memory.data(), bytes);
            CHECK(!make_sparse_grid(built.scene, 0.6, arena).ready);
        }
    }
    const Scene nothing = {};
    Arena none(nullptr, 0);
    CHECK(plan_sparse_grid(nothing, 1).bytes == 0);
    const SparseGrid bricks = make_sparse_grid(nothing, 1, none);
    CHECK(bricks.ready);
    CHECK(bricks.count == 0);
}

TEST_CASE(WISP_ARITH_NAME ": of a lattice too large to count, a plan takes all bricks") {
    const std::vector<Particle> particles = {{{-300, -300, -300}, 1, 1}, {{300, 300, 300}, 1, 1}};
    const BuiltSparseGrid built({smoke_of(particles)}, 0.75);
    const uint64_t lattice = number_of(built.bricks.lattice.count);
    CHECK(lattice > uint64_t{1} << 19);
    CHECK(built.plan.count == lattice);
    CHECK(built.bricks.count <= 16);
}

TEST_CASE(WISP_ARITH_NAME ": a plan counts bricks exactly, of whole layers at a time or of rows of one") {
    Sequence next{5};
    for (const Double3 &half : {Double3{250, 150, 90}, Double3{700, 700, 9}, Double3{20, 30, 3000}}) {
        std::vector<Particle> particles;
        for (int i = 0; i < 3000; ++i)
            particles.push_back(
                {{half.x * (2 * next() - 1), half.y * (2 * next() - 1), half.z * (2 * next() - 1)}, 1, 1});
        const BuiltSparseGrid built({smoke_of(particles)}, 0.75);
        CHECK(number_of(built.bricks.lattice.count) > 40000);
        CHECK(built.plan.count == built.bricks.count);
    }
    // Blocks that are full or empty, so that blocks and samples touch the same bricks.
    constexpr int32_t edge = 1600, layers = 2;
    std::vector<float> density(edge * edge * layers);
    std::vector<bool> full(edge / 8 * (edge / 8));
    for (size_t i = 0; i < full.size(); ++i) full[i] = next() < 0.2;
    for (int32_t i = 0; i < edge * edge * layers; ++i)
        density[static_cast<size_t>(i)] = full[static_cast<size_t>(i / edge % edge / 8 * (edge / 8) + i % edge / 8)];
    const GridDescription grid = {edge,
                                  edge,
                                  layers,
                                  density.data(),
                                  0.7,
                                  {0, 0, 0},
                                  {edge / 2.0, edge / 2.0, 1},
                                  {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const BlockedGrid blocked(grid, 0, 0, 0);
    const BuiltSparseGrid dense({grid_smoke_of(grid)}, 1), sparse({grid_smoke_of(blocked.grid)}, 1);
    CHECK(number_of(dense.bricks.lattice.count) > 40000);
    CHECK(dense.plan.count == dense.bricks.count);
    CHECK(sparse.plan.count == dense.bricks.count);
}

TEST_CASE(WISP_ARITH_NAME ": the bytes of a lattice that no memory holds do not wrap") {
    const std::vector<Particle> apart = {{{-8000, -8000, -8000}, 0.0625, 1}, {{8000, 8000, 8000}, 0.0625, 1}};
    const std::vector<SmokeDescription> smokes = {smoke_of(apart)};
    Scene scene = scene_of(smokes[0], {});
    for (const double lengths : {0.55, 0.01}) {
        const SparseGridPlan plan = plan_sparse_grid(scene, lengths);
        CHECK(plan.count >= uint64_t{1} << 40);
        CHECK(plan.count <= uint64_t{1} << 47);
        Settings settings = small_settings(4);
        settings.method = Method::map;
        settings.density_step = lengths;
        CHECK(renderer.plan(scene, settings).arena_bytes > plan.count);
    }
}

TEST_CASE(WISP_ARITH_NAME ": every brick that holds a node has the same point there, and the same density") {
    const SmokeLists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 0.6);
        const SparseGrid &bricks = built.bricks();
        struct Node {
            Vec3 x;
            std::vector<Real> sigma;
        };
        std::map<std::array<int32_t, 3>, Node> nodes;
        uint64_t again = 0, different = 0;
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < nodes_of(1); ++k) {
                const Cell position = lattice_coordinates(bricks, b, k);
                Node here = {node_of(bricks, b, cell_of_index(nodes_along(1), k)), {}};
                for (uint32_t s = 0; s < built.medium.count; ++s) here.sigma.push_back(built.field(s).nodes(b)[k]);
                const auto found = nodes.insert({{position.x, position.y, position.z}, here});
                if (found.second) continue;
                ++again;
                const Node &before = found.first->second;
                if (!same_bits(before.x, here.x) || before.sigma != here.sigma) ++different;
            }
        CHECK(again > 500);
        CHECK(different == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": the holders of a node are all bricks that have it, whichever brick it is given relative to") {
    const SmokeLists all;
    Sequence next{9};
    for (double lengths : {0.3, 0.6}) {
        const BuiltSparseGrid built({all.lists[1][0]}, lengths);
        const SparseGrid &bricks = built.bricks;
        for (int32_t spacing = 1; spacing <= brick_cells; spacing *= 2) {
            const int32_t n = nodes_along(spacing);
            std::map<std::array<int32_t, 3>, std::vector<std::pair<uint32_t, uint32_t>>> holders;
            for (uint32_t b = 0; b < bricks.count; ++b)
                for (uint32_t k = 0; k < nodes_of(spacing); ++k) {
                    const Cell position = lattice_coordinates(bricks, b, k, spacing);
                    holders[{position.x, position.y, position.z}].push_back({b, k});
                }
            uint64_t wrong = 0, max_holders = 0, outside = 0;
            for (int round = 0; round < 4000; ++round) {
                const Cell &count = bricks.lattice.count;
                const auto any = [&](int32_t most_) { return static_cast<int32_t>(next() * most_); };
                const Cell position = {any(count.x), any(count.y), any(count.z)};
                // From n - 1 nodes before the brick to n - 1 behind it; the extreme positions are more frequent.
                const auto node_along = [&] {
                    const int32_t ends[] = {-1, 0, n - 1, n};
                    return any(2) ? ends[any(4)] : any(3 * n - 2) - (n - 1);
                };
                const Cell node = {node_along(), node_along(), node_along()};
                std::vector<std::pair<uint32_t, uint32_t>> found;
                for_each_holder(bricks, position, node, n, [&](uint32_t b, uint32_t k) { found.push_back({b, k}); });
                std::sort(found.begin(), found.end());
                const auto expected = holders[{position.x * (n - 1) + node.x, position.y * (n - 1) + node.y,
                                               position.z * (n - 1) + node.z}];
                if (found != expected) ++wrong;
                max_holders = std::max<uint64_t>(max_holders, found.size());
                outside += node.x < 0 && !found.empty() ? 1 : 0;
            }
            CAPTURE(spacing);
            CHECK(wrong == 0);
            CHECK(max_holders == 8);
            CHECK(outside > 20);
        }
    }
}

namespace {

// Two smokes of particles with different kernels and anisotropic phase functions, one of which emits; and lights of all
// kinds, one of them inside the smoke.
struct Lit {
    Lit() : big(cloud(40, 2, 1.5, 1.2, 3)), small(cloud(60, 1.5, 1, 0.6, 4)) {
        smokes = {smoke_of(big, Kernel::poly6), smoke_of(small)};
        smokes[0].albedo = {0.9, 0.5, 0.2};
        smokes[0].emission = {0.1, 0.2, 0};
        smokes[0].asymmetry = -0.4;
        smokes[1].asymmetry = 0.5;
        lights = {{LightKind::point, {0.5, 0.25, 0.5}, {0, 0, 1}, 2, {4, 5, 6}},
                  {LightKind::spot,
                   {4, 6, 5},
                   {-4 / std::sqrt(77.0), -6 / std::sqrt(77.0), -5 / std::sqrt(77.0)},
                   0.03,
                   {50, 40, 60}},
                  {LightKind::parallel, {}, {-0.6, -0.8, 0}, 2, {3, 2, 1}},
                  {LightKind::constant, {-3, -7, 4}, {0, 0, 1}, 2, {1, 1, 3}}};
        scene.camera = look_at_origin(12, 8, 6);
        scene.background = {0.5, 0.25, 0.125};
        scene.lights = lights.data();
        scene.light_count = 4;
        scene.smokes = smokes.data();
        scene.smoke_count = 2;
    }
    std::vector<Particle> big, small;
    std::vector<SmokeDescription> smokes;
    std::vector<LightSource> lights;
    Scene scene = {};
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": without photons resampled smoke looks as the exact one does") {
    const Lit lit;
    // With each light, and with all together; with emission and background in every picture.
    for (uint32_t first = 0; first < 5; ++first) {
        Scene scene = lit.scene;
        if (first < 4) scene.lights += first, scene.light_count = 1;
        const Rendered truth = render_in_memory(scene, brick_settings(4, 0));
        REQUIRE(truth.status == Status::done);
        double errors[2];
        for (int fine = 0; fine < 2; ++fine) {
            const Rendered bricks = render_in_memory(scene, brick_settings(4, fine ? 0.3 : 0.6));
            REQUIRE(bricks.status == Status::done);
            errors[fine] = relative_difference(bricks.rgb, truth.rgb);
            CHECK(bricks.statistics.smoke.march_samples > 0);
            CHECK(bricks.statistics.smoke.march_samples <= truth.statistics.smoke.march_samples);
        }
        CAPTURE(first);
        CHECK(errors[0] < 0.03);
        // The error goes with the square of the cell. Around a light inside the smoke, depths have a kink.
        const bool inside = first == 0 || first == 4;
        CHECK(errors[1] < (inside ? 0.75 : 0.4) * errors[0]);
    }
}

TEST_CASE(WISP_ARITH_NAME ": eight steps at a time through resampled smoke give what one at a time gives") {
    // The same densities and stored depths, marched by method direct, from outside and inside.
    Lit lit;
    for (double z : {12.0, 0.5})
        for (double step : {0.5, 0.07}) {
            lit.scene.camera.origin = {0.3, 0.1, z};
            Settings settings = brick_settings(4, 0.5);
            settings.step = step;
            const Rendered lanes = render_in_memory(lit.scene, settings);
            settings.method = Method::direct;
            const Rendered single = render_in_memory(lit.scene, settings);
            REQUIRE(lanes.status == Status::done);
            REQUIRE(single.status == Status::done);
            CAPTURE(z);
            CAPTURE(step);
            // The inverse square in the middle of a step, 16 and more away, is its mean but for 1 / (12 16^2).
            CHECK(relative_difference(lanes.rgb, single.rgb) < 3e-4);
        }
}

TEST_CASE(WISP_ARITH_NAME ": without lights resampled smoke is the attenuated background and its emission") {
    Lit lit;
    lit.scene.light_count = 0;
    for (int emits = 0; emits < 2; ++emits) {
        Settings settings = brick_settings(6, 0.5);
        if (!emits) lit.smokes[0].emission = {0, 0, 0};
        const Rendered bricks = render_in_memory(lit.scene, settings);
        settings.method = Method::direct;
        const Rendered single = render_in_memory(lit.scene, settings);
        REQUIRE(bricks.status == Status::done);
        REQUIRE(single.status == Status::done);
        CHECK(relative_difference(bricks.rgb, single.rgb) < 400 * unit_error);
        lit.smokes[0].emission = {0.1, 0.2, 0};
    }
}

TEST_CASE(WISP_ARITH_NAME ": with bricks a crop has the pixels of the whole picture, and the plan's bytes suffice") {
    const Lit lit;
    struct {
        double light_step;
        IrradianceMap irradiance;
        uint64_t photons;
    } const rows[] = {{0, IrradianceMap::none, 0},      {0, IrradianceMap::uniform, 300},
                      {0.5, IrradianceMap::none, 0},    {0.5, IrradianceMap::none, 300},
                      {2, IrradianceMap::uniform, 300}, {1, IrradianceMap::adaptive, 300}};
    for (const auto &row : rows) {
        Settings settings = brick_settings(4, 0.5);
        settings.light_step = row.light_step;
        settings.irradiance = row.irradiance;
        settings.irradiance_step = 2;
        settings.photons = row.photons;
        const Rendered whole = render_in_memory(lit.scene, settings);
        CAPTURE(row.light_step);
        REQUIRE(whole.status == Status::done);
        CHECK(whole.statistics.bytes.arena_peak <= whole.statistics.bytes.arena_size);
        settings.crop = {1, 2, 3, 4};
        const Rendered crop = render_in_memory(lit.scene, settings);
        for (size_t y = 0; y < 2; ++y)
            CHECK(std::memcmp(&crop.rgb[6 * y], &whole.rgb[3 * (4 * (y + 2) + 1)], 6 * sizeof(float)) == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the plan of a box has its cells, however fine or coarse" * doctest::test_suite("long")) {
    Lit lit;
    std::vector<SmokeDescription> box = {box_smoke({2, 3, 1.5}, 0.75, 10)};
    lit.scene.smokes = box.data();
    lit.scene.smoke_count = 1;
    for (double cell : {0.15, 0.22, 0.3, 0.45, 0.55, 1.0, 3.0}) {
        Settings settings = brick_settings(2, 2 * cell);
        settings.density_step = cell;
        settings.light_step = settings.irradiance_step = 2 * cell;
        settings.irradiance = IrradianceMap::uniform;
        settings.photons = 300;
        CAPTURE(cell);
        const uint64_t bricks = plan_sparse_grid(lit.scene, cell).count;
        CHECK(renderer.plan(lit.scene, settings).bricks == bricks);
        CHECK(renderer.plan(lit.scene, settings).map_sums ==
              sums_of_fluence(photon_needs(lit.scene, settings), bricks, 2));
        CHECK(render_in_memory(lit.scene, settings).status == Status::done);
    }
}

TEST_CASE(WISP_ARITH_NAME ": with less memory than they need bricks make no picture") {
    const Lit lit;
    Settings settings = brick_settings(2, 1);
    settings.photons = 300;
    const Rendered whole = render_in_memory(lit.scene, settings);
    REQUIRE(whole.status == Status::done);
    std::vector<unsigned char> memory(whole.statistics.bytes.arena_size);
    for (size_t size = 0; size < 30; ++size)
        CHECK(is_untouched(
            render_in({memory.data(), whole.statistics.bytes.arena_peak * size / 30}, lit.scene, settings)));
}
