// Hard cases B: coefficients of the medium that are 0, 1, or far too small or large.
#include "core/photons/photon_walk.h"
#include "support/built_smoke.h"
#include "support/chosen_draws.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr bool is_f32 = std::is_same_v<Real, float>, is_f64 = std::is_same_v<Real, double>,
               is_fixed = std::is_same_v<Real, Fixed>;

uint64_t key_of(uint64_t i) { return (i + 1) * 0x9e3779b97f4a7c15u; }

const LightSource lamp = {
    LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {8, 4, 2}}; // powers of two: the photons' powers are exact

// A scene of one smoke and one light, with what it points to.
struct LampSmoke {
    explicit LampSmoke(const std::vector<Particle> &particles_, Kernel kernel = Kernel::spline)
        : particles(particles_) {
        smoke = smoke_of(particles, kernel);
        scene.camera = look_at_origin(12, 8, 8);
        scene.background = {1, 0.5, 0.25};
        scene.smokes = &smoke;
        scene.smoke_count = 1;
        scene.lights = &light;
    }
    Rendered picture(uint64_t photons = 0, double step = 0.5) {
        Settings settings = small_settings(8);
        settings.photons = photons;
        settings.step = step;
        return render_in_memory(scene, settings);
    }
    std::vector<Particle> particles;
    SmokeDescription smoke;
    LightSource light = lamp;
    Scene scene = {};
};

bool same_bits(const Rendered &a, const Rendered &b) {
    return a.rgb.size() == b.rgb.size() && std::memcmp(a.rgb.data(), b.rgb.data(), a.rgb.size() * sizeof(float)) == 0;
}

// Smoke whose extinction on the z axis is `sigma`, to the bit, at every multiple of 1/4 from -246 to 246. It ends at
// -250 and 250, so that the middles of steps of 10, 100 and 1000 are such points.
std::vector<Particle> even_slab(double sigma) {
    double sum = 0;
    for (int i = -7; i <= 7; ++i) sum += 15 / (64 * pi_) * std::pow(2 - std::abs(i) / 4.0, 3);
    std::vector<Particle> particles;
    for (int i = -992; i <= 992; ++i) particles.push_back({{0, 0, i / 4.0}, 1, sigma / sum});
    return particles;
}

// The radiance along the z axis, seen from z = 1024.
double along_axis(LampSmoke &lit, double step) {
    lit.scene.camera = look_at_origin(1024, 1, 1);
    Settings settings = small_settings(1);
    settings.step = step;
    return render_in_memory(lit.scene, settings).rgb[0];
}

// An infinite medium of extinction 1, with an albedo for each channel.
struct InfiniteMedium {
    Double3 albedo_;
};
struct AnyCollision {
    bool found;
    Real distance;
};
AnyCollision first_collision(const InfiniteMedium &, const Ray &, Real, Event event) {
    return {true, -wisp::log(unit_open<Real>(draw(event, 0)))};
}
Color albedo(const InfiniteMedium &medium, const AnyCollision &) { return vec_of(medium.albedo_); }
Phase phase(const InfiniteMedium &, const AnyCollision &) { return Phase(Real(0)); }

// How a walk ended, and the photon's power at each collision.
struct Walk {
    PathEnd ending;
    std::vector<Color> powers;
};
Walk walk_of(const Double3 &albedos, const Color &power, uint64_t key) {
    Walk walked = {};
    walked.ending = walk(InfiniteMedium{albedos}, Photon{{vec(0, 0, 0), vec(0, 0, 1)}, power, true}, key,
                         [&](const AnyCollision &, uint32_t, const Photon &p) { walked.powers.push_back(p.power); });
    return walked;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME
          ": hard case B1: particles without extinction change no bit of the picture and stop no photon") {
    LampSmoke clear(cloud(50, 3, 1, 0)), none({});
    for (LampSmoke *lit : {&clear, &none}) {
        lit->scene.light_count = 1;
        lit->smoke.emission = {2, 2, 2};
    }
    const Rendered a = clear.picture(3000), b = none.picture(3000);
    REQUIRE(a.status == Status::done);
    CHECK(same_bits(a, b));
    for (size_t i = 0; i < a.rgb.size(); i += 3) {
        CHECK(a.rgb[i] == 1);
        CHECK(a.rgb[i + 1] == 0.5f);
        CHECK(a.rgb[i + 2] == 0.25f);
    }
    CHECK(a.statistics.photons.emitted == 3000);
    CHECK(a.statistics.photons.escaped == 3000);
    CHECK(a.statistics.photons.collisions == 0);
    const BuiltField field(clear.smoke);
    const Ray ray = {vec(-8, 0, 0), vec(1, 0, 0)};
    CHECK(wisp::exp(-optical_depth(field.field, ray, Real(20))) == Real(1));
    for (uint64_t key = 0; key < 3000; ++key)
        CHECK(!first_collision(field.field, ray, Real(20), photon_event(key, 1)).found);
    for (uint32_t i = 0; i < clear.smoke.count; ++i) // the largest draw of each particle
        CHECK(!first_collision(field.field, ray, Real(20), event_with_draw(i, 0)).found);
}

