// Photons through resampled smoke, and the irradiance map made of what they leave.
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

constexpr double pi_ = 3.14159265358979323846;

const std::vector<LightSource> sun = {{LightKind::parallel, {}, {0, 0, -1}, 2, {1, 1, 1}}};

Settings photon_settings(uint64_t photons) {
    Settings settings = small_settings(4);
    settings.method = Method::map;
    settings.density_step = settings.light_step = 1;
    settings.photons = photons;
    return settings;
}

bool adds_up(const Statistics::Photons &n) {
    return n.emitted == n.absorbed + n.escaped + n.blocked + n.capped && n.blocked == 0;
}

// How photons fare in a box of half-width 1 from -1 to 1, lit along -z, in double: drawn from closed forms.
struct Fortune {
    double collisions = 0, escaped = 0, path = 0; // a photon; `path` after the first collision
};
Fortune analog(double sigma, double albedo, double g, int photons) {
    Fortune fate;
    Sequence next{77};
    for (int i = 0; i < photons; ++i) {
        double x[3] = {2 * next() - 1, 2 * next() - 1, 1}, d[3] = {0, 0, -1};
        x[2] += std::log(1 - next() * (1 - std::exp(-2 * sigma))) / sigma;
        for (;;) {
            fate.collisions += 1;
            if (!(next() < albedo)) break;
            const double xi = next(), turn = 2 * pi_ * next(), s = (1 - g * g) / (1 - g + 2 * g * xi);
            const double cosine = g == 0 ? 2 * xi - 1 : (1 + g * g - s * s) / (2 * g);
            const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
            // Any two vectors at right angles to d.
            const int least = std::fabs(d[0]) < 0.6 ? 0 : 1;
            double u[3] = {least == 0 ? 1.0 : 0.0, least == 1 ? 1.0 : 0.0, 0}, v[3];
            for (double &c : u) c -= d[least] * d[&c - u];
            const double size = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
            for (double &c : u) c /= size;
            for (int k = 0; k < 3; ++k) v[k] = d[(k + 1) % 3] * u[(k + 2) % 3] - d[(k + 2) % 3] * u[(k + 1) % 3];
            double leave = 1e9;
            for (int k = 0; k < 3; ++k) {
                d[k] = sine * (std::cos(turn) * u[k] + std::sin(turn) * v[k]) + cosine * d[k];
                if (d[k] != 0) leave = std::min(leave, ((d[k] > 0 ? 1 : -1) - x[k]) / d[k]);
            }
            const double flight = -std::log(1 - next()) / sigma;
            fate.path += std::min(flight, leave);
            if (!(flight < leave)) {
                fate.escaped += 1;
                break;
            }
            for (int k = 0; k < 3; ++k) x[k] += d[k] * flight;
        }
    }
    fate.collisions /= photons;
    fate.escaped /= photons;
    fate.path /= photons;
    return fate;
}

double total_of(const FluenceSums &deposits, uint32_t channel = 0) {
    double sum = 0;
    const size_t nodes = size_t{deposits.bricks->count} * nodes_of(deposits.spacing);
    for (size_t i = 0; i < nodes; ++i)
        sum += static_cast<double>(deposits.power[i * deposits.channels + channel]) * 0x1p-24;
    return sum;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": photons in a resampled box fare as those drawn from closed forms") {
    const double sigma = 1.5;
    for (double albedo : {0.5, 1.0})
        for (double g : {0.0, 0.5, -0.5}) {
            SmokeDescription box = box_smoke({1, 1, 1}, sigma, 16);
            box.albedo = {albedo, albedo, albedo};
            box.asymmetry = g;
            const Scene scene = scene_of(box, sun);
            const int n = 6000;
            const TracedFluence traced(scene, photon_settings(n));
            const auto &counts = traced.statistics.photons;
            const Fortune expected = analog(sigma, albedo, g, 4 * n);
            CAPTURE(albedo);
            CAPTURE(g);
            CHECK(counts.emitted == n);
            CHECK(adds_up(counts));
            CHECK(counts.collisions == counts.stored + counts.emitted);
            if (albedo == 1) CHECK(counts.escaped == counts.emitted);
            // Collisions of a photon have a variance of about their mean squared; 1.25: of both samples.
            CHECK(std::fabs(double(counts.collisions) / n - expected.collisions) <
                  4 * expected.collisions * std::sqrt(1.25 / n));
            CHECK(std::fabs(double(counts.escaped) / n - expected.escaped) <=
                  4 * std::sqrt(1.25 * expected.escaped * (1 - expected.escaped) / n));
            CHECK(std::fabs(total_of(traced.deposits) / n - expected.path) < 4 * expected.path * std::sqrt(1.25 / n));
            // In a constant density all collisions are real: each leaves a mean free path.
            CHECK(total_of(traced.deposits) == doctest::Approx(double(counts.stored) / sigma).epsilon(1e-5));
            CHECK((traced.deposits.flux != nullptr) == (g != 0));
            CHECK((traced.deposits.harmonics != nullptr) == (g != 0));
        }
}

