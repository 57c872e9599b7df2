// The sums of a particle map at the core's door: traced in parts, reused for other views, and refused when they cannot
// be right.
#include "wisp/wisp.h"
#include "core/photons/particle_map.h"
#include "support/mixture.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <cstring>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr uint64_t photons = 3 * batch_photons + 100;

// A scene, and memory for the sums of its photons.
struct Sums {
    explicit Sums(const Scene &scene_, const Settings &settings_)
        : scene(scene_), settings(settings_),
          values(renderer.plan(scene, settings).map_sums, -1), sums{values.data(), values.size(), 0} {}
    Status trace(const Batches &batches) {
        return use([&](Arena &arena) { return trace_batches(scene, settings, batches, arena, sums, statistics); });
    }
    Status render(const Scene &view, Settings how, std::vector<float> &rgb) {
        rgb.assign(static_cast<size_t>(3 * how.crop.x1 * how.crop.y1), -1);
        return use([&](Arena &arena) {
            return WISP_ARITH::renderer.render({view, how, arena, statistics, {}, rgb.data(), &sums});
        });
    }
    template <class Work> Status use(Work &&work) {
        std::vector<unsigned char> memory(renderer.plan(scene, settings).arena_bytes);
        Arena arena(memory.data(), memory.size());
        return work(arena);
    }
    Scene scene;
    Settings settings;
    std::vector<int64_t> values;
    PhotonSums sums;
    Statistics statistics;
};

Settings map_settings(Deposit deposit) {
    Settings settings = small_settings(5);
    settings.method = Method::map;
    settings.photons = photons;
    settings.deposit = deposit;
    return settings;
}

bool same(const Statistics::Photons &a, const Statistics::Photons &b) {
    return a.emitted == b.emitted && a.collisions == b.collisions && a.stored == b.stored && a.absorbed == b.absorbed &&
           a.escaped == b.escaped && a.blocked == b.blocked && a.capped == b.capped;
}

struct Scenes {
    Mixture mixture; // colours, flux, and a smoke that glows
    std::vector<Particle> particles = cloud(200, 2, 0.8, 0.2);
    SmokeDescription single_channel = smoke_of(particles); // all photons are alike
    std::vector<LightSource> lights = {{LightKind::point, {6, 5, 4}, {0, 0, 1}, 2, {40, 40, 40}}};
    Scene list[2] = {mixture.scene, scene_of(single_channel, lights)};
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": batches traced apart, in any order, give the sums and counts of one run") {
    const Scenes scenes;
    for (const Scene &scene : scenes.list)
        for (Deposit deposit : {Deposit::exact, Deposit::path}) {
            const Settings settings = map_settings(deposit);
            Sums whole(scene, settings), parts(scene, settings), half(scene, settings);
            CHECK(batch_count(photons) == 4);
            REQUIRE(whole.trace(all_batches(settings)) == Status::done);
            CHECK(whole.sums.count == whole.values.size());
            CHECK(whole.statistics.photons.emitted == photons);
            for (const Batches &batches : {Batches{3, 4}, Batches{0, 1}, Batches{1, 3}})
                REQUIRE(parts.trace(batches) == Status::done);
            CHECK(parts.values == whole.values);
            CHECK(same(parts.statistics.photons, whole.statistics.photons));
            REQUIRE(half.trace({0, 2}) == Status::done);
            CHECK(half.values != whole.values);
            CHECK(half.statistics.photons.emitted == 2 * batch_photons);
        }
}

TEST_CASE(WISP_ARITH_NAME ": a picture from stored sums is that of photons traced for it, from every view") {
    const Scenes scenes;
    for (const Scene &scene : scenes.list) {
        const Settings settings = map_settings(Deposit::exact);
        Sums traced(scene, settings), stored(scene, settings);
        const Rendered alone = render_in_memory(scene, settings);
        std::vector<float> rgb;
        REQUIRE(traced.render(scene, settings, rgb) == Status::done);
        CHECK(rgb == alone.rgb);
        CHECK(traced.statistics.photons.emitted == photons);
        REQUIRE(stored.trace(all_batches(settings)) == Status::done);
        CHECK(traced.values == stored.values);

        Scene other = scene;
        other.camera = look_at_origin(9, 7, 7);
        Settings wide = settings;
        wide.crop = {0, 0, 7, 3};
        wide.step = 0.25;
        const std::vector<int64_t> before = stored.values;
        stored.statistics = {};
        REQUIRE(stored.render(other, wide, rgb) == Status::done);
        CHECK(rgb == render_in_memory(other, wide).rgb);
        CHECK(rgb != alone.rgb);
        CHECK(stored.statistics.photons.emitted == 0);
        CHECK(stored.statistics.bytes.particle_map == alone.statistics.bytes.particle_map);
        CHECK(stored.values == before);
    }
}

TEST_CASE(WISP_ARITH_NAME ": sums of another number than the scene's are refused, and no picture is made") {
    const Scenes scenes;
    const Settings settings = map_settings(Deposit::exact);
    std::vector<float> rgb;
    const auto untouched = [&] { return rgb == std::vector<float>(rgb.size(), -1); };
    for (const Scene &scene : scenes.list) {
        Sums sums(scene, settings);
        REQUIRE(sums.trace({0, 1}) == Status::done);
        const uint64_t right = sums.sums.count;
        sums.values.resize(right + 1);
        sums.sums = {sums.values.data(), right + 1, 0};
        for (uint64_t wrong : {uint64_t{1}, right - 1, right + 1}) {
            sums.sums.count = wrong;
            CHECK(sums.render(scene, settings, rgb) == Status::size_mismatch);
            CHECK(untouched());
            CHECK(sums.trace({1, 2}) == Status::size_mismatch);
        }
        sums.sums = {sums.values.data(), right - 1, 0}; // too little room
        CHECK(sums.render(scene, settings, rgb) == Status::out_of_memory);
        CHECK(untouched());
    }
    // Sums of a scene that needs none.
    Settings none = settings;
    none.photons = 0;
    Sums sums(scenes.list[0], none);
    CHECK(sums.values.empty());
    CHECK(sums.render(scenes.list[0], none, rgb) == Status::done);
    int64_t number = 0;
    sums.sums = {&number, 1, 1};
    CHECK(sums.render(scenes.list[0], none, rgb) == Status::size_mismatch);
}

TEST_CASE(WISP_ARITH_NAME ": tracing ends before deposits that a sum might not hold") {
    const Scenes scenes;
    for (Deposit deposit : {Deposit::exact, Deposit::path}) {
        const Settings settings = map_settings(deposit);
        // The largest flux of a deposit: of R + G + B, or the largest deposit of a flight.
        const double largest = (deposit == Deposit::exact ? 3 : 127) * 0x1p24;
        const uint64_t limit = max_deposits(settings);
        CHECK(renderer.plan(scenes.list[0], settings).max_photons == limit);
        CHECK((static_cast<double>(limit) + 1e6) * largest < 0x1p63);
        CHECK(static_cast<double>(limit) * 2 * 127 * 0x1p24 > (deposit == Deposit::exact ? 0x1p67 : 0x1p63));
        Sums sums(scenes.list[0], settings);
        REQUIRE(sums.trace({0, 1}) == Status::done);
        const uint64_t deposits = sums.statistics.photons.stored + sums.statistics.photons.emitted;
        Sums fits(scenes.list[0], settings), full(scenes.list[0], settings);
        fits.statistics.photons.stored = limit - deposits;
        CHECK(fits.trace({0, 1}) == Status::done);
        full.statistics.photons.stored = limit - deposits + 1;
        CHECK(full.trace({0, 1}) == Status::overflow);
    }
}
