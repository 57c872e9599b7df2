// The particle map against the reference, against `direct` where both must agree, and its deposits and kept depths.
#include "built_map.h"
#include "mixture.h"
#include "wisp/particle_march.h"
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

double relative_difference(const std::vector<float> &a, const std::vector<float> &b) {
    double squares = 0, sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        squares += d * d;
        sum += static_cast<double>(b[i]);
    }
    return std::sqrt(squares * static_cast<double>(a.size())) / sum;
}

double sum_of(const std::vector<float> &values) {
    double sum = 0;
    for (float value : values) sum += static_cast<double>(value);
    return sum;
}

// The mean of the reference's samples, and the relative noise of all.
std::vector<float> reference_of(const Scene &scene, int pixels, uint32_t passes, double &noise) {
    Settings settings = small_settings(pixels);
    settings.reference = true;
    settings.last_pass = passes;
    std::vector<unsigned char> memory(plan(scene, settings).bytes.arena);
    Arena arena(memory.data(), memory.size());
    std::vector<PixelSums> sums(static_cast<size_t>(pixels * pixels));
    Statistics statistics;
    REQUIRE(render_reference(scene, settings, arena, Observer{}, sums.data(), statistics) == Status::done);
    std::vector<float> mean;
    double variance = 0, sum = 0;
    for (const PixelSums &pixel : sums)
        for (const PixelSums::Channel &c : pixel.channels) {
            const double n = passes, x = static_cast<double>(c.sum.low) * 0x1p-32 / n;
            const double square = static_cast<double>(c.square.high) + static_cast<double>(c.square.low) * 0x1p-64;
            mean.push_back(static_cast<float>(x));
            variance += std::max(0.0, square / n - x * x) / n;
            sum += x;
        }
    noise = std::sqrt(variance * static_cast<double>(mean.size())) / sum;
    return mean;
}

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
        SmokeSource smoke = smoke_of(particles);
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
                for (uint32_t i = 0; i < 3 * map.of_smoke[s].count; i += 3)
                    sums[run][s] += static_cast<double>(map.of_smoke[s].power[i]) * 0x1p-24;
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

TEST_CASE(WISP_ARITH_NAME ": sources are what the sums make of them, within the rounding of an entry") {
    // Powers that differ by 2^12, of up to four million photons on an element, with fluxes of every share of them.
    std::vector<Particle> particles = cloud(40, 2, 1, 0.5);
    const Vec3 eye = vec(0.5, -4, 3);
    for (uint32_t channels : {1u, 3u})
        for (double g : {0.0, 0.5, -0.3}) {
            SmokeSource smoke = smoke_of(particles);
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
            Deposits deposits = {power.data(), g == 0 ? nullptr : flux.data(), 40, channels};
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
                const double cosine = along / std::sqrt(f * r), share = g * std::sqrt(f) / whole[i];
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

TEST_CASE(WISP_ARITH_NAME ": kept depths are exact at their nodes, and err with the square of their distance") {
    const Mixture mixture;
    const BuiltMedium built(mixture.smokes);
    std::vector<Light> lights;
    for (const LightSource &light : mixture.lights) lights.push_back(make_light(light));
    double errors[2];
    for (int fine = 0; fine < 2; ++fine) {
        const double spacing = fine ? 0.25 : 0.5;
        Scene scene = mixture.scene;
        std::vector<unsigned char> memory(light_depth_bytes(scene, spacing));
        Arena arena(memory.data(), memory.size());
        LightDepths depths, backwards;
        uint64_t rays = 0;
        REQUIRE(make_light_depths(built.medium, lights.data(), 2, real(spacing), arena, &rays, depths));
        const auto exact = [&](uint32_t l, const Vec3 &x) {
            const Illumination way = illuminate(lights[l], x, x, x);
            return at(optical_depth(built.medium, {x, -way.direction}, way.distance));
        };
        Sequence next{5};
        std::vector<Vec3> points;
        for (int i = 0; i < 400; ++i) points.push_back(vec(2 * next() - 1, 2 * next() - 1, 2 * next() - 1));
        double squares = 0;
        std::vector<Real> found;
        for (const Vec3 &x : points) {
            found.push_back(light_depth(depths, 1, x));
            squares += std::pow(at(found.back()) - exact(1, x), 2);
        }
        errors[fine] = std::sqrt(squares / 400);
        const Vec3 node = depths.lattice.low + Vec3(real(8), real(9), real(10)) * real(spacing);
        for (uint32_t l = 0; l < 2; ++l)
            CHECK(at(light_depth(depths, l, node)) == doctest::Approx(exact(l, node)).epsilon(1e-4).scale(1));
        CHECK(rays < 2 * 8 * 400);

        // Whoever asks first: the same bits.
        std::vector<unsigned char> other(memory.size());
        Arena second(other.data(), other.size());
        REQUIRE(make_light_depths(built.medium, lights.data(), 2, real(spacing), second, &rays, backwards));
        for (size_t i = points.size(); i-- > 0;) CHECK(light_depth(backwards, 1, points[i]) == found[i]);

        // Without room for a single brick too.
        Arena full(other.data(), other.size());
        REQUIRE(make_light_depths(built.medium, lights.data(), 2, real(spacing), full, &rays, backwards));
        REQUIRE(full.make<unsigned char>(full.size() - full.mark() - 128));
        for (size_t i = 0; i < 20; ++i) CHECK(light_depth(backwards, 1, points[i]) == found[i]);
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
