// Whole pictures against closed forms and an independent marcher; crops, permutations, memory.
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

// The ray through the middle of pixel (x, y) of a picture of look_at_origin(12, 8, n).
Ray pixel_ray(int n, int x, int y) {
    const double step = 8.0 / n / 12;
    return {vec(0, 0, 12), normalize(vec((x + 0.5 - 0.5 * n) * step, (0.5 * n - y - 0.5) * step, -1))};
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": absorbing smoke attenuates by Beer and Lambert's law") {
    // The march's depth against the closed one; it converges with the square of the step.
    LitSmoke lit(cloud(300, 3, 1, 0.3));
    lit.smoke.albedo = {0, 0, 0};
    const BuiltField field(lit.smoke);
    double worst[2] = {0, 0};
    for (int fine = 0; fine < 2; ++fine) {
        Settings settings = small_settings(8);
        settings.step = fine ? 0.0625 : 0.25;
        const Rendered picture = render_in_memory(lit.scene, settings);
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x) {
                const double expected = std::exp(-at(optical_depth(field.field, pixel_ray(8, x, y), Real(100))));
                worst[fine] = std::max(worst[fine], std::fabs(double(picture.rgb[size_t(8 * y + x) * 3]) - expected));
            }
    }
    CHECK(worst[0] < 2e-3);
    CHECK(worst[1] < 2e-4);
}

TEST_CASE(WISP_ARITH_NAME ": among particles of unlike smoothing lengths steps are fine where the smoke is") {
    // By the middle particle a ray needs steps of 1/128; steps of that length all the way would be 2,500 a ray.
    LitSmoke lit({{{0, 0, 0}, 2, 10}, {{0.5, 0.25, 0}, 0.015625, 0.0006}, {{-0.5, 0.5, 0.25}, 0.125, 0.02}});
    lit.smoke.albedo = {0, 0, 0};
    lit.scene.camera = look_at_origin(12, 8, 32);
    const BuiltField field(lit.smoke);
    for (const Method method : {Method::direct, Method::map}) {
        Settings settings = small_settings(32);
        settings.method = method;
        settings.density_step = 0;
        settings.irradiance = IrradianceMap::none;
        settings.photons = 0;
        settings.step = 0.25;
        const Rendered picture = render_in_memory(lit.scene, settings);
        double worst = 0;
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) {
                const double expected = std::exp(-at(optical_depth(field.field, pixel_ray(32, x, y), Real(100))));
                worst = std::max(worst, std::fabs(double(picture.rgb[size_t(32 * y + x) * 3]) - expected));
            }
        CHECK(worst < 4e-3);
        CHECK(picture.statistics.smoke.march_samples < 32 * 32 * 60);
    }
}

TEST_CASE(WISP_ARITH_NAME ": an even slab has its source's radiance times 1 - e^-tau for any step") { // B4, E13
    // Particles far larger than the picture: the density is the same within a few thousandths along the middle ray.
    for (double step : {0.001, 0.004, 0.01}) {
        LitSmoke lit({{{0, 0, 0}, 64, 2000}});
        lit.smoke.albedo = {0, 0, 0};
        lit.smoke.emission = {1, 1, 1};
        lit.scene.background = {0, 0, 0};
        lit.scene.camera = look_at_origin(512, 1, 1);
        Settings settings = small_settings(1);
        settings.step = step;
        const Rendered picture = render_in_memory(lit.scene, settings);
        const double depth = 2000 * 15 / (8 * pi_ * 64 * 64); // N-L, on the axis
        CHECK(picture.rgb[0] == doctest::Approx(1 - std::exp(-depth)).epsilon(3e-5));
    }
}

