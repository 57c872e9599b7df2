// The march through exact densities: transmittance, emission and the weight of a step have closed forms (S1, N-E4).
#include "core/march/ray_march.h"
#include "support/built_sparse_grid.h"
#include "support/thin_wall.h"

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr double half = 2;

// A box of constant extinction, 2 half wide, that emits the radiance 1 0.5 0.25 per unit of depth.
SmokeDescription glowing_box(double sigma) {
    SmokeDescription box =
        grid_smoke_of({1, 1, 1, nullptr, sigma, {0, 0, 0}, {half, half, half}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
    box.albedo = {0, 0, 0};
    box.emission = {1, 0.5, 0.25};
    return box;
}

const Ray along_x = {vec(-3, 0.25, 0.5), vec(1, 0, 0)};

Segment march_box(double sigma, double step, const std::vector<Light> &lights = {}, double albedo = 0) {
    SmokeDescription box = glowing_box(sigma);
    box.albedo = {albedo, albedo, albedo};
    const BuiltMedium built({box});
    Statistics statistics;
    Real extinctions[1];
    Marcher marcher = {};
    marcher.medium = &built.medium;
    marcher.lights = {lights.data(), static_cast<uint32_t>(lights.size()), nullptr, nullptr};
    marcher.steps = {real(step), real(step), Real(1)};
    marcher.extinctions = extinctions;
    marcher.statistics = &statistics;
    const Segment seen = march(marcher, along_x, infinite_distance, nullptr);
    // Each step, and its parts: not deeper than 1/8.
    CHECK(statistics.smoke.march_samples <= static_cast<uint64_t>((2 * half / step + 1) * (2 + sigma * step * 8)));
    return seen;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a march through a constant box follows Beer and Lambert, whatever the step") {
    for (const double sigma : {0.01, 0.5, 2.0})
        for (const double step : {4.0, 1.0, 0.3, 0.01}) {
            CAPTURE(sigma);
            CAPTURE(step);
            const double depth = 2 * half * sigma;
            const double error = 500 * unit_error + 3.2e-11; // of the series of a step's weight
            const Segment seen = march_box(sigma, step);
            CHECK(std::fabs(at(seen.transmittance) - std::exp(-depth)) < error);
            CHECK(std::fabs(at(seen.radiance.x) - (1 - std::exp(-depth))) < error);
            CHECK(std::fabs(at(seen.radiance.z) - 0.25 * (1 - std::exp(-depth))) < error);
        }
}

TEST_CASE(WISP_ARITH_NAME ": a march ends where the smoke is opaque, and beyond smoke there is nothing") {
    const Segment seen = march_box(100, 0.01);
    CHECK(at(seen.transmittance) < 1.2e-7);
    CHECK(std::fabs(at(seen.radiance.x) - 1) < 500 * unit_error + 1.2e-7);

    const BuiltMedium built({glowing_box(1)});
    Marcher marcher = {};
    marcher.medium = &built.medium;
    const Segment beside = march(marcher, {vec(-3, 2.5, 0), vec(1, 0, 0)}, infinite_distance, nullptr);
    CHECK(at(beside.transmittance) == 1);
    CHECK(at(beside.radiance.x) == 0);
}

TEST_CASE(WISP_ARITH_NAME ": single scattering of a parallel light along the ray has its closed form") {
    // Light travels along the ray's direction: at depth s the light has come through s, and what is scattered back to
    // the eye goes through s again: A / (4 pi) E int e^-2s ds, beside the emission (1 - A) int e^-s ds.
    Light light = {};
    light.kind = LightKind::parallel;
    light.direction = along_x.direction;
    light.color = Color(Real(2));
    const double sigma = 0.5, albedo = 0.5, depth = 2 * half * sigma, pi = 3.14159265358979323846;
    const double exact = albedo / (4 * pi) * 2 * (1 - std::exp(-2 * depth)) / 2 + (1 - albedo) * (1 - std::exp(-depth));
    // The light's own depth is sampled in the middle of steps: s^2 / 24 of it.
    CHECK(at(march_box(sigma, 0.01, {light}, albedo).radiance.x) == doctest::Approx(exact).epsilon(3e-5));
}

TEST_CASE(WISP_ARITH_NAME ": the weight of a step is (1 - e^-s) / s, in its series too") {
    CHECK(at(mean_transmittance(Real(0))) == 1);
    for (const double s : {1e-6, 0.001, 0x1p-7 * 0.999, 0x1p-7, 0.1, 1.0, 16.0})
        CHECK(std::fabs(at(mean_transmittance(real(s))) + std::expm1(-at(real(s))) / at(real(s))) <
              8 * unit_error / std::min(1.0, s < 0x1p-7 ? 1.0 : s) + 4e-11);
}

TEST_CASE(WISP_ARITH_NAME ": a depth of many small steps keeps its digits") {
    Depth depth;
    const Real step = real(1e-4);
    for (int i = 0; i < 100000; ++i) depth.add(step);
    CHECK(std::fabs(at(depth.value) - 1e5 * at(step)) < 32 * unit_error);
}

TEST_CASE(WISP_ARITH_NAME ": a wall that is thinner than a step is as deep as it is to single steps, resampled or not") {
    const ThinWall wall;
    const BuiltMedium exact({wall.smoke});
    const Resampled resampled({wall.smoke}, 0.5);
    for (const Medium *medium : {&exact.medium, &resampled.medium}) {
        Statistics statistics;
        Real extinctions[1];
        Marcher marcher = {};
        marcher.medium = medium;
        marcher.steps = {real(wall.step), real(wall.step), Real(1)};
        marcher.extinctions = extinctions;
        marcher.statistics = &statistics;
        check_thin_wall([&](Real end) { return march(marcher, wall.ray, end, nullptr); });
    }
}
