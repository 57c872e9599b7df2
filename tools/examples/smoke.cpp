// Points in memory, a picture of smoke out.
//
//     c++ -std=c++17 smoke.cpp $(pkg-config --cflags --libs wisp) -o smoke
//     ./smoke smoke.pfm [BYTES]        a ceiling of the memory
//
// The picture is that of `wisp render smoke.aff`, bit for bit.
#include "example.h"
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

namespace {

// A ball of points in ascending order of x, y and z. The core wants the smallest smoothing length from 1 to 2, and the
// smoke about the origin: scale and move points of your own.
std::vector<wisp::Particle> ball() {
    std::vector<wisp::Particle> points;
    for (int x = -3; x <= 3; ++x)
        for (int y = -3; y <= 3; ++y)
            for (int z = -3; z <= 3; ++z)
                if (x * x + y * y + z * z <= 9) points.push_back({{1.0 * x, 1.0 * y, 1.0 * z}, 1, 1}); // h and area 1
    return points;
}

bool print_progress(void *context, wisp::Stage stage, uint64_t done, uint64_t total) {
    const wisp::Plan &plan = *static_cast<const wisp::Plan *>(context);
    static unsigned long long last = 100;
    const unsigned long long percent = total > 0 ? 100 * done / total : 0;
    if (percent == last) return true; // it is called often
    last = percent;
    std::fprintf(stderr, "\r%-13s %3llu %%", plan[stage].name, percent);
    return true; // false would stop the work
}

int refuse(const wisp::Plan &plan) {
    const wisp::PlanRow *largest = plan.rows;
    for (const wisp::PlanRow &row : plan.rows)
        if (row.bytes > largest->bytes) largest = &row;
    std::fprintf(stderr, "smoke needs %llu bytes, most of them for this: %s\n",
                 static_cast<unsigned long long>(plan.arena_bytes), largest->name);
    return 4;
}

} // namespace

int main(int count, char **words) {
    if (count < 2) return std::fputs("usage: smoke PICTURE.pfm [BYTES]\n", stderr), 2;
    const std::vector<wisp::Particle> points = ball();
    const double dim = 1.0 / 16; // 2^-radiance_exponent: the brightest light and background are below 1
    wisp::SmokeDescription smoke = {};
    smoke.particles = points.data();
    smoke.count = static_cast<uint32_t>(points.size());
    smoke.smallest_h = smoke.largest_h = 1;
    smoke.total_area = static_cast<double>(points.size());
    smoke.albedo = {0.9, 0.9, 0.9};
    wisp::LightSource sun = {};
    sun.kind = wisp::LightKind::parallel;
    sun.direction = {-0.6, -0.8, 0};
    sun.color = {12 * dim, 11 * dim, 9 * dim};
    constexpr int size = 129;
    wisp::Scene scene = {};
    scene.camera = camera_at({0, 0, 10}, size);
    scene.background = {0.5 * dim, 0.6 * dim, 0.9 * dim};
    scene.radiance_exponent = 4;
    scene.lights = &sun;
    scene.light_count = 1;
    scene.smokes = &smoke;
    scene.smoke_count = 1;

    wisp::Settings settings = {};
    settings.crop = {0, 0, size, size};
    settings.samples = 4;
    settings.photons = 40000;
    settings.seed = 1;
    settings.method = wisp::Method::map;
    settings.irradiance = wisp::IrradianceMap::uniform;
    settings.density_step = settings.light_step = settings.irradiance_step = 0.5; // smoothing lengths
    settings.step = 1;

    const wisp::Renderer &renderer = wisp::f32::renderer; // or f64, fixed
    wisp::Plan plan = renderer.plan(scene, settings);
    if (count > 2 && plan.arena_bytes > std::strtoull(words[2], nullptr, 10)) return refuse(plan);
    const size_t bytes = static_cast<size_t>(plan.arena_bytes);
    const std::unique_ptr<unsigned char[]> block(new (std::nothrow) unsigned char[bytes]);
    if (!block) return refuse(plan);
    wisp::Arena arena(block.get(), bytes);
    std::vector<float> picture(size_t{3} * size * size);
    wisp::Statistics statistics;
    wisp::Job job = {scene, settings, arena, statistics, {&plan, print_progress}, picture.data()};
    const wisp::Status status = renderer.render(job);
    std::fprintf(stderr, "\r%-19s\n", status == wisp::Status::done ? "done" : "");
    if (status != wisp::Status::done)
        return std::fprintf(stderr, "not rendered: status %d\n", static_cast<int>(status)), 1;
    if (!write_pfm(words[1], picture.data(), size)) return std::perror(words[1]), 5;
    return 0;
}
