// Interpolated optical depths against exact ones, and pictures with them.
#include "core/lights/optical_depth_grid.h"
#include "support/built_smoke.h"
#include "support/compared_pictures.h"
#include "support/mixture.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

TEST_CASE(WISP_ARITH_NAME ": interpolated depths err with the square of the spacing, and without bias" *
          doctest::test_suite("long")) {
    const Mixture mixture;
    const BuiltMedium built(mixture.smokes);
    std::vector<Light> lights;
    for (const LightSource &light : mixture.lights) lights.push_back(make_light(light));
    double errors[2];
    for (int fine = 0; fine < 2; ++fine) {
        const double spacing = fine ? 0.25 : 0.5;
        const Scene scene = mixture.scene;
        const SparseGridPlan plan = plan_sparse_grid(scene, spacing);
        std::vector<unsigned char> memory(plan.bytes + optical_depth_grid_bytes(plan.count, 2, 1));
        Arena arena(memory.data(), memory.size());
        const SparseGrid bricks = make_sparse_grid(scene, spacing, arena);
        REQUIRE(bricks.ready);
        OpticalDepthGrid depths;
        uint64_t rays = 0;
        REQUIRE(make_optical_depth_grid(built.medium, lights.data(), 2, bricks, 1, arena, &rays, depths));
        Sequence next{5};
        double squares = 0, sum = 0;
        int found = 0;
        for (int i = 0; i < 2000; ++i) {
            const Vec3 x = vec(2 * next() - 1, 2 * next() - 1, 2 * next() - 1);
            Real sigma = Real(0);
            for (uint32_t s = 0; s < built.medium.count; ++s) sigma += extinction(built.medium.smokes[s].field, x);
            if (!(sigma > Real(0))) continue; // only points in smoke are asked for
            const Illumination from = illuminate(lights[1], x, x, x);
            const double exact = at(optical_depth(built.medium, {x, -from.direction}, from.distance));
            const double error = at(optical_depth_to_light(depths, 1, x)) - exact;
            squares += error * error;
            sum += error;
            ++found;
        }
        REQUIRE(found > 500);
        errors[fine] = std::sqrt(squares / found);
        CHECK(std::fabs(sum / found) < 0.25 * errors[fine]);
        CHECK(rays <= uint64_t{2} * bricks.count * nodes_of(1));
    }
    CHECK(errors[1] < 0.45 * errors[0]);
    CHECK(errors[0] < 0.1);
}

TEST_CASE(WISP_ARITH_NAME ": with interpolated depths a crop is a part of the whole, and the plan's bytes suffice") {
    const Mixture mixture;
    for (Method method : {Method::direct, Method::map}) {
        Settings settings = small_settings(6);
        settings.method = method;
        settings.photons = 500;
        settings.light_step = 0.5;
        const Rendered whole = render_in_memory(mixture.scene, settings);
        REQUIRE(whole.status == Status::done);
        CHECK(whole.statistics.bytes.arena_peak <= whole.statistics.bytes.arena_size);
        settings.light_step = 0;
        CHECK(relative_difference(whole.rgb, render_in_memory(mixture.scene, settings).rgb) < 0.02);
        settings.light_step = 0.5;
        settings.crop = {2, 3, 5, 5};
        const Rendered part = render_in_memory(mixture.scene, settings);
        for (size_t y = 0; y < 2; ++y)
            CHECK(std::memcmp(&part.rgb[9 * y], &whole.rgb[3 * (6 * (y + 3) + 2)], 9 * sizeof(float)) == 0);
    }
}
