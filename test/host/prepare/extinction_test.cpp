// The depth of a density grid's samples where diffuse light enters, by which its cells are chosen.
#include "host/prepare/extinction.h"
#include <cmath>
#include <doctest/doctest.h>
#include <vector>

using namespace wisp;

namespace {

struct TestGrid {
    TestGrid(int32_t nx, int32_t ny, int32_t nz, const std::vector<float> &density_) : density(density_) {
        REQUIRE(density.size() == static_cast<size_t>(nx * ny * nz));
        grid.nx = nx, grid.ny = ny, grid.nz = nz;
        grid.density = density.data();
        grid.extinction = 1;
        grid.half = {nx * 0.5, ny * 0.5, nz * 0.5}; // samples are cubes of edge 1
    }
    // The root mean square of depths of samples along one column that light meets one after the other.
    static double along(const std::vector<double> &depths) {
        double tau = 0, light = 0, sum = 0;
        for (double depth : depths) {
            const double out = 1 / (1 + 0.75 * tau) - 1 / (1 + 0.75 * (tau + depth));
            tau += depth, light += out, sum += out * depth * depth;
        }
        return std::sqrt(sum / light);
    }

    std::vector<float> density;
    GridDescription grid = {};
};

} // namespace

TEST_CASE("extinction: light enters an even grid where that is as deep as anywhere, however deep and wide it is") {
    for (const float density : {1e-3f, 0.5f, 3.0f}) {
        TestGrid test(3, 4, 5, std::vector<float>(60, density));
        CHECK(lit_depth(test.grid) == doctest::Approx(double{density}));
        test.grid.half.y *= 10; // the longest edge counts
        test.grid.extinction = 2;
        CHECK(lit_depth(test.grid) == doctest::Approx(20 * double{density}));
    }
    CHECK(lit_depth(TestGrid(2, 2, 2, std::vector<float>(8, 0.0f)).grid) == 0);
    CHECK(lit_depth(TestGrid(2, 1, 1, {1e30f, 1e-30f}).grid) > 1e3);
    TestGrid deep(2, 1, 1, {1e38f, 3e38f});
    deep.grid.extinction = 1e300;
    CHECK(lit_depth(deep.grid) > 1e3);
}

TEST_CASE("extinction: light is where it enters, from the side where samples are the deepest") {
    // Along x: 0.1, 0.2, 5. From the front most light goes out before the deep sample, from behind in it.
    CHECK(lit_depth(TestGrid(3, 1, 1, {0.1f, 0.2f, 5}).grid) == doctest::Approx(TestGrid::along({5, 0.2, 0.1})));
    // A core that no light reaches but through much smoke, along each axis.
    const std::vector<float> soft = {0.25f, 0.5f, 1, 2, 4, 8, 4, 2, 1, 0.5f, 0.25f};
    const double expected = TestGrid::along({soft.begin(), soft.end()});
    // Across a column all samples meet light at once. So the columns stand beside each other.
    for (int axis : {0, 1, 2}) {
        const int32_t n[3] = {axis == 0 ? 11 : 1, axis == 1 ? 11 : 1, axis == 2 ? 11 : 1};
        const TestGrid test(n[0], n[1], n[2], soft);
        double light = 0, sum = 0;
        for (float depth : soft) {
            const double out = 1 - 1 / (1 + 0.75 * double{depth});
            light += out, sum += out * double{depth} * double{depth};
        }
        CHECK(lit_depth(test.grid) == doctest::Approx(std::max(expected, std::sqrt(sum / light))));
    }
}