TEST_CASE(WISP_ARITH_NAME ": single scattering equals an independent march in double") {
    for (LightKind kind : {LightKind::point, LightKind::spot, LightKind::parallel, LightKind::constant}) {
        LitSmoke lit(cloud(200, 2.5, 1, 0.4), kind == LightKind::spot ? Kernel::poly6 : Kernel::spline);
        lit.scene.camera = look_at_origin(12, 8, 2);
        lit.scene.background = {0, 0, 0};
        lit.smoke.albedo = {0.9, 0.5, 0};
        lit.smoke.asymmetry = 0.5;
        const double dx = -4, dy = -5, dz = -3, norm = std::sqrt(50.0);
        lit.light({kind, {4, 5, 3}, {dx / norm, dy / norm, dz / norm}, 1 - std::cos(0.3), {50, 40, 30}});
        Settings settings = small_settings(2);
        settings.step = 0.03125;
        const Rendered picture = render_in_memory(lit.scene, settings);
        REQUIRE(picture.status == Status::done);

        const BuiltField field(lit.smoke);
        for (int pixel = 0; pixel < 4; ++pixel) {
            const Ray ray = pixel_ray(2, pixel % 2, pixel / 2);
            const double o[] = {at(ray.origin.x), at(ray.origin.y), at(ray.origin.z)};
            const double w[] = {at(ray.direction.x), at(ray.direction.y), at(ray.direction.z)};
            double sum = 0;
            const int n = 3000;
            const double begin = 5, end = 19;
            for (int i = 0; i < n; ++i) {
                const double t = begin + (end - begin) * (i + 0.5) / n;
                const double x[] = {o[0] + t * w[0], o[1] + t * w[1], o[2] + t * w[2]};
                const Vec3 p = vec(x[0], x[1], x[2]);
                const double sigma = at(extinction(field.field, p));
                if (sigma == 0) continue;
                double l[] = {x[0] - 4, x[1] - 5, x[2] - 3};
                double distance = std::sqrt(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]), falloff = 1;
                for (double &c : l) c /= distance;
                if (kind == LightKind::parallel) l[0] = dx / norm, l[1] = dy / norm, l[2] = dz / norm, distance = 100;
                if (kind == LightKind::point || kind == LightKind::spot) falloff = 1 / (distance * distance);
                if (kind == LightKind::spot && (l[0] * dx + l[1] * dy + l[2] * dz) / norm < std::cos(0.3)) continue;
                const double cosine = -(l[0] * w[0] + l[1] * w[1] + l[2] * w[2]);
                const double phase = 0.75 / (4 * pi_ * std::pow(1.25 - cosine, 1.5));
                const double light =
                    std::exp(-at(optical_depth(field.field, {p, vec(-l[0], -l[1], -l[2])}, real(distance))));
                const double eye = std::exp(-at(optical_depth(field.field, ray, real(t))));
                sum += sigma * phase * falloff * light * eye * (end - begin) / n;
            }
            CAPTURE(static_cast<int>(kind));
            CHECK(double(picture.rgb[size_t(pixel) * 3]) == doctest::Approx(50 * 0.9 * sum).epsilon(5e-4));
            CHECK(double(picture.rgb[size_t(pixel) * 3 + 1]) == doctest::Approx(40 * 0.5 * sum).epsilon(5e-4));
            CHECK(picture.rgb[size_t(pixel) * 3 + 2] == 0);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a crop is the same part of the whole, to the bit") {
    LitSmoke lit(cloud(400, 3, 1, 0.3));
    lit.smoke.asymmetry = 0.4;
    lit.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}});
    Settings settings = small_settings(12);
    settings.samples = 3; // not a square: the R2 sequence
    settings.photons = 5000;
    const Rendered whole = render_in_memory(lit.scene, settings);
    settings.crop = {3, 5, 9, 11};
    const Rendered part = render_in_memory(lit.scene, settings);
    for (int y = 5; y < 11; ++y)
        CHECK(std::memcmp(&part.rgb[size_t((y - 5) * 6 * 3)], &whole.rgb[size_t((y * 12 + 3) * 3)],
                          6 * 3 * sizeof(float)) == 0);
    CHECK(part.statistics.rays.primary == 36 * 3);
    settings.crop = {3, 5, 10, 10, 3};
    REQUIRE(settings.crop.width() == 3);
    REQUIRE(settings.crop.height() == 2);
    const Rendered some = render_in_memory(lit.scene, settings);
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 3; ++x)
            CHECK(std::memcmp(&some.rgb[size_t((y * 3 + x) * 3)],
                              &whole.rgb[size_t(((3 * y + 5) * 12 + 3 * x + 3) * 3)], 3 * sizeof(float)) == 0);
    CHECK(some.statistics.rays.primary == 6 * 3);
}

