// Hard cases D: the photon map and its estimate (S2, N-E5, N-E6).
#include "core/photons/photon_walk.h"
#include "host/base/error.h"
#include "host/results/statistics_json.h"
#include "host/scene/options.h"
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr bool is_fixed = std::is_same_v<Real, Fixed>;

// Relative error of an estimate from known photons and a known radius: sixteen roundings. In fixed it is that of
// 1 / (4 pi), whose resolution is 1.5e-9, and of intermediate results above 2^-7.
constexpr double digits = is_fixed ? 1e-7 : 16 * unit_error;

bool near(double found, double expected, double relative = digits) {
    return std::fabs(found - expected) <= relative * std::fabs(expected);
}

double ball(double radius) { return 4 * pi_ / 3 * radius * radius * radius; }

// Photons of equal power without directions. Estimates are power per volume.
struct Photons {
    explicit Photons(const std::vector<Vec3> &points, uint32_t most = 500)
        : memory(point_tree_bytes(static_cast<uint32_t>(points.size())) + gather_bytes(most) + 4096),
          arena(memory.data(), memory.size()) {
        map.tree = build_point_tree(points.data(), static_cast<uint32_t>(points.size()), arena);
        map.uniform_power = Color(Real(1));
        map.unit.unit = Real(1);
        mark = arena.mark();
    }
    Real raw_estimate(const Vec3 &x, uint32_t k, Real radius) {
        arena.rewind(mark);
        Gather gather;
        REQUIRE(map.tree.ready);
        REQUIRE(make_gather(k, arena, gather));
        return estimate_radiance(map, Phase(Real(0)), x, vec(0, 0, 1), radius, gather, statistics).x;
    }
    double estimate(const Vec3 &x, uint32_t k, Real radius) { return at(raw_estimate(x, k, radius)) * 4 * pi_; }
    // The first k of the photons by (distance, index), and the squared distance of the last one.
    std::vector<uint32_t> ids_of_nearest(const Vec3 &x, uint32_t k, Real radius, Real *radius_squared = nullptr) {
        arena.rewind(mark);
        Gather gather;
        REQUIRE(make_gather(k, arena, gather));
        const Nearest found = nearest(map.tree, x, k, radius, gather.scratch, gather.slot, gather.distance_squared);
        std::vector<uint32_t> ids;
        for (uint32_t i = 0; i < found.count; ++i) ids.push_back(map.tree.id[gather.slot[i]]);
        std::sort(ids.begin(), ids.end());
        if (radius_squared) *radius_squared = found.radius_squared;
        return ids;
    }
    std::vector<unsigned char> memory;
    Arena arena;
    PhotonMap map = {};
    Statistics statistics;
    size_t mark;
};

// `count` photons in a box of the given half-widths.
std::vector<Vec3> photons_in_box(int count, double x, double y, double z, Sequence &next) {
    std::vector<Vec3> points;
    for (int i = 0; i < count; ++i) {
        const double u = next(), v = next(), w = next();
        points.push_back(vec((2 * u - 1) * x, (2 * v - 1) * y, (2 * w - 1) * z));
    }
    return points;
}

const LightSource point_light = {LightKind::point, {6, 8, 4}, {0, 0, 1}, 2, {100, 80, 60}};

// An infinite medium of extinction 1 with isotropic scattering, with the functions that `walk` calls.
struct Infinite {
    double albedo_;
};
struct AnyCollision {
    bool found;
    Real distance;
};
AnyCollision first_collision(const Infinite &, const Ray &, Real, Event event) {
    return {true, -wisp::log(unit_open<Real>(draw(event, 0)))};
}
Color albedo(const Infinite &medium, const AnyCollision &) { return Color(real(medium.albedo_)); }
Phase phase(const Infinite &, const AnyCollision &) { return Phase(Real(0)); }

