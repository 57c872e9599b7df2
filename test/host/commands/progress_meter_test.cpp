// What part of a run is done: stages of a frame by their shares, frames among each other.
#include "host/commands/progress_meter.h"
#include <doctest/doctest.h>
#include <chrono>
#include <thread>

using namespace wisp;

TEST_CASE("progress: the part that is done grows from 0 to 1 over stages and frames, by the time that stages take") {
    RunProgress run(4);
    run.shares[static_cast<int>(Stage::photons)] = 3;
    run.shares[static_cast<int>(Stage::camera_rays)] = 1;
    CHECK(part_done(run, Stage::frame_cache, 0.5) == 0); // takes no time
    CHECK(part_done(run, Stage::photons, 0) == 0);
    CHECK(part_done(run, Stage::photons, 0.5) == doctest::Approx(0.375 / 4));
    CHECK(part_done(run, Stage::gather, 1) == doctest::Approx(0.75 / 4));
    CHECK(part_done(run, Stage::camera_rays, 1) == doctest::Approx(0.25));
    run.done = 3;
    CHECK(part_done(run, Stage::photons, 0) == doctest::Approx(0.75));
    CHECK(part_done(run, Stage::camera_rays, 1) == doctest::Approx(1));
}

TEST_CASE("progress: the time that is left goes by the stage at hand, however much longer than the others it takes") {
    RunProgress run(2);
    run.shares[static_cast<int>(Stage::photons)] = 1;
    run.shares[static_cast<int>(Stage::camera_rays)] = 3;
    double seconds[stage_count] = {};
    seconds[static_cast<int>(Stage::photons)] = 2;
    CHECK(seconds_left(run, Stage::photons, 0.5, seconds) == doctest::Approx(2 * (4 + 12) - 2));
    seconds[static_cast<int>(Stage::camera_rays)] = 60;
    CHECK(seconds_left(run, Stage::camera_rays, 0.1, seconds) == doctest::Approx(2 * (2 + 600) - 62));
    run.frames = 1;
    CHECK(seconds_left(run, Stage::camera_rays, 1, seconds) == doctest::Approx(0));
}

TEST_CASE("progress: a frame's shares are those that were measured in the frame before") {
    RunProgress run(2);
    Plan plan = {};
    plan.rows[static_cast<int>(Stage::photons)] = {"photons", "photons", StageGroup::photons, true, "", 0};
    plan.rows[static_cast<int>(Stage::camera_rays)] = {"camera rays", "render", StageGroup::render, true, "", 0};
    Options options;
    options.progress = Options::Progress::never;
    ProgressMeter meter(options, 0, plan, run);
    CHECK(run.shares[static_cast<int>(Stage::photons)] > 0);
    CHECK(run.shares[static_cast<int>(Stage::march)] == 0);
    const Observer observer = meter.observer();
    CHECK(observer(Stage::photons, 0, 10));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    CHECK(observer(Stage::camera_rays, 0, 10));
    meter.finish();
    CHECK(run.measured);
    CHECK(run.done == 1);
    CHECK(run.shares[static_cast<int>(Stage::photons)] >= 0.02);
    CHECK(run.shares[static_cast<int>(Stage::photons)] == meter.seconds(StageGroup::photons));
    CHECK(run.shares[static_cast<int>(Stage::camera_rays)] == meter.seconds(StageGroup::render));
    const double measured = run.shares[static_cast<int>(Stage::photons)];
    ProgressMeter next(options, 1, plan, run);
    CHECK(run.shares[static_cast<int>(Stage::photons)] == measured);
}
