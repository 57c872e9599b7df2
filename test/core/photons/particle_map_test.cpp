// The particle map against the reference, against `direct` where both must agree, and its deposits and kept depths.
#include "core/march/particle_march.h"
#include "support/built_map.h"
#include "support/compared_pictures.h"
#include "support/mixture.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

Settings map_settings(int pixels, uint64_t photons) {
    Settings settings = small_settings(pixels);
    settings.method = Method::map;
    settings.photons = photons;
    return settings;
}

// Of a ray: some hundreds of rounded sums.
constexpr double rounding = 200 * unit_error;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": without photons the particle map gives what direct gives") {
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
        const Rendered direct = render_in_memory(mixture.scene, settings);
        settings.method = Method::map;
        const Rendered map = render_in_memory(mixture.scene, settings);
        CHECK(relative_difference(map.rgb, direct.rgb) < rounding);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the particle map is as bright as the reference") {
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
        const std::vector<float> truth = reference_of(scene, 4, 800, noise);
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

TEST_CASE(WISP_ARITH_NAME ": the parts of a flight's depth add up to the whole") {
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

TEST_CASE(WISP_ARITH_NAME ": flights leave what collisions leave, on average, and vary less") {
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

TEST_CASE(WISP_ARITH_NAME ": a kernel deposit is shared by the parts in the density, and adds up to the photon") {
    // Against the density's definition, for every element.
    const Mixture mixture;
    const BuiltMedium built(mixture.smokes);
    Sequence next{17};
    uint32_t claimed = 0;
    for (int round = 0; round < 90; ++round) {
        const uint32_t s = static_cast<uint32_t>(round) % 3;
        const SmokeDescription &smoke = mixture.smokes[s];
        const DensityField &field = built.medium.smokes[s].field;
        const uint32_t count = elements_of(smoke);
        const uint32_t channels = round % 2 ? 3 : 1;
        const Direction kept = round % 4 < 2 ? Direction::flux : Direction::mean;
        const double x[3] = {4 * next() - 2, 4 * next() - 2, 4 * next() - 2};
        const Vec3 at_x = vec(x[0], x[1], x[2]), way = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.5));
        const double color[3] = {1, next(), next()};
        std::vector<int64_t> power(count * channels), flux(count * 3);
        const Deposits deposits = {power.data(), flux.data(), count, channels, kept};
        const bool done = deposit_by_kernel(deposits, field, at_x, vec(color[0], color[1], color[2]), way);
        CHECK(done == (at(extinction(field, at_x)) > 0));
        if (!done) continue;
        ++claimed;

        std::vector<double> part(count);
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
                part[i] = product;
            } else {
                const uint32_t id = field.particles.tree.id[i];
                part[i] = brute_density({smoke.particles[id]}, smoke.kernel, x[0], x[1], x[2]);
            }
            total += part[i];
        }
        // In units: rounding of the sum, and of two results; in fixed the parts of thin places have few digits.
        const double bar = 2 + 0x1p24 * 500 * unit_error * std::max(1.0, std::is_same_v<Real, Fixed> ? 1 / total : 0);
        const double v[3] = {at(way.x), at(way.y), at(way.z)};
        int64_t power_sum[3] = {}, flux_sum[3] = {};
        for (uint32_t i = 0; i < count; ++i) {
            const double share = part[i] / total;
            for (uint32_t c = 0; c < channels; ++c) {
                const int64_t found = power[i * channels + c];
                power_sum[c] += found;
                CHECK(std::fabs(static_cast<double>(found) - color[c] * share * 0x1p24) <= bar);
            }
            for (uint32_t c = 0; c < 3; ++c) {
                const int64_t found = flux[3 * i + c];
                flux_sum[c] += found;
                if (kept == Direction::flux)
                    CHECK(std::fabs(static_cast<double>(found) -
                                    (color[0] + color[1] + color[2]) * share * v[c] * 0x1p24) <= 3 * bar);
                else if (share > 1e-3 && !smoke.is_grid()) // a sample may be met in several cells' corners
                    CHECK(std::fabs(static_cast<double>(found) - v[c] * 0x1p24) <= bar);
                else if (share == 0 && total > 1e-3)
                    CHECK(found == 0);
            }
        }
        for (uint32_t c = 0; c < channels; ++c) CHECK(power_sum[c] == std::llround(color[c] * 0x1p24));
        const double all = at(real(color[0]) + real(color[1]) + real(color[2]));
        for (uint32_t c = 0; c < 3 && kept == Direction::flux; ++c)
            CHECK(std::fabs(static_cast<double>(flux_sum[c]) - v[c] * all * 0x1p24) <= 1 + 0x1p24 * 8 * unit_error);
    }
    CHECK(claimed > 50);
}