TEST_CASE(WISP_ARITH_NAME ": rows are handed on from the top, in room for one, until their receiver stops the work") {
    LitSmoke lit(cloud(100, 3, 1, 0.3));
    lit.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}});
    Settings settings = small_settings(12);
    settings.photons = 2000;
    for (const Crop crop : {Crop{0, 0, 12, 12}, Crop{3, 5, 10, 10, 3}}) {
        settings.crop = crop;
        const Rendered whole = render_in_memory(lit.scene, settings);
        const size_t values = size_t(crop.width()) * 3;
        for (int32_t stop_after = 0; stop_after <= crop.height(); ++stop_after) { // 0: never
            struct Received {
                size_t values;
                int32_t stop_after, next;
                std::vector<float> rgb;
            } received = {values, stop_after, 0, {}};
            std::vector<unsigned char> memory(renderer.plan(lit.scene, settings).arena_bytes);
            std::vector<float> row(values + 1, -7); // one more, which nobody may write
            Arena arena(memory.data(), memory.size());
            Statistics statistics;
            const Observer observer = {&received, nullptr, [](void *context, int32_t y, const float *rgb) {
                                           Received &to = *static_cast<Received *>(context);
                                           CHECK(y == to.next++);
                                           to.rgb.insert(to.rgb.end(), rgb, rgb + to.values);
                                           return to.next != to.stop_after;
                                       }};
            const Status status = renderer.render({lit.scene, settings, arena, statistics, observer, row.data()});
            CHECK(status == (stop_after == 0 ? Status::done : Status::stopped));
            CHECK(received.next == (stop_after == 0 ? crop.height() : stop_after));
            CHECK(row[values] == -7);
            CHECK(std::memcmp(received.rgb.data(), whole.rgb.data(), received.rgb.size() * sizeof(float)) == 0);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": two smokes add, and one split in two is the one") {
    const auto all = cloud(300, 3, 1, 0.3);
    const std::vector<Particle> first(all.begin(), all.begin() + 120), second(all.begin() + 120, all.end());
    LitSmoke one(all);
    one.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}});
    LitSmoke two(all);
    const SmokeDescription parts[] = {smoke_of(first), smoke_of(second)};
    two.scene.smokes = parts;
    two.scene.smoke_count = 2;
    two.light(one.lights[0]);
    Settings settings = small_settings(8);
    settings.photons = 40000;
    settings.gather = 20;
    const Rendered a = render_in_memory(one.scene, settings), b = render_in_memory(two.scene, settings);
    CHECK(a.statistics.photons.collisions == doctest::Approx(double(b.statistics.photons.collisions)).epsilon(0.01));
    double sum = 0, difference = 0;
    for (size_t i = 0; i < a.rgb.size(); ++i) {
        sum += a.rgb[i];
        difference += a.rgb[i] - b.rgb[i];
    }
    CHECK(std::fabs(difference) < 0.02 * sum); // two maps blur otherwise than one
}

TEST_CASE(WISP_ARITH_NAME ": an arena of the planned size suffices, a smaller one is refused and nothing is drawn") {
    LitSmoke lit(cloud(200, 3, 1, 0.3));
    lit.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}});
    lit.smoke.asymmetry = 0.5;
    Settings settings = small_settings(4);
    settings.photons = 3000;
    const uint64_t planned = renderer.plan(lit.scene, settings).arena_bytes;
    CHECK(render_in_memory(lit.scene, settings).statistics.bytes.arena_peak <= planned);
    for (double share : {0.0, 0.01, 0.2}) {
        std::vector<unsigned char> memory(static_cast<size_t>(double(planned) * share) + 1);
        CHECK(is_untouched(render_in({memory.data(), memory.size()}, lit.scene, settings)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": the plan names what a scene needs, and no more") {
    LitSmoke lit(cloud(100, 3, 1, 0.3));
    Settings settings = small_settings(4);
    settings.photons = 1000;
    CHECK(!renderer.plan(lit.scene, settings).photons); // nothing lights it
    lit.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 50, 50}});
    const Plan even = renderer.plan(lit.scene, settings);
    CHECK(even.photons);
    CHECK(even.photon_directions == Plan::Directions::none);
    CHECK(!even.photon_powers);
    lit.smoke.asymmetry = 0.1;
    CHECK(renderer.plan(lit.scene, settings).photon_directions != Plan::Directions::none);
    lit.smoke.albedo = {0.9, 0.8, 0.7};
    CHECK(renderer.plan(lit.scene, settings).photon_powers);
    lit.smoke.albedo = {0, 0, 0};
    const Plan black = renderer.plan(lit.scene, settings);
    CHECK(!black.photons);
    CHECK(black[Stage::photons].bytes == 0);
    CHECK(black[Stage::gather].bytes == 0);
    CHECK(black.arena_bytes < even.arena_bytes);
}

