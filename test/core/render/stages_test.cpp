// The table of stages: what `plan` says is what a render does. A stage takes no more than its row says, and nothing
// where its row says no (the test build ends the process there, too).
#include "core/render/path_tracer.h"
#include "support/built_smoke.h"
#include "support/repeated_job.h"
#include "support/smoky_room.h"
#include "wisp/photon_sums.h"
#include <doctest/doctest.h>
#include <iterator>
#include <string>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

struct Run {
    Plan plan;
    Status status;
    Statistics statistics;

    uint64_t used(Stage stage) const { return statistics.bytes.stages[static_cast<uint32_t>(stage)]; }
};

// Renders in exactly the arena that is planned.
Run run(const Scene &scene, const Settings &settings) {
    Run run = {renderer.plan(scene, settings), Status::done, {}};
    std::vector<unsigned char> memory(run.plan.arena_bytes);
    Arena arena(memory.data(), memory.size());
    const size_t pixels = static_cast<size_t>(settings.crop.width() * settings.crop.height());
    std::vector<float> rgb(3 * pixels);
    std::vector<PixelSums> sums(pixels);
    std::vector<int64_t> photons(run.plan.map_sums);
    PhotonSums photon_sums = {photons.data(), photons.size(), 0};
    Job job = {scene, settings, arena, run.statistics, {}, rgb.data()};
    job.pixels = sums.data();
    job.batches = all_batches(settings);
    if (settings.goal == Goal::photons) job.photons = &photon_sums;
    run.status = renderer.render(job);
    return run;
}

void check_rows(const Run &run) {
    CHECK(run.status == Status::done);
    uint64_t sum = 0;
    for (uint32_t i = 0; i < stage_count; ++i) {
        const PlanRow &row = run.plan.rows[i];
        CAPTURE(std::string(row.name));
        CHECK(row.reason != nullptr);
        if (!row.needed) CHECK(row.bytes == 0);
        CHECK(run.statistics.bytes.stages[i] <= row.bytes);
        sum += row.bytes;
    }
    CHECK(run.plan.arena_bytes == sum);
    CHECK(run.statistics.bytes.arena_peak <= sum);
    CHECK(run.statistics.bytes.arena_size == sum);
}

const LightSource lamp = {LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 50, 50}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": every stage keeps to its row, whatever is asked for") {
    const auto particles = cloud(120, 3, 1, 0.3);
    int runs = 0;
    for (const bool lit : {false, true})
        for (const bool black : {false, true})
            for (const double asymmetry : {0.0, 0.5})
                for (const Goal goal : {Goal::picture, Goal::photons, Goal::reference})
                    for (const Method method : {Method::direct, Method::map, Method::volume})
                        for (const Estimate estimate : {Estimate::kernel, Estimate::knn})
                            for (const uint64_t photons : {0, 2000})
                                for (const double step : {0.0, 1.0}) {
                                    if (goal != Goal::picture && (step > 0 || estimate == Estimate::knn) &&
                                        method != Method::map)
                                        continue;
                                    LitSmoke smoke(particles);
                                    if (lit) smoke.light(lamp);
                                    smoke.smoke.asymmetry = asymmetry;
                                    if (black) smoke.smoke.albedo = {0, 0, 0};
                                    Settings settings = small_settings(3);
                                    settings.goal = goal;
                                    settings.method = method;
                                    settings.estimate = estimate;
                                    settings.photons = photons;
                                    settings.density_step = step;
                                    settings.light_step = step;
                                    settings.irradiance_step = 1;
                                    settings.irradiance =
                                        estimate == Estimate::knn ? IrradianceMap::none : IrradianceMap::uniform;
                                    settings.last_pass = 1;
                                    CAPTURE(lit);
                                    CAPTURE(black);
                                    CAPTURE(static_cast<int>(goal));
                                    CAPTURE(static_cast<int>(method));
                                    CAPTURE(static_cast<int>(estimate));
                                    CAPTURE(photons);
                                    CAPTURE(step);
                                    check_rows(run(smoke.scene, settings));
                                    ++runs;
                                }
    CHECK(runs > 100);
}

TEST_CASE(WISP_ARITH_NAME ": without photons nothing is gathered, and no memory is planned for it") {
    LitSmoke smoke(cloud(100, 3, 1, 0.3));
    smoke.light(lamp);
    Settings settings = small_settings(3);
    settings.method = Method::map;
    settings.deposit = Deposit::kernel;
    settings.direction = Direction::mean;
    settings.estimate = Estimate::knn;
    const Run none = run(smoke.scene, settings);
    check_rows(none);
    CHECK(!none.plan[Stage::gather].needed);
    settings.photons = 2000;
    const Run some = run(smoke.scene, settings);
    check_rows(some);
    CHECK(some.plan[Stage::gather].needed);
    CHECK(some.used(Stage::gather) > 0);
}

