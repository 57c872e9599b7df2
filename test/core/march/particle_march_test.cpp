// The march over a particle map: windows of steps, and the sources of particles and grids. Whole pictures are in
// particle_map_test.
#include "core/march/particle_march.h"
#include "support/thin_wall.h"

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Marches with sources of radiance 1 0.5 0.25 per unit of depth, the same for all elements.
Segment march_sources(const BuiltMedium &built, uint32_t elements, const Ray &ray, double step,
                      Real end = infinite_distance) {
    const std::vector<Color> source(elements, Color(real(1), real(0.5), real(0.25)));
    const Color *const sources[] = {source.data()};
    std::vector<unsigned char> memory(window_bytes(built.scene));
    Arena arena(memory.data(), memory.size());
    Statistics statistics;
    ParticleMarcher marcher = {};
    REQUIRE(make_window(built.scene, arena, marcher));
    marcher.medium = &built.medium;
    marcher.sources = sources;
    marcher.steps = {real(step), real(step), Real(1)};
    marcher.statistics = &statistics;
    return march(marcher, ray, end, nullptr);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": sources in a constant box have their closed form over part of a window and over several") {
    const BuiltMedium built(
        {grid_smoke_of({1, 1, 1, nullptr, 0.5, {0, 0, 0}, {2, 2, 2}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}})});
    for (const double step : {4.0, 0.1, 4.0 / window_steps, 0.011}) {
        CAPTURE(step);
        const Segment seen = march_sources(built, 1, {vec(-3, 0.25, 0.5), vec(1, 0, 0)}, step);
        CHECK(std::fabs(at(seen.transmittance) - std::exp(-2.0)) < 500 * unit_error);
        CHECK(std::fabs(at(seen.radiance.x) - (1 - std::exp(-2.0))) < 500 * unit_error + 3.2e-11);
        CHECK(std::fabs(at(seen.radiance.z) - 0.25 * (1 - std::exp(-2.0))) < 500 * unit_error + 3.2e-11);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": particles of one source radiance send it times the opacity, and their depth is the exact one") {
    for (const Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const std::vector<Particle> particles = cloud(100, 1.5, 0.5, 0.1);
        const BuiltMedium built({smoke_of(particles, kernel)});
        const Ray ray = {vec(-5, 0.25, 0.125), vec(1, 0, 0)};
        const Segment seen = march_sources(built, point_tree_slots(100), ray, 0.01);
        const double opacity = 1 - at(seen.transmittance);
        CHECK(opacity > 0.1);
        CHECK(at(seen.radiance.x) == doctest::Approx(opacity).epsilon(1e-5));
        CHECK(at(seen.radiance.y) == doctest::Approx(0.5 * opacity).epsilon(1e-5));
        // Steps of a fiftieth of h: the midpoint rule errs by about (step / h)^2.
        const double exact = std::exp(-at(optical_depth(built.medium, ray, infinite_distance)));
        CHECK(at(seen.transmittance) == doctest::Approx(exact).epsilon(1e-3));
    }
}

TEST_CASE(WISP_ARITH_NAME ": a wall that is thinner than a step is as deep as it is in a window of steps") {
    const ThinWall wall;
    const BuiltMedium built({wall.smoke});
    const uint32_t samples = static_cast<uint32_t>(wall.samples.size());
    check_thin_wall([&](Real end) { return march_sources(built, samples, wall.ray, wall.step, end); });
}