double total(const Rendered &picture) {
    double sum = 0;
    for (float value : picture.rgb) sum += value;
    return sum;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME
          ": hard case D1: fewer than K photons are divided by the ball of the search radius; no photons give 0") {
    const Vec3 o = vec(0, 0, 0);
    Photons none({}), one({vec(0.25, 0, 0)}), two({vec(0.25, 0, 0), vec(0, 0.5, 0)});
    CHECK(none.raw_estimate(o, 500, Real(2)) == Real(0));
    CHECK(none.raw_estimate(o, 2, Real(2)) == Real(0));
    CHECK(near(one.estimate(o, 500, Real(2)), 1 / ball(2)));
    CHECK(near(one.estimate(o, 2, Real(2)), 1 / ball(2)));
    CHECK(one.raw_estimate(vec(3, 0, 0), 2, Real(2)) == Real(0)); // beyond the radius
    CHECK(near(two.estimate(o, 2, Real(2)), 1 / ball(0.5))); // K were found: the farthest photon only sets the radius
    Options options;
    CHECK_THROWS_AS(set_option(options, "gather", "1", ""),
                    Error); // K >= 2: one photon is left when the farthest is not counted
    set_option(options, "gather", "2", "");

    std::vector<Vec3> points;
    for (int i = 1; i <= 10; ++i) points.push_back(vec(0, 0, i * 0.125));
    Photons ten(points);
    CHECK(near(ten.estimate(o, 500, Real(2)), 10 / ball(2)));
    CHECK(near(ten.estimate(o, 500, Real(5)), 10 / ball(5)));

    // Pictures with so few photons.
    SmokeDescription smoke = {};
    const auto particles = cloud(100, 1, 1, 3);
    smoke = smoke_of(particles);
    smoke.albedo = {1, 1, 1};
    const std::vector<LightSource> lights = {point_light};
    Settings settings = small_settings(4);
    settings.gather = 500;
    const Rendered dark = render_in_memory(scene_of(smoke, lights), settings);
    for (uint64_t photons : {uint64_t{1}, uint64_t{10}}) {
        settings.photons = photons;
        const Rendered picture = render_in_memory(scene_of(smoke, lights), settings);
        CHECK(picture.statistics.photons.emitted == photons);
        for (float value : picture.rgb) CHECK(std::isfinite(value));
        CHECK(total(picture) >= total(dark));
    }
    CHECK(dark.statistics.photons.emitted == 0);
}

TEST_CASE(WISP_ARITH_NAME ": hard case D2: photons at one point give a finite estimate, with the smallest radius") {
    Photons photons(std::vector<Vec3>(20, vec(0.5, 0.5, 0.5)));
    photons.map.unit.exponent = -20;
    // The smallest radius is 1e-3 of the search radius, by default the support. In fixed 1e-3 has a relative error of
    // 2^-33 / 1e-3, and its cube three times that.
    const double expected = 9 / ball(2e-3) * 0x1p-20, relative = is_fixed ? 4e-7 : digits;
    CHECK(near(photons.estimate(vec(0.5, 0.5, 0.5), 10, Real(2)), expected, relative));
    CHECK(near(photons.estimate(vec(0.5, 0.5, 0.501), 10, Real(2)), expected, relative)); // nearer than that
    const double farther = photons.estimate(vec(0.5, 0.5, 0.5625), 10, Real(2));
    CHECK(near(farther, 9 / ball(0.0625) * 0x1p-20));
    CHECK(near(photons.estimate(vec(0.5, 0.5, 0.5), 20, Real(2)), expected * 19 / 9, relative)); // all photons tie
    photons.map.unit.exponent = 0;
    CHECK(near(photons.estimate(vec(0.5, 0.5, 0.5), 21, Real(2)), 20 / ball(2))); // not full
}

