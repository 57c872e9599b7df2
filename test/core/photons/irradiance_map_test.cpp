// The irradiance map: interpolation, adaptive bricks, packing (S4-4).
#include "support/worst.h"
#include "wisp/wisp.h"
#include "support/built_sparse_grid.h"
#include "support/compared_pictures.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <array>
#include <cstring>
#include <map>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Fluence sums that a test chooses, over a box of 30 x 22 x 22 cells of width 1.
struct ChosenSums {
    explicit ChosenSums(int32_t spacing, uint32_t channels, bool directed = false)
        : built({box()}, 1), power(size_t{built.bricks().count} * nodes_of(spacing) * channels),
          flux(directed ? power.size() / channels * 3 : 0),
          harmonics(directed ? size_t{built.bricks().count} * nodes_of(harmonic_spacing(spacing)) * harmonic_numbers
                             : 0),
          deposits{&built.medium,
                   &built.bricks(),
                   spacing,
                   power.data(),
                   directed ? flux.data() : nullptr,
                   directed ? harmonics.data() : nullptr,
                   channels,
                   Color(Real(1)),
                   {Real(1), 0},
                   {Real(1), 0},
                   0,
                   nullptr,
                   nullptr} {
        REQUIRE(same(built.bricks().cell, Vec3(Real(1))));
    }
    static bool same(const Vec3 &a, const Vec3 &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
    static SmokeDescription box() {
        SmokeDescription source = box_smoke({15, 11, 11}, 1, 22);
        source.smallest_h = source.largest_h = 1.01; // of a width the next smaller that fits is taken
        return source;
    }
    static constexpr int32_t size[3] = {30, 22, 22};
    bool holds(const Cell &node) const { return node.x <= size[0] && node.y <= size[1] && node.z <= size[2]; }

    // Power for a radiance at every node: `of(place in the lattice of the finest nodes, channel)`.
    template <class Of> void fill(Of &&of) {
        const SparseGrid &bricks = built.bricks();
        const int32_t s = deposits.spacing;
        const auto below = [](double t) { // of a tent from -1 to 1
            t = std::clamp(t, -1.0, 1.0);
            return t < 0 ? 0.5 * (t + 1) * (t + 1) : 1 - 0.5 * (1 - t) * (1 - t);
        };
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < nodes_of(s); ++k) {
                const Cell at_ = lattice_coordinates(bricks, b, k, s), &in = bricks.position[b];
                const int32_t place[3] = {at_.x * s, at_.y * s, at_.z * s}, from[3] = {in.x * 8, in.y * 8, in.z * 8};
                double volume = 1; // of the node's tent, in the brick and the box
                for (int c = 0; c < 3; ++c) {
                    const double end = std::min(from[c] + 8, size[c]);
                    volume *= s * (below((end - place[c]) / s) - below(double(from[c] - place[c]) / s));
                }
                for (uint32_t c = 0; c < deposits.channels; ++c)
                    power[(size_t{b} * nodes_of(s) + k) * deposits.channels + c] =
                        std::llround(of(Cell{place[0], place[1], place[2]}, c) * 4 * pi_ * volume * 0x1p24);
            }
    }
    double reach(int axis) const { return size[axis]; }
    Irradiance map(double tolerance) {
        memory.resize(irradiance_bytes(scene_of(box(), {}), built.bricks().count, deposits.spacing,
                                       deposits.flux != nullptr, true, deposits.harmonics != nullptr, 0));
        Arena arena(memory.data(), memory.size());
        const Irradiance made = make_irradiance(built.medium, deposits, {}, real(tolerance), arena);
        REQUIRE(made.ready);
        return made;
    }
    // In units of cells from the lattice's beginning, in the box.
    Color read(const Irradiance &map, double x, double y, double z) const {
        const SparseGrid &bricks = built.bricks();
        const Cell cell = {int32_t(x) / 8, int32_t(y) / 8, int32_t(z) / 8};
        return light_at(map, brick_at(bricks, cell), vec(x - 8 * cell.x, y - 8 * cell.y, z - 8 * cell.z)).radiance;
    }
    Resampled built; // deep: the tolerance is what it says
    std::vector<int64_t> power, flux, harmonics;
    FluenceSums deposits;
    std::vector<unsigned char> memory;
};