TEST_CASE(WISP_ARITH_NAME ": black smoke without light keeps no depths to lights") {
    LitSmoke smoke(cloud(100, 3, 1, 0.3));
    smoke.smoke.albedo = {0, 0, 0};
    Settings settings = small_settings(3);
    settings.method = Method::map;
    settings.density_step = settings.light_step = 0.5;
    settings.irradiance_step = 1;
    for (const bool lit : {false, true}) {
        if (lit) smoke.light(lamp);
        const Run dark = run(smoke.scene, settings);
        check_rows(dark);
        CHECK(!dark.plan[Stage::light_depths].needed);
        CHECK(dark.used(Stage::light_depths) == 0);
        CHECK(dark.used(Stage::bricks) > 0);
    }
    smoke.smoke.albedo = {0.5, 0.5, 0.5};
    const Run grey = run(smoke.scene, settings);
    check_rows(grey);
    CHECK(grey.plan[Stage::light_depths].needed);
    CHECK(grey.used(Stage::light_depths) > 0);
}

TEST_CASE(WISP_ARITH_NAME ": light cuts are built where their row says so, for one light as for two") {
    for (const size_t lights : {0, 1, 2}) {
        LitSmoke smoke(cloud(100, 3, 1, 0.3));
        for (size_t i = 0; i < lights; ++i) smoke.light(lamp);
        Settings settings = small_settings(3);
        settings.lights = LightChoice::cuts;
        const Run without = run(smoke.scene, settings);
        check_rows(without);
        CHECK(!without.plan[Stage::light_cuts].needed); // there is no surface
        Room room;
        room.add({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, room.material({}));
        for (size_t i = 0; i < lights; ++i) room.light(LightKind::point, {0, 0, 3}, {1, 1, 1});
        room.build();
        room.scene.camera = look_at_origin(12, 8, 3);
        const Run with = run(room.scene, settings);
        check_rows(with);
        CHECK(with.plan[Stage::light_cuts].needed == (lights > 0));
        CHECK((with.used(Stage::light_cuts) > 0) == (lights > 0));
        settings.lights = LightChoice::all;
        CHECK(!renderer.plan(room.scene, settings)[Stage::light_cuts].needed);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the reference's majorants have a row of their own") {
    LitSmoke smoke(cloud(100, 3, 1, 0.3));
    smoke.light(lamp);
    Settings settings = small_settings(3);
    settings.goal = Goal::reference;
    settings.last_pass = 2;
    const Run paths = run(smoke.scene, settings);
    check_rows(paths);
    CHECK(paths.plan[Stage::majorants].bytes == majorant_bytes(smoke.scene));
    CHECK(paths.used(Stage::majorants) > 0);
    CHECK(paths.plan[Stage::particle_tree].bytes == medium_bytes(smoke.scene, 0));
}

TEST_CASE(WISP_ARITH_NAME ": majorants of any box are planned, and hardly more") {
    Settings settings = small_settings(1);
    settings.goal = Goal::reference;
    settings.last_pass = 1;
    Sequence next{7};
    int divided = 0;
    const auto rendered = [&settings, &divided](Scene &scene) {
        scene.camera = look_at_origin(120, 8, 1);
        const Run paths = run(scene, settings);
        check_rows(paths);
        // How many cells hold smoke, of those that are divided, is known in the run alone.
        const uint64_t bytes = paths.plan[Stage::majorants].bytes, most = sizeof(Real) << 19;
        CHECK((bytes < paths.used(Stage::majorants) * 2 + 256 || (bytes >= most && bytes < most + 1024)));
        divided += bytes >= most ? 1 : 0;
    };
    for (int i = 0; i < 60; ++i) {
        CAPTURE(i);
        const double extent = i % 3 == 0 ? 1 + i / 3 : 0.1 + 20 * next();
        LitSmoke smoke(cloud(1 + i, extent, i % 2 ? 1 : 0.25 + next(), 0.3, uint64_t(i) + 1));
        smoke.light(lamp);
        rendered(smoke.scene);
        const double a = i % 4 ? pi_ * next() : 0;
        const SmokeDescription grid =
            grid_smoke_of({4 + i,
                           3,
                           5,
                           nullptr,
                           0.3,
                           {next(), 1, -2},
                           {2 + next(), 1, 3},
                           {{std::cos(a), std::sin(a), 0}, {-std::sin(a), std::cos(a), 0}, {0, 0, 1}}});
        const std::vector<LightSource> lights = {lamp};
        Scene scene = scene_of(grid, lights);
        rendered(scene);
    }
    CHECK(divided < 10);
}

TEST_CASE(WISP_ARITH_NAME ": density grids and boxes are smoke as particles are") {
    const float densities[] = {1, 2, 3, 4, 5, 6, 7, 8};
    for (const bool box : {false, true}) {
        const SmokeDescription grid = grid_smoke_of(
            {2, 2, 2, box ? nullptr : densities, 0.3, {0, 0, 0}, {1, 1, 1}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
        const std::vector<LightSource> lights = {lamp};
        Scene scene = scene_of(grid, lights);
        scene.camera = look_at_origin(12, 3, 24);
        Settings settings = small_settings(3);
        const Run smoke = run(scene, settings);
        check_rows(smoke);
        CHECK(smoke.plan.smoke);
        CHECK(smoke.plan[Stage::march].needed);
    }
    Settings settings = small_settings(3);
    LitSmoke none({});
    CHECK(!renderer.plan(none.scene, settings).smoke);
    CHECK(!renderer.plan(none.scene, settings)[Stage::march].needed);
}

TEST_CASE(WISP_ARITH_NAME ": what is kept serves no frame that differs in one setting") {
    using Change = void (*)(Settings &);
    const Change changes[] = {
        [](Settings &s) { s.density_step = 0.5; },
        [](Settings &s) { s.density_step = s.light_step = 0; },
        [](Settings &s) { s.light_step = 0.5; },
        [](Settings &s) { s.irradiance_step = 0.5; },
        [](Settings &s) { s.irradiance = IrradianceMap::none; },
        [](Settings &s) { s.irradiance = IrradianceMap::adaptive; },
        [](Settings &s) { s.method = Method::direct; },
        [](Settings &s) { s.method = Method::map; },
        [](Settings &s) { s.deposit = Deposit::path; },
        [](Settings &s) { s.deposit = Deposit::nodes; },
        [](Settings &s) { s.direction = Direction::mean; },
        [](Settings &s) { s.estimate = Estimate::knn; },
        [](Settings &s) { s.photons = 400; },
        [](Settings &s) { s.photons = 0; },
        [](Settings &s) { s.paths = 1; },
        [](Settings &s) { s.seed = 2; },
        [](Settings &s) { s.step = 0.3; },
        [](Settings &s) { s.gather = 20; },
        [](Settings &s) { s.gather_radius = 1; },
        [](Settings &s) { s.samples = 2; },
        [](Settings &s) { s.depth = 0; },
        [](Settings &s) { s.shadows = ShadowMethod::lie; },
        [](Settings &s) { s.lights = LightChoice::cuts; },
        [](Settings &s) { s.tree = TreeKind::kd; },
        [](Settings &s) { s.goal = Goal::reference, s.last_pass = 1; },
        [](Settings &s) { s.layers = true; },
        [](Settings &s) {
            s.crop = {1, 2, 5, 6};
        },
    };
    const Scenery room;
    int others = 0;
    for (const Way &way : {ways[0], ways[3], ways[6]}) {
        Settings first = settings_of(way, ShadowMethod::exact, 1);
        first.crop = {2, 1, 6, 5};
        first.photons = 300;
        RepeatedJob job(room.scene, first);
        for (size_t i = 0; i < std::size(changes); ++i) {
            CAPTURE(i);
            Settings second = first;
            changes[i](second);
            RepeatedJob changed(room.scene, second);
            std::vector<unsigned char> memory(std::max(job.plan().arena_bytes, changed.plan().arena_bytes));
            const auto made = [&](RepeatedJob &of, FrameCache *cache) {
                Arena arena(memory.data(), memory.size());
                CHECK(of.run(arena, cache) == Status::done);
                return of.made();
            };
            const std::string alone = made(job, nullptr), changed_alone = made(changed, nullptr);
            FrameCache cache = {};
            CHECK(made(job, &cache) == alone);
            cache.same_smoke = true;
            for (int k = 0; k < 2; ++k) {
                CHECK(made(changed, &cache) == changed_alone);
                CHECK(made(job, &cache) == alone);
            }
            others += alone != changed_alone;
        }
    }
    CHECK(others > 40);
}

TEST_CASE(WISP_ARITH_NAME ": smoke without particles changes no bit, beside smoke that has some") {
    const std::vector<Particle> one = cloud(80, 1.2, 0.5, 0.1), another = cloud(70, 1.2, 0.6, 0.08, 2), none;
    SmokeDescription smokes[] = {smoke_of(one), smoke_of(none), smoke_of(another), smoke_of(none)};
    for (const int i : {1, 3}) {
        smokes[i].albedo = {0.2, 0.4, 0.6};
        smokes[i].emission = {3, 2, 1};
        smokes[i].asymmetry = 0.8;
    }
    const SmokeDescription others[] = {smokes[0], smokes[2]};
    for (const bool surfaces : {false, true}) {
        Scenery room(surfaces);
        for (const Way &way : ways)
            for (const Goal goal : {Goal::picture, Goal::photons, Goal::reference})
                for (const uint32_t paths : {0, 2}) {
                    if (goal != Goal::picture && paths > 0) continue;
                    CAPTURE(surfaces);
                    CAPTURE(&way - ways);
                    CAPTURE(static_cast<int>(goal));
                    CAPTURE(paths);
                    Settings settings = settings_of(way, ShadowMethod::exact, 1);
                    settings.photons = 500;
                    settings.goal = goal;
                    settings.paths = paths;
                    settings.last_pass = 2;
                    settings.layers = goal == Goal::picture;
                    std::string made[2];
                    for (const bool with : {false, true}) {
                        room.scene.smokes = with ? smokes : others;
                        room.scene.smoke_count = with ? 4 : 2;
                        RepeatedJob job(room.scene, settings);
                        std::vector<unsigned char> memory(job.plan().arena_bytes);
                        Arena arena(memory.data(), memory.size());
                        REQUIRE(job.run(arena, nullptr) == Status::done);
                        made[with] = job.made();
                    }
                    CHECK(made[0] == made[1]);
                }
    }
}
