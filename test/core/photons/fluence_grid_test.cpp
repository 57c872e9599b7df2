// Photons through resampled smoke, and their fluence at the nodes (S2, S4-3).
#include "wisp/wisp.h"
#include "support/built_sparse_grid.h"
#include "support/compared_pictures.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <array>
#include <map>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Analog photons in a box from -1 to 1, lit along -z, in double, drawn from closed forms.
struct PhotonMeans {
    double collisions = 0, escaped = 0; // per photon
};
PhotonMeans analog(double sigma, double albedo, double g, int photons) {
    PhotonMeans means;
    Sequence next{77};
    for (int i = 0; i < photons; ++i) {
        double x[3] = {2 * next() - 1, 2 * next() - 1, 1}, d[3] = {0, 0, -1};
        x[2] += std::log(1 - next() * (1 - std::exp(-2 * sigma))) / sigma;
        for (;;) {
            means.collisions += 1;
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
            if (!(flight < leave)) {
                means.escaped += 1;
                break;
            }
            for (int k = 0; k < 3; ++k) x[k] += d[k] * flight;
        }
    }
    means.collisions /= photons;
    means.escaped /= photons;
    return means;
}

double total_of(const FluenceSums &deposits, uint32_t channel = 0) {
    double sum = 0;
    const size_t nodes = size_t{deposits.bricks->count} * nodes_of(deposits.spacing);
    for (size_t i = 0; i < nodes; ++i)
        sum += static_cast<double>(deposits.power[i * deposits.channels + channel]) * 0x1p-24;
    return sum;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": photons in a resampled box behave as those drawn from closed forms") {
    const double sigma = 1.5;
    for (double albedo : {0.5, 1.0})
        for (double g : {0.0, 0.5, -0.5}) {
            SmokeDescription box = box_smoke({1, 1, 1}, sigma, 48); // a cell is thin: all photons start with one power
            box.albedo = {albedo, albedo, albedo};
            box.asymmetry = g;
            const Scene scene = scene_of(box, sun_along_z);
            const int n = 6000;
            const TracedFluence traced(scene, brick_settings(4, 1, n));
            const auto &counts = traced.statistics.photons;
            const PhotonMeans expected = analog(sigma, albedo, g, 4 * n);
            CAPTURE(albedo);
            CAPTURE(g);
            CHECK(counts.emitted == n);
            CHECK(adds_up(counts));
            CHECK(counts.blocked == 0);
            CHECK(counts.collisions == counts.stored + counts.emitted);
            if (albedo == 1) CHECK(counts.escaped == counts.emitted);
            // Collisions of a photon have a variance of about their mean squared; 1.25: of both samples.
            CHECK(std::fabs(double(counts.collisions) / n - expected.collisions) <
                  4 * expected.collisions * std::sqrt(1.25 / n));
            CHECK(std::fabs(double(counts.escaped) / n - expected.escaped) <=
                  4 * std::sqrt(1.25 * expected.escaped * (1 - expected.escaped) / n));
            // In a constant density all collisions are real: each leaves its power.
            CHECK(total_of(traced.deposits) == doctest::Approx(double(counts.stored)).epsilon(1e-5));
            CHECK((traced.deposits.flux != nullptr) == (g != 0));
            CHECK((traced.deposits.harmonics != nullptr) == (g != 0));
        }
}