// Relative errors of a sum of eight holders, and of an entry.
constexpr double sums_error = 40 * unit_error + 0x1p-22;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case D13: the irradiance map is exact on its points, and where light is even") {
    for (int32_t spacing : {1, 2}) {
        ChosenSums chosen(spacing, 1);
        const SparseGrid &bricks = chosen.built.bricks();
        Sequence next{3};
        // Constant: the same bits wherever it is asked, in the last cell and by a rounding outside.
        chosen.fill([](const Cell &, uint32_t) { return 8 / (4 * pi_); });
        const Irradiance even = chosen.map(0);
        const double value = at(chosen.read(even, 5, 5, 5).x);
        CHECK(value == doctest::Approx(8 / (4 * pi_)).epsilon(sums_error));
        int different = 0;
        for (int i = 0; i < 1000; ++i) {
            const Color light =
                chosen.read(even, chosen.reach(0) * next(), chosen.reach(1) * next(), chosen.reach(2) * next());
            different += at(light.x) == value ? 0 : 1;
        }
        CHECK(different == 0);
        for (double p : {-1e-4, 8.0, 8 + 1e-4}) CHECK(at(light_at(even, 0, vec(p, p, p)).radiance.x) == value);

        // A node has its point's value, in whichever brick and cell it is looked up.
        chosen.fill([&](const Cell &, uint32_t) { return 1 + next(); });
        const Irradiance uneven = chosen.map(0);
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < nodes_of(spacing); ++k) {
                const Cell node = cell_of_index(nodes_along(spacing), k);
                const Color found =
                    light_at(uneven, b, Vec3(Real(node.x * spacing), Real(node.y * spacing), Real(node.z * spacing)))
                        .radiance;
                const double stored = static_cast<double>(uneven.value[uint32_t(uneven.first[b]) + k]);
                // At the end of a row between two others: a + 1 (b - a).
                CHECK(std::fabs(at(found.x) - std::ldexp(stored, uneven.scale[b].exponent[0] - single_channel_bits)) <=
                      8 * unit_error);
            }
    }
}

TEST_CASE(WISP_ARITH_NAME ": linear light is interpolated exactly, across the borders of bricks too") {
    for (int32_t spacing : {1, 2, 4, 8})
        for (uint32_t channels : {1u, 3u}) {
            ChosenSums chosen(spacing, channels);
            const auto of = [](double x, double y, double z, uint32_t c) {
                return (1 + 0.05 * x + 0.02 * y + 0.03 * z) / (c + 1);
            };
            chosen.fill([&](const Cell &p, uint32_t c) { return of(p.x, p.y, p.z, c); });
            const Irradiance map = chosen.map(0);
            CHECK(map.single_channel == (channels == 1));
            Sequence next{6};
            int wrong = 0;
            for (int i = 0; i < 1000; ++i) {
                const double x = chosen.reach(0) * next(), y = chosen.reach(1) * next(), z = chosen.reach(2) * next();
                const Color found = chosen.read(map, x, y, z);
                // Of a packed colour: 2^-9 of the largest channel.
                const double bar = of(x, y, z, 0) * (channels == 1 ? 2 * sums_error : 0x1p-9 + sums_error);
                for (uint32_t c = 0; c < channels; ++c)
                    wrong += std::fabs(at(found[static_cast<int>(c)]) - of(x, y, z, c)) < bar ? 0 : 1;
            }
            CAPTURE(spacing);
            CHECK(wrong == 0);
        }
}

