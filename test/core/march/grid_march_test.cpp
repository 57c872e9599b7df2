// The march through resampled smoke, eight steps side by side. Whole pictures are in sparse_grid_test and render_test.
#include "core/march/grid_march.h"
#include "support/built_sparse_grid.h"
#include "support/thin_wall.h"
#include <cmath>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

struct MarchRoom {
    std::vector<unsigned char> memory = std::vector<unsigned char>(march_room_bytes());
    Arena arena{memory.data(), memory.size()};
    GridMarchRoom *room = make_march_room(arena);
};

// The same smoke marched by lanes and step by step.
void compare_marches(const std::vector<SmokeDescription> &sources, const Ray &ray, double step) {
    const Resampled built(sources, 1);
    Statistics statistics;
    const OpticalDepthGrid no_lights = {&built.medium, nullptr, 0, built.medium.bricks, 1, nullptr, false};
    MarchRoom own;
    GridMarcher lanes_marcher = {&built.medium, &no_lights,  nullptr, nullptr, real(step),
                                 Real(0),       &statistics, {},      own.room};
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

// A point light in the middle of a box of 16 x 16 x 16 cells of edge 1, under a map whose nodes hold nothing.
struct LampInBox {
    explicit LampInBox(double g, int32_t spacing_)
        : built({source(g)}, 1), light{LightKind::point, vec(0, 0, 0), vec(0, 0, 1), Real(0), Color(real(intensity))},
          memory(optical_depth_grid_bytes(built.bricks().count, 1, 1)), value(nodes_of(1) * built.bricks().count),
          first(built.bricks().count), spacing(built.bricks().count, spacing_), scale(built.bricks().count) {
        Arena arena(memory.data(), memory.size());
        uint64_t rays = 0;
        REQUIRE(make_optical_depth_grid(built.medium, &light, 1, built.bricks(), 1, arena, &rays, depths));
        map.bricks = &built.bricks();
        map.first = first.data();
        map.spacing = spacing.data();
        map.scale = scale.data();
        map.value = value.data();
        map.single_channel = true;
        map.incident = true;
        map.color = Color(Real(1));
    }
    static SmokeDescription source(double g) {
        SmokeDescription box = box_smoke({8, 8, 8}, sigma, 16);
        box.asymmetry = g;
        box.albedo = {albedo, albedo, albedo};
        return box;
    }
    // Of a ray along x that passes the light at distance y.
    double radiance(double y, bool of_map) {
        MarchRoom own;
        GridMarcher marcher = {
            &built.medium, &depths, of_map ? &map : nullptr, nullptr, real(1), Real(0), &statistics, {}, own.room};
        return at(march(marcher, {vec(-20, y, 0), vec(1, 0, 0)}, infinite_distance, nullptr).radiance.x);
    }
    // The same by steps through exact densities.
    double radiance_step_by_step(double y, bool of_map) {
        Real extinction;
        Marcher marcher = {};
        marcher.medium = &built.medium;
        marcher.lights = {&light, 1, nullptr, nullptr};
        marcher.irradiance = of_map ? &map : nullptr;
        marcher.steps = {real(1), real(1), Real(1)};
        marcher.extinctions = &extinction;
        marcher.statistics = &statistics;
        return at(march(marcher, {vec(-20, y, 0), vec(1, 0, 0)}, infinite_distance, nullptr).radiance.x);
    }
    static constexpr double sigma = 0.03125, albedo = 0.75, intensity = 2000;
    Resampled built;
    Light light;
    std::vector<unsigned char> memory;
    std::vector<uint32_t> value;
    std::vector<int32_t> first, spacing;
    std::vector<ColorScale> scale;
    OpticalDepthGrid depths = {};
    Irradiance map = {};
    Statistics statistics;
};

double henyey_greenstein(double g, double cosine) {
    return (1 - g * g) / (4 * pi_ * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

// What leaves along a direction at angle `towards` to the way from the light, of light that was scattered twice, at
// distance 1, per sigma_s^2 and intensity. The place of the first scattering is told by the angles at the light and
// here, which add up to the angle that the light turns by there, and by a third one around the way: its volume over
// both squared distances is the product of their differentials.
double scattered_twice(double g, double towards) {
    const int n = 48;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        const double turn = (i + 0.5) * pi_ / n;
        double mean = 0;
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) {
                const double here = (j + 0.5) * turn / n, around = (k + 0.5) * pi_ / n;
                mean += henyey_greenstein(g, std::cos(here) * std::cos(towards) +
                                                 std::sin(here) * std::sin(towards) * std::cos(around)) /
                        (n * n);
            }
        sum += henyey_greenstein(g, std::cos(turn)) * turn * mean * 2 * pi_ * pi_ / n;
    }
    return sum;
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
    MarchRoom own;
    GridMarcher marcher = {&built.medium, &no_lights,  nullptr, nullptr, real(wall.step),
                           Real(0),       &statistics, {},      own.room};
    check_thin_wall([&](Real end) { return march(marcher, wall.ray, end, nullptr); });
}

TEST_CASE(WISP_ARITH_NAME ": around a light the march adds what nodes blur of the light that was scattered twice" *
          doctest::test_suite("long")) {
    for (const double g : {0.0, 0.3, 0.5, -0.5})
        for (const int32_t spacing : {1, 2}) {
            LampInBox box(g, spacing);
            const double reach = std::sqrt(2.0) * spacing;
            for (const double y : {0.1875, 0.5625, 0.9375}) {
                const double half = std::sqrt(reach * reach - y * y);
                const int steps = 64;
                double expected = 0;
                for (int i = 0; i < steps; ++i) {
                    const double x = (2 * (i + 0.5) / steps - 1) * half, r = std::hypot(x, y);
                    expected += scattered_twice(g, std::acos(-x / r)) / r * (1 - r / reach) * (1 - r / reach) *
                                std::exp(-box.sigma * (r + x + 8)) * 2 * half / steps;
                }
                expected *= box.sigma * box.sigma * box.albedo * box.albedo * box.intensity;
                CAPTURE(g);
                CAPTURE(spacing);
                CAPTURE(y);
                const double peak = box.radiance(y, true) - box.radiance(y, false);
                CHECK(std::fabs(peak / expected - 1) < 0.1);
                CHECK(std::fabs((box.radiance_step_by_step(y, true) - box.radiance_step_by_step(y, false)) / peak - 1) <
                      0.01);
            }
            CHECK(box.radiance(reach + 0.25, true) == box.radiance(reach + 0.25, false));
            box.light.kind = LightKind::constant; // has no falloff, and no peak
            CHECK(box.radiance(0.5625, true) == box.radiance(0.5625, false));
        }
}