TEST_CASE(WISP_ARITH_NAME ": hard case D3: ties of distance are broken by the photons' index, whatever the tree") {
    std::vector<Vec3> lattice;
    for (int i = 0; i < 729; ++i) lattice.push_back(vec(i % 9, i / 9 % 9, i / 81));
    // The same photons, and others that are too far away to count but change the tree.
    std::vector<Vec3> more = lattice;
    Sequence next;
    for (const Vec3 &p : photons_in_box(1500, 30, 30, 30, next)) more.push_back(p + vec(70, 10, 0));
    Photons few(lattice), many(more);
    for (const Vec3 &x : {vec(4, 4, 4), vec(4.5, 4.5, 4.5), vec(0, 0, 0), vec(4, 4.5, 8)}) {
        std::vector<std::pair<double, uint32_t>> order; // distances are exact in every arithmetic
        for (uint32_t i = 0; i < lattice.size(); ++i) {
            const Vec3 d = lattice[i] - x;
            order.push_back({at(dot(d, d)), i});
        }
        std::sort(order.begin(), order.end());
        for (uint32_t k = 2; k <= 100; ++k) {
            std::vector<uint32_t> expected;
            for (uint32_t i = 0; i < k; ++i) expected.push_back(order[i].second);
            std::sort(expected.begin(), expected.end());
            Real radius_squared;
            CAPTURE(k);
            CHECK(few.ids_of_nearest(x, k, Real(20), &radius_squared) == expected);
            CHECK(at(radius_squared) == order[k - 1].first);
            CHECK(many.ids_of_nearest(x, k, Real(20)) == expected);
            CHECK(few.raw_estimate(x, k, Real(20)) == many.raw_estimate(x, k, Real(20)));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D4: the estimate of a uniform field is unbiased for every K, where K / V_K has a bias of "
          "K / (K - 1)") {
    // 40 photons to a unit of volume, queries where no ball reaches the boundary.
    const int n = 30000;
    Sequence next;
    const double half = std::cbrt(n / 40.0) / 2, middle = half - 1.6, density = 40;
    Photons photons(photons_in_box(n, half, half, half, next));
    const struct {
        uint32_t k;
        double biased; // the mean of K / V_K, relative to the density
        int queries;
    } rows[] = {{2, 2.0, 6000}, {10, 1.111, 2000}, {50, 1.0204, 1000}, {500, 1.0020, 100}};
    for (const auto &row : rows) {
        double sum = 0, sum_of_biased = 0;
        for (int q = 0; q < row.queries; ++q) {
            const double u = next(), v = next(), w = next();
            const Vec3 x = vec((2 * u - 1) * middle, (2 * v - 1) * middle, (2 * w - 1) * middle);
            Real radius_squared;
            photons.ids_of_nearest(x, row.k, Real(3), &radius_squared);
            const double value = photons.estimate(x, row.k, Real(3));
            const double biased = row.k / ball(std::sqrt(at(radius_squared)));
            // (K - 1) / V_K, photon by photon. In fixed the squared radius has a resolution of 2^-33 / r^2, and its
            // root and cube half and three times that.
            const double resolution = is_fixed ? 3 * 0x1p-33 / at(radius_squared) : 0;
            CHECK(near(value, biased * (row.k - 1) / row.k, 2 * digits + resolution));
            sum += value / density;
            sum_of_biased += biased / density;
        }
        // The relative deviation of one estimate is 1 / sqrt(K - 2); as many are independent as balls fit side by side.
        // At K = 2 the variance grows with the logarithm of the queries: P(X > x) = 1 / (2 x^2), so the mean of n
        // estimates has about sqrt(ln(n) / n).
        const double apart = std::min<double>(row.queries, 8 * middle * middle * middle * density / row.k);
        const double deviation = row.k == 2 ? std::sqrt(std::log(apart) / apart) : 1 / std::sqrt((row.k - 2) * apart);
        CAPTURE(row.k);
        CHECK(std::fabs(sum / row.queries - 1) < 4 * deviation);
        CHECK(std::fabs(sum_of_biased / row.queries - row.biased) < 4 * deviation * row.biased + 5e-4);
    }
    CHECK(photons.statistics.smoke.gathers == 6000 + 2000 + 1000 + 100);
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D5: at the flat boundary of a uniform half-space the estimate is half the density") {
    Sequence next;
    const int n = 20000, queries = 2000;
    std::vector<Vec3> points = photons_in_box(n, 19, 19, 1, next);
    for (Vec3 &p : points) p.z -= Real(1);
    Photons photons(points);
    const double density = n / (38.0 * 38 * 2);
    double sum = 0;
    for (int q = 0; q < queries; ++q) {
        const double x = 34 * next() - 17, y = 34 * next() - 17;
        const double value = photons.estimate(vec(x, y, 0), 10, Real(4));
        CHECK(std::isfinite(value));
        CHECK(value > 0);
        sum += value / density / queries;
    }
    // The relative deviation of one is 1 / sqrt(8). Half balls of ten photons side by side: 34 x 34 x r, r = 0.89.
    const double apart = 34 * 34 * 0.89 * density / 10;
    CHECK(std::fabs(sum - 0.5) < 4 * 0.5 / std::sqrt(8 * std::min<double>(apart, queries)));
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D8: the power of many photons is their number times the power of one, without rounding "
          "errors of a sum") {
    if (std::is_same_v<Real, float>) { // naive sums: 6.5 % and 0.9 % off, and one that stops growing
        float sum = 0, many = 16777216;
        for (int i = 1; i <= 10000000; ++i) {
            sum += 1e-7f;
            if (i == 1000000) CHECK(sum == doctest::Approx(0.099060).epsilon(1e-5));
        }
        CHECK(sum == doctest::Approx(1.064767).epsilon(1e-6));
        CHECK(many + 1.0f == many);
    }
    if (is_fixed) CHECK(at(real(1e-7)) * 1e7 == doctest::Approx(0.998843).epsilon(1e-6)); // 429 units

    // A light of power 1 that emitted 1e7 photons, of which 120,000 are found: 1e-7 is 1.6777216 2^-24.
    const uint32_t n = 120000;
    Sequence next;
    Photons photons(photons_in_box(static_cast<int>(n), 0x1p-4, 0x1p-4, 0x1p-4, next), n + 1);
    photons.map.unit.unit = Real(1.6777216);
    photons.map.unit.exponent = -24;
    const double expected = n * 1e-7 / ball(0x1p-3);
    CHECK(near(photons.estimate(vec(0, 0, 0), n + 1, Real(0x1p-3)), expected));
    // The same with a power for each photon: whole numbers add exactly.
    const std::vector<Color> powers(n, Color(Real(1)));
    photons.map.power = powers.data();
    CHECK(near(photons.estimate(vec(0, 0, 0), n + 1, Real(0x1p-3)), expected));
}

TEST_CASE(WISP_ARITH_NAME ": hard case D9: a photon's power of 1e-10 keeps its digits") {
    // 1e-10 = 1.717986918 2^-34: below the resolution of fixed, were it not stored as mantissa and exponent.
    Photons photons(std::vector<Vec3>(10, vec(0.001, 0, 0)));
    photons.map.unit.unit = Real(1.7179869184);
    photons.map.unit.exponent = -34;
    // The estimate itself has 2e-5 / 2^-32 = 8e4 units in fixed.
    CHECK(
        near(photons.estimate(vec(0, 0, 0), 50, Real(0.0078125)), 10e-10 / ball(0.0078125), is_fixed ? 2e-5 : digits));
    // Tracing makes such a unit: unit in [1, 2), and unit 2^exponent times the emitted photons is the light's power.
    const auto particles = cloud(200, 1, 1, 0.5);
    const SmokeDescription smoke = smoke_of(particles);
    Settings settings = small_settings(1);
    for (uint64_t emitted : {uint64_t{1}, uint64_t{1000}, uint64_t{9000}}) {
        settings.photons = emitted;
        for (double d : {8.0, 4096.0}) {
            const std::vector<LightSource> lights = {
                {LightKind::point, {d, 0, 0}, {0, 0, 1}, 2, {d * d, d * d, d * d}}};
            const BuiltPhotons traced(scene_of(smoke, lights), settings);
            REQUIRE(traced.maps.status == Status::done);
            const PhotonMap &map = traced.maps.per_smoke[0];
            const double power = at(make_emitter(traced.lights[0], traced.medium.sphere).power.x);
            CHECK(at(map.unit.unit) >= 1);
            CHECK(at(map.unit.unit) < 2);
            CHECK(near(std::ldexp(at(map.unit.unit), map.unit.exponent) * double(emitted), power));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case D10: estimates with the smallest and largest radius have the right volume") {
    // In fixed 4/3 pi r^3 would be 0 below 3.8e-4 and overflow above 800, 1 / r^2 below 2.2e-5. Instead 3 / (16 pi^2)
    // times the photons is divided by r three times, and scaled by a third of the map's exponent in between: results of
    // about that size, each with a resolution of 2^-33, of the quotient before its scaling.
    const auto resolution = [](double photons, double r) {
        return is_fixed ? digits + 6 * 0x1p-33 * std::max(r, 1.0) / (photons * 3 / (16 * pi_ * pi_)) : digits;
    };
    const auto exponent_for = [](double r) { return static_cast<int32_t>(3 * std::floor(std::log2(r))); };
    for (double r : {1.5e-5, 1e-4, 3.8e-4, 1.4e-3, 0.03, 1.0, 799.0, 801.0, 16000.0}) {
        Photons photons({vec(0, 0, 0), vec(0, 0, 0), vec(0, 0, 0)});
        photons.map.unit.exponent = exponent_for(r);
        const double expected = 3 / ball(at(real(r))) * std::ldexp(1.0, photons.map.unit.exponent);
        CAPTURE(r);
        CHECK(near(photons.estimate(vec(0, 0, 0), 50, real(r)), expected, resolution(3, r)));
    }
    // The radius is the K-th photon's distance, from the smallest radius on.
    for (double r : {0.002, 0.0078125, 0.25, 40.0, 4000.0}) {
        Photons photons({vec(0, 0, 0), vec(r, 0, 0)});
        photons.map.unit.exponent = exponent_for(r);
        const double expected = 1 / ball(at(real(r))) * std::ldexp(1.0, photons.map.unit.exponent);
        // In fixed r^2 has a resolution of 2^-33 / r^2, and its root and cube half and three times that.
        const double root = is_fixed ? 1.5 * 0x1p-33 / (r * r) : 0;
        CAPTURE(r);
        CHECK(near(photons.estimate(vec(0, 0, 0), 2, real(std::max(2.0, 2 * r))), expected, resolution(1, r) + root));
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D11: the map of an infinite medium has the published fluence, less that of first "
          "collisions") {
    // A = 0.9, isotropic: fluence 0.143284 at r = 1, of which e^-1 / (4 pi) is direct and not in the map.
    const int n = 200000;
    double all = 0, later = 0;
    const double low = 0.95, high = 1.05, volume = 4 * pi_ / 3 * (high * high * high - low * low * low);
    for (int i = 0; i < n; ++i) {
        const Phase uniform(Real(0));
        const uint64_t key = (uint64_t(i) + 1) * 0x9e3779b97f4a7c15u;
        const Event birth = photon_event(key, 0);
        const Vec3 direction = deflect(vec(0, 0, 1), uniform.sample(unit_open<Real>(draw(birth, 1))),
                                       unit_half_open<Real>(draw(birth, 2)));
        walk(Infinite{0.9}, Photon{{vec(0, 0, 0), direction}, Color(Real(1)), true}, key,
             [&](const AnyCollision &, uint32_t number, const Photon &p) {
                 const double r2 = at(dot(p.ray.origin, p.ray.origin));
                 if (r2 < low * low || r2 > high * high) return;
                 all += 1;
                 later += number > 0 ? 1 : 0;
             });
    }
    // The mean over the shell differs from its middle by less than 0.5 %; the rest is the noise of the count.
    const auto bar = [&](double count, double fluence) { return 4 * std::sqrt(count) / n / volume + 0.005 * fluence; };
    CHECK(std::fabs(all / n / volume - 0.143284) < bar(all, 0.143284));
    CHECK(std::fabs(later / n / volume - 0.114009) < bar(later, 0.114009));
    CHECK(std::fabs((all - later) / n / volume - 0.0292749) < bar(all - later, 0.0292749));

    // The renderer's map has every collision but each photon's first.
    const auto particles = cloud(300, 2, 1, 0.5);
    const SmokeDescription smoke = smoke_of(particles);
    const std::vector<LightSource> lights = {point_light};
    Settings settings = small_settings(1);
    settings.photons = batch_photons;
    const BuiltPhotons traced(scene_of(smoke, lights), settings);
    uint64_t collided = 0;
    Mt19937 generator(1, 0, 0, 0);
    const Emitter emitter = make_emitter(traced.lights[0], traced.medium.sphere);
    for (uint32_t i = 0; i < batch_photons; ++i) {
        const uint64_t upper = generator();
        const uint64_t key = upper << 32 | generator();
        const Photon photon = emit(emitter, traced.medium.sphere, photon_event(key, 0));
        collided += first_collision(traced.medium, photon.ray, infinite_distance, photon_event(key, 1)).found ? 1 : 0;
    }
    CHECK(traced.statistics.photons.collisions - traced.statistics.photons.stored == collided);
    CHECK(traced.maps.per_smoke[0].tree.count == traced.statistics.photons.stored);
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D12: photons stored before the roulette, times the albedo, give the estimate of those "
          "stored after it") {
    const auto particles = cloud(300, 2, 1, 1.5);
    SmokeDescription smoke = smoke_of(particles);
    smoke.albedo = {0.5, 0.5, 0.5};
    const std::vector<LightSource> lights = {{LightKind::point, {6, 8, 4}, {0, 0, 1}, 2, {100, 100, 100}}};
    const Scene scene = scene_of(smoke, lights);
    Settings settings = small_settings(8);
    settings.crop = {3, 3, 6, 6};
    settings.step = 0.125;
    settings.photons = 6 * batch_photons;
    settings.gather = 20000; // never full: the estimate is linear in the photons
    const Rendered picture = render_in_memory(scene, settings);
    Settings without = settings;
    without.photons = 0;
    const double before = total(picture) - total(render_in_memory(scene, without));

    // The same photons at their second and later scatterings.
    const BuiltMedium built({smoke});
    const Light light = make_light(lights[0]);
    const Emitter emitter = make_emitter(light, built.medium.sphere);
    std::vector<Vec3> scattered;
    for (uint32_t batch = 0; batch < 6; ++batch) {
        Mt19937 generator(1, 0, batch, 0);
        for (uint32_t i = 0; i < batch_photons; ++i) {
            const uint64_t upper = generator();
            const uint64_t key = upper << 32 | generator();
            std::vector<Vec3> collisions;
            const PathEnd ending =
                walk(built.medium, emit(emitter, built.medium.sphere, photon_event(key, 0)), key,
                     [&](const MediumCollision &, uint32_t, const Photon &p) { collisions.push_back(p.ray.origin); });
            if (ending == PathEnd::absorbed) collisions.pop_back();
            for (size_t c = 1; c < collisions.size(); ++c) scattered.push_back(collisions[c]);
        }
    }
    // No factor of albedo: the power of scattered photons per volume is the scattered light. Where there is no smoke
    // the light is 0, whatever the estimate blurs into it.
    Photons after(scattered, settings.gather);
    const double photon_power = at(emitter.power.x) / double(settings.photons);
    const BuiltField field(smoke);
    double sum = 0;
    for (int y = 3; y < 6; ++y)
        for (int x = 3; x < 6; ++x) {
            const Camera &c = scene.camera;
            const Ray ray = {vec(c.origin.x, c.origin.y, c.origin.z),
                             normalize(vec(c.corner.x + (x + 0.5) * c.right.x, c.corner.y + (y + 0.5) * c.down.y, -1))};
            const double dt = 0.125;
            for (double t = 6 + dt / 2; t < 18; t += dt) {
                const Vec3 p = ray.origin + ray.direction * real(t);
                if (extinction(field.field, p) == Real(0)) continue;
                const double through = std::exp(-at(optical_depth(field.field, ray, real(t))));
                sum += 3 * through * dt * photon_power / (4 * pi_) * after.estimate(p, settings.gather, Real(2));
            }
        }
    CHECK(picture.statistics.smoke.gathered > 0);
    // The noise of one roulette for each photon, and half a per cent between the two quadratures.
    REQUIRE(scattered.size() > 2000);
    CHECK(std::fabs(before / sum - 1) < 4 / std::sqrt(double(scattered.size())) + 0.005);
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D14: a light whose photons hit nothing emits the given number and stores nothing") {
    // A light beside the smoke that points away, and one that is behind it.
    const auto particles = cloud(100, 1, 1, 1);
    const SmokeDescription smoke = smoke_of(particles);
    for (const Double3 &axis : {Double3{1, 0, 0}, Double3{0, -1, 0}}) {
        const std::vector<LightSource> lights = {{LightKind::spot, {30, 0, 0}, axis, 0.1, {5, 5, 5}}};
        Settings settings = small_settings(4);
        settings.photons = 10000;
        const Rendered picture = render_in_memory(scene_of(smoke, lights), settings);
        REQUIRE(picture.status == Status::done);
        const auto &p = picture.statistics.photons;
        CHECK(p.emitted == 10000);
        CHECK(p.escaped == 10000);
        CHECK(p.stored == 0);
        CHECK(p.thinning == 0);
        for (float value : picture.rgb) CHECK(value == 0);
    }
    // A light that shines between two clouds.
    const std::vector<Particle> puffs = {{{-60, 0, 0}, 1, 1}, {{60, 0, 0}, 1, 1}};
    const SmokeDescription two = smoke_of(puffs);
    const std::vector<LightSource> lights = {{LightKind::parallel, {0, 0, 0}, {0, 0, -1}, 0, {1, 1, 1}}};
    Settings settings = small_settings(4);
    const Rendered without = render_in_memory(scene_of(two, lights), settings);
    settings.photons = 50;
    const Rendered picture = render_in_memory(scene_of(two, lights), settings);
    CHECK(picture.statistics.photons.emitted == 50);
    CHECK(picture.statistics.photons.stored == 0);
    CHECK(std::memcmp(picture.rgb.data(), without.rgb.data(), picture.rgb.size() * sizeof(float)) == 0);
}

TEST_CASE(WISP_ARITH_NAME ": hard case D15: a full store is thinned out, and loses no light") {
    const auto particles = cloud(48, 1, 1, 0.5);
    const SmokeDescription smoke = smoke_of(particles);
    const std::vector<LightSource> lights = {{LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {1, 1, 1}}};
    const Scene scene = scene_of(smoke, lights);
    Settings settings = small_settings(2);
    settings.photons = 3 * batch_photons;
    const BuiltPhotons all(scene, settings); // there is room for all
    const uint64_t stored_by_all = all.statistics.photons.stored;
    CHECK(all.statistics.photons.thinning == 0);
    // One too few, and far too few.
    for (uint64_t capacity : {stored_by_all, stored_by_all - 1, stored_by_all / 5}) {
        PhotonPlan planned = plan_photons(scene, settings);
        planned.capacity = capacity;
        const BuiltPhotons traced(scene, settings, planned);
        REQUIRE(traced.maps.status == Status::done);
        const auto &p = traced.statistics.photons;
        const PhotonMap &map = traced.maps.per_smoke[0];
        CHECK((p.thinning > 0) == (capacity < stored_by_all));
        CHECK(p.thinning <= 4);
        // Every photon is traced, as if there were room.
        CHECK(p.emitted == 3 * batch_photons);
        CHECK(p.emitted == p.absorbed + p.escaped + p.blocked + p.capped);
        CHECK(p.collisions == all.statistics.photons.collisions);
        CHECK(p.stored <= capacity);
        CHECK(map.tree.count == p.stored);
        // One of 2^thinning is stored, with that much more power: all of it, but for the noise of the draw.
        const double share = std::ldexp(1.0, -int(p.thinning)), expected = share * double(stored_by_all);
        CHECK(std::fabs(double(p.stored) - expected) <= 5 * std::sqrt(expected * (1 - share)));
        CHECK(near(std::ldexp(at(map.unit.unit), map.unit.exponent), 4 * pi_ / double(p.emitted) / share));
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case D16: counters, batches and seeds have 64 bits") {
    const uint64_t many = 5000000000;
    const auto particles = cloud(200, 2, 1, 0.5);
    const SmokeDescription smoke = smoke_of(particles);
    const std::vector<LightSource> lights = {point_light};
    const Scene scene = scene_of(smoke, lights);
    Settings settings = small_settings(1);
    settings.photons = many;
    PhotonPlan planned = plan_photons(scene, settings);
    CHECK(planned.capacity > 0x7ffffff0u);  // as many as a tree takes,
    CHECK(planned.capacity <= 0x7fffffffu); // and no more
    // Tracing itself, with a store that is full after some batches, until it is stopped.
    settings.photons = 8 * batch_photons;
    planned = plan_photons(scene, settings);
    planned.capacity = 5000;
    settings.photons = many;
    uint64_t work = 0;
    const Observer observer = {&work, [](void *context, Stage, uint64_t done, uint64_t of) {
                                   *static_cast<uint64_t *>(context) = of;
                                   return done < 9 * batch_photons * units_of_photon;
                               }};
    const BuiltPhotons traced(scene, settings, planned, observer);
    CHECK(work == many * units_of_photon);
    CHECK(traced.statistics.photons.emitted >= 9 * batch_photons);
    CHECK(traced.statistics.photons.emitted < 10 * batch_photons);
    CHECK(traced.maps.status == Status::stopped);

    // Counters hold and show as many.
    RunReport report;
    report.arithmetic = WISP_ARITH_NAME;
    report.frames.resize(1);
    report.frames[0].plan = renderer.plan(scene, settings);
    auto &counts = report.frames[0].statistics.photons;
    counts.emitted = counts.collisions = counts.stored = counts.absorbed = counts.escaped = counts.blocked =
        counts.capped = many;
    const std::string json = statistics_json(report);
    size_t shown = 0;
    for (size_t i = json.find("5000000000"); i != json.npos; i = json.find("5000000000", i + 1)) ++shown;
    CHECK(shown == 7);
    Options options;
    set_option(options, "photons", "5000000000", "");
    set_option(options, "seed", "4294967297", "");
    CHECK(options.photons == many);
    CHECK(options.seed == 4294967297);

    // The upper half of the seed counts.
    settings.photons = 500;
    uint64_t collisions[3];
    for (int i = 0; i < 3; ++i) {
        settings.seed = i == 0 ? 1 : i == 1 ? 4294967297 : 8589934593;
        collisions[i] = BuiltPhotons(scene, settings).statistics.photons.collisions;
    }
    CHECK(collisions[0] != collisions[1]);
    CHECK(collisions[1] != collisions[2]);
}