TEST_CASE("extinction: a soft ball is lit where it is thin, a hollow one on its inner face, too") {
    constexpr int32_t n = 24;
    const auto ball = [](auto &&density_at) {
        std::vector<float> density;
        for (int32_t z = 0; z < n; ++z)
            for (int32_t y = 0; y < n; ++y)
                for (int32_t x = 0; x < n; ++x) {
                    const double r =
                        std::sqrt((x - 11.5) * (x - 11.5) + (y - 11.5) * (y - 11.5) + (z - 11.5) * (z - 11.5));
                    density.push_back(static_cast<float>(density_at(r / 12)));
                }
        return TestGrid(n, n, n, density);
    };
    const auto soft = [](double r) { return r < 1 ? 4 * (1 - r) * (1 - r) : 0; };
    CHECK(lit_depth(ball(soft).grid) < 1);
    CHECK(lit_depth(ball([](double r) { return r < 1 ? 4.0 : 0.0; }).grid) == doctest::Approx(4).epsilon(0.01));
    // Emptiness in the dense core: there may be a lamp.
    const double hollow = lit_depth(ball([&](double r) { return r < 0.3 ? 0 : soft(r); }).grid);
    CHECK(hollow > 1.1 * lit_depth(ball(soft).grid));
}

TEST_CASE("extinction: around lights that stand in smoke, and no others") {
    const auto depth_at = [](const SmokeDescription &smoke, const Double3 &place, LightKind kind = LightKind::point) {
        const LightSource light = {kind, place, {0, 0, -1}, 0.1, {1, 1, 1}};
        Scene scene = {};
        scene.smokes = &smoke;
        scene.smoke_count = 1;
        scene.lights = &light;
        scene.light_count = 1;
        return density_of(scene).depth_at_lights;
    };
    // A sample of 5 in a row, turned by a quarter about z: x of the grid is y of the scene.
    TestGrid row(6, 1, 1, {0, 0, 5, 0, 0, 0});
    SmokeDescription smoke = {};
    row.grid.axis[0] = {0, 1, 0}, row.grid.axis[1] = {-1, 0, 0}, row.grid.axis[2] = {0, 0, 1};
    row.grid.center = {10, 0, 0};
    row.grid.extinction = 2;
    smoke.grid = row.grid;
    smoke.smallest_h = smoke.largest_h = 1;
    smoke.total_area = 10;
    CHECK(depth_at(smoke, {10, -0.5, 0}) == 10); // in it
    CHECK(depth_at(smoke, {10.4, 0.5, 0.4}) == 10);
    CHECK(depth_at(smoke, {10, -1.9, 0}, LightKind::spot) == 10); // next to it
    CHECK(depth_at(smoke, {10, 1.1, 0}) == 0);                    // two from it
    CHECK(depth_at(smoke, {10, -0.5, 0.6}) == 0);                 // beside the grid
    CHECK(depth_at(smoke, {9, -0.5, 0}) == 0);
    CHECK(depth_at(smoke, {10, -0.5, 0}, LightKind::parallel) == 0);
    CHECK(depth_at(smoke, {10, -0.5, 0}, LightKind::constant) == 0);
    // A box is as dense anywhere; lengths are a twentieth of its shortest edge.
    smoke.grid.density = nullptr;
    smoke.grid.nx = smoke.grid.ny = smoke.grid.nz = 1;
    smoke.smallest_h = smoke.largest_h = 0.05;
    CHECK(depth_at(smoke, {10, 2.9, 0}) == doctest::Approx(2 * 0.05));
    CHECK(depth_at(smoke, {10, 3.1, 0}) == 0);
    // Of 100 particles all areas in the ball of two smoothing lengths, relative to its volume.
    const std::vector<Particle> particles(100, {{1, 2, 3}, 0.5, 0.02});
    smoke = {};
    smoke.particles = particles.data();
    smoke.count = 100;
    smoke.smallest_h = smoke.largest_h = 0.5;
    smoke.total_area = 2;
    const double mean = 2 / (4.0 / 3 * 3.14159265358979) * 0.5;
    CHECK(depth_at(smoke, {1, 2.9, 3}) == doctest::Approx(mean));
    CHECK(depth_at(smoke, {1, 3.1, 3}) == 0);
}
