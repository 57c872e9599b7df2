// The particle map against the reference, against `direct` where both must agree, and its deposits (S4-3).
#include "core/march/particle_march.h"
#include "support/built_map.h"
#include "support/compared_pictures.h"
#include "support/mixture.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <type_traits>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Of a ray: some hundreds of rounded sums.
constexpr double rounding = 200 * unit_error;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": without photons the particle map renders what direct renders") {
    // The same steps, the same sums in another order: windows, chords and padding must lose or add nothing.
    const Mixture mixture;
    for (double step : {0.5, 0.03}) { // a part of a window, and several
        Settings settings = small_settings(6);
        settings.step = step;
        const Rendered direct = render_in_memory(mixture.scene, settings);
        settings.method = Method::map;
        const Rendered map = render_in_memory(mixture.scene, settings);
        REQUIRE(direct.status == Status::done);
        REQUIRE(map.status == Status::done);
        CHECK(relative_difference(map.rgb, direct.rgb) < rounding);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a camera in the smoke sees the same through the particle map") {
    Mixture mixture;
    for (double z : {1.5, 0.0}) {
        mixture.scene.camera.origin = {0.3, 0.1, z};
        Settings settings = small_settings(6);
        settings.step = 0.25; // none is divided: the bound of rounding is that of whole steps
        const Rendered direct = render_in_memory(mixture.scene, settings);
        settings.method = Method::map;
        const Rendered map = render_in_memory(mixture.scene, settings);
        CHECK(relative_difference(map.rgb, direct.rgb) < rounding);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the particle map is as bright as the reference" * doctest::test_suite("long")) {
    // The sum of a picture, of all orders of scattering. What kernels blur goes with the square of the depth of a
    // smoothing length, here 0.35: 1.5 %. With g = 0.5 the flux stands for all directions: 2 % more.
    struct {
        double g;
        Double3 albedo, emission;
        double bias;
    } const rows[] = {{0, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.015},
                      {0.5, {1, 0.8, 0.5}, {0, 0, 0}, 0.035},
                      {0, {0.9, 0.9, 0.9}, {0.02, 0.01, 0}, 0.015}};
    const std::vector<Particle> particles = cloud(2400, 3, 0.8, 0.04);
    for (const auto &row : rows) {
        SmokeDescription smoke = smoke_of(particles);
        smoke.asymmetry = row.g;
        smoke.albedo = row.albedo;
        smoke.emission = row.emission;
        const std::vector<LightSource> lights = {{LightKind::point, {6, 5, 4}, {0, 0, 1}, 2, {40, 40, 40}}};
        Scene scene = scene_of(smoke, lights);
        scene.camera = look_at_origin(12, 5, 4);
        double noise;
        const std::vector<float> truth = reference_of(scene, 4, std::is_same_v<Real, float> ? 200 : 100, noise);
        Settings settings = map_settings(4, 20000);
        const Rendered map = render_in_memory(scene, settings);
        REQUIRE(map.status == Status::done);
        // Pixels are drawn apart, photons too; what one photon brings varies as much as all.
        const double stored = static_cast<double>(map.statistics.photons.stored);
        const double error = std::sqrt(noise * noise / 16 + 2 / stored);
        CAPTURE(row.g);
        CHECK(error < 0.03);
        CHECK(std::fabs(sum_of(map.rgb) / sum_of(truth) - 1) < 3.5 * error + row.bias);
        settings.photons = 0; // without what is scattered twice and more it is far from it
        CHECK(sum_of(render_in_memory(scene, settings).rgb) < 0.85 * sum_of(truth));
    }
}

TEST_CASE(WISP_ARITH_NAME ": the depths of a flight's elements add up to the whole") {
    const Mixture mixture;
    const BuiltMedium built(mixture.smokes);
    Sequence next{21};
    for (int i = 0; i < 60; ++i) {
        const Vec3 from = vec(8 * next() - 4, 8 * next() - 4, 8 * next() - 4);
        const Ray ray = {from, normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375))};
        const Real end = real(i % 3 ? 6 * next() : 50);
        for (uint32_t s = 0; s < 3; ++s) {
            const DensityField &field = built.medium.smokes[s].field;
            double sum = 0, elements = elements_of(mixture.smokes[s]);
            for_each_depth(field, ray, end, [&](uint32_t element, Real depth) {
                CHECK(element < elements);
                CHECK(depth >= Real(0));
                sum += at(depth);
            });
            CHECK(std::fabs(sum - at(optical_depth(field, ray, end))) <
                  2e-5 * (1 + sum) * (unit_error < 1e-12 ? 1e-8 : 1));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": deposits along flights have the mean of deposits at collisions, and less variance") {
    const Mixture mixture;
    double power[2][3], spread[2];
    for (int path = 0; path < 2; ++path) {
        double sums[8][3];
        for (int run = 0; run < 8; ++run) {
            Settings settings = map_settings(1, 1500);
            settings.deposit = path ? Deposit::path : Deposit::exact;
            settings.seed = static_cast<uint64_t>(run);
            const TracedMap traced(mixture.scene, settings);
            const ParticleMap &map = traced.map;
            for (uint32_t s = 0; s < 3; ++s) {
                sums[run][s] = 0;
                for (uint32_t i = 0; i < 3 * map.per_smoke[s].count; i += 3)
                    sums[run][s] += static_cast<double>(map.per_smoke[s].power[i]) * 0x1p-24;
            }
        }
        spread[path] = 0;
        for (uint32_t s = 0; s < 3; ++s) {
            power[path][s] = 0;
            for (const auto &run : sums) power[path][s] += run[s] / 8;
            for (const auto &run : sums) spread[path] += std::pow(run[s] / power[path][s] - 1, 2);
        }
    }
    for (uint32_t s = 0; s < 3; ++s) { // 12,000 photons' deposits; those of one photon vary about as their number
        CAPTURE(s);
        CHECK(power[0][s] > 100);
        CHECK(std::fabs(power[1][s] / power[0][s] - 1) < 4 * std::sqrt(3 / (8 * power[0][s])));
    }
    CHECK(spread[1] < spread[0]);
}

TEST_CASE(WISP_ARITH_NAME ": a kernel deposit is divided in proportion to the density, and adds up to the photon") {
    // Against the density's definition, for every element.
    const Mixture mixture;
    const BuiltMedium built(mixture.smokes);
    Sequence next{17};
    uint32_t deposited = 0;
    for (int round = 0; round < 90; ++round) {
        const uint32_t s = static_cast<uint32_t>(round) % 3;
        const SmokeDescription &smoke = mixture.smokes[s];
        const DensityField &field = built.medium.smokes[s].field;
        const uint32_t count = elements_of(smoke);
        const uint32_t channels = round % 2 ? 3 : 1;
        const Direction kind = round % 4 < 2 ? Direction::flux : Direction::mean;
        const double x[3] = {4 * next() - 2, 4 * next() - 2, 4 * next() - 2};
        const Vec3 at_x = vec(x[0], x[1], x[2]), direction = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.5));
        const double color[3] = {1, next(), next()};
        std::vector<int64_t> power(count * channels), flux(count * 3);
        const Deposits deposits = {power.data(), flux.data(), count, channels, kind};
        const bool done = deposit_by_kernel(deposits, field, at_x, vec(color[0], color[1], color[2]), direction);
        CHECK(done == (at(extinction(field, at_x)) > 0));
        if (!done) continue;
        ++deposited;

        std::vector<double> contribution(count);
        double total = 0;
        for (uint32_t i = 0; i < count; ++i) {
            if (smoke.is_grid()) {
                const GridDescription &grid = smoke.grid;
                double product = static_cast<double>(grid.density[i]);
                // The tent's value: of the distance in cells, flat over the outer half of the border cells.
                const int n[3] = {grid.nx, grid.ny, grid.nz},
                          half_steps[3] = {2 * static_cast<int>(i) % (2 * n[0]) + 1,
                                           2 * (static_cast<int>(i) / n[0] % n[1]) + 1,
                                           2 * (static_cast<int>(i) / n[0] / n[1]) + 1};
                const double d[3] = {x[0] - grid.center.x, x[1] - grid.center.y, x[2] - grid.center.z};
                const double half[3] = {grid.half.x, grid.half.y, grid.half.z};
                for (int k = 0; k < 3; ++k) {
                    const double along = d[0] * grid.axis[k].x + d[1] * grid.axis[k].y + d[2] * grid.axis[k].z;
                    const double place = std::clamp((along / half[k] + 1) * n[k] / 2, 0.5, n[k] - 0.5);
                    product *= std::max(0.0, 1 - std::fabs(place - 0.5 * half_steps[k]));
                }
                contribution[i] = product;
            } else {
                const uint32_t id = field.particles.tree.id[i];
                contribution[i] = brute_density({smoke.particles[id]}, smoke.kernel, x[0], x[1], x[2]);
            }
            total += contribution[i];
        }
        // In units: rounding of the sum, and of two results; in fixed the parts of thin places have few digits.
        const double bar = 2 + 0x1p24 * 500 * unit_error * std::max(1.0, std::is_same_v<Real, Fixed> ? 1 / total : 0);
        const double v[3] = {at(direction.x), at(direction.y), at(direction.z)};
        int64_t power_sum[3] = {}, flux_sum[3] = {};
        for (uint32_t i = 0; i < count; ++i) {
            const double fraction = contribution[i] / total;
            for (uint32_t c = 0; c < channels; ++c) {
                const int64_t found = power[i * channels + c];
                power_sum[c] += found;
                CHECK(std::fabs(static_cast<double>(found) - color[c] * fraction * 0x1p24) <= bar);
            }
            for (uint32_t c = 0; c < 3; ++c) {
                const int64_t found = flux[3 * i + c];
                flux_sum[c] += found;
                if (kind == Direction::flux)
                    CHECK(std::fabs(static_cast<double>(found) -
                                    (color[0] + color[1] + color[2]) * fraction * v[c] * 0x1p24) <= 3 * bar);
                else if (fraction > 1e-3 && !smoke.is_grid()) // a sample may be met in several cells' corners
                    CHECK(std::fabs(static_cast<double>(found) - v[c] * 0x1p24) <= bar);
                else if (fraction == 0 && total > 1e-3)
                    CHECK(found == 0);
            }
        }
        for (uint32_t c = 0; c < channels; ++c) CHECK(power_sum[c] == std::llround(color[c] * 0x1p24));
        const double all = at(real(color[0]) + real(color[1]) + real(color[2]));
        for (uint32_t c = 0; c < 3 && kind == Direction::flux; ++c)
            CHECK(std::fabs(static_cast<double>(flux_sum[c]) - v[c] * all * 0x1p24) <= 1 + 0x1p24 * 8 * unit_error);
    }
    CHECK(deposited > 50);
}

