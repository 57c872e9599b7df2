// Every stage asks the observer often, and ends where it says stop. What a stopped frame leaves changes no later
// picture.
#include "support/built_surfaces.h"
#include "support/repeated_job.h"
#include <doctest/doctest.h>
#include <initializer_list>
#include <map>
#include <type_traits>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

struct Call {
    Stage stage;
    uint64_t done, total;
};
struct Log {
    std::vector<Call> calls;
    size_t stop_after;
};

// A job in memory of its own.
class Stoppable : public RepeatedJob {
  public:
    Stoppable(const Scene &scene, const Settings &settings)
        : RepeatedJob(scene, settings), memory_(plan().arena_bytes) {}

    // Stops at the call of that number, from 1 on; 0: never.
    Status run(size_t stop_after, FrameCache *cache, Log &log) {
        log = {{}, stop_after};
        Arena arena(memory_.data(), memory_.size());
        const Observer observer = {&log, [](void *context, Stage stage, uint64_t done, uint64_t total) {
                                       Log &to = *static_cast<Log *>(context);
                                       to.calls.push_back({stage, done, total});
                                       return to.calls.size() != to.stop_after;
                                   }};
        const Status status = RepeatedJob::run(arena, cache, observer);
        if (status == Status::stopped) CHECK(arena.mark() == 0);
        return status;
    }

  private:
    std::vector<unsigned char> memory_;
};

// Whole, and stopped at every call, in f64 and fixed at every 25th. `working`: stages with more than trivial work.
void check(const Scene &scene, const Settings &settings, std::initializer_list<Stage> working) {
    Stoppable render(scene, settings);
    Log whole, log;
    FrameCache cache = {};
    REQUIRE(render.run(0, &cache, whole) == Status::done);
    const std::string picture = render.made();
    std::map<Stage, size_t> growths;
    for (size_t i = 0; i < whole.calls.size(); ++i) {
        const Call &call = whole.calls[i];
        CHECK(call.done <= call.total);
        if (i > 0 && call.stage == whole.calls[i - 1].stage) growths[call.stage] += call.done > whole.calls[i - 1].done;
    }
    for (const Stage stage : working) {
        CAPTURE(static_cast<int>(stage));
        CHECK(growths[stage] >= 10);
    }
    std::map<Stage, size_t> stopped;
    for (size_t k = 1; k <= whole.calls.size(); k += std::is_same_v<Real, float> ? 1 : 25) {
        cache = {};
        CAPTURE(k);
        const Stage stage = whole.calls[k - 1].stage;
        CAPTURE(static_cast<int>(stage));
        CHECK(render.run(k, &cache, log) == Status::stopped);
        CHECK(log.calls.size() == k); // nobody asks again
        CHECK(cache.frame == nullptr);
        const size_t before = stopped[stage]++;
        if (before != 0 && before != 7) continue;
        // A whole frame after it, the same smoke in the next frame that is stopped, too, and a whole one again.
        for (const bool stop : {false, true, false}) {
            const Status status = render.run(stop ? k : 0, &cache, log);
            CHECK(status == (stop && log.calls.size() == k ? Status::stopped : Status::done));
            if (!stop) CHECK(render.made() == picture);
            cache.same_smoke = true;
        }
    }
}

Settings settings_of(Method method) {
    Settings settings = small_settings(6);
    settings.method = method;
    settings.photons = 700;
    return settings;
}

const LightSource lamp = {LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 50, 50}};

struct Smoke : LitSmoke {
    explicit Smoke(uint32_t count) : LitSmoke(cloud(count, 3, 0.8, 0.1)) {
        smoke.albedo = {0.8, 0.7, 0.6};
        smoke.asymmetry = 0.2;
        light(lamp);
        light({LightKind::parallel, {0, 0, 0}, {0, 0, -1}, 2, {1, 2, 3}});
        scene.camera = look_at_origin(12, 8, 6);
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": stopping: resampled smoke") {
    Smoke smoke(300);
    Settings settings = settings_of(Method::map);
    settings.density_step = settings.light_step = 0.5;
    settings.irradiance = IrradianceMap::uniform;
    const std::initializer_list<Stage> working = {Stage::bricks, Stage::light_depths, Stage::photons, Stage::irradiance,
                                                  Stage::camera_rays};
    SUBCASE("uniform") { check(smoke.scene, settings, working); }
    SUBCASE("adaptive") {
        settings.irradiance = IrradianceMap::adaptive;
        check(smoke.scene, settings, working);
    }
    SUBCASE("photons alone") {
        settings.goal = Goal::photons;
        check(smoke.scene, settings, {Stage::bricks, Stage::light_depths, Stage::photons});
    }
    SUBCASE("random paths") {
        settings.paths = 3;
        check(smoke.scene, settings, {Stage::bricks, Stage::majorants, Stage::camera_rays});
    }
}

TEST_CASE(WISP_ARITH_NAME ": stopping: exact densities") {
    Smoke smoke(2000);
    Settings settings = settings_of(Method::direct);
    SUBCASE("photon map") { check(smoke.scene, settings, {Stage::particle_tree, Stage::photons, Stage::camera_rays}); }
    SUBCASE("particle map") {
        settings.method = Method::map;
        check(smoke.scene, settings, {Stage::particle_tree, Stage::photons, Stage::sources, Stage::camera_rays});
    }
    SUBCASE("irradiance of a photon map") {
        settings.irradiance = IrradianceMap::adaptive;
        settings.irradiance_step = 1;
        check(smoke.scene, settings, {Stage::particle_tree, Stage::photons, Stage::irradiance, Stage::camera_rays});
    }
    SUBCASE("reference") {
        settings.goal = Goal::reference;
        settings.first_pass = 0;
        settings.last_pass = 2;
        check(smoke.scene, settings, {Stage::particle_tree, Stage::majorants, Stage::camera_rays});
    }
}

TEST_CASE(WISP_ARITH_NAME ": stopping: surfaces by each way to find shadows") {
    Room room;
    const uint32_t grey = room.material({{0.1, 0.1, 0.1}, {0.6, 0.5, 0.4}, {0.2, 0.2, 0.2}, 10, 0, 1});
    for (int i = 0; i < 20; ++i)
        for (int j = 0; j < 20; ++j) {
            const double x = i * 0.3 - 3, y = j * 0.3 - 3, z = (i * 7 + j * 5) % 11 * 0.1;
            room.add({x, y, z}, {x + 0.3, y, z}, {x + 0.3, y + 0.3, z + 0.1}, {x, y + 0.3, z}, grey);
        }
    for (int i = 0; i < 40; ++i) room.light(LightKind::point, {i % 7 - 3.0, i % 5 - 2.0, i % 3 + 3.0}, {2, 2, 2});
    room.build();
    room.scene.camera = look_at_origin(12, 6, 6);
    Settings settings = settings_of(Method::map);
    settings.depth = 3;
    for (const ShadowMethod method :
         {ShadowMethod::trace, ShadowMethod::cache, ShadowMethod::paper, ShadowMethod::exact, ShadowMethod::voxel,
          ShadowMethod::lightbuffer, ShadowMethod::lie}) {
        CAPTURE(static_cast<int>(method));
        settings.shadows = method;
        check(room.scene, settings, {Stage::triangle_trees, Stage::camera_rays});
    }
    settings.lights = LightChoice::cuts;
    check(room.scene, settings, {Stage::triangle_trees, Stage::light_cuts, Stage::camera_rays});
}
