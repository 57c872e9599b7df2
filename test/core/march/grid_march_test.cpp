// The march through resampled smoke, eight steps side by side. Whole pictures are in sparse_grid_test and render_test.
#include "core/march/grid_march.h"
#include "support/built_sparse_grid.h"
#include "support/thin_wall.h"

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// The same smoke marched by lanes and step by step.
void compare_marches(const std::vector<SmokeDescription> &sources, const Ray &ray, double step) {
    const Resampled built(sources, 1);
    Statistics statistics;
    const OpticalDepthGrid no_lights = {&built.medium, nullptr, 0, built.medium.bricks, 1, nullptr, false};
    GridMarcher lanes_marcher = {&built.medium, &no_lights, nullptr, nullptr, real(step), Real(0), &statistics};
    const Segment seen = march(lanes_marcher, ray, infinite_distance, nullptr);
    std::vector<Real> extinctions(sources.size());
    Marcher marcher = {};
    marcher.medium = &built.medium;
    marcher.steps = {real(step), real(step), Real(1)};
    marcher.extinctions = extinctions.data();
    marcher.statistics = &statistics;
    const Segment expected = march(marcher, ray, infinite_distance, nullptr);
    CHECK(at(expected.transmittance) < 0.9);
    CHECK(std::fabs(at(seen.transmittance) - at(expected.transmittance)) < 2000 * unit_error);
    CHECK(std::fabs(at(seen.radiance.x) - at(expected.radiance.x)) < 2000 * unit_error + 1e-8);
    // One source function everywhere: radiance is source times opacity, whatever the density.
    CHECK(std::fabs(at(seen.radiance.x) - (1 - at(seen.transmittance))) < 2000 * unit_error + 1e-8);
    CHECK(std::fabs(at(seen.radiance.z) - 0.25 * (1 - at(seen.transmittance))) < 2000 * unit_error + 1e-8);
}

SmokeDescription glowing(SmokeDescription smoke) {
    smoke.albedo = {0, 0, 0};
    smoke.emission = {1, 0.5, 0.25};
    return smoke;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": eight steps at a time see what single steps see, and opacity times the source function") {
    const std::vector<Particle> particles = cloud(100, 3, 1, 0.5);
    const Ray ray = {vec(-9, 0.25, 0.5), normalize(vec(1, 0.125, -0.0625))};
    for (const double step : {0.5, 0.11, 2.5}) {
        CAPTURE(step);
        compare_marches({glowing(smoke_of(particles))}, ray, step);
        compare_marches({glowing(box_smoke({2, 3, 4}, 0.5, 20))}, ray, step);
        compare_marches({glowing(smoke_of(particles)), glowing(smoke_of(particles, Kernel::poly6))}, ray, step);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a wall that is thinner than a step is as deep as it is, wherever a ray ends in it") {
    const ThinWall wall;
    const Resampled built({wall.smoke}, 0.5);
    Statistics statistics;
    const OpticalDepthGrid no_lights = {&built.medium, nullptr, 0, built.medium.bricks, 1, nullptr, false};
    GridMarcher marcher = {&built.medium, &no_lights, nullptr, nullptr, real(wall.step), Real(0), &statistics};
    check_thin_wall([&](Real end) { return march(marcher, wall.ray, end, nullptr); });
}