TEST_CASE(WISP_ARITH_NAME ": trilinear deposits and interpolation keep the sum of light, and blur by cell^2 / 6 each") {
    // A layer of light, a Gaussian along x with a variance of 2 cells^2, deposited by tents.
    ChosenSums chosen(1, 1);
    const double middle = 15.3, variance = 2;
    chosen.fill([&](const Cell &p, uint32_t) {
        double sum = 0;
        for (int i = -50; i < 50; ++i) {
            const double offset = (i + 0.5) / 50, x = p.x + offset - middle;
            sum += (1 - std::fabs(offset)) / 50 * std::exp(-0.5 * x * x / variance);
        }
        return sum;
    });
    const Irradiance map = chosen.map(0);
    double harmonics[3] = {0, 0, 0};
    for (int i = 0; i < 2900; ++i) {
        const double x = (i + 0.5) / 100, light = at(chosen.read(map, x, 8.5, 4.5).x) / 100;
        harmonics[0] += light;
        harmonics[1] += light * x;
        harmonics[2] += light * x * x;
    }
    const double mean = harmonics[1] / harmonics[0];
    CHECK(harmonics[0] == doctest::Approx(std::sqrt(2 * pi_ * variance)).epsilon(1e-3));
    CHECK(mean == doctest::Approx(middle).epsilon(1e-3));
    CHECK(harmonics[2] / harmonics[0] - mean * mean == doctest::Approx(variance + 2 / 6.0).epsilon(0.01));
}

TEST_CASE(WISP_ARITH_NAME ": an adaptive map has fewer points, and all others are within its tolerance") {
    for (uint32_t channels : {1u, 3u})
        for (bool directed : {false, true}) {
            // A steep ball in one corner, a gentle slope elsewhere, noise in the last bricks.
            ChosenSums chosen(1, channels, directed);
            Sequence next{8};
            chosen.fill([&](const Cell &p, uint32_t c) {
                const double noise = p.x > 24 ? next() : 0;
                return (1 + 0.03 * p.x + 4 * std::exp(-0.3 * (p.x * p.x + p.y * p.y + p.z * p.z)) + noise) / (c + 1);
            });
            const Irradiance uniform = chosen.map(0);
            const SparseGrid &bricks = chosen.built.bricks();
            std::vector<std::array<double, 3>> all;
            for (uint32_t b = 0; b < bricks.count; ++b) {
                CHECK(uniform.spacing[b] == 1);
                for (uint32_t k = 0; k < nodes_of(1); ++k) {
                    const Cell n = cell_of_index(nodes_along(1), k);
                    const Color light = light_at(uniform, b, Vec3(Real(n.x), Real(n.y), Real(n.z))).radiance;
                    all.push_back({at(light.x), at(light.y), at(light.z)});
                }
            }
            CHECK(uniform.points == bricks.count * nodes_of(1));
            const uint64_t of_brick = 20 + (directed ? nodes_of(2) * harmonic_words * 4 : 0);
            CHECK(bytes_of(uniform) == uint64_t{uniform.points} * (directed ? 8 : 4) + bricks.count * of_brick);
            const double packed = channels == 1 ? sums_error : 0x1p-8; // both maps round their entries
            uint32_t before = uniform.points;
            for (double tolerance : {0.002, 0.02, 0.1}) {
                const Irradiance map = chosen.map(tolerance);
                uint32_t points = 0, spacings[9] = {};
                for (uint32_t b = 0; b < bricks.count; ++b) {
                    CHECK(map.first[b] == static_cast<int32_t>(points));
                    points += nodes_of(map.spacing[b]);
                    ++spacings[map.spacing[b]];
                    double greatest = 0, worst = 0;
                    for (uint32_t k = 0; k < nodes_of(1); ++k) {
                        const auto &exact = all[size_t{b} * nodes_of(1) + k];
                        const Cell n = cell_of_index(nodes_along(1), k);
                        const Color light = light_at(map, b, Vec3(Real(n.x), Real(n.y), Real(n.z))).radiance;
                        for (size_t c = 0; c < 3; ++c) {
                            greatest = std::max(greatest, exact[c]);
                            worst = worst_of(worst, std::fabs(at(light[static_cast<int>(c)]) - exact[c]));
                        }
                    }
                    CHECK(worst <= greatest * (tolerance + packed));
                }
                CHECK(map.points == points);
                CHECK(points <= before);
                before = points;
                CHECK(spacings[1] > 0); // noise
                CHECK(spacings[8] > 0); // the slope
                CHECK(bytes_of(map) == uint64_t{points} * (directed ? 8 : 4) + bricks.count * of_brick);
            }
            CHECK(before < uniform.points * 3 / 4);
        }
}

