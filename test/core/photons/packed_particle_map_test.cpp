// Packed entries, source functions, and the nearest elements (S4-3).
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

TEST_CASE(WISP_ARITH_NAME ": sources are those of the sums, within the rounding of an entry") {
    // Powers that differ by 2^12, of up to four million photons on an element, with fluxes from 0 to all of it.
    std::vector<Particle> particles = cloud(40, 2, 1, 0.5);
    const Vec3 eye = vec(0.5, -4, 3);
    for (uint32_t channels : {1u, 3u})
        for (const auto &[g, kind] : {std::pair(0.0, Direction::flux), std::pair(0.5, Direction::flux),
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
                const double fraction = next(), x = next() - 0.5, y = next() - 0.5, z = next() - 0.5;
                const double scale = fraction * whole[i] / std::sqrt(x * x + y * y + z * z);
                flux[3 * i] = std::llround(x * scale);
                flux[3 * i + 1] = std::llround(y * scale);
                flux[3 * i + 2] = std::llround(z * scale);
            }
            Deposits deposits = {power.data(), g == 0 ? nullptr : flux.data(), 40, channels, kind};
            const ParticleMap map = {&deposits, vec(color[0], color[1], color[2]), {real(1.25), -20}};
            PackedSums packed(scene, map);
            const PointTree &tree = built.medium.smokes[0].field.particles.tree;
            for (uint32_t i = 0; i < 40; ++i) {
                const double to_eye[3] = {at(eye.x - tree.x[i]), at(eye.y - tree.y[i]), at(eye.z - tree.z[i])};
                double along = 0, f = 0, r = 0;
                for (uint32_t c = 0; c < 3; ++c) {
                    const double d = static_cast<double>(flux[3 * i + c]);
                    along += d * to_eye[c];
                    f += d * d;
                    r += to_eye[c] * to_eye[c];
                }
                const double cosine = along / std::sqrt(f * r),
                             fraction = kind == Direction::mean ? g : g * std::sqrt(f) / whole[i];
                const double p =
                    (1 - fraction * fraction) /
                    (4 * 3.14159265358979323846 * std::pow(1 + fraction * fraction - 2 * fraction * cosine, 1.5));
                const Color found = packed.source(scene, built.medium, eye, i);
                double largest_power = 0, powers[3];
                for (uint32_t c = 0; c < 3; ++c) {
                    powers[c] = color[c] * static_cast<double>(power[i * channels + (channels == 3 ? c : 0)]) * 0x1p-24;
                    largest_power = std::max(largest_power, powers[c]);
                }
                const double values[3] = {at(found.x), at(found.y), at(found.z)};
                const double albedo[3] = {0.9, 0.75, 0.5};
                // Of a flux that is off by d <= sqrt(3) / 2 / 511: p by 3 |g| d / (1 - |g|)^2 of itself at most.
                const double bar = 3 * std::fabs(g) * (0.866 / 511) / std::pow(1 - std::fabs(g), 2) +
                                   (channels == 3 ? 1.0 / 512 : 2e-6);
                for (int c = 0; c < 3; ++c) {
                    const double expected = albedo[c] * p * powers[c] * 1.25 * 0x1p-20 / 0.5;
                    CHECK(std::fabs(values[c] - expected) <=
                          bar * expected * largest_power / powers[c] + 10 * unit_error);
                }
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": the nearest particles are those that carry power, and their sum is divided by the ball") {
    // Against all particles sorted by distance; every third carries nothing.
    const std::vector<Particle> particles = cloud(60, 1.5, 1, 0.5);
    for (uint32_t channels : {1u, 3u})
        for (const auto &[g, kind] :
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
            const double axis[3] = {0.6, 0, 0.8}; // all light goes that to_eye, half of it in the flux
            for (uint32_t i = 0; i < 60; ++i)
                for (uint32_t c = 0; c < 3; ++c) {
                    const int64_t *p = &power[i * channels];
                    const double whole =
                        channels == 1 ? 3.0 * static_cast<double>(*p) : static_cast<double>(p[0] + p[1] + p[2]);
                    flux[3 * i + c] = std::llround(0.5 * axis[c] * whole);
                }
            Deposits deposits = {power.data(), g == 0 ? nullptr : flux.data(), 60, channels, kind};
            const ParticleMap map = {&deposits, Color(Real(1)), {real(1.25), -12}};
            PackedSums packed(scene, map);
            const uint32_t max_photons = 8;
            std::vector<unsigned char> memory(element_map_bytes(scene) + gather_bytes(max_photons));
            Arena arena(memory.data(), memory.size());
            const PhotonMap *maps = nullptr;
            Gather gather;
            REQUIRE(make_element_maps(built.medium, packed.packed, arena, maps));
            REQUIRE(make_gather(max_photons, arena, gather));
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
                const bool is_full = near[max_photons - 1].first < reach;
                ++(is_full ? full : partial);
                const double radius = is_full ? near[max_photons - 1].first : reach;
                const double cosine = at(out.x) * axis[0] + at(out.z) * axis[2];
                const double e = kind == Direction::mean ? g : g * 0.5;
                const double p = (1 - e * e) / (4 * pi_ * std::pow(1 + e * e - 2 * e * cosine, 1.5));
                const Color found = estimate_radiance(maps[0], built.medium.smokes[0].phase, vec(x[0], x[1], x[2]), out,
                                                      real(reach), gather, statistics);
                const double values[3] = {at(found.x), at(found.y), at(found.z)};
                for (uint32_t c = 0; c < 3; ++c) {
                    double sum = 0; // (k - 1) of them when full, all within the ball else
                    for (size_t k = 0; k < near.size() && (is_full ? k < max_photons - 1 : near[k].first < reach); ++k)
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
