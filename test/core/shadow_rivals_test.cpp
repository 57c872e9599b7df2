// Ways to find shadows whose results are those of tracing: every shadow and every picture.
#include "room_frames.h"
#include "wisp/render.h"
#include <memory>

namespace wisp::WISP_ARITH {

namespace {

constexpr ShadowMethod exact_methods[] = {ShadowMethod::cache, ShadowMethod::voxel, ShadowMethod::lightbuffer,
                                          ShadowMethod::lie};
constexpr uint32_t light_counts[] = {0, 1, 3, 15, 16, 40};

std::vector<float> picture(const Scene &scene, const Settings &settings, std::vector<unsigned char> &block,
                           Statistics &statistics, Kept &kept) {
    std::vector<float> rgb(static_cast<size_t>(room_pixels) * room_pixels * 3);
    Arena arena(block.data(), block.size());
    REQUIRE(render(scene, settings, arena, Observer{}, rgb.data(), statistics, nullptr, &kept) == Status::done);
    return rgb;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": every shadow is that of tracing, in every frame") {
    for (const ShadowMethod method : exact_methods) {
        CAPTURE(static_cast<int>(method));
        uint64_t asked = 0, wrong = 0, shadowed = 0;
        TreeCounts traced = {};
        uint64_t extra = 0, culled = 0, moving = 0;
        for (uint64_t seed = 0; seed < 120; ++seed) {
            const double sizes[] = {1, 16, 1024};
            RoomFrames room(seed, sizes[seed % 3], light_counts[seed % 6], method);
            room.heard.heard = [&](const ShadowQuery &query, bool found) {
                ++asked;
                shadowed += found;
                wrong += found != room.blocked(query);
            };
            for (int frame = 0; frame < 4; ++frame) {
                room.render_frame([](int, int, const Ray &) {});
                room.change();
            }
            traced.node_visits += room.statistics.shadow.traced.node_visits;
            extra += room.statistics.shadow.extra_tests;
            culled += room.statistics.rays.shadow_culled;
            moving += room.statistics.rays.shadow_dynamic_only;
        }
        CHECK(wrong == 0);
        CHECK(asked > 200000);
        CHECK(shadowed > asked / 10);
        CHECK(shadowed < asked);
        CHECK(traced.node_visits > 0);
        if (method != ShadowMethod::voxel) CHECK(extra > asked / 10);
        if (method == ShadowMethod::cache) continue;
        CHECK(culled > asked / 100);
        CHECK(moving > asked / 2000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": pictures are those of tracing, in every frame, within the planned bytes") {
    for (const ShadowMethod method : exact_methods)
        for (uint64_t seed = 500; seed < 530; ++seed) {
            CAPTURE(static_cast<int>(method));
            CAPTURE(seed);
            RoomFrames room(seed, 16, light_counts[seed % 6], method);
            Settings plain = room.settings;
            plain.shadows = ShadowMethod::trace;
            std::vector<unsigned char> block(static_cast<size_t>(plan(room.scene, room.settings).bytes.arena)),
                plain_block(static_cast<size_t>(plan(room.scene, plain).bytes.arena));
            CHECK(block.size() > plain_block.size());
            Kept kept = {}, plain_kept = {};
            Statistics statistics, plain_statistics;
            for (int frame = 0; frame < 3; ++frame) {
                CHECK(picture(room.scene, room.settings, block, statistics, kept) ==
                      picture(room.scene, plain, plain_block, plain_statistics, plain_kept));
                room.change();
            }
            CHECK(statistics.rays.shadow == plain_statistics.rays.shadow);
            CHECK(statistics.bytes.mode_words > 0);
            CHECK(plain_statistics.bytes.mode_words == 0);
            const std::vector<float> right = picture(room.scene, plain, plain_block, plain_statistics, plain_kept);
            for (size_t eighths = 0; eighths < 8; ++eighths) { // too little is said, or it suffices
                Kept none = {};
                Arena small(block.data(), block.size() * eighths / 8);
                std::vector<float> rgb(right.size());
                const Status status =
                    render(room.scene, room.settings, small, Observer{}, rgb.data(), statistics, nullptr, &none);
                CHECK((status == Status::out_of_memory || (status == Status::done && rgb == right)));
                CHECK((status == Status::out_of_memory || eighths > 0));
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": the number of lights may change from frame to frame") {
    for (const ShadowMethod method : exact_methods) {
        RoomFrames room(3, 16, 16, method);
        Settings plain = room.settings;
        plain.shadows = ShadowMethod::trace;
        std::vector<unsigned char> block(static_cast<size_t>(plan(room.scene, room.settings).bytes.arena));
        Kept kept = {}, plain_kept = {};
        Statistics statistics;
        for (const uint32_t count : {4u, 16u, 1u, 0u, 15u}) {
            room.scene.light_count = count;
            std::vector<unsigned char> plain_block(static_cast<size_t>(plan(room.scene, plain).bytes.arena));
            plain_kept = {};
            CHECK(picture(room.scene, room.settings, block, statistics, kept) ==
                  picture(room.scene, plain, plain_block, statistics, plain_kept));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": the cache tries the last occluder of a triangle and a light before the tree") {
    Room room;
    const uint32_t white = room.material(matte({1, 1, 1}));
    add_floor(room, 0, 10, white);
    room.add({-5, 4, 5}, {5, 4, 5}, {0, 4, -5}, white);
    room.light(LightKind::constant, {0, 8, 0}, {1, 1, 1}, {0, -1, 0});
    room.light(LightKind::constant, {0, 6, 0}, {1, 1, 1}, {0, -1, 0});
    room.build();
    Settings settings = {};
    settings.shadows = ShadowMethod::cache;
    std::vector<unsigned char> block(static_cast<size_t>(shadow_bytes(room.scene, settings)));
    Arena arena(block.data(), block.size());
    REQUIRE(make_shadow_memory(room.scene, settings, arena, room.shadows.memory));
    room.shadows.method = ShadowMethod::cache;
    const auto ask = [&](double x, uint32_t light, uint32_t triangle, bool still) {
        const Vec3 from = vec_of({x, 0, 0.5}), way = room.tracer.lights[light].position - from;
        const Real far = length(way);
        return is_shadowed(room.shadows,
                           {{from, way / far}, far - room.surfaces.skin, light, triangle, still, Real(0), Real(0)});
    };
    const uint64_t &extra = room.statistics.shadow.extra_tests, &visits = room.statistics.shadow.traced.node_visits;
    CHECK(ask(0, 0, 0, true)); // nothing is known
    CHECK(extra == 0);
    const uint64_t first = visits;
    CHECK(first > 0);
    CHECK(ask(0.5, 0, 0, true));
    CHECK(extra == 1);
    CHECK(visits == first);
    CHECK(ask(0.5, 1, 0, true)); // of another light, of another triangle, of one that moves
    CHECK(ask(0.5, 0, 1, true));
    CHECK(ask(0.5, 0, 8, false));
    CHECK(extra == 1);
    CHECK(visits > first);
    CHECK(!ask(9.5, 0, 0, true)); // tried in vain, and kept
    CHECK(extra == 2);
    const uint64_t before = visits;
    CHECK(ask(0.5, 0, 0, true));
    CHECK(extra == 3);
    CHECK(ask(0.5, 0, 7, false)); // what moves shares one
    CHECK(extra == 4);
    CHECK(visits == before);
    CHECK(room.statistics.rays.shadow == 8);
}

} // namespace wisp::WISP_ARITH