TEST_CASE(WISP_ARITH_NAME ": the map stores colours and fluxes within the errors of their entries") {
    ChosenSums chosen(2, 3, true);
    Sequence next{12};
    // Even light: nothing to sharpen. Colours of all kinds, and fluxes of all lengths.
    for (int round = 0; round < 12; ++round) {
        const double color[3] = {next(), next() * 0.1, next() * 0.01 + 1e-3}, fraction = next();
        const Vec3 direction = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375));
        chosen.fill([&](const Cell &, uint32_t c) { return color[c]; });
        for (size_t i = 0; i < chosen.flux.size(); ++i) {
            const size_t node = i / 3;
            const double all = double(chosen.power[3 * node] + chosen.power[3 * node + 1] + chosen.power[3 * node + 2]);
            chosen.flux[i] = std::llround(all * fraction * at(direction[static_cast<int>(i % 3)]));
        }
        const Irradiance map = chosen.map(0);
        const double largest_channel = std::max({color[0], color[1], color[2]});
        for (int i = 0; i < 50; ++i) {
            const FluenceAndFlux light = light_at(map, 0, vec(8 * next(), 8 * next(), 8 * next()));
            for (int c = 0; c < 3; ++c) {
                CHECK(std::fabs(at(light.radiance[c]) - color[c]) < largest_channel * (0x1p-9 + sums_error));
                CHECK(std::fabs(at(light.flux[c]) - fraction * at(direction[c])) < 0.5 / 511 + 1e-4);
            }
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": the map stores harmonics relative to the sums of all bricks that hold a node") {
    ChosenSums chosen(1, 1, true);
    const SparseGrid &bricks = chosen.built.bricks();
    const int32_t spacing = harmonic_spacing(1);
    Sequence next{13};
    std::map<std::array<int32_t, 3>, std::array<double, harmonic_numbers>> sums;
    const auto place = [&](uint32_t b, uint32_t k) {
        const Cell at_ = lattice_coordinates(bricks, b, k, spacing);
        return std::array<int32_t, 3>{at_.x, at_.y, at_.z};
    };
    int64_t *sum = chosen.harmonics.data();
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes_of(spacing); ++k)
            for (uint32_t i = 0; i < harmonic_numbers; ++i) {
                const double units = i == 0 ? next() + 0.01 : next() * static_cast<double>(sum[-int32_t(i)]) / 0x1p24;
                *sum++ = std::llround(units * 0x1p24);
                sums[place(b, k)][i] += units;
            }
    const Irradiance map = chosen.map(0);
    CHECK(map.harmonic_spacing == spacing);
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes_of(spacing); ++k) {
            const auto &expected = sums[place(b, k)];
            for (uint32_t i = 0; i < harmonic_count; ++i) {
                const uint32_t packed = map.harmonics[(b * nodes_of(spacing) + k) * harmonic_words + i / 3];
                const double found = flux_units(packed, static_cast<int32_t>(i % 3)) / 511.0;
                CHECK(std::fabs(found - (2 * expected[1 + i] / expected[0] - 1)) < 0.5 / 511 + 1e-4);
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": a map without enough memory says so; without light it is dark") {
    ChosenSums chosen(1, 3, true);
    const Irradiance dark = chosen.map(0.02);
    for (uint32_t i = 0; i < dark.points; ++i) CHECK((dark.value[i] == 0 && dark.flux[i] == 0));
    CHECK(dark.points == chosen.built.bricks().count * nodes_of(8));
    std::vector<unsigned char> memory(chosen.memory.size());
    Arena enough(memory.data(), memory.size());
    REQUIRE(make_irradiance(chosen.built.medium, chosen.deposits, {}, Real(0), enough).ready);
    for (size_t part = 0; part < 50; ++part) {
        Arena arena(memory.data(), enough.peak() * part / 50);
        CHECK(!make_irradiance(chosen.built.medium, chosen.deposits, {}, Real(0), arena).ready);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": a map says how much its light varies, as its photons and the largest of its smokes have it") {
    for (const int32_t spacing : {1, 4})
        for (const double albedo : {0.25, 1.0})
            for (const double g : {0.0, 0.5}) {
                CAPTURE(spacing);
                CAPTURE(albedo);
                CAPTURE(g);
                ChosenSums chosen(spacing, 1);
                std::vector<SmokeVolume> smokes(2, chosen.built.medium.smokes[0]);
                smokes[0].albedo = vec(0.25 * albedo, albedo, 0);
                smokes[0].phase = Phase(real(g));
                smokes[1].albedo = vec(0.2, 0.2, 0.2);
                Medium both = chosen.built.medium;
                both.smokes = smokes.data();
                both.count = 2;
                chosen.deposits.medium = &both;
                chosen.deposits.photon = {real(0.625), -3};
                const double once = 151.0 / 315 * 151 / 315 * 0.625 / 8 / (spacing * spacing) / (4 * pi_);
                const double uneven = (1 + g * g) / ((1 - g * g) * (1 - g * g)); // 4 pi int p^2
                const auto is = [](double variance) { return doctest::Approx(variance).epsilon(1e-4).scale(0); };
                CHECK(at(chosen.map(0).variance) == is(once * std::max(albedo * uneven, 0.2)));
                // Where the peak is taken off, the rest has a largest value.
                chosen.deposits.largest = real(1.25);
                CHECK(at(chosen.map(0).variance) == is(once * std::max(albedo * std::min(uneven, 1.25), 0.2)));
            }
}

TEST_CASE(WISP_ARITH_NAME ": with fewer points in the irradiance map, a picture is nearly the same, and smaller") {
    SmokeDescription box = box_smoke({1.5, 1.5, 1.5}, 1, 24);
    box.asymmetry = 0.3;
    Scene scene = scene_of(box, sun_along_z);
    scene.camera = look_at_origin(12, 3.5, 4);
    Settings settings = brick_settings(4, 1, 20000);
    settings.step = 1;
    Rendered pictures[3];
    for (int i = 0; i < 3; ++i) {
        settings.irradiance = i == 2 ? IrradianceMap::adaptive : IrradianceMap::uniform;
        settings.irradiance_step = i == 1 ? 4 : 2;
        pictures[i] = render_in_memory(scene, settings);
        REQUIRE(pictures[i].status == Status::done);
    }
    const auto bytes = [&](int i) { return pictures[i].statistics.bytes.irradiance; };
    const uint64_t bricks = plan_sparse_grid(scene, 1).count;
    CHECK(bytes(0) == bricks * (nodes_of(2) * 4 + 20)); // along lines to the eye: without directions
    CHECK(bytes(1) == bricks * (nodes_of(4) * 4 + 20));
    CHECK(bytes(2) <= bytes(0)); // so few photons are noise
    CHECK(std::fabs(sum_of(pictures[1].rgb) / sum_of(pictures[0].rgb) - 1) < 0.03);
    CHECK(relative_difference(pictures[2].rgb, pictures[0].rgb) < 0.01);
}

TEST_CASE(WISP_ARITH_NAME ": resampled smoke of any kind that glows is as bright with method direct") {
    const std::vector<Particle> particles = cloud(60, 1, 1, 0.4);
    for (const SmokeDescription &source :
         {box_smoke({1.5, 1.5, 1.5}, 1, 8), smoke_of(particles), smoke_of(particles, Kernel::poly6)}) {
        SmokeDescription smoke = source;
        smoke.albedo = {0.5, 0.5, 0.5};
        smoke.emission = {1, 1, 1};
        const Scene scene = scene_of(smoke, {});
        Settings settings = brick_settings(4, 1, 4000);
        settings.method = Method::direct;
        settings.density_step = settings.step = 0.25;
        const Rendered bricks = render_in_memory(scene, settings);
        settings.density_step = settings.light_step = 0;
        const Rendered exact = render_in_memory(scene, settings);
        REQUIRE(bricks.status == Status::done);
        REQUIRE(exact.status == Status::done);
        // Other draws: the noise of some thousands of collisions.
        CHECK(std::fabs(sum_of(bricks.rgb) / sum_of(exact.rgb) - 1) < 0.05);
    }
}
