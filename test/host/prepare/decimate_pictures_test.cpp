// Removed particles change rays and pixels by no more than epsilon.
#include "host/prepare/decimate.h"
#include "support/built_smoke.h"
#include "support/worst.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Particles whose masses spread over four powers of ten, a few of them far away.
std::vector<Particle> dusty_cloud(Kernel kernel) {
    auto particles = cloud(1500, 4, 1, 1, kernel == Kernel::spline ? 1 : 2);
    Sequence next;
    for (Particle &p : particles) {
        p.h = 0.75 + 0.5 * next();
        p.area = 0.3 * std::pow(next(), 6);
        if (next() < 0.02) p.position = {p.position.x * 5, p.position.y * 5, p.position.z * 2.5};
    }
    sort_canonically(particles);
    return particles;
}

struct Thinned {
    std::vector<Particle> gone, transfers, left; // transfers: the mass that receivers get, as particles
    size_t given = 0;

    Thinned(const std::vector<Particle> &all, const SmokeDescription &smoke, const Double3 &eye,
            const std::vector<LightSource> &lights, double epsilon)
        : left(all) {
        const auto removals = find_negligible({all}, {smoke}, eye, lights, epsilon)[0];
        for (const Removal &r : removals) {
            gone.push_back(all[r.index]);
            if (r.mass_receiver == r.index) continue;
            transfers.push_back({all[r.mass_receiver].position, all[r.mass_receiver].h, all[r.index].area});
        }
        remove_particles(left, removals);
        sort_canonically(transfers);
        sort_canonically(left);
    }
};

// The greatest depth of these particles on rays through `targets`, from a point or along a direction.
double greatest_depth(const std::vector<Particle> &particles, Kernel kernel, const std::vector<Particle> &targets,
                      const Double3 &source, bool parallel) {
    if (particles.empty()) return 0;
    const BuiltField built(smoke_of(particles, kernel));
    Sequence next;
    double greatest = 0;
    for (const Particle &target : targets)
        for (int i = 0; i < 2; ++i) {
            const auto near = [&](double x) { return i == 0 ? x : x + (next() - 0.5) * target.h; };
            const Vec3 to = vec(near(target.position.x), near(target.position.y), near(target.position.z));
            const Vec3 direction = normalize(parallel ? vec_of(source) : to - vec_of(source));
            const Vec3 from = parallel ? to - direction * Real(64) : vec_of(source);
            greatest = std::max(greatest, at(optical_depth(built.field, {from, direction}, Real(256))));
        }
    return greatest;
}

LightSource light_at(LightKind kind, double x, double y, double z, double power) {
    return {kind, {x, y, z}, {x, y, z}, 2, {power, power, power}};
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": no ray from the eye or a light loses or gains more than the bound") {
    const Double3 eye = {0, 0, 12};
    // Outside, within the smoke, parallel.
    const std::vector<LightSource> lights = {light_at(LightKind::point, 9, 8, 5, 1),
                                             light_at(LightKind::spot, 0.5, 1, -0.5, 1),
                                             light_at(LightKind::parallel, -0.6, 0.3, 0.2, 1)};
    for (Kernel kernel : {Kernel::spline, Kernel::poly6})
        for (double epsilon : {0.01, 0.1}) {
            const auto particles = dusty_cloud(kernel);
            const Thinned decimate(particles, smoke_of(particles, kernel), eye, lights, epsilon);
            CAPTURE(decimate.gone.size());
            CHECK(decimate.gone.size() > 100);
            CHECK(decimate.transfers.size() > 100);
            const double most = -std::log1p(-epsilon);
            double lost = 0, given = 0;
            const auto ask = [&](const Double3 &source, bool parallel) {
                const double loss = greatest_depth(decimate.gone, kernel, particles, source, parallel);
                const double gain = greatest_depth(decimate.transfers, kernel, particles, source, parallel);
                CHECK(loss <= most + 200 * unit_error);
                CHECK(gain <= most + 200 * unit_error);
                lost = std::max(lost, loss);
                given = std::max(given, gain);
            };
            ask(eye, false);
            for (const LightSource &light : lights) ask(light.position, light.kind == LightKind::parallel);
            // The bound is used.
            CHECK(lost > 0.4 * most);
            CHECK(given > 0.4 * most);
        }
}

