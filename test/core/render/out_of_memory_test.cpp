// Every allocation of the core that can fail is made to fail: the arena ends one byte before the end of each allocation
// that needs more of it than all before. Others cannot fail, as an arena does not shrink.
#include "support/animated_room.h"
#include "support/repeated_job.h"
#include "support/smoky_room.h"
#include <cstring>
#include <doctest/doctest.h>
#include <initializer_list>
#include <type_traits>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// A block with an odd address between guards. What lies behind the `size` bytes of an arena is guard, too.
class GuardedBlock {
  public:
    explicit GuardedBlock(size_t most) : bytes_(most + 2 * guard), most_(most) {}

    Arena arena(size_t size) {
        size_ = size;
        std::memset(bytes_.data(), mark, guard);
        std::memset(begin() + size, mark, most_ - size + guard);
        return Arena(begin(), size);
    }
    bool is_kept() const {
        const auto is_mark = [](unsigned char byte) { return byte == mark; };
        const auto end_of_guard = bytes_.begin() + guard;
        return std::all_of(bytes_.begin(), end_of_guard, is_mark) &&
               std::all_of(end_of_guard + static_cast<ptrdiff_t>(size_), bytes_.end(), is_mark);
    }

  private:
    static constexpr size_t guard = 4096 + 1;
    static constexpr unsigned char mark = 0xa5;
    unsigned char *begin() { return bytes_.data() + guard; }

    std::vector<unsigned char> bytes_;
    size_t most_, size_ = 0;
};

struct Frame {
    RepeatedJob &job;
    bool same_smoke;
    std::string undisturbed = {};
};

// Renders the frames in an arena of that size, with a cache. The result is the most of it that was in use.
size_t render_frames(std::vector<Frame> &frames, GuardedBlock &block, size_t size, size_t &failed) {
    FrameCache cache = {};
    size_t peak = 0;
    for (Frame &frame : frames) {
        Arena arena = block.arena(size);
        cache.same_smoke = frame.same_smoke;
        const Status status = frame.job.run(arena, &cache);
        CHECK(block.is_kept());
        peak = std::max(peak, arena.peak());
        if (status == Status::done) {
            CHECK(frame.job.made() == frame.undisturbed);
            continue;
        }
        CHECK(status == Status::out_of_memory);
        CHECK(cache.frame == nullptr);
        CHECK(arena.mark() == 0);
        CHECK(frame.job.made_nothing());
        ++failed;
    }
    CHECK(peak <= size);
    return peak;
}

// Whole in exactly the bytes that are planned; then with less and less, and whole again after each, in f64 and fixed
// after every 16th. The result is how many times an allocation has failed.
size_t check(std::vector<Frame> frames) {
    size_t planned = 0;
    for (Frame &frame : frames) planned = std::max<size_t>(planned, frame.job.plan().arena_bytes);
    GuardedBlock block(planned);
    for (Frame &frame : frames) {
        Arena arena = block.arena(frame.job.plan().arena_bytes);
        REQUIRE(frame.job.run(arena, nullptr) == Status::done);
        frame.undisturbed = frame.job.made();
        CHECK(!frame.job.made_nothing());
    }
    size_t all = 0, failed = 0;
    size_t peak = render_frames(frames, block, planned, failed);
    CHECK(failed == 0);
    for (int shortage = 0; peak > 0; ++shortage) {
        CAPTURE(peak);
        failed = 0;
        peak = render_frames(frames, block, peak - 1, failed);
        CHECK(failed > 0);
        all += failed;
        if (!std::is_same_v<Real, float> && shortage % 16 != 0) continue;
        failed = 0;
        render_frames(frames, block, planned, failed);
        CHECK(failed == 0);
    }
    return all;
}

// The scene twice: the second time with what lives on.
size_t check(const Scene &scene, const Settings &settings) {
    RepeatedJob job(scene, settings);
    return check({{job, false}, {job, true}});
}

constexpr Crop few_pixels = {2, 2, 5, 4};
const LightSource lamp = {LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 50, 50}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": out of memory: smoke among surfaces, by each way to render it, with layers") {
    const Scenery room;
    for (const Way &way : ways) {
        Settings settings = settings_of(way, ShadowMethod::exact, 1);
        settings.crop = few_pixels;
        settings.photons = 300;
        settings.layers = true;
        CHECK(check(room.scene, settings) > 10);
    }
}

