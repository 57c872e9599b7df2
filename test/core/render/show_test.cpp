// What stages have made, as a probe finds it: closed forms of fog and of shadows, flights that hang together, and no
// stage beyond the one that is asked for.
#include "support/built_sparse_grid.h"
#include "support/smoky_room.h"
#include "wisp/probe.h"
#include <cmath>
#include <map>

namespace wisp::WISP_ARITH {

namespace {

struct Answers {
    std::vector<float> values;
    std::vector<uint64_t> cells;
    std::vector<Mark> marks;
    Statistics statistics;
};

Answers ask(const Scene &scene, const Settings &settings, Quantity quantity, const std::vector<Double3> &points = {},
            uint32_t light = 0) {
    Answers answers = {};
    const size_t count = points.empty() ? settings.crop.pixels() : points.size();
    answers.values.resize(count, -7);
    answers.cells.resize(count, 7);
    std::vector<unsigned char> memory(renderer.plan(scene, settings).arena_bytes);
    std::vector<float> rgb(3 * settings.crop.pixels());
    Arena arena(memory.data(), memory.size());
    Job job = {scene, settings, arena, answers.statistics, {}, rgb.data()};
    const Probe probe = {
        quantity,
        light,
        points.data(),
        points.size(),
        answers.values.data(),
        answers.cells.data(),
        &answers.marks,
        [](void *marks, const Mark &mark) { static_cast<std::vector<Mark> *>(marks)->push_back(mark); }};
    REQUIRE(show(job, probe) == Status::done);
    return answers;
}

constexpr double sigma = 0.25;

// Fog from y = -1 to 1, under a light from straight above, seen from above.
struct Fog : Room {
    Fog() {
        light(LightKind::parallel, {}, {1, 1, 1}, {0, -1, 0});
        build();
        smoke = grid_smoke_of({1, 1, 1, nullptr, sigma, {0, 0, 0}, {8, 1, 8}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
        smoke.smallest_h = smoke.largest_h = 0.5;
        scene.smokes = &smoke;
        scene.smoke_count = 1;
        scene.camera = {{0, 5, 0}, {-0.5, -1, -0.5}, {1.0 / pixels, 0, 0}, {0, 0, 1.0 / pixels}};
    }
    SmokeDescription smoke;
};

double distance(const Double3 &a, const Double3 &b) {
    return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) + (a.z - b.z) * (a.z - b.z));
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": show: density and depths of fog are those of closed forms") {
    const Fog fog;
    const std::vector<Double3> points = {{0, 0, 0}, {3, 0.5, -2}, {-7, -0.875, 7}, {0, 1.5, 0}, {9, 0, 0}};
    for (const double step : {0.0, 1.0}) {
        CAPTURE(step);
        const Settings settings = brick_settings(pixels, step);
        const Answers density = ask(fog.scene, settings, Quantity::density, points);
        for (size_t i = 0; i < 3; ++i) CHECK(double{density.values[i]} == doctest::Approx(sigma).epsilon(1e-6));
        for (size_t i = 3; i < 5; ++i) CHECK(density.values[i] != density.values[i]); // nothing is there
        if (step > 0) {
            CHECK(density.cells[0] != 0);
            CHECK(density.cells[0] != density.cells[2]);
        }
        CHECK(density.cells[4] == 0);
        CHECK(density.statistics.rays.primary == 0); // the stages after it do not run

        const Answers depth = ask(fog.scene, settings, Quantity::optical_depth);
        for (int i = 0; i < pixels * pixels; ++i) {
            const double x = (i % pixels + 0.5) / pixels - 0.5, z = (i / pixels + 0.5) / pixels - 0.5;
            const double chord = 2 * std::sqrt(1 + x * x + z * z);
            CHECK(double{depth.values[static_cast<size_t>(i)]} == doctest::Approx(sigma * chord).epsilon(1e-5));
        }
    }
    const Answers to_light = ask(fog.scene, brick_settings(pixels, 1), Quantity::light_depth, points);
    for (size_t i = 0; i < 3; ++i)
        CHECK(double{to_light.values[i]} == doctest::Approx(sigma * (1 - points[i].y)).epsilon(1e-4));
    CHECK(to_light.values[3] != to_light.values[3]);
    CHECK(to_light.statistics.rays.primary == 0);
}

TEST_CASE(WISP_ARITH_NAME ": show: the depth along a ray ends with the first surface") {
    Fog fog;
    add_floor(fog, 0, 20, fog.material(matte({0.5, 0.5, 0.5})));
    fog.build();
    const Answers depth = ask(fog.scene, brick_settings(pixels, 1), Quantity::optical_depth);
    for (int i = 0; i < pixels * pixels; ++i) {
        const double x = (i % pixels + 0.5) / pixels - 0.5, z = (i / pixels + 0.5) / pixels - 0.5;
        CHECK(double{depth.values[static_cast<size_t>(i)]} ==
              doctest::Approx(sigma * std::sqrt(1 + x * x + z * z)).epsilon(1e-5));
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": show: photons collide as the statistics count, and each flight begins where the last ended") {
    const Scenery scenery;
    size_t checked = 0;
    for (const Way &way : ways) {
        CAPTURE(static_cast<int>(&way - ways));
        const Settings settings = settings_of(way);
        const Statistics of_picture = render_in_memory(scenery.scene, settings).statistics;
        const Answers photons = ask(scenery.scene, settings, Quantity::photons);
        const auto &counts = photons.statistics.photons;
        CHECK(counts.emitted == settings.photons);
        CHECK(counts.collisions == of_picture.photons.collisions); // who looks on changes nothing
        CHECK(counts.escaped == of_picture.photons.escaped);
        CHECK(photons.marks.size() == counts.collisions);
        CHECK(photons.statistics.smoke.march_samples == 0);

        const Answers flights = ask(scenery.scene, settings, Quantity::flights);
        std::map<uint64_t, std::vector<Mark>> paths;
        for (const Mark &mark : flights.marks) paths[mark.photon].push_back(mark);
        CHECK(paths.size() > settings.photons / 2);
        for (const auto &[photon, path] : paths) {
            CHECK(photon < settings.photons);
            for (size_t i = 1; i < path.size(); ++i) {
                CHECK(distance(path[i - 1].to, path[i].from) < 1e-3);
                ++checked;
            }
        }
    }
    CHECK(checked > 1000);
}

TEST_CASE(WISP_ARITH_NAME ": show: nodes of the irradiance map double with the light") {
    for (const Way &way : ways) {
        if (way.irradiance == IrradianceMap::none) continue;
        CAPTURE(static_cast<int>(&way - ways));
        Scenery scenery(true, false);
        const Settings settings = settings_of(way);
        const Answers once = ask(scenery.scene, settings, Quantity::nodes);
        for (LightSource &light : scenery.lights)
            light.color = {light.color.x * 2, light.color.y * 2, light.color.z * 2};
        const Answers twice = ask(scenery.scene, settings, Quantity::nodes);
        const auto sum_of = [](const Answers &answers) {
            double sum = 0;
            for (const Mark &mark : answers.marks) sum += mark.value;
            return sum;
        };
        CHECK(once.statistics.rays.primary == 0);
        CHECK(once.marks.size() > 100);
        CHECK(sum_of(twice) == doctest::Approx(2 * sum_of(once)).epsilon(0.01));
        double least = once.marks[0].value, most = least;
        for (const Mark &mark : once.marks) {
            CHECK(mark.size > 0);
            least = std::min(least, mark.value), most = std::max(most, mark.value);
        }
        CHECK(most > 2 * least);
        if (std::is_same_v<Real, Fixed>) continue; // there the least light of a node may round to none
        REQUIRE(once.marks.size() == twice.marks.size());
        for (size_t i = 0; i < once.marks.size(); ++i) {
            CHECK(distance(once.marks[i].to, twice.marks[i].to) == 0);
            CHECK(twice.marks[i].value == 2 * once.marks[i].value);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": show: proofs are true of the shadow of a plate") {
    Room room;
    const uint32_t grey = room.material(matte({0.5, 0.5, 0.5}));
    add_floor(room, 0, 4, grey);
    add_floor(room, 2, 1, grey);
    room.light(LightKind::parallel, {}, {1, 1, 1}, {0, -1, 0});
    room.build();
    constexpr int size = 96;
    room.scene.camera = {{0, 1.5, 6}, {-0.5, 0.3, -1}, {1.0 / size, 0, 0}, {0, -1.0 / size, 0}};
    Settings settings = small_settings(size);
    settings.shadows = ShadowMethod::exact;
    settings.samples = 16;
    const Answers proofs = ask(room.scene, settings, Quantity::proofs);
    std::map<uint64_t, float> state_of;
    size_t lit = 0, shadowed = 0;
    for (int i = 0; i < size * size; ++i) {
        const float value = proofs.values[static_cast<size_t>(i)];
        if (value != value) continue;
        const auto known = state_of.insert({proofs.cells[static_cast<size_t>(i)], value}).first;
        CHECK(known->second == value);
        const double down = 0.3 - (i / size + 0.5) / size, t = 1.5 / -down;
        REQUIRE(down < 0); // the background has no proof
        const double x = t * ((i % size + 0.5) / size - 0.5), z = 6 - t;
        const bool below = std::fabs(x) < 1 && std::fabs(z) < 1;
        const auto state = static_cast<CellState>(static_cast<int>(value));
        if (state == CellState::lit) CHECK(!below);
        if (state == CellState::shadowed) CHECK(below);
        lit += state == CellState::lit;
        shadowed += state == CellState::shadowed;
    }
    CHECK(lit > 1000);
    CHECK(shadowed > 100);
    // A technique that proves nothing has nothing to show.
    settings.shadows = ShadowMethod::trace;
    for (const float value : ask(room.scene, settings, Quantity::proofs).values) CHECK(value != value);
}

TEST_CASE(WISP_ARITH_NAME ": show: an arena that is too small is refused, and a stop is obeyed") {
    const Fog fog;
    const Settings settings = brick_settings(pixels, 1);
    std::vector<unsigned char> memory(renderer.plan(fog.scene, settings).arena_bytes);
    std::vector<Double3> points(1000);
    std::vector<float> values(points.size());
    std::vector<uint64_t> cells(points.size());
    Statistics statistics;
    const Probe probe = {Quantity::density, 0,       points.data(), points.size(), values.data(),
                         cells.data(),      nullptr, nullptr};
    Arena small(memory.data(), memory.size() / 8), whole(memory.data(), memory.size());
    CHECK(show({fog.scene, settings, small, statistics}, probe) == Status::out_of_memory);
    const Observer refuses = {nullptr, [](void *, Stage, uint64_t, uint64_t) { return false; }};
    CHECK(show({fog.scene, settings, whole, statistics, refuses}, probe) == Status::stopped);
}

} // namespace wisp::WISP_ARITH