TEST_CASE(WISP_ARITH_NAME
          ": the power that starts in a box is what the box takes from the light, however deep its cells") {
    // 4 * (1 - e^(-2 sigma)) of a parallel light of irradiance 1, for a box of edges 2. The sum over nodes alone is
    // s / 2 coth(s / 2) times that, for cells of depth s: 1.08 for the deepest here.
    for (double sigma : {2.0, 8.0}) {
        SmokeDescription box = box_smoke({1, 1, 1}, sigma, 16);
        box.albedo = {0.5, 0.5, 0.5};
        const int n = 20000;
        const TracedFluence traced(scene_of(box, sun_along_z), brick_settings(4, 1, n));
        const PhotonMeans expected = analog(sigma, 0.5, 0, 4 * n);
        const PhotonUnit &unit = traced.deposits.unit;
        const double sum = total_of(traced.deposits) * std::ldexp(at(unit.unit), unit.exponent);
        CAPTURE(sigma);
        CHECK(sum / (4 * (1 - std::exp(-2 * sigma)) * (expected.collisions - 1)) ==
              doctest::Approx(1).epsilon(0.005 + 4 * std::sqrt(1.25 / n)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": a photon is deposited at the nodes around it by trilinear weights") {
    // Dense smoke stops light in the first cell, near the face: the layer of the face receives most, along any axis.
    SmokeDescription box = box_smoke({1, 1, 1}, 20, 4);
    box.albedo = {0.5, 0.5, 0.5};
    for (int axis = 0; axis < 3; ++axis) {
        const Double3 way = {axis == 0 ? -1.0 : 0, axis == 1 ? -1.0 : 0, axis == 2 ? -1.0 : 0};
        const std::vector<LightSource> lights = {{LightKind::parallel, {}, way, 2, {1, 1, 1}}};
        const TracedFluence traced(scene_of(box, lights), brick_settings(4, 1, 2000));
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

TEST_CASE(WISP_ARITH_NAME
          ": deposits are the collisions, and the light made of them gives them back, whatever the density") {
    // A tentative collision deposits the probability that it is real. Light that is interpolated between nodes, times
    // sigma_t, integrates to the same.
    std::vector<Particle> particles = cloud(120, 2.5, 1, 0.5);
    for (size_t i = 0; i < particles.size(); i += 3) particles[i].h = 1.5;
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const SmokeDescription smoke = smoke_of(particles, kernel);
        const std::vector<LightSource> lights = {{LightKind::point, {5, 4, 3}, {0, 0, 1}, 2, {40, 40, 40}}};
        Settings settings = brick_settings(4, 1, 3000);
        settings.density_step = 0.5;
        TracedFluence traced(scene_of(smoke, lights), settings);
        REQUIRE(find_tents(traced.deposits, traced.arena));
        const auto &counts = traced.statistics.photons;
        CHECK(adds_up(counts));
        CHECK(counts.blocked == 0);
        CHECK(counts.stored > 1500);
        CHECK(counts.collisions == counts.stored + counts.emitted);
        CHECK(std::fabs(total_of(traced.deposits) - double(counts.stored)) < 4 * std::sqrt(double(counts.stored)));
        // The integral of sigma_t times the interpolated light, by points drawn in the smoke's bounds.
        double collisions = 0, squares = 0;
        const SparseGrid &bricks = *traced.deposits.bricks;
        const Vec3 extent = bricks.bounds.high - bricks.bounds.low;
        Sequence next{9};
        const int points = 200000;
        for (int i = 0; i < points; ++i) {
            const Vec3 x = bricks.bounds.low + vec(next() * at(extent.x), next() * at(extent.y), next() * at(extent.z));
            const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
            if (brick == no_brick) continue;
            const Vec3 p = position_in(bricks, brick, x);
            const CellPosition cell = find_cell(p, 1);
            const double light = at(between_nodes(cell, 1, [&](uint32_t k) {
                FluenceAndFlux there;
                light_at_node(traced.deposits, brick, cell_of_index(nodes_along(1), k), there);
                return there.radiance.x;
            }));
            const double sent = 4 * pi_ * light * at(extinction(traced.medium.smokes[0].field.resampled, brick, p));
            collisions += sent;
            squares += sent * sent;
        }
        const PhotonUnit &unit = traced.deposits.unit;
        const double volume = at(extent.x) * at(extent.y) * at(extent.z) / std::ldexp(at(unit.unit), unit.exponent);
        const double error = std::sqrt(squares - collisions * collisions / points) / points * volume;
        CHECK(error < 0.03 * total_of(traced.deposits));
        CHECK(std::fabs(collisions / points * volume - total_of(traced.deposits)) <
              4 * error + 0.002 * total_of(traced.deposits)); // hardly any smoke is around nodes that are left out
    }
}

TEST_CASE(WISP_ARITH_NAME ": fluxes are sums of direction times power, and never longer than the power") {
    SmokeDescription box = box_smoke({1, 1, 1}, 0.5, 8);
    box.albedo = {1, 1, 1};
    box.asymmetry = 0.9;
    const TracedFluence traced(scene_of(box, sun_along_z), brick_settings(4, 1, 3000));
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

TEST_CASE(WISP_ARITH_NAME ": harmonics are those of the direction of flight, at the place of the flight" *
          doctest::test_suite("long")) {
    // For a photon with one flight, the flux is the direction, and the centre of the power is the place.
    SmokeDescription box = box_smoke({1, 1, 1}, 3, 16);
    box.albedo = {0.5, 0.5, 0.5};
    box.asymmetry = -0.5;
    const Scene scene = scene_of(box, sun_along_z);
    for (int32_t spacing : {1, 2, 8}) {
        int flown = 0;
        double offset = 0; // of the nearest node, mean
        for (uint64_t seed = 1; seed < 100 && flown < 12; ++seed) {
            Settings settings = brick_settings(4, 1, 1);
            settings.seed = seed;
            const TracedFluence traced(scene, settings, spacing);
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
            sum(deposits.power, 1, spacing, &power, place);
            sum(deposits.flux, 3, spacing, flux, unused);
            sum(deposits.harmonics, harmonic_numbers, harmonic_spacing(spacing), harmonics, harmonic_place);
            CHECK(harmonics[0] == doctest::Approx(3 * power).epsilon(1e-5));
            for (int axis = 0; axis < 3; ++axis) {
                const double off = (harmonic_place[axis] - place[axis]) / harmonic_spacing(spacing);
                CHECK(std::fabs(off) < 0.5 + 1e-3);
                offset += off / (12 * 3);
            }
            const SphericalHarmonics expected =
                harmonics_of(normalize(vec(flux[0] / harmonics[0], flux[1] / harmonics[0], flux[2] / harmonics[0])));
            for (uint32_t i = 0; i < harmonic_count; ++i)
                CHECK(std::fabs(2 * harmonics[1 + i] / harmonics[0] - 1 - at(expected.value[i])) < 1e-4);
        }
        CHECK(flown == 12);
        CHECK(std::fabs(offset) < 0.2); // four times its deviation, 12^-1/2 / 6
    }
}

TEST_CASE(WISP_ARITH_NAME ": harmonics are stored where some smoke is not isotropic and not peaked, and nowhere else") {
    SmokeDescription smokes[] = {box_smoke({1, 1, 1}, 3, 16), box_smoke({1, 1, 1}, 2, 16)};
    Scene scene = scene_of(smokes[0], sun_along_z);
    scene.smokes = smokes;
    scene.smoke_count = 2;
    const Settings settings = brick_settings(4, 1, 1000);
    const auto numbers = [&](double a, double b) { // of a brick
        smokes[0].asymmetry = a;
        smokes[1].asymmetry = b;
        CHECK(photon_needs(scene, settings).directions == (a != 0 || b != 0));
        return sums_of_fluence(photon_needs(scene, settings), 1, 2);
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

TEST_CASE(WISP_ARITH_NAME ": black smoke traces no photons, and glowing smoke emits them itself") {
    SmokeDescription box = box_smoke({1, 1, 1}, 2, 8);
    box.albedo = {0, 0, 0};
    Scene scene = scene_of(box, sun_along_z);
    const Settings settings = brick_settings(4, 1, 2000);
    CHECK(renderer.plan(scene, settings).map_sums == 0);
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
    CHECK(counts.blocked == 0);
    CHECK(counts.stored == counts.collisions); // from the first: nothing else counts those
    // 4 pi (1 - albedo) L sigma V.
    const double power = 4 * pi_ * 0.5 * 2 * 8;
    CHECK(at(scale_pow2(traced.deposits.unit.unit, traced.deposits.unit.exponent)) * 2000 ==
          doctest::Approx(power).epsilon(1e-3));
    const Resampled resampled({box}, 1);
    CHECK(std::fabs(double(counts.stored) - total_of(traced.deposits)) < 1e-4 * double(counts.stored));
}

TEST_CASE(WISP_ARITH_NAME ": in two smokes photons collide with each by its density, and take its albedo") {
    // One over the other: of 3 collisions one is with the black one.
    const std::vector<Particle> particles = cloud(60, 1.5, 1.5, 1);
    std::vector<Particle> heavier = particles;
    for (Particle &p : heavier) p.area *= 2;
    SmokeDescription smokes[] = {smoke_of(particles), smoke_of(heavier)};
    smokes[0].albedo = {0, 0, 0};
    smokes[1].albedo = {1, 1, 1};
    Scene scene = scene_of(smokes[0], sun_along_z);
    scene.smokes = smokes;
    scene.smoke_count = 2;
    Settings settings = brick_settings(4, 1, 4000);
    settings.density_step = 0.5;
    const TracedFluence traced(scene, settings);
    const auto &counts = traced.statistics.photons;
    CHECK(adds_up(counts));
    CHECK(counts.blocked == 0);
    const double n = double(counts.collisions), black = double(counts.absorbed);
    CHECK(n > 5000);
    CHECK(std::fabs(black - n / 3) < 4 * std::sqrt(n * 2 / 9));
}

TEST_CASE(WISP_ARITH_NAME ": photons of resampled smoke carry the power of the first collisions") {
    const double sigma = 2;
    const SmokeDescription box = box_smoke({1, 1, 1}, sigma, 16);
    const auto power_of = [&](const std::vector<LightSource> &lights) {
        const int n = 10;
        const TracedFluence traced(scene_of(box, lights), brick_settings(4, 1, n));
        return at(scale_pow2(traced.deposits.unit.unit, traced.deposits.unit.exponent)) * n;
    };
    // What the box takes out of a parallel light: by trapezia along it.
    const double cell = 0.125 * sigma;
    CHECK(power_of(sun_along_z) == doctest::Approx(4 * (1 - std::exp(-2 * sigma))).epsilon(cell * cell / 12 + 1e-3));
}

TEST_CASE(WISP_ARITH_NAME ": photons of a light in resampled smoke collide first as Beer and Lambert say") {
    // The smoke is deep, thin, or so thin that few tentative collisions come; the light stands at a node, between
    // nodes, or less than a cell outside.
    const double half = 1;
    struct FirstFlights {
        uint64_t photon = UINT64_MAX;
        double power = 0, length = 0;
        static void add(void *context, const FlightRecord &flight) {
            FirstFlights &flights = *static_cast<FirstFlights *>(context);
            if (flights.photon == flight.photon) return;
            flights.photon = flight.photon;
            flights.power += at(flight.power.x);
            flights.length += at(flight.power.x) * at(flight.end);
        }
    };
    for (const double sigma : {2.0, 0.05, 0.002})
        for (const Double3 &place : {Double3{0, 0, 0}, Double3{0.31, -0.47, 0.66}, Double3{0.2, 1.05, -0.1}}) {
            CAPTURE(sigma);
            CAPTURE(place.y);
            const SmokeDescription box = box_smoke({half, half, half}, sigma, 16);
            const std::vector<LightSource> lights = {{LightKind::point, place, {0, 0, 1}, 2, {3, 3, 3}}};
            const int n = 20000;
            FirstFlights flights;
            const FlightRecorder recorder = {&flights, FirstFlights::add};
            const TracedFluence traced(scene_of(box, lights), brick_settings(4, 1, n), 1, &recorder);
            const double unit = at(scale_pow2(traced.deposits.unit.unit,
                                              traced.deposits.unit.exponent + traced.distribution.deposit_shift));
            // Over all directions: what collides, and that times how far it flies.
            const int rays = 20000;
            double power = 0, length = 0;
            for (int i = 0; i < rays; ++i) {
                const double z = 2 * (i + 0.5) / rays - 1, turn = 2 * pi_ * 0.618033988749894848 * i,
                             side = std::sqrt(1 - z * z);
                const double d[3] = {side * std::cos(turn), side * std::sin(turn), z};
                const double from[3] = {place.x, place.y, place.z};
                double begin = 0, end = 1e9;
                for (int k = 0; k < 3; ++k) {
                    const double a = (-half - from[k]) / d[k], b = (half - from[k]) / d[k];
                    begin = std::max(begin, std::min(a, b));
                    end = std::min(end, std::max(a, b));
                }
                if (!(begin < end)) continue;
                const double depth = sigma * (end - begin), taken = 1 - std::exp(-depth);
                power += 3 * 4 * pi_ / rays * taken;
                length += 3 * 4 * pi_ / rays * (taken * begin + (1 - std::exp(-depth) * (1 + depth)) / sigma);
            }
            CHECK(flights.power * unit == doctest::Approx(power).epsilon(0.025));
            CHECK(flights.length * unit == doctest::Approx(length).epsilon(0.025));
        }
}

TEST_CASE(WISP_ARITH_NAME ": photons of smoke that glows start into all directions alike") {
    SmokeDescription box = box_smoke({1, 1, 1}, 1, 16);
    box.albedo = {0.5, 0.5, 0.5};
    box.emission = {1, 1, 1};
    struct FirstFlights {
        uint64_t photon = UINT64_MAX;
        double count = 0, sums[9] = {}; // of x, y, z and of their products
        static void add(void *context, const FlightRecord &flight) {
            FirstFlights &flights = *static_cast<FirstFlights *>(context);
            if (flights.photon == flight.photon) return;
            flights.photon = flight.photon;
            ++flights.count;
            const Vec3 &d = flight.ray.direction;
            CHECK(at(dot(d, d)) == doctest::Approx(1).epsilon(1e-5));
            const double x = at(d.x), y = at(d.y), z = at(d.z),
                         terms[] = {x, y, z, x * x, y * y, z * z, x * y, y * z, z * x};
            for (int i = 0; i < 9; ++i) flights.sums[i] += terms[i];
        }
    } flights;
    Scene scene = scene_of(box, {});
    scene.light_count = 0;
    const FlightRecorder recorder = {&flights, FirstFlights::add};
    const TracedFluence traced(scene, brick_settings(4, 1, 20000), 1, &recorder);
    REQUIRE(flights.count == 20000);
    for (int i = 0; i < 9; ++i) { // within 5 standard deviations
        const double mean = i / 3 == 1 ? 1.0 / 3 : 0, variance = i < 3 ? 1.0 / 3 : i < 6 ? 4.0 / 45 : 1.0 / 15;
        CAPTURE(i);
        CHECK(std::fabs(flights.sums[i] / flights.count - mean) < 5 * std::sqrt(variance / flights.count));
    }
}

TEST_CASE(WISP_ARITH_NAME ": the fluence grid is as bright as the reference") {
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
        Settings settings = brick_settings(4, 1, 40000);
        settings.step = 1;
        const Rendered picture = render_in_memory(scene, settings);
        REQUIRE(picture.status == Status::done);
        const double stored = static_cast<double>(picture.statistics.photons.stored);
        const double error = std::sqrt(noise * noise / 16 + 2 / stored);
        CAPTURE(&row - rows);
        CAPTURE(sum_of(picture.rgb) / sum_of(truth));
        CAPTURE(error);
        CHECK(adds_up(picture.statistics.photons));
        CHECK(picture.statistics.photons.blocked == 0);
        CHECK(error < 0.05);
        CHECK(std::fabs(sum_of(picture.rgb) / sum_of(truth) - 1) < 3.5 * error + row.bias);
        CHECK(relative_difference(picture.rgb, truth) < 2 * noise + 0.05);
        settings.photons = 0; // what is scattered twice and more is a good part of it
        CHECK(sum_of(render_in_memory(scene, settings).rgb) < (glows ? 0.95 : 0.85) * sum_of(truth));
    }
}

TEST_CASE(WISP_ARITH_NAME ": light from opposite sides, which has no flux, scatters in the right directions" *
          doctest::test_suite("long")) {
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
            Settings settings = brick_settings(4, 1, 100000);
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

TEST_CASE(WISP_ARITH_NAME ": batches traced apart through resampled smoke give the sums and the picture of one run") {
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
    Settings settings = brick_settings(4, 1, 2 * batch_photons + 100);
    settings.density_step = settings.light_step = 0.5;
    settings.irradiance = IrradianceMap::uniform;
    settings.irradiance_step = 1;
    const Plan planned = renderer.plan(scene, settings);
    CHECK(planned.photon_directions == Plan::Directions::harmonics);
    CHECK(planned.photon_powers);
    std::vector<unsigned char> memory(planned.arena_bytes);
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
        REQUIRE(trace_batches(scene, settings, batches, arena, to.sums, to.statistics) == Status::done);
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
    settings.method = Method::direct; // sums are those of a map, whatever else is to be rendered
    Sums otherwise = make();
    trace(otherwise, {0, 3});
    CHECK(otherwise.values == whole.values);
    settings.method = Method::map;
    const auto counts = [](const Sums &of) {
        const auto &p = of.statistics.photons;
        return std::vector<uint64_t>{p.emitted, p.collisions, p.stored,   p.absorbed,      p.escaped,     p.blocked,
                                     p.capped,  p.lost,       p.thinning, p.variance.high, p.variance.low};
    };
    CHECK(counts(parts) == counts(whole));

    const Rendered alone = render_in_memory(scene, settings);
    REQUIRE(alone.status == Status::done);
    std::vector<float> rgb(alone.rgb.size());
    for (Sums *from : {&parts, &drawn, &drawn}) { // kept, traced for it, kept
        Arena arena(memory.data(), memory.size());
        REQUIRE(renderer.render({scene, settings, arena, from->statistics, {}, rgb.data(), &from->sums}) ==
                Status::done);
        CHECK(rgb == alone.rgb);
        CHECK(from->values == whole.values);
    }
    settings.seed = 2;
    CHECK(render_in_memory(scene, settings).rgb != alone.rgb);
}