TEST_CASE(WISP_ARITH_NAME ": out of memory: photons of each kind, and random paths") {
    LitSmoke smoke(cloud(120, 3, 0.8, 0.1));
    smoke.smoke.asymmetry = 0.4;
    smoke.light(lamp);
    smoke.light({LightKind::parallel, {0, 0, 0}, {0, 0, -1}, 2, {1, 2, 3}});
    Settings settings = small_settings(3);
    settings.photons = 300; // with fewer, none may be scattered twice
    settings.method = Method::map;
    settings.irradiance_step = 1;
    for (const Goal goal : {Goal::picture, Goal::photons})
        for (const Deposit deposit : {Deposit::exact, Deposit::path, Deposit::kernel})
            for (const Direction direction : {Direction::flux, Direction::mean}) {
                settings.goal = goal;
                settings.deposit = deposit;
                settings.direction = direction;
                CHECK(check(smoke.scene, settings) > 5);
            }
    settings.density_step = settings.light_step = 1;
    settings.irradiance = IrradianceMap::uniform;
    for (const Goal goal : {Goal::picture, Goal::photons}) {
        settings.goal = goal;
        CHECK(check(smoke.scene, settings) > 5);
    }
    settings.goal = Goal::picture;
    settings.paths = 2;
    CHECK(check(smoke.scene, settings) > 5);
    settings.paths = 0;
    smoke.smoke.emission = {1, 2, 3};
    CHECK(check(smoke.scene, settings) > 5);
}

TEST_CASE(WISP_ARITH_NAME ": out of memory: the reference, of smoke, of surfaces and of both") {
    Scenery both;
    Scene smoke = both.scene, surfaces = both.scene;
    smoke.static_count = 0;
    surfaces.smoke_count = 0;
    for (const Scene &scene : {both.scene, smoke, surfaces}) {
        Settings settings = settings_of(ways[0], ShadowMethod::exact, 1);
        settings.crop = few_pixels;
        settings.goal = Goal::reference;
        settings.last_pass = 2;
        for (const bool layers : {false, true}) {
            settings.layers = layers;
            CHECK(check(scene, settings) > 5);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": out of memory: grids and boxes") {
    std::vector<float> densities;
    for (int i = 0; i < 6 * 5 * 4; ++i) densities.push_back(static_cast<float>(i % 7));
    for (const bool box : {false, true}) {
        const SmokeDescription grid = grid_smoke_of(
            {6, 5, 4, box ? nullptr : densities.data(), 0.3, {0, 0, 0}, {2, 2, 1}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
        const std::vector<LightSource> lights = {lamp};
        const Scene scene = scene_of(grid, lights);
        for (const Way &way : ways) {
            Settings settings = settings_of(way, ShadowMethod::exact, 1);
            settings.crop = few_pixels;
            settings.photons = 300;
            CHECK(check(scene, settings) > 5);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": out of memory: animated surfaces by each way to find shadows") {
    for (const ShadowMethod method :
         {ShadowMethod::trace, ShadowMethod::cache, ShadowMethod::paper, ShadowMethod::exact, ShadowMethod::voxel,
          ShadowMethod::lightbuffer, ShadowMethod::lie})
        for (const TreeKind tree : {TreeKind::bvh, TreeKind::kd})
            for (const LightChoice lights : {LightChoice::all, LightChoice::cuts}) {
                CAPTURE(static_cast<int>(method));
                CAPTURE(static_cast<int>(tree));
                RoomFrames room(3, 16, 5, method);
                room.settings.check_shadows = false;
                room.settings.crop = few_pixels;
                room.settings.tree = tree;
                room.settings.lights = lights;
                CHECK(check(room.scene, room.settings) > 10);
            }
}

TEST_CASE(WISP_ARITH_NAME ": out of memory: in a frame with more smoke than the one before, and after it") {
    LitSmoke little(cloud(20, 2, 0.8, 0.1)), much(cloud(80, 2, 0.8, 0.1));
    for (LitSmoke *smoke : {&little, &much}) smoke->light(lamp);
    for (const Way &way : ways) {
        Settings settings = settings_of(way, ShadowMethod::exact, 1);
        settings.crop = few_pixels;
        settings.photons = 100;
        RepeatedJob first(little.scene, settings), second(much.scene, settings);
        CHECK(check({{first, false}, {second, false}, {second, true}, {first, false}}) > 20);
    }
}
