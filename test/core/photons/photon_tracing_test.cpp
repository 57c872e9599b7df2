// Tracing photons in batches: bookkeeping, and what photons must carry (S2).
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <cmath>
#include <doctest/doctest.h>
#include <initializer_list>
#include <set>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// A scene and what it points to.
struct LitCloud {
    LitCloud(const std::vector<SmokeDescription> &smokes_, const std::vector<LightSource> &lights_)
        : smokes(smokes_), lights(lights_) {
        scene.camera = look_at_origin(20, 10, 16);
        scene.smokes = smokes.data();
        scene.smoke_count = static_cast<uint32_t>(smokes.size());
        scene.lights = lights.data();
        scene.light_count = static_cast<uint32_t>(lights.size());
    }
    std::vector<SmokeDescription> smokes;
    std::vector<LightSource> lights;
    Scene scene = {};
};

const LightSource point_light = {LightKind::point, {6, 8, 4}, {0, 0, 1}, 2, {100, 80, 60}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": emitted = absorbed + escaped + blocked + capped, and each batch can be traced alone") {
    const auto particles = cloud(800, 3, 1, 0.1);
    for (double a : {0.0, 0.5, 1.0}) {
        std::vector<SmokeDescription> smokes = {smoke_of(particles)};
        smokes[0].albedo = {a, a, a};
        smokes[0].asymmetry = 0.3;
        Settings settings = small_settings(8);
        settings.photons = 3 * batch_photons + 100;
        const LitCloud cloudy(smokes, {point_light});
        const Rendered picture = render_in_memory(cloudy.scene, settings);
        const auto &p = picture.statistics.photons;
        if (a == 0) { // nothing scatters: no photon is traced (B5)
            CHECK(p.emitted == 0);
            continue;
        }
        CHECK(p.emitted == settings.photons);
        CHECK(adds_up(p));
        CHECK(p.collisions > p.stored);
        CHECK(p.stored > 0);
        if (a == 1) CHECK(p.absorbed == 0); // B6
        // Collisions that were not stored are the photons' first.
        CHECK(p.collisions - p.stored <= p.emitted);
    }
}

TEST_CASE(WISP_ARITH_NAME ": every batch balances, and is the same whatever batches are traced with it") {
    const auto particles = cloud(800, 3, 1, 0.1);
    const LitCloud cloudy({smoke_of(particles)}, {point_light});
    const auto photons_of_batches = [&](uint64_t photons, const Batches &batches) {
        Settings settings = small_settings(1);
        settings.photons = photons;
        settings.method = Method::map;
        settings.goal = Goal::photons;
        const Plan plan = renderer.plan(cloudy.scene, settings);
        std::vector<unsigned char> memory(plan.arena_bytes);
        std::vector<int64_t> values(plan.map_sums);
        Arena arena(memory.data(), memory.size());
        PhotonSums sums = {values.data(), values.size(), 0};
        Statistics statistics;
        REQUIRE(trace_batches(cloudy.scene, settings, batches, arena, sums, statistics) == Status::done);
        CHECK(adds_up(statistics.photons));
        return statistics.photons;
    };
    const auto numbers = [](const Statistics::Photons &n) {
        return std::vector<uint64_t>{n.emitted, n.collisions, n.stored, n.absorbed, n.escaped, n.blocked, n.capped};
    };
    constexpr uint64_t photons = 3 * batch_photons + 100;
    std::vector<uint64_t> sum(7);
    std::set<uint64_t> different;
    for (uint64_t batch = 0; batch < 4; ++batch) {
        const Statistics::Photons alone = photons_of_batches(photons, {batch, batch + 1});
        CHECK(alone.emitted == (batch < 3 ? batch_photons : 100));
        if (batch < 3) CHECK(numbers(photons_of_batches(9 * batch_photons, {batch, batch + 1})) == numbers(alone));
        for (size_t i = 0; i < sum.size(); ++i) sum[i] += numbers(alone)[i];
        different.insert(alone.collisions);
    }
    CHECK(different.size() == 4);
    CHECK(numbers(photons_of_batches(photons, {0, 4})) == sum);
    // A photon map stores the same photons.
    Settings settings = small_settings(1);
    settings.photons = photons;
    CHECK(numbers(render_in_memory(cloudy.scene, settings).statistics.photons) == sum);
}

TEST_CASE(WISP_ARITH_NAME ": the fraction of photons that collide is that of the optical depth") {
    // Albedo so small that only first collisions count: the fraction of photons that collide is the mean of 1 - e^-tau
    // over the directions sent, by quadrature with the closed depth.
    const auto particles = cloud(600, 3, 1, 0.1);
    std::vector<SmokeDescription> smokes = {smoke_of(particles)};
    smokes[0].albedo = {1e-6, 1e-6, 1e-6};
    const LightSource sun = {LightKind::parallel, {0, 0, 0}, {0, 0, -1}, -1, {1, 1, 1}};
    const LitCloud cloudy(smokes, {sun});
    Settings settings = small_settings(2);
    settings.photons = 40000;
    const Rendered picture = render_in_memory(cloudy.scene, settings);
    const BuiltMedium built(smokes);
    const Sphere sphere = built.medium.sphere;
    double hit = 0;
    const int n = 200;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) {
            const double x = 2 * (i + 0.5) / n - 1, y = 2 * (k + 0.5) / n - 1;
            if (x * x + y * y > 1) continue;
            const Vec3 start = sphere.center + vec(x, y, 1) * sphere.radius;
            hit += 1 - std::exp(-at(optical_depth(built.medium, {start, vec(0, 0, -1)}, Real(100))));
        }
    const double expected = hit / (n * n) * 4 / pi_;
    CAPTURE(picture.statistics.photons.emitted);
    const double found = double(picture.statistics.photons.absorbed) / double(settings.photons);
    CHECK(std::fabs(found - expected) < 4 * std::sqrt(expected * (1 - expected) / double(settings.photons)) + 1e-3);
}

TEST_CASE(WISP_ARITH_NAME ": a black light does not make photons differ in power") {
    const auto particles = cloud(10, 1, 1, 1);
    const std::vector<SmokeDescription> smokes = {smoke_of(particles)};
    const LightSource black = {LightKind::point, {5, 0, 0}, {0, 0, 1}, 2, {0, 0, 0}};
    LightSource red = black, blue = black, dim_red = black;
    red.color = {9, 0, 0};
    blue.color = {0, 0, 9};
    dim_red.color = {2, 0, 0};
    Settings settings = small_settings(1);
    settings.photons = 1000;
    CHECK(renderer.plan(LitCloud(smokes, {black, red, blue}).scene, settings).photon_powers);
    CHECK(!renderer.plan(LitCloud(smokes, {black, red, dim_red}).scene, settings).photon_powers);
}