TEST_CASE(WISP_ARITH_NAME ": an observer is called for every stage that works, and may stop each call") {
    LitSmoke lit(cloud(100, 3, 1, 0.3));
    lit.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 50, 50}});
    Settings settings = small_settings(4);
    settings.photons = 2 * batch_photons;
    std::vector<unsigned char> memory(renderer.plan(lit.scene, settings).arena_bytes);
    std::vector<float> rgb(4 * 4 * 3);
    struct Log {
        int calls, stop_after;
        bool seen[stage_count];
    };
    const auto run = [&](int stop_after, Log &log) {
        log = {0, stop_after, {}};
        const Observer observer = {&log, [](void *context, Stage stage, uint64_t, uint64_t) {
                                       Log &l = *static_cast<Log *>(context);
                                       l.seen[static_cast<uint32_t>(stage)] = true;
                                       return ++l.calls < l.stop_after;
                                   }};
        Arena arena(memory.data(), memory.size());
        Statistics statistics;
        return renderer.render({lit.scene, settings, arena, statistics, observer, rgb.data()});
    };
    Log all;
    CHECK(run(1000, all) == Status::done);
    for (const Stage stage :
         {Stage::lights, Stage::particle_tree, Stage::photons, Stage::gather, Stage::march, Stage::camera_rays})
        CHECK(all.seen[static_cast<uint32_t>(stage)]);
    CHECK(!all.seen[static_cast<uint32_t>(Stage::shadows)]);
    for (int stop = 1; stop <= all.calls; ++stop) {
        Log log;
        CHECK(run(stop, log) == Status::stopped);
        CHECK(log.calls == stop);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a light far away gives what a near one of the same irradiance does") {
    // The smoke is small and thin, so that the light's distance changes nothing but its strength.
    LitSmoke lit(cloud(60, 1, 1, 0.01));
    lit.scene.camera = look_at_origin(12, 4, 4);
    lit.scene.background = {0, 0, 0};
    double first = 0;
    for (double d : {1000.0, 4000.0, 16000.0}) {
        lit.lights.clear();
        lit.light({LightKind::point, {d, 0, 0}, {0, 0, 1}, 2, {d * d, d * d, d * d}});
        const Rendered picture = render_in_memory(lit.scene, small_settings(4));
        double sum = 0;
        for (float value : picture.rgb) sum += value;
        if (first == 0) first = sum;
        CHECK(sum == doctest::Approx(first).epsilon(5e-4));
    }
}

TEST_CASE(WISP_ARITH_NAME ": an empty smoke beside another changes no bit") {
    LitSmoke lit(cloud(200, 3, 1.5, 0.3));
    lit.light({LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}});
    Settings settings = small_settings(6);
    settings.photons = 3000;
    const Rendered alone = render_in_memory(lit.scene, settings);
    const SmokeDescription both[] = {smoke_of({}), lit.smoke};
    lit.scene.smokes = both;
    lit.scene.smoke_count = 2;
    const Rendered beside = render_in_memory(lit.scene, settings);
    CHECK(std::memcmp(alone.rgb.data(), beside.rgb.data(), alone.rgb.size() * sizeof(float)) == 0);
}

TEST_CASE(WISP_ARITH_NAME ": steps are fractions of the smallest smoothing length") {
    std::vector<Particle> particles = cloud(100, 0.05, 0.0625, 1e-4);
    LitSmoke alone(particles);
    particles.push_back({{40, 40, 40}, 2, 1e-6});
    sort_canonically(particles);
    LitSmoke mixed(particles);
    for (LitSmoke *lit : {&alone, &mixed}) {
        lit->smoke.albedo = {0, 0, 0};
        lit->scene.camera = look_at_origin(12, 0.1, 4);
    }
    const Rendered a = render_in_memory(alone.scene, small_settings(4)),
                   b = render_in_memory(mixed.scene, small_settings(4));
    for (size_t i = 0; i < a.rgb.size(); ++i) CHECK(b.rgb[i] == doctest::Approx(a.rgb[i]).epsilon(0.02));
    CHECK(a.rgb[0] < 0.99);
}
