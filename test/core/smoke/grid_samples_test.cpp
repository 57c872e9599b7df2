// Sparse grids, whose samples are in blocks: the same bits as of all samples of the box; and what they cost.
#include "core/smoke/grid_samples.h"
#include "support/blocked_grid.h"
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include <doctest/doctest.h>
#include <set>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Two balls of smoke in a box that is empty elsewhere.
struct TwoBalls {
    static constexpr int32_t nx = 45, ny = 30, nz = 37;

    TwoBalls() : density(size_t{nx} * ny * nz) {
        Sequence next{5};
        for (int32_t z = 0; z < nz; ++z)
            for (int32_t y = 0; y < ny; ++y)
                for (int32_t x = 0; x < nx; ++x) {
                    const auto near = [&](int32_t cx, int32_t cy, int32_t cz, int32_t radius) {
                        const int32_t dx = x - cx, dy = y - cy, dz = z - cz;
                        return dx * dx + dy * dy + dz * dz < radius * radius;
                    };
                    if (near(9, 8, 7, 6) || near(38, 24, 31, 8)) // the second one reaches the faces
                        density[static_cast<size_t>((z * ny + y) * nx + x)] = static_cast<float>(0.25 + next());
                }
        grid.nx = nx, grid.ny = ny, grid.nz = nz;
        grid.density = density.data();
        grid.extinction = 3;
        grid.half = {2.25, 1.5, 1.85};
        grid.axis[0] = {1, 0, 0}, grid.axis[1] = {0, 1, 0}, grid.axis[2] = {0, 0, 1};
    }
    std::vector<float> density;
    GridDescription grid = {};
};

struct Skipped {
    int32_t x, y, z;
};
constexpr Skipped all_skipped[] = {{0, 0, 0}, {7, 3, 5}, {1, 7, 2}};