TEST_CASE(WISP_ARITH_NAME ": with a single particle a kernel deposit is the exact one") {
    const std::vector<Particle> particles = {{{0.25, 0, 0}, 1.5, 12}};
    SmokeDescription smoke = smoke_of(particles);
    smoke.asymmetry = 0.5;
    smoke.albedo = {0.9, 0.5, 0.25};
    const std::vector<LightSource> lights = {{LightKind::point, {6, 5, 4}, {0, 0, 1}, 2, {40, 20, 10}}};
    const Scene scene = scene_of(smoke, lights);
    for (Direction kept : {Direction::flux, Direction::mean}) {
        Settings settings = map_settings(1, 3000);
        settings.direction = kept;
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
    for (Direction kept : {Direction::flux, Direction::mean}) {
        Settings settings = map_settings(1, 2000);
        settings.direction = kept;
        const TracedMap traced(mixture.scene, settings);
        std::vector<Emitter> room(8);
        Arena arena(room.data(), room.size() * sizeof(Emitter));
        const Emitters emitters = find_emitters(traced.medium, traced.lights.data(), 2, arena);
        std::vector<double> expected(3 * elements_of(mixture.smokes[1])), most(expected.size());
        Statistics counted;
        for_each_photon(settings.seed, 0, settings.photons, [&](uint64_t key) {
            trace_photon(traced.medium, nullptr, emitters, key, counted,
                         [&](const MediumCollision &to, const Photon &photon, const Color &power) {
                             if (to.smoke != 1) return;
                             const double d[3] = {at(photon.ray.direction.x), at(photon.ray.direction.y),
                                                  at(photon.ray.direction.z)};
                             const double weight =
                                 kept == Direction::mean ? 1 : at(power.x) + at(power.y) + at(power.z);
                             for (uint32_t c = 0; c < 3; ++c) {
                                 expected[3 * to.element + c] += d[c] * weight;
                                 most[3 * to.element + c] += 1;
                             }
                         });
            return true;
        });
        double sum = 0;
        for (size_t i = 0; i < expected.size(); ++i) {
            const double found = static_cast<double>(traced.map.per_smoke[1].flux[i]) * 0x1p-24;
            CHECK(std::fabs(found - expected[i]) <= most[i] * (0x1p-24 + 10 * unit_error));
            sum += std::fabs(expected[i]);
        }
        CHECK(sum > 100);
    }
}

TEST_CASE(WISP_ARITH_NAME ": sources are what the sums make of them, within the rounding of an entry") {
    // Powers that differ by 2^12, of up to four million photons on an element, with fluxes of every share of them.
    std::vector<Particle> particles = cloud(40, 2, 1, 0.5);
    const Vec3 eye = vec(0.5, -4, 3);
    for (uint32_t channels : {1u, 3u})
        for (const auto &[g, kept] : {std::pair(0.0, Direction::flux), std::pair(0.5, Direction::flux),
                                      std::pair(-0.3, Direction::flux), std::pair(0.5, Direction::mean)}) {
            SmokeDescription smoke = smoke_of(particles);
            smoke.asymmetry = g;
            smoke.albedo = {0.9, 0.75, 0.5};
            const BuiltMedium built({smoke});
            const Scene scene = scene_of(smoke, {});
            Sequence next{channels};
            std::vector<int64_t> power(40 * channels), flux(120);
            const double color[3] = {1, channels == 1 ? 0.5 : 1, channels == 1 ? 0.25 : 1}; // of all photons
            for (int64_t &p : power)
                p = static_cast<int64_t>(std::ldexp(1 + next(), 34 + static_cast<int>(12 * next())));
            std::vector<double> whole(40);
            for (uint32_t i = 0; i < 40; ++i) {
                for (uint32_t c = 0; c < 3; ++c)
                    whole[i] += color[c] * static_cast<double>(power[i * channels + (channels == 3 ? c : 0)]);
                const double share = next(), x = next() - 0.5, y = next() - 0.5, z = next() - 0.5;
                const double scale = share * whole[i] / std::sqrt(x * x + y * y + z * z);
                flux[3 * i] = std::llround(x * scale);
                flux[3 * i + 1] = std::llround(y * scale);
                flux[3 * i + 2] = std::llround(z * scale);
            }
            Deposits deposits = {power.data(), g == 0 ? nullptr : flux.data(), 40, channels, kept};
            const ParticleMap map = {&deposits, vec(color[0], color[1], color[2]), {real(1.25), -20}};
            PackedSums packed(scene, map);
            const PointTree &tree = built.medium.smokes[0].field.particles.tree;
            for (uint32_t i = 0; i < 40; ++i) {
                const double way[3] = {at(eye.x - tree.x[i]), at(eye.y - tree.y[i]), at(eye.z - tree.z[i])};
                double along = 0, f = 0, r = 0;
                for (uint32_t c = 0; c < 3; ++c) {
                    const double d = static_cast<double>(flux[3 * i + c]);
                    along += d * way[c];
                    f += d * d;
                    r += way[c] * way[c];
                }
                const double cosine = along / std::sqrt(f * r),
                             share = kept == Direction::mean ? g : g * std::sqrt(f) / whole[i];
                const double p = (1 - share * share) /
                                 (4 * 3.14159265358979323846 * std::pow(1 + share * share - 2 * share * cosine, 1.5));
                const Color found = packed.source(scene, built.medium, eye, i);
                double most = 0, powers[3];
                for (uint32_t c = 0; c < 3; ++c) {
                    powers[c] = color[c] * static_cast<double>(power[i * channels + (channels == 3 ? c : 0)]) * 0x1p-24;
                    most = std::max(most, powers[c]);
                }
                const double values[3] = {at(found.x), at(found.y), at(found.z)};
                const double albedo[3] = {0.9, 0.75, 0.5};
                // Of a flux that is off by d <= sqrt(3) / 2 / 511: p by 3 |g| d / (1 - |g|)^2 of itself at most.
                const double bar = 3 * std::fabs(g) * (0.866 / 511) / std::pow(1 - std::fabs(g), 2) +
                                   (channels == 3 ? 1.0 / 512 : 2e-6);
                for (int c = 0; c < 3; ++c) {
                    const double expected = albedo[c] * p * powers[c] * 1.25 * 0x1p-20 / 0.5;
                    CHECK(std::fabs(values[c] - expected) <= bar * expected * most / powers[c] + 10 * unit_error);
                }
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": the nearest particles are those that carry power, their sum is over the ball") {
    // Against all particles sorted by distance; every third carries nothing.
    const std::vector<Particle> particles = cloud(60, 1.5, 1, 0.5);
    const double pi_ = 3.14159265358979323846;
    for (uint32_t channels : {1u, 3u})
        for (const auto &[g, kept] :
             {std::pair(0.0, Direction::flux), std::pair(0.5, Direction::flux), std::pair(0.5, Direction::mean)}) {
            SmokeDescription smoke = smoke_of(particles);
            smoke.asymmetry = g;
            const BuiltMedium built({smoke});
            const Scene scene = scene_of(smoke, {});
            Sequence next{channels};
            std::vector<int64_t> power(60 * channels), flux(180);
            for (uint32_t i = 0; i < 60; ++i)
                for (uint32_t c = 0; c < channels && i % 3 != 1; ++c)
                    power[i * channels + c] = static_cast<int64_t>((1 + next()) * 0x1p30);
            const double axis[3] = {0.6, 0, 0.8}; // all light goes that way, half of it in the flux
            for (uint32_t i = 0; i < 60; ++i)
                for (uint32_t c = 0; c < 3; ++c) {
                    const int64_t *p = &power[i * channels];
                    const double whole =
                        channels == 1 ? 3.0 * static_cast<double>(*p) : static_cast<double>(p[0] + p[1] + p[2]);
                    flux[3 * i + c] = std::llround(0.5 * axis[c] * whole);
                }
            Deposits deposits = {power.data(), g == 0 ? nullptr : flux.data(), 60, channels, kept};
            const ParticleMap map = {&deposits, Color(Real(1)), {real(1.25), -12}};
            PackedSums packed(scene, map);
            const uint32_t most = 8;
            std::vector<unsigned char> memory(element_map_bytes(scene) + gather_bytes(most));
            Arena arena(memory.data(), memory.size());
            const PhotonMap *maps = nullptr;
            Gather gather;
            REQUIRE(make_element_maps(built.medium, packed.packed, arena, maps));
            REQUIRE(make_gather(most, arena, gather));
            CHECK(maps[0].tree.count == 40);
            const PointTree &tree = built.medium.smokes[0].field.particles.tree;
            Statistics statistics;
            uint32_t full = 0, partial = 0;
            for (int query = 0; query < 40; ++query) {
                const double x[3] = {3 * next() - 1.5, 3 * next() - 1.5, 3 * next() - 1.5};
                const Vec3 out = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.5));
                std::vector<std::pair<double, uint32_t>> near;
                for (uint32_t i = 0; i < 60; ++i) {
                    if (power[i * channels] == 0) continue;
                    const double dx = at(tree.x[i]) - x[0], dy = at(tree.y[i]) - x[1], dz = at(tree.z[i]) - x[2];
                    near.emplace_back(std::sqrt(dx * dx + dy * dy + dz * dz), i);
                }
                std::sort(near.begin(), near.end());
                const double reach = 1.2;
                const bool is_full = near[most - 1].first < reach;
                ++(is_full ? full : partial);
                const double radius = is_full ? near[most - 1].first : reach;
                const double cosine = at(out.x) * axis[0] + at(out.z) * axis[2];
                const double e = kept == Direction::mean ? g : g * 0.5;
                const double p = (1 - e * e) / (4 * pi_ * std::pow(1 + e * e - 2 * e * cosine, 1.5));
                const Color found = estimate_radiance(maps[0], built.medium.smokes[0].phase, vec(x[0], x[1], x[2]), out,
                                                 real(reach), gather, statistics);
                const double values[3] = {at(found.x), at(found.y), at(found.z)};
                for (uint32_t c = 0; c < 3; ++c) {
                    double sum = 0; // (k - 1) of them when full, all within the ball else
                    for (size_t k = 0; k < near.size() && (is_full ? k < most - 1 : near[k].first < reach); ++k)
                        sum +=
                            static_cast<double>(power[near[k].second * channels + (channels == 3 ? c : 0)]) * 0x1p-24;
                    const double expected = sum * p * 1.25 * 0x1p-12 / (4.0 / 3 * pi_ * radius * radius * radius);
                    const double bar = (channels == 3 ? 1.0 / 256 : 1e-5) + (g == 0 ? 0 : 0.021);
                    CHECK(std::fabs(values[c] - expected) <= bar * expected + 1e-6);
                }
            }
            CHECK(full > 3);
            CHECK(partial > 3);
        }
}

TEST_CASE(WISP_ARITH_NAME
          ": the nearest particles are about as bright as their kernels, and the plan's bytes suffice") {
    // Fewer particles than K, in balls of the kernels' support: the same sum with another kernel, but for what lies
    // beside the smoke's edge.
    const std::vector<Particle> particles = cloud(600, 3, 1, 0.2);
    SmokeDescription smoke = smoke_of(particles);
    const std::vector<LightSource> lights = {{LightKind::point, {6, 5, 4}, {0, 0, 1}, 2, {40, 40, 40}}};
    const Scene scene = scene_of(smoke, lights);
    Settings settings = map_settings(6, 4000);
    const Rendered kernel = render_in_memory(scene, settings);
    settings.estimate = Estimate::knn;
    settings.gather = 500;
    const Rendered nearest = render_in_memory(scene, settings);
    REQUIRE(nearest.status == Status::done);
    CHECK(nearest.statistics.smoke.gathers > 100);
    CHECK(kernel.statistics.smoke.gathers == 0);
    CHECK(nearest.statistics.bytes.arena_peak <= nearest.statistics.bytes.arena_size);
    settings.photons = 0;
    const Rendered single = render_in_memory(scene, settings);
    const double of_photons = sum_of(nearest.rgb) - sum_of(single.rgb);
    CHECK(of_photons / (sum_of(kernel.rgb) - sum_of(single.rgb)) == doctest::Approx(1).epsilon(0.1));
}

TEST_CASE(WISP_ARITH_NAME ": kept depths err with the square of their distance, and not to one side") {
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
            if (!(sigma > Real(0))) continue; // nobody asks there
            const Illumination way = illuminate(lights[1], x, x, x);
            const double exact = at(optical_depth(built.medium, {x, -way.direction}, way.distance));
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

TEST_CASE(WISP_ARITH_NAME ": with kept depths a crop is a part of the whole, and the plan's bytes suffice") {
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