// Before a bright sky nothing but transmittance shows.
TEST_CASE(WISP_ARITH_NAME ": pixels of backlit smoke change by no more than the part that may go") {
    for (double epsilon : {0.01, 0.1}) {
        auto particles = dusty_cloud(Kernel::spline);
        SmokeDescription smoke = smoke_of(particles);
        smoke.albedo = {0, 0, 0};
        const std::vector<LightSource> lights;
        Scene scene = scene_of(smoke, lights);
        scene.background = {0.25, 0.5, 1};
        scene.camera = look_at_origin(12, 8, 24);
        Settings settings = small_settings(24);
        settings.step = 0.1;
        const Rendered before = render_in_memory(scene, settings);
        const Thinned decimate(particles, smoke, scene.camera.origin, lights, epsilon);
        SmokeDescription left = smoke_of(decimate.left);
        left.albedo = {0, 0, 0};
        scene.smokes = &left;
        const Rendered after = render_in_memory(scene, settings);
        double greatest = 0;
        for (size_t i = 0; i < before.rgb.size(); ++i) {
            const double was = static_cast<double>(before.rgb[i]), is = static_cast<double>(after.rgb[i]);
            const double sky = i % 3 == 0 ? 0.25 : i % 3 == 1 ? 0.5 : 1, change = std::fabs(std::log(is / was));
            // Steps of s h are wrong by 0.125 s^2 of the depth (N-E4), before and after.
            CHECK(change <= -std::log1p(-epsilon) * 1.00125 - 0.0025 * std::log(was / sky) + 1e-6);
            greatest = std::max(greatest, change);
        }
        CHECK(greatest > 0.2 * epsilon);
    }
}

TEST_CASE(WISP_ARITH_NAME ": pixels of lit smoke stay within the bound of single scattering") {
    for (double epsilon : {0.1, 0.3}) {
        const auto particles = dusty_cloud(Kernel::spline);
        SmokeDescription smoke = smoke_of(particles);
        smoke.emission = {0.02, 0.02, 0.02};
        const std::vector<LightSource> lights = {light_at(LightKind::point, 30, 30, 12, 2000),
                                                 light_at(LightKind::parallel, -0.6, 0.64, -0.48, 1)};
        // S: 2000 W/sr from at least 20 away, and the parallel light; p = 1 / (4 pi); a tenth of what glows.
        const double brightest = 0.9 * (2000 / 400.0 + 1) / (4 * 3.14159265358979323846) + 0.1 * 0.02;
        Scene scene = scene_of(smoke, lights);
        scene.background = {0.05, 0.05, 0.05};
        scene.camera = look_at_origin(12, 8, 10);
        Settings settings = small_settings(10);
        settings.step = 0.2;
        const Rendered before = render_in_memory(scene, settings);
        const Thinned decimate(particles, smoke, scene.camera.origin, lights, epsilon);
        SmokeDescription left = smoke_of(decimate.left);
        left.emission = smoke.emission;
        scene.smokes = &left;
        const Rendered after = render_in_memory(scene, settings);
        double worst = 0;
        const double quadrature = 0.02; // 0.125 s^2 of a depth (N-E4), s = 0.2, and depths of up to 4
        for (size_t i = 0; i < before.rgb.size(); ++i) {
            const double was = static_cast<double>(before.rgb[i]), is = static_cast<double>(after.rgb[i]);
            const double kept = (1 - epsilon) * (1 - epsilon);
            CHECK(is >= kept * (was - epsilon * brightest) * (1 - quadrature));
            CHECK(is <= (was / kept + epsilon * brightest) * (1 + quadrature));
            worst = worst_of(worst, std::fabs(is - was) / was);
        }
        CHECK(worst > 0.02 * epsilon);
        CHECK(before.statistics.smoke.particles - after.statistics.smoke.particles == decimate.gone.size());
    }
}