TEST_CASE(WISP_ARITH_NAME ": a photon is left to the nodes around it by their shares") {
    // Smoke that lets light no farther than the first cell, where it is near the face: that has most, by any axis.
    SmokeDescription box = box_smoke({1, 1, 1}, 20, 4);
    box.albedo = {0.5, 0.5, 0.5};
    for (int axis = 0; axis < 3; ++axis) {
        const Double3 way = {axis == 0 ? -1.0 : 0, axis == 1 ? -1.0 : 0, axis == 2 ? -1.0 : 0};
        const std::vector<LightSource> lights = {{LightKind::parallel, {}, way, 2, {1, 1, 1}}};
        const TracedFluence traced(scene_of(box, lights), photon_settings(2000));
        double layers[9] = {};
        for (uint32_t k = 0; k < nodes_of(1); ++k) {
            const Cell node = lattice_coordinates(*traced.deposits.bricks, 0, k);
            layers[axis == 0 ? node.x : axis == 1 ? node.y : node.z] += static_cast<double>(traced.deposits.power[k]);
        }
        REQUIRE(traced.deposits.bricks->count == 1);
        CHECK(layers[4] > 1.25 * layers[3]);
        CHECK(layers[3] > 10 * layers[2]);
    }
}

TEST_CASE(WISP_ARITH_NAME ": photons leave lengths that make up their collisions, whatever the density") {
    // A tentative collision leaves its length at nodes by trilinear shares: times their densities it is the chance
    // that it was one.
    std::vector<Particle> particles = cloud(120, 2.5, 1, 0.5);
    for (size_t i = 0; i < particles.size(); i += 3) particles[i].h = 1.5;
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const SmokeDescription smoke = smoke_of(particles, kernel);
        const std::vector<LightSource> lights = {{LightKind::point, {5, 4, 3}, {0, 0, 1}, 2, {40, 40, 40}}};
        Settings settings = photon_settings(3000);
        settings.density_step = 0.5;
        const TracedFluence traced(scene_of(smoke, lights), settings);
        const auto &counts = traced.statistics.photons;
        CHECK(adds_up(counts));
        CHECK(counts.stored > 1500);
        CHECK(counts.collisions == counts.stored + counts.emitted);
        double expected = 0;
        for (uint32_t b = 0; b < traced.deposits.bricks->count; ++b)
            for (uint32_t k = 0; k < nodes_of(1); ++k)
                expected += static_cast<double>(traced.deposits.power[b * nodes_of(1) + k]) * 0x1p-24 *
                            at(traced.medium.smokes[0].field.resampled.nodes(b)[k]);
        CHECK(std::fabs(expected - double(counts.stored)) < 4 * std::sqrt(double(counts.stored)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": fluxes are the directions of what flies, and never more than it") {
    SmokeDescription box = box_smoke({1, 1, 1}, 0.5, 8);
    box.albedo = {1, 1, 1};
    box.asymmetry = 0.9;
    const TracedFluence traced(scene_of(box, sun), photon_settings(3000));
    const FluenceSums &deposits = traced.deposits;
    double flux[3] = {0, 0, 0};
    const size_t nodes = size_t{deposits.bricks->count} * nodes_of(1);
    for (size_t i = 0; i < nodes; ++i) {
        double squares = 0;
        for (size_t c = 0; c < 3; ++c) {
            const double x = static_cast<double>(deposits.flux[3 * i + c]) * 0x1p-24;
            flux[c] += x;
            squares += x * x;
        }
        // R + G + B = 3 times the power; rounding of every deposit.
        CHECK(std::sqrt(squares) <= 3 * static_cast<double>(deposits.power[i]) * 0x1p-24 * (1 + 1e-6) + 1e-3);
    }
    const double all = 3 * total_of(deposits);
    CHECK(all > 1000);
    CHECK(flux[2] < -0.75 * all); // most flies on downwards
    CHECK(flux[2] > -0.95 * all);
    CHECK(std::fabs(flux[0]) < 0.05 * all);
    CHECK(std::fabs(flux[1]) < 0.05 * all);
}

TEST_CASE(WISP_ARITH_NAME ": moments are those of the direction that flew, at the place where it did") {
    // Of a photon that flies once, the flux tells the direction, and the centre of the power the place.
    SmokeDescription box = box_smoke({1, 1, 1}, 3, 16);
    box.albedo = {0.5, 0.5, 0.5};
    box.asymmetry = -0.5;
    const Scene scene = scene_of(box, sun);
    for (int32_t stride : {1, 2, 8}) {
        int flown = 0;
        double astray = 0; // of the nearest node, on average
        for (uint64_t seed = 1; seed < 100 && flown < 12; ++seed) {
            Settings settings = photon_settings(1);
            settings.seed = seed;
            const TracedFluence traced(scene, settings, stride);
            if (traced.statistics.photons.stored != 1) continue;
            ++flown;
            const FluenceSums &deposits = traced.deposits;
            // Sums of numbers over all nodes, and the centre of the first.
            const auto sum = [&](const int64_t *values, uint32_t count, int32_t every, double *sums, double *center) {
                for (uint32_t b = 0; b < deposits.bricks->count; ++b)
                    for (uint32_t k = 0; k < nodes_of(every); ++k, values += count) {
                        const Cell place = lattice_coordinates(*deposits.bricks, b, k, every);
                        for (uint32_t i = 0; i < count; ++i) sums[i] += static_cast<double>(values[i]);
                        center[0] += static_cast<double>(values[0]) * place.x * every;
                        center[1] += static_cast<double>(values[0]) * place.y * every;
                        center[2] += static_cast<double>(values[0]) * place.z * every;
                    }
                for (int axis = 0; axis < 3; ++axis) center[axis] /= sums[0];
            };
            double power = 0, flux[3] = {}, harmonics[harmonic_numbers] = {}, place[3] = {}, harmonic_place[3] = {},
                   unused[3] = {};
            sum(deposits.power, 1, stride, &power, place);
            sum(deposits.flux, 3, stride, flux, unused);
            sum(deposits.harmonics, harmonic_numbers, harmonic_spacing(stride), harmonics, harmonic_place);
            CHECK(harmonics[0] == doctest::Approx(3 * power).epsilon(1e-5));
            for (int axis = 0; axis < 3; ++axis) {
                const double off = (harmonic_place[axis] - place[axis]) / harmonic_spacing(stride);
                CHECK(std::fabs(off) < 0.5 + 1e-3);
                astray += off / (12 * 3);
            }
            const SphericalHarmonics expected =
                harmonics_of(normalize(vec(flux[0] / harmonics[0], flux[1] / harmonics[0], flux[2] / harmonics[0])));
            for (uint32_t i = 0; i < harmonic_count; ++i)
                CHECK(std::fabs(2 * harmonics[1 + i] / harmonics[0] - 1 - at(expected.value[i])) < 1e-4);
        }
        CHECK(flown == 12);
        CHECK(std::fabs(astray) < 0.2); // four times its deviation, 12^-1/2 / 6
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": moments are kept where some smoke scatters a little unevenly, and cost nothing elsewhere") {
    SmokeDescription smokes[] = {box_smoke({1, 1, 1}, 3, 16), box_smoke({1, 1, 1}, 2, 16)};
    Scene scene = scene_of(smokes[0], sun);
    scene.smokes = smokes;
    scene.smoke_count = 2;
    const Settings settings = photon_settings(1000);
    const auto numbers = [&](double a, double b) { // of a brick
        smokes[0].asymmetry = a;
        smokes[1].asymmetry = b;
        CHECK(photon_needs(scene, settings).directions == (a != 0 || b != 0));
        return plan_fluence(scene, settings, 1, 2).sums;
    };
    const uint64_t flux = nodes_of(2) * 4, more = nodes_of(4) * harmonic_numbers;
    CHECK(numbers(0, 0) == nodes_of(2));
    for (double g : {0.58, -0.58, 0.99}) {
        CHECK(numbers(0, g) == flux);
        CHECK(numbers(-g, g) == flux);
        for (double little : {0.57, -0.57, 1e-9}) CHECK(numbers(g, little) == flux + more);
    }
    for (double g : {-0.58, -0.57, -1e-3, 0.0, 1e-3, 0.57, 0.58})
        CHECK(uses_harmonics(real(g)) == (g != 0 && std::fabs(g) < 0.577));
}

TEST_CASE(WISP_ARITH_NAME ": black smoke traces no photons through bricks, and glowing smoke starts them in itself") {
    SmokeDescription box = box_smoke({1, 1, 1}, 2, 8);
    box.albedo = {0, 0, 0};
    Scene scene = scene_of(box, sun);
    const Settings settings = photon_settings(2000);
    CHECK(plan(scene, settings).map_sums == 0);
    const Rendered black = render_in_memory(scene, settings);
    REQUIRE(black.status == Status::done);
    CHECK(black.statistics.photons.emitted == 0);
    CHECK(sum_of(black.rgb) == 0);

    box.albedo = {0.5, 0.5, 0.5};
    box.emission = {1, 1, 1};
    scene.light_count = 0;
    const TracedFluence traced(scene, settings);
    const auto &counts = traced.statistics.photons;
    CHECK(counts.emitted == 2000);
    CHECK(adds_up(counts));
    CHECK(counts.stored == counts.collisions); // from the first: nothing else counts those
    // 4 pi (1 - albedo) L sigma V.
    const double power = 4 * pi_ * 0.5 * 2 * 8;
    CHECK(at(scale_pow2(traced.deposits.unit.unit, traced.deposits.unit.exponent)) * 2000 ==
          doctest::Approx(power).epsilon(1e-3));
    const Resampled resampled({box}, 1);
    CHECK(std::fabs(double(counts.stored) - 2 * total_of(traced.deposits)) < 1e-4 * double(counts.stored));
}

TEST_CASE(WISP_ARITH_NAME ": in two smokes photons collide with each by its share, and take its albedo") {
    // One over the other: of 3 collisions one is with the black one.
    const std::vector<Particle> particles = cloud(60, 1.5, 1.5, 1);
    std::vector<Particle> heavier = particles;
    for (Particle &p : heavier) p.area *= 2;
    SmokeDescription smokes[] = {smoke_of(particles), smoke_of(heavier)};
    smokes[0].albedo = {0, 0, 0};
    smokes[1].albedo = {1, 1, 1};
    Scene scene = scene_of(smokes[0], sun);
    scene.smokes = smokes;
    scene.smoke_count = 2;
    Settings settings = photon_settings(4000);
    settings.density_step = 0.5;
    const TracedFluence traced(scene, settings);
    const auto &counts = traced.statistics.photons;
    CHECK(adds_up(counts));
    const double n = double(counts.collisions), black = double(counts.absorbed);
    CHECK(n > 5000);
    CHECK(std::fabs(black - n / 3) < 4 * std::sqrt(n * 2 / 9));
}

TEST_CASE(WISP_ARITH_NAME ": photons through bricks bring the power that first collides") {
    const double sigma = 2;
    const SmokeDescription box = box_smoke({1, 1, 1}, sigma, 16);
    const auto power_of = [&](const std::vector<LightSource> &lights) {
        const int n = 10;
        const TracedFluence traced(scene_of(box, lights), photon_settings(n));
        return at(scale_pow2(traced.deposits.unit.unit, traced.deposits.unit.exponent)) * n;
    };
    // What the box takes out of a parallel light: by trapezia along it.
    const double cell = 0.125 * sigma;
    CHECK(power_of(sun) == doctest::Approx(4 * (1 - std::exp(-2 * sigma))).epsilon(cell * cell / 12 + 1e-3));
    // Around a point light the inverse square is right on average, wherever the light is between the nodes.
    Sequence next{5};
    double found = 0, expected = 0;
    for (int place = 0; place < 8; ++place) {
        const double from[3] = {0.5 * next(), 0.5 * next(), 0.5 * next()};
        const double power = power_of({{LightKind::point, {from[0], from[1], from[2]}, {0, 0, 1}, 2, {1, 1, 1}}});
        double exact = 0; // the mean of 1 - e^-depth over all directions
        const int rays = 2000;
        for (int i = 0; i < rays; ++i) {
            const double z = 2 * (i + 0.5) / rays - 1, turn = 2 * pi_ * next(), side = std::sqrt(1 - z * z);
            const double d[3] = {side * std::cos(turn), side * std::sin(turn), z};
            double leave = 1e9;
            for (int k = 0; k < 3; ++k) leave = std::min(leave, ((d[k] > 0 ? 1 : -1) - from[k]) / d[k]);
            exact += 4 * pi_ * (1 - std::exp(-sigma * leave)) / rays;
        }
        CHECK(power == doctest::Approx(exact).epsilon(0.1));
        found += power;
        expected += exact;
    }
    CHECK(found == doctest::Approx(expected).epsilon(0.02));
}

TEST_CASE(WISP_ARITH_NAME ": photons through bricks are as bright as the reference") {
    // Sums of pictures, of all orders of scattering.
    const LightSource slanted = {LightKind::parallel, {}, {0, -0.6, -0.8}, 2, {3, 3, 3}},
                      near = {LightKind::point, {0.5, 2.5, 1}, {0, 0, 1}, 2, {9, 9, 9}},
                      inside = {LightKind::point, {0.5, -0.3, 0.1}, {0, 0, 1}, 2, {9, 9, 9}},
                      cone = {LightKind::spot, {0, 0, 4}, {0, 0, -1}, 0.03, {60, 60, 60}},
                      even = {LightKind::constant, {0, 3, 1}, {0, 0, 1}, 2, {3, 3, 3}};
    struct {
        LightSource light;
        double g;
        Double3 albedo, emission;
        double bias;
    } const rows[] = {
        {slanted, 0, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.01},      {slanted, 0.5, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.03},
        {slanted, -0.5, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.04},   {slanted, 0, {1, 0.8, 0.5}, {0, 0, 0}, 0.01},
        {slanted, 0, {0.9, 0.9, 0.9}, {0.5, 0.25, 0}, 0.01}, {near, 0, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.01},
        {inside, 0, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.02},       {cone, 0, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.03},
        {even, 0, {0.9, 0.9, 0.9}, {0, 0, 0}, 0.01}};
    for (const auto &row : rows) {
        SmokeDescription box = box_smoke({1.5, 1.5, 1.5}, 1, 16);
        box.asymmetry = row.g;
        box.albedo = row.albedo;
        box.emission = row.emission;
        const bool glows = row.emission.x > 0;
        const std::vector<LightSource> lights = {row.light};
        Scene scene = scene_of(box, lights);
        scene.light_count = glows ? 0 : 1;
        scene.camera = look_at_origin(12, 3.5, 4);
        double noise;
        box.smallest_h = 1; // wide majorants for the reference: all are equal
        const std::vector<float> truth = reference_of(scene, 4, 400, noise);
        box.smallest_h = box.largest_h;
        Settings settings = photon_settings(20000);
        settings.step = 1;
        const Rendered picture = render_in_memory(scene, settings);
        REQUIRE(picture.status == Status::done);
        const double stored = static_cast<double>(picture.statistics.photons.stored);
        const double error = std::sqrt(noise * noise / 16 + 2 / stored);
        CAPTURE(&row - rows);
        CAPTURE(sum_of(picture.rgb) / sum_of(truth));
        CAPTURE(error);
        CHECK(adds_up(picture.statistics.photons));
        CHECK(error < 0.05);
        CHECK(std::fabs(sum_of(picture.rgb) / sum_of(truth) - 1) < 3.5 * error + row.bias);
        CHECK(relative_difference(picture.rgb, truth) < 2 * noise + 0.05);
        settings.photons = 0; // what is scattered twice and more is a good part of it
        CHECK(sum_of(render_in_memory(scene, settings).rgb) < (glows ? 0.95 : 0.85) * sum_of(truth));
    }
}

TEST_CASE(WISP_ARITH_NAME ": light from opposite sides, which has no flux, is scattered to where it goes") {
    for (double g : {0.5, -0.5})
        for (const Double3 &way : {Double3{0, 0, 1}, Double3{0.6, 0.8, 0}}) { // to the eye, and across
            const std::vector<LightSource> lights = {{LightKind::parallel, {}, way, 2, {3, 3, 3}},
                                                     {LightKind::parallel, {}, {-way.x, -way.y, -way.z}, 2, {3, 3, 3}}};
            SmokeDescription box = box_smoke({1.5, 1.5, 1.5}, 1, 16);
            box.asymmetry = g;
            box.albedo = {1, 1, 1};
            Scene scene = scene_of(box, lights);
            scene.camera = look_at_origin(12, 2.5, 4);
            double noise;
            box.smallest_h = 1; // wide majorants for the reference: all are equal
            const std::vector<float> truth = reference_of(scene, 4, 2500, noise);
            box.smallest_h = box.largest_h;
            Settings settings = photon_settings(100000);
            settings.step = 1;
            const Rendered picture = render_in_memory(scene, settings);
            REQUIRE(picture.status == Status::done);
            CAPTURE(g);
            CAPTURE(way.z);
            CAPTURE(noise);
            CHECK(noise < 0.03);
            CHECK(std::fabs(sum_of(picture.rgb) / sum_of(truth) - 1) < 0.02);
        }
}

TEST_CASE(WISP_ARITH_NAME ": batches traced apart through bricks leave the sums and the picture of one run") {
    const std::vector<Particle> big = cloud(40, 2.5, 1.5, 0.6, 3), small = cloud(80, 2, 1, 0.25, 4);
    SmokeDescription smokes[] = {smoke_of(big, Kernel::poly6), smoke_of(small)};
    smokes[0].albedo = {0.9, 0.5, 0.2};
    smokes[1].asymmetry = 0.5;
    smokes[1].emission = {0.1, 0.2, 0};
    const std::vector<LightSource> lights = {{LightKind::point, {0.5, 0.25, 0.5}, {0, 0, 1}, 2, {4, 5, 6}},
                                             {LightKind::parallel, {}, {-0.6, -0.8, 0}, 2, {3, 2, 1}}};
    Scene scene = scene_of(smokes[0], lights);
    scene.smokes = smokes;
    scene.smoke_count = 2;
    Settings settings = photon_settings(2 * batch_photons + 100);
    settings.density_step = settings.light_step = 0.5;
    settings.irradiance = IrradianceMap::uniform;
    settings.irradiance_step = 1;
    const Plan planned = plan(scene, settings);
    CHECK(planned.photon_directions);
    CHECK(planned.photon_harmonics);
    CHECK(planned.photon_powers);
    std::vector<unsigned char> memory(planned.bytes.arena);
    struct Sums {
        std::vector<int64_t> values;
        PhotonSums sums;
        Statistics statistics = {};
    };
    const auto make = [&] {
        Sums made = {std::vector<int64_t>(planned.map_sums, -1), {}};
        made.sums = {made.values.data(), made.values.size(), 0};
        return made;
    };
    const auto trace = [&](Sums &to, const Batches &batches) {
        Arena arena(memory.data(), memory.size());
        REQUIRE(trace_map(scene, settings, batches, arena, Observer{}, to.sums, to.statistics) == Status::done);
    };
    Sums whole = make(), parts = make(), drawn = make();
    trace(whole, {0, 3});
    CHECK(whole.sums.count == whole.values.size());
    trace(parts, {2, 3});
    trace(parts, {0, 1});
    CHECK(parts.values != whole.values);
    trace(parts, {1, 2});
    CHECK(parts.values == whole.values);
    CHECK(parts.statistics.photons.emitted == settings.photons);
    CHECK(std::memcmp(&parts.statistics.photons, &whole.statistics.photons, sizeof whole.statistics.photons) == 0);

    const Rendered alone = render_in_memory(scene, settings);
    REQUIRE(alone.status == Status::done);
    std::vector<float> rgb(alone.rgb.size());
    for (Sums *from : {&parts, &drawn, &drawn}) { // kept, traced for it, kept
        Arena arena(memory.data(), memory.size());
        REQUIRE(render(scene, settings, arena, Observer{}, rgb.data(), from->statistics, &from->sums) == Status::done);
        CHECK(rgb == alone.rgb);
        CHECK(from->values == whole.values);
    }
    settings.seed = 2;
    CHECK(render_in_memory(scene, settings).rgb != alone.rgb);
}

namespace {

// Deposits of the test's own over a box of 30 x 22 x 22 cells of width 1.
struct Given {
    explicit Given(int32_t stride, uint32_t channels, bool directed = false)
        : built({box()}, 1), power(size_t{built.bricks.count} * nodes_of(stride) * channels),
          flux(directed ? power.size() / channels * 3 : 0),
          harmonics(directed ? size_t{built.bricks.count} * nodes_of(harmonic_spacing(stride)) * harmonic_numbers : 0),
          deposits{&built.bricks,
                   stride,
                   power.data(),
                   directed ? flux.data() : nullptr,
                   directed ? harmonics.data() : nullptr,
                   channels,
                   Color(Real(1)),
                   {Real(1), 0}} {
        REQUIRE(same(built.bricks.cell, Vec3(Real(1))));
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
        const SparseGrid &bricks = built.bricks;
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
        memory.resize(irradiance_bytes(scene_of(box(), {}), built.bricks.count, deposits.spacing,
                                       deposits.flux != nullptr, deposits.harmonics != nullptr));
        Arena arena(memory.data(), memory.size());
        const Irradiance made = make_irradiance(medium.medium, deposits, real(tolerance), arena);
        REQUIRE(made.ready);
        return made;
    }
    // In units of cells from the lattice's beginning, in the box.
    Color read(const Irradiance &map, double x, double y, double z) const {
        const SparseGrid &bricks = built.bricks;
        const Cell cell = {int32_t(x) / 8, int32_t(y) / 8, int32_t(z) / 8};
        return light_at(map, brick_at(bricks, cell), vec(x - 8 * cell.x, y - 8 * cell.y, z - 8 * cell.z)).radiance;
    }
    BuiltSparseGrid built;
    BuiltMedium medium{{box()}}; // deep: the tolerance is what it says
    std::vector<int64_t> power, flux, harmonics;
    FluenceSums deposits;
    std::vector<unsigned char> memory;
};

// Relative errors of a sum of eight holders, and of an entry.
constexpr double given_error = 40 * unit_error + 0x1p-22;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case D13: the irradiance map is exact on its points, and where light is even") {
    for (int32_t stride : {1, 2}) {
        Given given(stride, 1);
        const SparseGrid &bricks = given.built.bricks;
        Sequence next{3};
        // Constant: the same bits wherever it is asked, in the last cell and by a rounding outside.
        given.fill([](const Cell &, uint32_t) { return 8 / (4 * pi_); });
        const Irradiance even = given.map(0);
        const double value = at(given.read(even, 5, 5, 5).x);
        CHECK(value == doctest::Approx(8 / (4 * pi_)).epsilon(given_error));
        int different = 0;
        for (int i = 0; i < 1000; ++i) {
            const Color light =
                given.read(even, given.reach(0) * next(), given.reach(1) * next(), given.reach(2) * next());
            different += at(light.x) == value ? 0 : 1;
        }
        CHECK(different == 0);
        for (double p : {-1e-4, 8.0, 8 + 1e-4}) CHECK(at(light_at(even, 0, vec(p, p, p)).radiance.x) == value);

        // A node has its point's value, whichever brick and cell it is asked in.
        given.fill([&](const Cell &, uint32_t) { return 1 + next(); });
        const Irradiance uneven = given.map(0);
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < nodes_of(stride); ++k) {
                const Cell node = cell_of_index(nodes_along(stride), k);
                const Color found =
                    light_at(uneven, b, Vec3(Real(node.x * stride), Real(node.y * stride), Real(node.z * stride)))
                        .radiance;
                const double kept = static_cast<double>(uneven.value[uint32_t(uneven.first[b]) + k]);
                // At the end of a row between two others: a + 1 (b - a).
                CHECK(std::fabs(at(found.x) - std::ldexp(kept, uneven.exponent[b] - single_channel_bits)) <= 8 * unit_error);
            }
    }
}

TEST_CASE(WISP_ARITH_NAME ": light that grows evenly is interpolated exactly, over bricks' borders too") {
    for (int32_t stride : {1, 2, 4, 8})
        for (uint32_t channels : {1u, 3u}) {
            Given given(stride, channels);
            const auto of = [](double x, double y, double z, uint32_t c) {
                return (1 + 0.05 * x + 0.02 * y + 0.03 * z) / (c + 1);
            };
            given.fill([&](const Cell &p, uint32_t c) { return of(p.x, p.y, p.z, c); });
            const Irradiance map = given.map(0);
            CHECK(map.single_channel == (channels == 1));
            Sequence next{6};
            int wrong = 0;
            for (int i = 0; i < 1000; ++i) {
                const double x = given.reach(0) * next(), y = given.reach(1) * next(), z = given.reach(2) * next();
                const Color found = given.read(map, x, y, z);
                // Of a packed colour: 2^-9 of the largest channel.
                const double bar = of(x, y, z, 0) * (channels == 1 ? 2 * given_error : 0x1p-9 + given_error);
                for (uint32_t c = 0; c < channels; ++c)
                    wrong += std::fabs(at(found[static_cast<int>(c)]) - of(x, y, z, c)) < bar ? 0 : 1;
            }
            CAPTURE(stride);
            CHECK(wrong == 0);
        }
}

TEST_CASE(WISP_ARITH_NAME ": neither the tents of photons nor those of the map widen light") {
    // A layer of light, normal along x with a variance of 2 cells^2, left by shares: the map has its sum and variance.
    Given given(1, 1);
    const double middle = 15.3, variance = 2;
    given.fill([&](const Cell &p, uint32_t) {
        double sum = 0;
        for (int i = -50; i < 50; ++i) {
            const double offset = (i + 0.5) / 50, x = p.x + offset - middle;
            sum += (1 - std::fabs(offset)) / 50 * std::exp(-0.5 * x * x / variance);
        }
        return sum;
    });
    const Irradiance map = given.map(0);
    double harmonics[3] = {0, 0, 0};
    for (int i = 0; i < 2900; ++i) {
        const double x = (i + 0.5) / 100, light = at(given.read(map, x, 8.5, 4.5).x) / 100;
        harmonics[0] += light;
        harmonics[1] += light * x;
        harmonics[2] += light * x * x;
    }
    const double mean = harmonics[1] / harmonics[0];
    CHECK(harmonics[0] == doctest::Approx(std::sqrt(2 * pi_ * variance)).epsilon(1e-3));
    CHECK(mean == doctest::Approx(middle).epsilon(1e-3));
    CHECK(harmonics[2] / harmonics[0] - mean * mean == doctest::Approx(variance).epsilon(0.01)); // else 2.33
}

TEST_CASE(WISP_ARITH_NAME ": an adaptive map has fewer points, and keeps every other within its tolerance") {
    for (uint32_t channels : {1u, 3u})
        for (bool directed : {false, true}) {
            // A steep ball in one corner, a gentle slope elsewhere, noise in the last bricks.
            Given given(1, channels, directed);
            Sequence next{8};
            given.fill([&](const Cell &p, uint32_t c) {
                const double noise = p.x > 24 ? next() : 0;
                return (1 + 0.03 * p.x + 4 * std::exp(-0.3 * (p.x * p.x + p.y * p.y + p.z * p.z)) + noise) / (c + 1);
            });
            const Irradiance uniform = given.map(0);
            const SparseGrid &bricks = given.built.bricks;
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
            const uint64_t of_brick = 12 + (directed ? nodes_of(2) * harmonic_words * 4 : 0);
            CHECK(bytes_of(uniform) == uint64_t{uniform.points} * (directed ? 8 : 4) + bricks.count * of_brick);
            const double packed = channels == 1 ? given_error : 0x1p-8; // both maps round their entries
            uint32_t before = uniform.points;
            for (double tolerance : {0.002, 0.02, 0.1}) {
                const Irradiance map = given.map(tolerance);
                uint32_t points = 0, strides[9] = {};
                for (uint32_t b = 0; b < bricks.count; ++b) {
                    CHECK(map.first[b] == static_cast<int32_t>(points));
                    points += nodes_of(map.spacing[b]);
                    ++strides[map.spacing[b]];
                    double greatest = 0, worst = 0;
                    for (uint32_t k = 0; k < nodes_of(1); ++k) {
                        const auto &exact = all[size_t{b} * nodes_of(1) + k];
                        const Cell n = cell_of_index(nodes_along(1), k);
                        const Color light = light_at(map, b, Vec3(Real(n.x), Real(n.y), Real(n.z))).radiance;
                        for (size_t c = 0; c < 3; ++c) {
                            greatest = std::max(greatest, exact[c]);
                            worst = std::max(worst, std::fabs(at(light[static_cast<int>(c)]) - exact[c]));
                        }
                    }
                    CHECK(worst <= greatest * (tolerance + packed));
                }
                CHECK(map.points == points);
                CHECK(points <= before);
                before = points;
                CHECK(strides[1] > 0); // noise
                CHECK(strides[8] > 0); // the slope
                CHECK(bytes_of(map) == uint64_t{points} * (directed ? 8 : 4) + bricks.count * of_brick);
            }
            CHECK(before < uniform.points * 3 / 4);
        }
}

TEST_CASE(WISP_ARITH_NAME ": the map keeps colours and fluxes within their entries' errors") {
    Given given(2, 3, true);
    Sequence next{12};
    // Even light: nothing to sharpen. Colours of all kinds, and fluxes of all lengths.
    for (int round = 0; round < 12; ++round) {
        const double color[3] = {next(), next() * 0.1, next() * 0.01 + 1e-3}, share = next();
        const Vec3 way = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375));
        given.fill([&](const Cell &, uint32_t c) { return color[c]; });
        for (size_t i = 0; i < given.flux.size(); ++i) {
            const size_t node = i / 3;
            const double all = double(given.power[3 * node] + given.power[3 * node + 1] + given.power[3 * node + 2]);
            given.flux[i] = std::llround(all * share * at(way[static_cast<int>(i % 3)]));
        }
        const Irradiance map = given.map(0);
        const double most = std::max({color[0], color[1], color[2]});
        for (int i = 0; i < 50; ++i) {
            const FluenceAndFlux light = light_at(map, 0, vec(8 * next(), 8 * next(), 8 * next()));
            for (int c = 0; c < 3; ++c) {
                CHECK(std::fabs(at(light.radiance[c]) - color[c]) < most * (0x1p-9 + given_error));
                CHECK(std::fabs(at(light.flux[c]) - share * at(way[c])) < 0.5 / 511 + 1e-4);
            }
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": the map keeps moments relative to what all bricks around a node received") {
    Given given(1, 1, true);
    const SparseGrid &bricks = given.built.bricks;
    const int32_t stride = harmonic_spacing(1);
    Sequence next{13};
    std::map<std::array<int32_t, 3>, std::array<double, harmonic_numbers>> sums;
    const auto place = [&](uint32_t b, uint32_t k) {
        const Cell at_ = lattice_coordinates(bricks, b, k, stride);
        return std::array<int32_t, 3>{at_.x, at_.y, at_.z};
    };
    int64_t *sum = given.harmonics.data();
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes_of(stride); ++k)
            for (uint32_t i = 0; i < harmonic_numbers; ++i) {
                const double units = i == 0 ? next() + 0.01 : next() * static_cast<double>(sum[-int32_t(i)]) / 0x1p24;
                *sum++ = std::llround(units * 0x1p24);
                sums[place(b, k)][i] += units;
            }
    const Irradiance map = given.map(0);
    CHECK(map.harmonic_spacing == stride);
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes_of(stride); ++k) {
            const auto &expected = sums[place(b, k)];
            for (uint32_t i = 0; i < harmonic_count; ++i) {
                const uint32_t packed = map.harmonics[(b * nodes_of(stride) + k) * harmonic_words + i / 3];
                const double found = flux_units(packed, static_cast<int32_t>(i % 3)) / 511.0;
                CHECK(std::fabs(found - (2 * expected[1 + i] / expected[0] - 1)) < 0.5 / 511 + 1e-4);
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": a map that finds no room says so; of nothing it is dark") {
    Given given(1, 3, true);
    const Irradiance dark = given.map(0.02);
    for (uint32_t i = 0; i < dark.points; ++i) CHECK((dark.value[i] == 0 && dark.flux[i] == 0));
    CHECK(dark.points == given.built.bricks.count * nodes_of(8));
    std::vector<unsigned char> memory(given.memory.size());
    Arena enough(memory.data(), memory.size());
    REQUIRE(make_irradiance(given.medium.medium, given.deposits, Real(0), enough).ready);
    for (size_t part = 0; part < 50; ++part) {
        Arena arena(memory.data(), enough.peak() * part / 50);
        CHECK(!make_irradiance(given.medium.medium, given.deposits, Real(0), arena).ready);
    }
}

TEST_CASE(WISP_ARITH_NAME ": with fewer points of the irradiance map a picture is nearly the same, and smaller") {
    SmokeDescription box = box_smoke({1.5, 1.5, 1.5}, 1, 24);
    box.asymmetry = 0.5;
    Scene scene = scene_of(box, sun);
    scene.camera = look_at_origin(12, 3.5, 4);
    Settings settings = photon_settings(20000);
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
    CHECK(bytes(0) == bricks * (nodes_of(2) * 8 + nodes_of(4) * harmonic_words * 4 + 12));
    CHECK(bytes(1) == bricks * (nodes_of(4) * 8 + nodes_of(4) * harmonic_words * 4 + 12));
    CHECK(bytes(2) <= bytes(0)); // so few photons are noise
    CHECK(std::fabs(sum_of(pictures[1].rgb) / sum_of(pictures[0].rgb) - 1) < 0.03);
    CHECK(relative_difference(pictures[2].rgb, pictures[0].rgb) < 0.01);
}

TEST_CASE(WISP_ARITH_NAME ": resampled smoke of any kind that glows is as bright by method direct") {
    const std::vector<Particle> particles = cloud(60, 1, 1, 0.4);
    for (const SmokeDescription &source :
         {box_smoke({1.5, 1.5, 1.5}, 1, 8), smoke_of(particles), smoke_of(particles, Kernel::poly6)}) {
        SmokeDescription smoke = source;
        smoke.albedo = {0.5, 0.5, 0.5};
        smoke.emission = {1, 1, 1};
        const Scene scene = scene_of(smoke, {});
        Settings settings = photon_settings(4000);
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
