// The path tracer of `--reference`: published transport values, closed forms, and what makes it resumable.
#include "core/render/path_tracer.h"
#include "physics/transport_rows.h"
#include "support/built_smoke.h"
#include "wisp/settings.h"
#include <cstring>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

SmokeDescription box_of(double half_x, double half_y, double half_z, double sigma) {
    SmokeDescription source = grid_smoke_of(
        {1, 1, 1, nullptr, sigma, {0, 0, 0}, {half_x, half_y, half_z}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
    source.smallest_h = source.largest_h = std::min({half_x, half_y, half_z}); // wide majorants: all are equal
    return source;
}

// A path tracer for one smoke and some lights.
struct Tracer {
    Tracer(const SmokeDescription &source, const std::vector<LightSource> &sources, Double3 background_ = {0, 0, 0})
        : built({source}), background(vec_of(background_)) {
        for (const LightSource &light : sources) lights.push_back(make_light(light));
        memory.resize(8 << 20);
        Arena arena(memory.data(), memory.size());
        tracer = {&built.medium, lights.data(), uint32_t(lights.size()), {}, &statistics, nullptr};
        tracer.majorants = make_majorants(built.medium, real(source.smallest_h), arena);
        REQUIRE(tracer.majorants.sigma);
    }
    // The first channel of a sample, the draws being those of number i.
    double sample(const Ray &ray, uint64_t i) const {
        Pcg32 generator(i * 0x9e3779b97f4a7c15u);
        const Color behind = background * wisp::exp(-optical_depth(built.medium, ray, infinite_distance));
        return at(sample_radiance(tracer, ray, infinite_distance, behind, generator).x);
    }

    BuiltMedium built;
    Color background;
    std::vector<Light> lights;
    Statistics statistics;
    std::vector<unsigned char> memory;
    PathTracer tracer;
};

Vec3 direction_of(double cosine) { return vec(std::sqrt(1 - cosine * cosine), 0, cosine); }

constexpr double width = 60;         // of a slab in mean free paths: what leaves at its rims is below 1e-6
constexpr double half_space = 60;    // deep enough: ten diffusion lengths at an albedo of 0.99
constexpr double most_variance = 30; // of samples of a row that is measured, in squares of its value

// Numbers in [0, 1) for the place of a sample, apart from those of its path.
struct Draws {
    explicit Draws(uint64_t i) : generator((i + 1) * 0xd1342543de82ef95u) {}
    double operator()() { return generator() * 0x1p-32; }
    Pcg32 generator;
};
double cosine_of(double cosine, Draws &next) { return cosine > 0 ? cosine : std::sqrt(1 - next()); }

// The radiance of a slab at the cosine `seen`, where light of irradiance pi comes at the cosine `lit`, over `lit`: its
// reflection or transmission function. A cosine of 0: the mean over all directions of a side, which gives fluxes.
bool scattered_by_slab(uint64_t seed, double albedo, double g, double depth, double seen, double lit, bool reflected,
                       Score &result) {
    SmokeDescription slab = box_of(width, width, depth / 2, 1);
    slab.albedo = {albedo, albedo, albedo};
    slab.asymmetry = g;
    Tracer tracer(slab, {{LightKind::parallel, {}, {0, 0, -1}, 2, {pi_, pi_, pi_}}});
    return score_until(
        most_variance,
        [&](int64_t i) {
            Draws next(seed << 32 | uint64_t(i));
            const double in = cosine_of(lit, next), out = cosine_of(seen, next), turn = 2 * pi_ * next();
            const Vec3 down = direction_of(in);
            tracer.lights[0].direction = {down.x, Real(0), -down.z};
            // These functions are means over the azimuth, or do not depend on it.
            const double side = std::sqrt(1 - out * out), away = reflected ? 1 : -1;
            const Vec3 to_eye = vec(side * std::cos(turn), side * std::sin(turn), out * away);
            const Ray ray = {vec(0, 0, away * depth / 2) + to_eye, -to_eye};
            return tracer.sample(ray, seed << 32 | uint64_t(i)) / in;
        },
        result);
}

// Radiance at a cosine from a slab that glows with radiance 1 and is not lit: what it does not absorb of light from
// there is missing (Kirchhoff).
bool glow_of_slab(uint64_t seed, double albedo, double g, double depth, double seen, Score &result) {
    SmokeDescription slab = box_of(width, width, depth / 2, 1);
    slab.albedo = {albedo, albedo, albedo};
    slab.asymmetry = g;
    slab.emission = {1, 1, 1};
    const Tracer tracer(slab, {});
    const Vec3 to_eye = direction_of(seen);
    const Ray ray = {vec(0, 0, depth / 2) + to_eye, -to_eye};
    return score_until(
        most_variance, [&](int64_t i) { return tracer.sample(ray, seed << 32 | uint64_t(i)); }, result);
}

// The scattered part of the fluence at distance r from a point light of power 1 in an infinite medium: 4 pi times the
// mean radiance from all directions.
bool fluence(uint64_t seed, double albedo, double r, Score &result) {
    SmokeDescription box = box_of(50, 50, 50, 1);
    box.albedo = {albedo, albedo, albedo};
    const double intensity = 1 / (4 * pi_);
    const Tracer tracer(box, {{LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {intensity, intensity, intensity}}});
    return score_until(
        most_variance,
        [&](int64_t i) {
            Draws next(seed << 32 | uint64_t(i));
            const double cosine = 2 * next() - 1, turn = 2 * pi_ * next(), side = std::sqrt(1 - cosine * cosine);
            const Ray ray = {vec(0.6 * r, 0, 0.8 * r), vec(side * std::cos(turn), side * std::sin(turn), cosine)};
            return 4 * pi_ * tracer.sample(ray, seed << 32 | uint64_t(i));
        },
        result);
}

// What passes a slab without a collision, of light of one cosine or of diffuse light (0).
double direct(double depth, double cosine) {
    if (cosine > 0) return std::exp(-depth / cosine);
    return std::exp(-depth) * (1 - depth) - depth * depth * std::expint(-depth); // 2 E3
}

// Measures what a camera can see for a row, of which `expected` is the value. False where it cannot.
bool measure(const Row &row, uint64_t seed, double &expected, Score &result) {
    double c, g, x, seen, lit;
    char word[8] = "";
    int end = 0;
    const char *id = row.id.c_str();
    const auto whole = [&] { return end > 0 && id[end] == 0; };
    expected = row.value;
    if (too_dark(row)) return false;
    if (std::sscanf(id, "slab_a%lf_g%lf_t%lf_%1[RT](%lf,%lf)%n", &c, &g, &x, word, &seen, &lit, &end) == 6 && whole())
        return scattered_by_slab(seed, c, g, x, seen, lit, word[0] == 'R', result);
    if (std::sscanf(id, "slab_a%lf_g%lf_t%lf_U%7s%n", &c, &g, &x, word, &end) == 4 && whole()) {
        const std::string way = word; // R1 T1 Td1 R(.5) T(.5) RU TU
        lit = way.back() == '1' ? 1 : way.back() == ')' ? 0.5 : 0;
        if (way[0] == 'T' && way[1] != 'd') expected -= direct(x, lit);
        return scattered_by_slab(seed, c, g, x, 0, lit, way[0] == 'R', result);
    }
    if (std::sscanf(id, "semi_c%lf_R(%lf,%lf)%n", &c, &seen, &lit, &end) == 3 && whole())
        return scattered_by_slab(seed, c, 0, half_space, seen, lit, true, result);
    if (std::sscanf(id, "semi_c%lf_UR(%lf)%n", &c, &lit, &end) == 2 && whole())
        return scattered_by_slab(seed, c, 0, half_space, 0, lit, true, result);
    if (std::sscanf(id, "semi_c%lf_URU%n", &c, &end) == 1 && whole())
        return scattered_by_slab(seed, c, 0, half_space, 0, 0, true, result);
    if (std::sscanf(id, "inf_c%lf_r%lf%n", &c, &x, &end) == 2 && whole()) {
        expected -= std::exp(-x) / (4 * pi_ * x * x);
        return fluence(seed, c, x, result);
    }
    return false;
}

// Rows of one plane albedo are used once more, with the one that makes up the energy.
bool measure_glow(const Row &row, const std::vector<Row> &rows, uint64_t seed, double &expected, Score &result) {
    double c, g, x, seen;
    int end = 0;
    const char *id = row.id.c_str();
    const auto whole = [&] { return end > 0 && id[end] == 0; };
    if ((std::sscanf(id, "slab_a%lf_g%lf_t%lf_UR1%n", &c, &g, &x, &end) == 3 && whole()) ||
        (std::sscanf(id, "slab_a%lf_g%lf_t%lf_UR(.5)%n", &c, &g, &x, &end) == 3 && whole())) {
        std::string partner = row.id;
        partner[partner.find("UR") + 1] = 'T';
        for (const Row &other : rows)
            if (other.id == partner) expected = 1 - row.value - other.value;
        return c < 1 && glow_of_slab(seed, c, g, x, row.id.back() == '1' ? 1 : 0.5, result);
    }
    if (std::sscanf(id, "semi_c%lf_UR(%lf)%n", &c, &seen, &end) == 2 && whole()) {
        expected = 1 - row.value;
        return glow_of_slab(seed, c, 0, half_space, seen, result);
    }
    return false;
}

// The bound of the cell, or of its part, that holds x.
Real bound_at(const Majorants &majorants, const Vec3 &x) {
    const Lattice &lattice = majorants.lattice;
    const Cell cell = cell_at(lattice, x);
    const int64_t i = index_of(lattice.count, cell);
    if (!majorants.first_part || !(majorants.sigma[i] > Real(0))) return majorants.sigma[i];
    const Cell count = {majorants.parts, majorants.parts, majorants.parts};
    const Lattice parts =
        make_lattice(lattice.low + lattice.edge * vec(cell.x, cell.y, cell.z), lattice.edge / Real(count.x), count);
    return majorants.sigma_of_part[majorants.first_part[i] + index_of(count, cell_at(parts, x))];
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": light collides as much, and as far, as the closed optical depth says" *
          doctest::test_suite("long")) {
    // Particles of both kernels with unlike sizes, and a turned grid: two ways that share nothing but the density.
    std::vector<Particle> particles = cloud(300, 3, 1, 1.2);
    for (size_t i = 0; i < particles.size(); i += 3) particles[i].h = 1.75;
    std::vector<float> density(5 * 4 * 3);
    Sequence next{7};
    for (float &d : density) d = static_cast<float>(next());
    SmokeDescription smokes[] = {smoke_of(particles), smoke_of(particles, Kernel::poly6), box_of(3, 2, 2.5, 0.7)};
    GridDescription &grid = smokes[2].grid;
    grid.nx = 5, grid.ny = 4, grid.nz = 3;
    grid.density = density.data();
    grid.axis[0] = {0.6, 0.8, 0};
    grid.axis[1] = {-0.8, 0.6, 0};
    for (const SmokeDescription &smoke : smokes) {
        const Tracer tracer(smoke, {});
        for (const Ray &ray :
             {Ray{vec(-8, 0.5, 0.25), normalize(vec(1, 0.1, -0.05))},
              Ray{vec(0.5, 1, -1), normalize(vec(0.3, -1, 0.4))}, Ray{vec(0.25, 0.5, -7), vec(0, 0, 1)}}) {
            Real begin = Real(0), end = infinite_distance;
            REQUIRE(clip(tracer.built.medium.bounds, ray, begin, end));
            const Ray inside = {ray.origin + ray.direction * begin, ray.direction};
            const double expected = std::exp(-at(optical_depth(tracer.built.medium, inside, end - begin)));
            REQUIRE(expected < 0.8);
            // Of a unit of light 1 - T collides. Where half, or any part p of it has collided, p is uniform: E[p] and
            // E[p^2] are the integrals of p and p^2 from 0 to 1 - T.
            const double collides = 1 - expected, unseen = expected < 1e-3 ? 2 * expected : 1e-9; // by 4000 samples
            for (int power = 0; power < 3; ++power) {
                Pcg32 generator(5);
                const Score mean = score(4000, [&](int64_t) {
                    const WeightedCollision found = sample_collision(tracer.tracer, inside, end - begin, generator);
                    REQUIRE((found.weight >= Real(0) && found.weight <= Real(1)));
                    if (!(found.weight > Real(0))) return 0.0;
                    const double p = 1 - std::exp(-at(optical_depth(tracer.built.medium, inside, found.distance)));
                    return at(found.weight) * std::pow(p, power);
                });
                CHECK(std::fabs(mean.mean - std::pow(collides, power + 1) / (power + 1)) < 4 * mean.error + unseen);
            }
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": most rays through thin smoke find a collision, and all light collides in deep smoke") {
    const auto weights = [](double sigma, double length) {
        const Tracer tracer(box_of(1, 1, length / 2, sigma), {});
        Pcg32 generator(7);
        return score(2000, [&](int64_t) {
            return at(
                sample_collision(tracer.tracer, {vec(0.1, 0.2, -length / 2), vec(0, 0, 1)}, real(length), generator)
                    .weight);
        });
    };
    const double thin = 1 - std::exp(-0.05);
    const Score found = weights(0.05, 1);
    CHECK(std::fabs(found.mean - thin) < 4 * found.error);
    // One flight's weight is 0 or 1: the standard deviation is sqrt(T (1 - T)).
    CHECK(found.error < 0.2 * std::sqrt(thin * (1 - thin) / 2000));
    const Score all = weights(4, 16);
    CHECK(all.mean == 1);
    CHECK(all.error == 0);
}

TEST_CASE(WISP_ARITH_NAME ": light collides with each of two smokes in proportion to its density") {
    const SmokeDescription thin = box_of(2, 2, 2, 0.25), dense = box_of(2, 2, 2, 0.75);
    Tracer tracer(thin, {});
    const BuiltMedium both({thin, dense});
    std::vector<unsigned char> memory(1 << 20);
    Arena arena(memory.data(), memory.size());
    tracer.tracer.medium = &both.medium;
    tracer.tracer.majorants = make_majorants(both.medium, Real(1), arena);
    Pcg32 generator(9);
    const double depth = 4, all = 1 - std::exp(-depth);
    for (uint32_t smoke : {0u, 1u}) {
        const Score part = score(4000, [&](int64_t) {
            const WeightedCollision found =
                sample_collision(tracer.tracer, {vec(0, 0, -2), vec(0, 0, 1)}, Real(4), generator);
            return found.smoke == smoke ? at(found.weight) : 0.0;
        });
        CHECK(std::fabs(part.mean - all * (smoke ? 0.75 : 0.25)) < 4 * part.error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": no density lies above the majorant of its cell") {
    std::vector<Particle> particles = cloud(200, 3, 1, 1);
    for (size_t i = 0; i < particles.size(); i += 2) particles[i].h = 1.5;
    for (const bool with_speck : {false, true}) { // far away: cells are wide then, and divided
        CAPTURE(with_speck);
        if (with_speck) particles.push_back({{300, 250, -280}, 1, 1});
        for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
            const SmokeDescription smoke = smoke_of(particles, kernel);
            const Tracer tracer(smoke, {});
            CHECK((tracer.tracer.majorants.first_part != nullptr) == with_speck);
            Sequence next;
            double greatest = 0;
            for (int i = 0; i < 20000; ++i) {
                const Vec3 x = vec(10 * next() - 5, 10 * next() - 5, 10 * next() - 5);
                const Real bound = bound_at(tracer.tracer.majorants, x);
                const Real sigma = extinction(tracer.built.medium.smokes[0].field, x);
                REQUIRE(sigma <= bound);
                if (bound > Real(0)) greatest = std::max(greatest, at(sigma / bound));
            }
            CHECK(greatest > 0.5); // a bound, not just something large
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a speck far away leaves paths through the smoke as short as they were, and as right") {
    std::vector<Particle> particles = cloud(300, 3, 1, 0.1);
    const Ray ray = {vec(-8, 0.5, 0.25), normalize(vec(1, 0.1, -0.05))};
    uint64_t evaluations[2];
    for (const bool with_speck : {false, true}) {
        if (with_speck) particles.push_back({{300, 250, -280}, 1, 0.1});
        SmokeDescription smoke = smoke_of(particles);
        smoke.emission = {1, 1, 1};
        smoke.albedo = {0, 0, 0};
        const Tracer tracer(smoke, {});
        const Score mean = score(2000, [&](int64_t i) { return tracer.sample(ray, uint64_t(i)); });
        const double depth = at(optical_depth(tracer.built.medium, ray, infinite_distance));
        CHECK(std::fabs(mean.mean - (1 - std::exp(-depth))) < 4 * mean.error + 1e-3);
        evaluations[with_speck] = tracer.statistics.smoke.density_evaluations;
    }
    CHECK(evaluations[1] < 2 * evaluations[0]); // a thousand times as many in cells of even size
}

TEST_CASE(WISP_ARITH_NAME ": a few particles of very unlike radii take no more majorants than pay") {
    std::vector<Particle> particles = cloud(100, 3, 1, 1);
    particles[0].h = 1.0 / 256;
    const Tracer tracer(smoke_of(particles), {});
    CHECK(number_of(tracer.tracer.majorants.lattice.count) > 1 << 17);
    CHECK(number_of(tracer.tracer.majorants.lattice.count) <= 1 << 19);
}

TEST_CASE(WISP_ARITH_NAME ": in a furnace the reference has the furnace's radiance") { // B8, for A = 0
    const std::vector<Particle> particles = cloud(300, 3, 1, 0.1);
    SmokeDescription smoke = smoke_of(particles);
    smoke.albedo = {0, 0, 0};
    smoke.emission = {0.75, 0.75, 0.75};
    const Tracer tracer(smoke, {}, {0.75, 0.75, 0.75});
    const Ray ray = {vec(-8, 0.5, 0.25), normalize(vec(1, 0.1, -0.05))};
    const Score mean = score(4000, [&](int64_t i) { return tracer.sample(ray, uint64_t(i)); });
    CHECK(std::fabs(mean.mean - 0.75) < 4 * mean.error);
}

TEST_CASE(WISP_ARITH_NAME ": a cloud that glows and scatters its own light is as bright by photons") { // B8, A > 0
    const std::vector<Particle> particles = cloud(400, 2, 1, 0.1);
    SmokeDescription smoke = smoke_of(particles);
    smoke.albedo = {0.7, 0.7, 0.7};
    smoke.asymmetry = 0.3;
    smoke.emission = {1, 1, 1};
    Scene scene = {};
    scene.camera = look_at_origin(12, 4, 3);
    scene.smokes = &smoke;
    scene.smoke_count = 1;
    Settings settings = small_settings(3);
    settings.photons = 40000;
    settings.step = 0.25;
    const Rendered picture = render_in_memory(scene, settings);
    REQUIRE(picture.status == Status::done);
    double photons = 0, paths = 0, variance = 0, scattered_alone = 0;
    const Tracer tracer(smoke, {});
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
            const double step = 4.0 / 3 / 12;
            const Ray ray = {vec(0, 0, 12), normalize(vec((x - 1) * step, (1 - y) * step, -1))};
            const Score pixel = score(1500, [&](int64_t i) { return tracer.sample(ray, uint64_t(9 * i + 3 * y + x)); });
            paths += pixel.mean;
            variance += pixel.error * pixel.error;
            photons += static_cast<double>(picture.rgb[size_t(9 * y + 3 * x)]);
            scattered_alone += 0.3 * (1 - std::exp(-at(optical_depth(tracer.built.medium, ray, infinite_distance))));
        }
    // Within the noise and 2 % for the gather's blur; what is scattered is a third of it.
    CHECK(scattered_alone < 0.75 * paths);
    CHECK(std::fabs(photons - paths) < 4 * std::sqrt(variance) + 0.02 * paths);
}

TEST_CASE(WISP_ARITH_NAME
          ": a light inside the smoke is seen as its closed airlight says, with a finite variance") { // E10
    // A = int_0^L e^-(t + d) / d^2 dt for a light 0.1 beside the ray at t = 1, L = 2; nearly no second scattering.
    SmokeDescription box = box_of(1, 5, 5, 1);
    const double albedo = 1e-3;
    box.albedo = {albedo, albedo, albedo};
    const Tracer tracer(box, {{LightKind::point, {0, 0.1, 0}, {0, 0, 1}, 2, {1, 1, 1}}});
    const Ray ray = {vec(-1, 0, 0), vec(1, 0, 0)};
    const Score mean = score(4000, [&](int64_t i) { return tracer.sample(ray, uint64_t(i)); });
    const double expected = albedo / (4 * pi_) * 9.1192720747;
    CHECK(std::fabs(mean.mean - expected) < 4 * mean.error + 1e-3 * expected);
    CHECK(mean.error < 0.02 * expected); // without the second strategy 0.034
}

TEST_CASE(WISP_ARITH_NAME ": lights in and beside the smoke are seen as they should be, with a small variance") {
    // In a box of depth 2 a ray passes lights at the distance 0.1: on its way, just outside of the smoke, and a spot
    // that shines across it. By quadrature of 1 / d^2, the phase, and what is left of the light.
    struct {
        std::string name;
        LightSource light;
        double g;
        // Of a sample, in units of its mean. Collisions, or places that are even in the angle,
        // leave 2.6, 1.0, 1.8, 1.9.
        double most_deviation;
    } rows[] = {
        {"a lamp", {LightKind::point, {0, 0, 0.1}, {0, 0, 1}, 2, {1, 1, 1}}, 0.8, 0.6},
        {"a lamp outside", {LightKind::point, {0, 1.05, 0.1}, {0, 0, 1}, 2, {1, 1, 1}}, 0.5, 0.45},
        {"a spot outside", {LightKind::spot, {0, 3, 0}, {0, -1, 0}, 0.01, {1, 1, 1}}, 0.5, 0.45},
        {"a spot", {LightKind::spot, {0, 0.5, 0}, {0, -1, 0}, 0.03, {1, 1, 1}}, 0.5, 0.2},
    };
    for (const auto &row : rows) {
        CAPTURE(row.name);
        SmokeDescription box = box_of(1, 1, 1, 1);
        const double albedo = 1e-3; // nearly no second scattering
        box.albedo = {albedo, albedo, albedo};
        box.asymmetry = row.g;
        const Tracer tracer(box, {row.light});
        const double y = row.light.position.y > 1 ? 0.95 : 0;
        const Ray ray = {vec(-1, y, 0), vec(1, 0, 0)};
        double expected = 0;
        constexpr int steps = 20000;
        for (int i = 0; i < steps; ++i) {
            const double x = -1 + 2 * (i + 0.5) / steps, to_y = y - row.light.position.y, to_z = -row.light.position.z,
                         d = std::sqrt(x * x + to_y * to_y + to_z * to_z);
            if (row.light.kind == LightKind::spot && 1 + to_y / d > row.light.one_minus_cosine) continue;
            const double in_smoke = row.light.position.y > 1 ? d * (1 - y) / -to_y : d;
            const double phase = (1 - row.g * row.g) / (4 * pi_ * std::pow(1 + row.g * row.g + 2 * row.g * x / d, 1.5));
            expected += albedo * phase / (d * d) * std::exp(-(x + 1) - in_smoke) * 2 / steps;
        }
        const Score mean = score(4000, [&](int64_t i) { return tracer.sample(ray, uint64_t(i)); });
        CHECK(std::fabs(mean.mean - expected) < 4 * mean.error + 2e-3 * expected);
        CHECK(mean.error * std::sqrt(4000) / expected < row.most_deviation);
    }
}

TEST_CASE(WISP_ARITH_NAME ": light of a lamp in the smoke that is scattered forward twice is found without luck") {
    SmokeDescription box = box_of(1, 1, 1, 1);
    box.albedo = {0.95, 0.95, 0.95};
    box.asymmetry = 0.8;
    const Tracer tracer(box, {{LightKind::point, {0.3, 0.2, 0.1}, {0, 0, 1}, 2, {1, 1, 1}}});
    const Score mean = score(20000, [&](int64_t i) {
        Pcg32 generator(uint64_t(i) * 0x9e3779b97f4a7c15u);
        return at(sample_multiple_scattering(tracer.tracer, {vec(-2, 0, 0), vec(1, 0, 0)}, Real(8), generator).x);
    });
    CHECK(mean.error * std::sqrt(20000) / mean.mean < 2); // 6 by directions and places that are even in the angle
}

TEST_CASE(WISP_ARITH_NAME ": light that is scattered forward twice is found without luck") {
    Score reflected;
    REQUIRE(scattered_by_slab(1, 0.9, 0.75, 2, 1, 1, true, reflected));
    const double deviation = reflected.error * std::sqrt(static_cast<double>(reflected.samples)); // of one sample
    CHECK(deviation < 0.12); // 0.2 by directions of the phase function alone
}

TEST_CASE(WISP_ARITH_NAME ": smoke of any density ends a path") { // B2
    // Next to nothing at its rim and a wall within: majorants there are far above what a flight meets.
    const double densest = std::is_same_v<Real, Fixed> ? 1e5 : 1e20;
    for (double area : {1e3, densest}) {
        const std::vector<Particle> particles = {{{0, 0, 0}, 1, area}};
        SmokeDescription smoke = smoke_of(particles);
        smoke.albedo = {0.5, 0.5, 0.5};
        const Tracer tracer(smoke, {{LightKind::parallel, {}, {0, 0, -1}, 2, {1, 1, 1}}}, {1, 1, 1});
        for (uint64_t i = 0; i < 20; ++i) {
            const double x = tracer.sample({vec(0.5, 0.25, 8), vec(0, 0, -1)}, i);
            CHECK(x >= 0);
            CHECK(x < 10);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": passes add up to the same sums however they are divided, and crops are parts") {
    const std::vector<Particle> particles = cloud(100, 3, 1, 1);
    const SmokeDescription smoke = smoke_of(particles);
    const LightSource light = {LightKind::point, {4, 5, 3}, {0, 0, 1}, 2, {50, 40, 30}};
    Scene scene = {};
    scene.camera = look_at_origin(12, 8, 4);
    scene.lights = &light;
    scene.light_count = 1;
    scene.smokes = &smoke;
    scene.smoke_count = 1;
    const auto trace = [&](std::vector<PixelSums> &sums, uint32_t first, uint32_t last, Crop crop, uint64_t seed) {
        Settings settings = small_settings(4);
        settings.goal = Goal::reference;
        settings.crop = crop;
        settings.samples = 3;
        settings.seed = seed;
        settings.first_pass = first;
        settings.last_pass = last;
        std::vector<unsigned char> memory(renderer.plan(scene, settings).arena_bytes);
        Arena arena(memory.data(), memory.size());
        Statistics statistics;
        sums.resize(size_t(crop.width() * crop.height()));
        Job job = {scene, settings, arena, statistics};
        job.pixels = sums.data();
        REQUIRE(renderer.render(job) == Status::done);
        CHECK(statistics.rays.primary == 3 * (last - first) * sums.size());
    };
    const auto same = [](const PixelSums &a, const PixelSums &b) { return std::memcmp(&a, &b, sizeof a) == 0; };
    std::vector<PixelSums> whole, parts, crop, some, other;
    trace(whole, 0, 5, {0, 0, 4, 4}, 1);
    trace(parts, 3, 5, {0, 0, 4, 4}, 1);
    trace(parts, 0, 1, {0, 0, 4, 4}, 1);
    trace(parts, 1, 3, {0, 0, 4, 4}, 1);
    trace(crop, 0, 5, {1, 2, 3, 4}, 1);
    trace(some, 0, 5, {0, 1, 4, 4, 2}, 1);
    trace(other, 0, 5, {0, 0, 4, 4}, 2);
    for (size_t i = 0; i < whole.size(); ++i) CHECK(same(whole[i], parts[i]));
    for (size_t y = 0; y < 2; ++y)
        for (size_t x = 0; x < 2; ++x) {
            CHECK(same(crop[2 * y + x], whole[4 * (y + 2) + x + 1]));
            CHECK(same(some[2 * y + x], whole[4 * (2 * y + 1) + 2 * x]));
        }
    CHECK(!same(whole[5], other[5]));
    CHECK(!same(whole[5], whole[6]));
}

TEST_CASE(WISP_ARITH_NAME ": the reference reproduces published transport values" * doctest::test_suite("long")) {
    const std::vector<Row> rows = transport_rows();
    TransportTable table("reference_" WISP_ARITH_NAME);
    for (const Row &row : rows) {
        double expected;
        Score result;
        const uint64_t seed = uint64_t(&row - rows.data()) + 1;
        if (measure(row, seed, expected, result)) table.add(row.id, expected, result);
        if (measure_glow(row, rows, seed, expected, result)) table.add("glow of " + row.id, expected, result);
    }
    table.finish(60);
}