TEST_CASE(WISP_ARITH_NAME ": hard case B2: the densest smoke looks like a wall with its source function as radiance") {
    // In fixed the host accepts extinctions up to 2^20; float ends at 3.4e38.
    const double densest = is_fixed ? 0x1p20 : 3e38, dense = is_fixed ? 0x1p20 : 1e30;
    const Ray ray = {vec(-5, 0, 0), vec(1, 0, 0)};
    for (double area : {dense, densest}) {
        LampSmoke wall({{{0, 0, 0}, 1, area}});
        wall.smoke.albedo = {0, 0, 0};
        wall.smoke.emission = {0.5, 0.25, 0.125};
        const BuiltField field(wall.smoke);
        const Real depth = optical_depth(field.field, ray, Real(20));
        CHECK(at(depth) == doctest::Approx(area * 15 / (8 * pi_)).epsilon(1e-5));
        CHECK(wisp::exp(-depth) == Real(0));
        const Rendered picture = wall.picture();
        const size_t middle = (8 * 4 + 4) * 3;
        CHECK(picture.rgb[middle] == doctest::Approx(0.5).epsilon(1e-5));
        for (size_t i = 0; i < picture.rgb.size(); ++i) { // the source function, the background, or a mixture of both
            const float source = i % 3 == 0 ? 0.5f : i % 3 == 1 ? 0.25f : 0.125f;
            CHECK(picture.rgb[i] <= 2 * source);
            CHECK(picture.rgb[i] >= source * (1 - 1e-5f));
        }
        // Photons stop at the boundary, 3 from the start. At a distance d behind it the depth is scale d^4 / 4 (kernel
        // (2 - q)^3, N-L). `error` is lost to rounding, and `longest` is the longest path.
        const double error = is_f64 ? 3e-14 : is_f32 ? 1.2e-5 : 3e-8, longest = 23;
        const double scale = area * 15 / (64 * pi_);
        const double farthest = 3 + std::pow(4 * (error + longest / scale), 0.25);
        for (uint64_t key = 0; key < 3000; ++key) {
            const auto collision = first_collision(field.field, ray, Real(20), photon_event(key, 1));
            REQUIRE(collision.found);
            CHECK(at(collision.distance) >= 3 - 1e-6);
            CHECK(at(collision.distance) <= farthest + 1e-6);
        }
    }
    // Many particles, a light and photons: no pixel exceeds the background or E p <= 10 / 9 / (4 pi) of the light.
    LampSmoke lit(cloud(200, 2, 1, is_fixed ? 1e5 : 1e29));
    lit.scene.light_count = 1;
    lit.light = {LightKind::point, {5, 0, 0}, {0, 0, 1}, 2, {10, 10, 10}};
    for (float value : lit.picture(300).rgb) {
        CHECK(std::isfinite(value));
        CHECK(value >= 0);
        CHECK(value <= 1);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case B3: steps of depth 1e-12 emit their depth times the source") {
    // One wide particle and 256 steps of length 1 = h / 64, each with a depth of at most 1e-12. The midpoint rule gives
    // the sum of depths within 4e-5 (N-E4). The radiance is 1 - e^-tau = tau.
    const double h = 64, area = 1e-12 * h * h * h * 8 * pi_ / 15, tau = area * 15 / (8 * pi_ * h * h);
    LampSmoke lit({{{0, 0, 0}, h, area}});
    lit.smoke.albedo = {0, 0, 0};
    lit.smoke.emission = {1, 1, 1};
    lit.scene.background = {0, 0, 0};
    const double radiance = along_axis(lit, 1 / h);
    // Fixed cannot represent a depth of 1e-12: rounding a step twice costs at most a unit.
    CHECK(std::fabs(radiance - tau) <= (is_fixed ? 256 * 0x1p-32 : 1e-4 * tau));
    if (is_fixed) return;
    CHECK(radiance > 0);
    const Real s = real(1e-12);
    CHECK(at(-wisp::expm1(-s) / s) == doctest::Approx(1 - 5e-13).epsilon(is_f32 ? 1e-7 : 3e-16));
    CHECK(wisp::expm1(-s) != Real(0));
}

TEST_CASE(WISP_ARITH_NAME ": hard case B4: a slab of depth 5 has 0.993262 of its source function for any step") {
    for (double step : {10.0, 100.0, 1000.0}) { // depths of 0.1, 1 and 10: the last is longer than the slab
        LampSmoke lit({});
        lit.smoke =
            grid_smoke_of({1, 1, 1, nullptr, 0.01, {0, 0, 0}, {250, 250, 250}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
        lit.smoke.smallest_h = lit.smoke.largest_h = 1;
        lit.smoke.albedo = {0, 0, 0};
        lit.smoke.emission = {1, 1, 1};
        lit.scene.background = {0, 0, 0};
        CAPTURE(step);
        // The slab's depth of 500 * 0.01 is rounded in some terms and fifty sums; e^-5 = 0.0067 times that error is
        // seen.
        CHECK(std::fabs(along_axis(lit, step) - 0.993262053) < 4e-7 + 0.0067 * 5 * 65 * unit_error + unit_error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case B5: for albedo 0 no photon is scattered, not even with a draw of 0") {
    const uint64_t key = key_with_draw(1, dimension_survival, 0);
    REQUIRE(draw(photon_event(key, 1), dimension_survival) == 0);
    const Walk walked = walk_of({0, 0, 0}, Color(Real(1)), key);
    CHECK(walked.ending == PathEnd::absorbed);
    CHECK(walked.powers.size() == 1);
    CHECK(walk_of({0x1p-20, 0, 0}, Color(Real(1)), key).powers.size() >
          1); // with any larger albedo a draw of 0 survives

    LampSmoke black(cloud(300, 3, 1, 0.3));
    black.smoke.albedo = {0, 0, 0};
    black.smoke.emission = {0.5, 0.25, 0};
    const Rendered dark = black.picture(0);
    black.scene.light_count = 1;
    const Rendered lit = black.picture(3000);
    CHECK(same_bits(dark, lit));
    CHECK(lit.statistics.photons.emitted == 0);
    CHECK(lit.statistics.photons.stored == 0);
    CHECK(lit.statistics.bytes.photon_map == 0);
    CHECK(lit.statistics.smoke.gathered == 0);
    // Emission and absorption alone: source (1 - T) + background T. T comes from the blue channel, which emits nothing.
    for (size_t i = 0; i < lit.rgb.size(); i += 3) {
        const double through = lit.rgb[i + 2] / 0.25;
        CHECK(lit.rgb[i] == doctest::Approx(0.5 * (1 - through) + through).epsilon(1e-5));
        CHECK(lit.rgb[i + 1] == doctest::Approx(0.25 * (1 - through) + 0.5 * through).epsilon(1e-5));
    }
    // With another smoke photons are traced; those that hit the black smoke are absorbed there.
    const std::vector<Particle> far = {{{0, 0, 0}, 1, 1e5}};
    SmokeDescription wall = smoke_of(far);
    wall.albedo = {0, 0, 0};
    const std::vector<Particle> near = {{{6, 6, 6}, 1, 1e-6}};
    const SmokeDescription both[] = {wall, smoke_of(near)};
    black.scene.smokes = both;
    black.scene.smoke_count = 2;
    black.light = {LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {1, 1, 1}};
    const Rendered beside = black.picture(2000);
    CHECK(beside.statistics.photons.emitted == 2000);
    CHECK(beside.statistics.photons.absorbed == 2000);
    CHECK(beside.statistics.photons.collisions == 2000);
    CHECK(beside.statistics.photons.stored == 0);
}

TEST_CASE(WISP_ARITH_NAME ": hard case B6: for albedo 1 no photon is absorbed, and every walk ends") {
    // The largest draw survives the roulette, and the power stays 1 to the bit.
    const uint64_t key = key_with_draw(1, dimension_survival, 0xffffffffu);
    REQUIRE(draw(photon_event(key, 1), dimension_survival) == 0xffffffffu);
    for (double a : {1.0, 1 - 0x1p-12}) {
        const Walk walked = walk_of({a, a, a}, Color(Real(1)), key);
        CHECK((walked.powers.size() > 1) == (a == 1));
        CHECK(walked.ending ==
              (a == 1 ? PathEnd::capped : PathEnd::absorbed)); // an infinite white medium: only the cap ends a walk
        if (a != 1) continue;
        CHECK(walked.powers.size() == 1000000);
        CHECK(walked.powers.back() == Color(Real(1)));
    }
    for (double area : {0.1, 1.0}) {
        LampSmoke white(cloud(800, 3, 1, area));
        white.smoke.albedo = {1, 1, 1};
        white.smoke.asymmetry = 0.3;
        white.scene.light_count = 1;
        const Statistics statistics = white.picture(5000).statistics;
        CHECK(statistics.photons.emitted == 5000);
        CHECK(statistics.photons.escaped == 5000);
        CHECK(statistics.photons.absorbed == 0);
        CHECK(statistics.photons.capped == 0);
        CHECK(statistics.photons.collisions > 1000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case B7: smoke with albedo 1 emits nothing, whatever its emission") {
    LampSmoke white(cloud(300, 3, 1, 0.3)), glowing(white.particles);
    for (LampSmoke *lit : {&white, &glowing}) lit->smoke.albedo = {1, 1, 1};
    glowing.smoke.emission = {5, 3, 1};
    CHECK(same_bits(white.picture(0), glowing.picture(0)));
    const Rendered dark = glowing.picture(2000);
    CHECK(dark.statistics.photons.emitted == 0);
    CHECK(same_bits(white.picture(0), dark));
    // Lit, with photons: the pictures are equal again.
    for (LampSmoke *lit : {&white, &glowing}) lit->scene.light_count = 1;
    const Rendered a = white.picture(2000), b = glowing.picture(2000);
    CHECK(a.statistics.photons.stored > 0);
    CHECK(a.statistics.photons.stored == b.statistics.photons.stored);
    CHECK(same_bits(a, b));
    // An albedo of 1 in some channels: those emit nothing.
    glowing.smoke.albedo = {1, 0.5, 1};
    glowing.scene.light_count = 0;
    white.scene.light_count = 0;
    const Rendered c = glowing.picture(0), d = white.picture(0);
    for (size_t i = 0; i < c.rgb.size(); i += 3) {
        CHECK(c.rgb[i] == d.rgb[i]);
        CHECK(c.rgb[i + 1] >= d.rgb[i + 1]);
        CHECK(c.rgb[i + 2] == d.rgb[i + 2]);
    }
    CHECK(c.rgb[(8 * 4 + 4) * 3 + 1] > d.rgb[(8 * 4 + 4) * 3 + 1]);
}

TEST_CASE(WISP_ARITH_NAME ": hard case B8: in a furnace every pixel has the furnace's radiance") {
    // Albedo 0 alone: the background does not light the smoke, so a scattering furnace cannot be made.
    for (Kernel kernel : {Kernel::spline, Kernel::poly6})
        for (double g : {0.0, 0.9})
            for (const auto &particles : {cloud(500, 3, 1, 2), cloud(20, 3, 1.75, 0.5, 7), cloud(1, 0.5, 1, 1e4)})
                for (double step : {0.1, 0.5, 2.0}) {
                    LampSmoke lit(particles, kernel);
                    lit.smoke.albedo = {0, 0, 0};
                    lit.smoke.asymmetry = g;
                    lit.smoke.emission = lit.scene.background = {0.75, 0.5, 1};
                    const Rendered picture = lit.picture(0, step);
                    for (size_t i = 0; i < picture.rgb.size(); i += 3) {
                        CHECK(std::fabs(picture.rgb[i] - 0.75f) < 1e-5);
                        CHECK(std::fabs(picture.rgb[i + 1] - 0.5f) < 1e-5);
                        CHECK(std::fabs(picture.rgb[i + 2] - 1.0f) < 1e-5);
                    }
                }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case B9: a channel of albedo 0 scatters nothing, and the weights of the others stay right") {
    const Double3 albedos = {0, 0.5, 1};
    const uint64_t never = key_with_draw(1, dimension_survival, 0), always = key_of(3);
    // White light: the survival probability q is 1, and the weights are 0, 1/2, 1 exactly.
    const Walk white = walk_of({0, 0.5, 1}, Color(Real(1)), always);
    CHECK(white.ending == PathEnd::capped);
    CHECK(white.powers[0] == Color(Real(1)));
    CHECK(white.powers[1] == vec(0, 0.5, 1));
    CHECK(white.powers[2] == vec(0, 0.25, 1));
    for (const Color &power : white.powers) {
        CHECK(power.y >= Real(0));
        CHECK(power.y <= Real(1));
    }
    // Red light is absorbed with any draw; nothing is divided by q = 0.
    const Walk red = walk_of(albedos, vec(1, 0, 0), never);
    CHECK(red.ending == PathEnd::absorbed);
    CHECK(red.powers.size() == 1);
    // Yellow light: q = 1/2, and a survivor has the whole power in green.
    const Walk yellow = walk_of(albedos, vec(1, 1, 0), never);
    REQUIRE(yellow.powers.size() > 1);
    CHECK(yellow.powers[1] == vec(0, 1, 0));
    // The roulette keeps each channel's mean: after one scattering it is the power times the albedo.
    const Color power = vec(1, 0.75, 0.25);
    double sum[3] = {};
    const int n = 4000;
    for (int i = 0; i < n; ++i) {
        const Walk one = walk_of({0, 0.5, 0.8}, power, key_of(uint64_t(i)));
        if (one.powers.size() < 2) continue;
        sum[0] += at(one.powers[1].x) / n;
        sum[1] += at(one.powers[1].y) / n;
        sum[2] += at(one.powers[1].z) / n;
    }
    const double q = 0.375; // max(0.75 * 0.5, 0.25 * 0.8)
    CHECK(sum[0] == 0);
    CHECK(std::fabs(sum[1] - 0.375) < 4 * 0.375 / q * std::sqrt(q * (1 - q) / n));
    CHECK(std::fabs(sum[2] - 0.2) < 4 * 0.2 / q * std::sqrt(q * (1 - q) / n));

    // The picture: red is that of black smoke, to the bit, and every channel is finite.
    LampSmoke colored(cloud(300, 3, 1, 0.3)), black(colored.particles);
    colored.smoke.albedo = albedos;
    black.smoke.albedo = {0, 0, 0};
    for (LampSmoke *lit : {&colored, &black}) {
        lit->scene.light_count = 1;
        lit->light.color = {8, 8, 8};
    }
    const Rendered a = colored.picture(5000), b = black.picture(5000);
    for (size_t i = 0; i < a.rgb.size(); i += 3) {
        CHECK(a.rgb[i] == b.rgb[i]);
        CHECK(std::isfinite(a.rgb[i + 1]));
        CHECK(a.rgb[i + 1] >= b.rgb[i + 1]);
        CHECK(std::isfinite(a.rgb[i + 2]));
        CHECK(a.rgb[i + 2] >= b.rgb[i + 2]);
    }
    CHECK(a.statistics.photons.stored > 200);
    CHECK(a.statistics.photons.absorbed == 0); // blue is never absorbed
}

TEST_CASE(WISP_ARITH_NAME ": hard case B10: transmittance becomes 0 where the numbers end, and is never negative") {
    const auto through = [](double tau) { return wisp::exp(real(-tau)); };
    if (is_fixed) {
        CHECK(at(through(22.2)) == 0x1p-32);
        CHECK(at(through(22.87)) == 0x1p-32);
        for (double tau : {22.874, 22.9, 87.0, 104.0, 745.0, 746.0, 1e9}) CHECK(through(tau) == Real(0));
    } else if (is_f32) {
        CHECK(at(through(22.2)) == doctest::Approx(std::exp(-22.2)).epsilon(2e-6)); // tau itself is rounded
        CHECK(at(through(22.9)) == doctest::Approx(std::exp(-22.9)).epsilon(2e-6));
        CHECK(at(through(87)) >= 0x1p-126);
        CHECK(at(through(87.33)) >= 0x1p-126);
        CHECK(at(through(87.34)) < 0x1p-126);
        CHECK(at(through(103.97)) == 0x1p-149);
        for (double tau : {103.98, 104.0, 745.0, 746.0, 3e38}) CHECK(through(tau) == Real(0));
    } else {
        for (double tau : {22.2, 22.9, 87.0, 104.0})
            CHECK(at(through(tau)) == doctest::Approx(std::exp(-tau)).epsilon(1e-14));
        CHECK(at(through(745)) == 0x1p-1074);
        CHECK(at(through(745.13)) == 0x1p-1074);
        for (double tau : {745.14, 746.0, 1e300}) CHECK(through(tau) == Real(0));
    }
    for (int i = 0; i < 8000; ++i) CHECK(through(i / 10.0) >= Real(0));
    // Pictures of smoke of these depths. The march ends at a depth of 16, so that 1.2e-7 of the background is left at
    // most.
    for (double tau : {22.2, 22.9, 87.0, 104.0, 745.0, 746.0}) {
        LampSmoke lit({{{0, 0, 0}, 1, tau * 8 * pi_ / 15}});
        lit.smoke.albedo = {0, 0, 0};
        const BuiltField field(lit.smoke);
        const Real depth = optical_depth(field.field, {vec(0, 0, 5), vec(0, 0, -1)}, Real(10));
        CHECK(at(depth) == doctest::Approx(tau).epsilon(is_f32 ? 3e-6 : 1e-8));
        CHECK(at(wisp::exp(-depth)) <= std::exp(-tau) * 1.001 + (is_fixed ? 0x1p-32 : 0));
        lit.scene.camera = look_at_origin(12, 1e-3, 1);
        const Rendered picture = render_in_memory(lit.scene, small_settings(1));
        CHECK(picture.rgb[0] >= 0);
        CHECK(picture.rgb[0] <= 1.2e-7f);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case B11: a thousand depths of 0.01 are added before one exponential") {
    // Products of a thousand transmittances are wrong by 7e-6 in float and 1.1e-5 in fixed.
    const double bar = is_f64 ? 1e-12 : is_f32 ? 7e-6 : 0x1p-32 / std::exp(-10);
    // Shadows and photons: a thousand particles in a row. On the axis the depth of one (poly6) is 9 / (2 pi (2 h)^2).
    std::vector<Particle> row;
    for (int i = 0; i < 1000; ++i) row.push_back({{0, 0, 4.0 * i - 2000}, 1, 0.01 * 8 * pi_ / 9});
    const BuiltField field(smoke_of(row, Kernel::poly6));
    const Real depth = optical_depth(field.field, {vec(0, 0, 3000), vec(0, 0, -1)}, Real(8000));
    CHECK(std::fabs(at(wisp::exp(-depth)) / std::exp(-10) - 1) < bar);
    // The march: 1000 steps of 1/2 through the even slab.
    const auto slab = even_slab(0.02);
    double expected = 0;
    for (int i = 0; i < 1000; ++i)
        for (const Particle &p : slab) {
            const double u = 2 - std::fabs((i + 0.5) / 2 - 250 - p.position.z);
            if (u > 0) expected += 0.5 * p.area * 15 / (64 * pi_) * u * u * u;
        }
    LampSmoke lit(slab);
    lit.smoke.albedo = {0, 0, 0};
    lit.scene.background = {1, 1, 1};
    const double marched = along_axis(lit, 0.5);
    // The film is float, and half a unit of a depth of 10 is 4.8e-7 there.
    const double march_bar = is_fixed ? bar : is_f32 ? 5e-7 : 1e-7;
    CHECK(std::fabs(marched / std::exp(-expected) - 1) < march_bar);
}