TEST_CASE(WISP_ARITH_NAME ": with a single particle a kernel deposit is the exact one") {
    const std::vector<Particle> particles = {{{0.25, 0, 0}, 1.5, 12}};
    SmokeDescription smoke = smoke_of(particles);
    smoke.asymmetry = 0.5;
    smoke.albedo = {0.9, 0.5, 0.25};
    const std::vector<LightSource> lights = {{LightKind::point, {6, 5, 4}, {0, 0, 1}, 2, {40, 20, 10}}};
    const Scene scene = scene_of(smoke, lights);
    for (Direction kind : {Direction::flux, Direction::mean}) {
        Settings settings = map_settings(1, 3000);
        settings.direction = kind;
        const TracedMap exact(scene, settings);
        settings.deposit = Deposit::kernel;
        const TracedMap kernel(scene, settings);
        CHECK(exact.statistics.photons.stored > 300);
        CHECK(kernel.statistics.photons.stored == exact.statistics.photons.stored);
        for (int c = 0; c < 3; ++c) {
            CHECK(kernel.map.per_smoke[0].power[c] == exact.map.per_smoke[0].power[c]);
            CHECK(kernel.map.per_smoke[0].flux[c] == exact.map.per_smoke[0].flux[c]);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": fluxes are sums of direction times power, mean directions of directions alone") {
    const Mixture mixture;
    for (Direction kind : {Direction::flux, Direction::mean}) {
        Settings settings = map_settings(1, 2000);
        settings.direction = kind;
        const TracedMap traced(mixture.scene, settings);
        std::vector<double> expected(3 * elements_of(mixture.smokes[1])), bound(expected.size());
        traced.trace_again(settings, [&](const MediumCollision &to, const Photon &photon, const Color &power) {
            if (to.smoke != 1) return;
            const double d[3] = {at(photon.ray.direction.x), at(photon.ray.direction.y), at(photon.ray.direction.z)};
            const double weight = kind == Direction::mean ? 1 : at(power.x) + at(power.y) + at(power.z);
            for (uint32_t c = 0; c < 3; ++c) {
                expected[3 * to.element + c] += d[c] * weight;
                bound[3 * to.element + c] += 1;
            }
        });
        double sum = 0;
        for (size_t i = 0; i < expected.size(); ++i) {
            const double found = static_cast<double>(traced.map.per_smoke[1].flux[i]) * 0x1p-24;
            CHECK(std::fabs(found - expected[i]) <= bound[i] * (0x1p-24 + 10 * unit_error));
            sum += std::fabs(expected[i]);
        }
        CHECK(sum > 100);
    }
}