const LightSource lamp = {LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": runs visit each stored sample of the box once, in both directions") {
    const TwoBalls dense;
    for (const Skipped &skipped : all_skipped) {
        const BlockedGrid blocked(dense.grid, skipped.x, skipped.y, skipped.z);
        CHECK(block_places(blocked.grid) == blocked.blocks.size());
        CHECK(stored_samples(blocked.grid) == blocked.samples.size());
        CHECK(blocked.samples.size() < dense.density.size() / 2);
        for (const GridDescription *grid : {&dense.grid, &blocked.grid})
            for (const bool backwards : {false, true}) {
                std::vector<float> found(dense.density.size(), -1.0f);
                int32_t last_y = -1, last_z = -1;
                for_each_run(
                    *grid,
                    [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t count) {
                        for (int32_t i = 0; i < count; ++i) {
                            float &sample = found[static_cast<size_t>((z * dense.ny + y) * dense.nx + x + i)];
                            CHECK(sample == -1.0f);
                            sample = densities[i];
                        }
                        if (!grid->blocks && last_z >= 0)
                            CHECK((backwards ? z < last_z || (z == last_z && y < last_y)
                                             : z > last_z || (z == last_z && y > last_y)));
                        last_y = y, last_z = z;
                        return true;
                    },
                    backwards);
                for (float &sample : found) sample = std::max(sample, 0.0f);
                CHECK(found == dense.density);
            }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a sparse grid has the bits of one with all samples") {
    const TwoBalls dense;
    const BuiltGrid all(dense.grid);
    for (const Skipped &skipped : all_skipped) {
        const BlockedGrid blocked(dense.grid, skipped.x, skipped.y, skipped.z);
        const BuiltGrid sparse(blocked.grid);
        REQUIRE(sparse.field.ready);
        CHECK(sparse.field.largest == all.field.largest);
        std::set<uint32_t> numbers;
        for (int32_t z = 0; z < dense.nz; ++z)
            for (int32_t y = 0; y < dense.ny; ++y)
                for (int32_t x = 0; x < dense.nx; ++x) {
                    const uint32_t number = number_of_sample(sparse.field, {x, y, z}),
                                   index = number_of_sample(all.field, {x, y, z});
                    CHECK(sparse.field.extinction[number] == all.field.extinction[index]);
                    if (!(all.field.extinction[index] > Real(0))) continue;
                    CHECK(number < stored_samples(blocked.grid));
                    CHECK(numbers.insert(number).second);
                    const Vec3 a = position_of_sample(sparse.field, number), b = position_of_sample(all.field, index);
                    CHECK((a.x == b.x && a.y == b.y && a.z == b.z));
                }
        Sequence next{9};
        int met = 0, hits = 0;
        for (int i = 0; i < 3000; ++i) {
            const auto inside = [&] { return vec(5 * next() - 2.5, 4 * next() - 2, 4 * next() - 2); };
            const Vec3 x = inside(), to = inside();
            CHECK(extinction(sparse.field, x) == extinction(all.field, x));
            met += extinction(all.field, x) > Real(0);
            const Ray ray = {x, normalize(to - x)};
            CHECK(optical_depth(sparse.field, ray, Real(3)) == optical_depth(all.field, ray, Real(3)));
            const Box box = {min(x, to), max(x, to)};
            CHECK(majorant(sparse.field, box) == majorant(all.field, box));
            const Event event = photon_event(uint64_t(i), 3);
            const Collision a = first_collision(sparse.field, ray, Real(9), event),
                            b = first_collision(all.field, ray, Real(9), event);
            CHECK(a.found == b.found);
            CHECK(a.distance == b.distance);
            if (!a.found) continue;
            ++hits;
            CHECK(a.element < stored_samples(blocked.grid));
            const Vec3 p = position_of_sample(sparse.field, a.element), q = position_of_sample(all.field, b.element);
            CHECK((p.x == q.x && p.y == q.y && p.z == q.z));
        }
        CHECK(met > 100);
        CHECK(hits > 100);
    }
}

TEST_CASE(WISP_ARITH_NAME ": pictures of a sparse grid have the bits of one with all samples, in the planned arena") {
    TwoBalls dense;
    int pictures = 0;
    for (const bool turned : {false, true}) {
        if (turned) dense.grid.axis[0] = {0.6, 0.8, 0}, dense.grid.axis[1] = {-0.8, 0.6, 0};
        const BlockedGrid blocked(dense.grid, 3, 6, 1);
        for (const Method method : {Method::direct, Method::map, Method::volume})
            for (const Goal goal : {Goal::picture, Goal::reference})
                for (const double step : {0.0, 0.5, 1.0}) {
                    if (goal == Goal::reference && (method != Method::volume || step > 0)) continue;
                    std::vector<float> pixels[2];
                    std::vector<PixelSums> sums[2];
                    for (int i = 0; i < 2; ++i) {
                        SmokeDescription smoke = grid_smoke_of(i ? blocked.grid : dense.grid);
                        smoke.total_area = 1; // sums of doubles in another order differ
                        const std::vector<LightSource> lights = {lamp};
                        Scene scene = scene_of(smoke, lights);
                        scene.camera = look_at_origin(12, 6, 12);
                        Settings settings = small_settings(12);
                        settings.goal = goal;
                        settings.method = method;
                        settings.photons = 500;
                        settings.density_step = settings.light_step = step;
                        settings.irradiance_step = step > 0 ? step : 1;
                        settings.last_pass = 2;
                        const Plan plan = renderer.plan(scene, settings);
                        std::vector<unsigned char> memory(plan.arena_bytes);
                        Arena arena(memory.data(), memory.size());
                        Statistics statistics;
                        pixels[i].resize(3 * 12 * 12);
                        sums[i].resize(12 * 12);
                        Job job = {scene, settings, arena, statistics, {}, pixels[i].data()};
                        job.pixels = sums[i].data();
                        REQUIRE(renderer.render(job) == Status::done);
                    }
                    CAPTURE(turned);
                    CAPTURE(static_cast<int>(method));
                    CAPTURE(step);
                    if (goal == Goal::picture) {
                        CHECK(*std::max_element(pixels[0].begin(), pixels[0].end()) > 0.01f);
                        CHECK(pixels[0] == pixels[1]);
                    } else {
                        bool any = false;
                        for (size_t p = 0; p < sums[0].size(); ++p)
                            for (int c = 0; c < 3; ++c) {
                                const WideSum &a = sums[0][p].channels[c].sum, &b = sums[1][p].channels[c].sum;
                                CHECK((a.high == b.high && a.low == b.low));
                                any = any || a.low != 0;
                            }
                        CHECK(any);
                    }
                    ++pictures;
                }
    }
    CHECK(pictures == 20);
}

TEST_CASE(WISP_ARITH_NAME ": a huge sparse grid costs what its blocks cost") {
    // 4,000 x 1,600 x 800 samples, 22 blocks of which have smoke: all samples would take 20 GB.
    GridDescription grid = {};
    grid.nx = 4000, grid.ny = 1600, grid.nz = 800;
    grid.extinction = 0.5;
    grid.half = {20, 8, 4};
    grid.axis[0] = {1, 0, 0}, grid.axis[1] = {0, 1, 0}, grid.axis[2] = {0, 0, 1};
    std::vector<uint32_t> blocks(static_cast<size_t>(block_places(grid)), no_block);
    uint32_t count = 0;
    for (int32_t i = 0; i < 22; ++i)
        blocks[static_cast<size_t>(((i * 4 % 100) * int64_t{200} + i * 9) * 500 + i * 22)] = count++;
    std::vector<float> density(size_t{count} * samples_of_block, 0.75f);
    grid.density = density.data();
    grid.blocks = blocks.data();
    grid.block_count = count;
    const SmokeDescription smoke = grid_smoke_of(grid);
    const std::vector<LightSource> lights = {lamp};
    Scene scene = scene_of(smoke, lights);
    Settings settings = small_settings(8);
    settings.photons = 100;
    settings.density_step = settings.light_step = settings.irradiance_step = 1;
    const Plan plan = renderer.plan(scene, settings);
    CHECK(plan.bricks >= count);
    CHECK(plan.bricks <= 27 * count); // itself and its neighbours
    CHECK(plan.arena_bytes < 320 << 20);
    std::vector<unsigned char> memory(plan.arena_bytes);
    Arena arena(memory.data(), memory.size());
    Statistics statistics;
    std::vector<float> rgb(3 * 8 * 8);
    Job job = {scene, settings, arena, statistics, {}, rgb.data()};
    CHECK(renderer.render(job) == Status::done);
}
