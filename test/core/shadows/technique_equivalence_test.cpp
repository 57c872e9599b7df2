// Techniques whose answers are those of tracing: every shadow and every picture.
#include "wisp/wisp.h"
#include "support/animated_room.h"
#include "support/queried_room.h"
#include "support/shadow_queries.h"
#include "wisp/settings.h"
#include <memory>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t light_counts[] = {0, 1, 3, 15, 16, 40};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": every shadow is that of tracing, in every frame") {
    for (const ShadowMethod method : equivalent_methods) {
        CAPTURE(static_cast<int>(method));
        uint64_t queries = 0, wrong = 0, shadowed = 0;
        TreeCounts traced = {};
        uint64_t extra = 0, culled = 0, moving = 0;
        for (uint64_t seed = 0; seed < 60; ++seed) {
            const double sizes[] = {1, 16, 1024};
            RoomFrames room(seed, sizes[seed % 3], light_counts[seed % 6], method);
            room.recorded.on_query = [&](const ShadowQuery &query, bool found) {
                ++queries;
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
        CHECK(queries > 100000);
        CHECK(shadowed > queries / 10);
        CHECK(shadowed < queries);
        CHECK(traced.node_visits > 0);
        if (method != ShadowMethod::voxel) CHECK(extra > queries / 10);
        if (method == ShadowMethod::cache) continue;
        CHECK(culled > queries / 100);
        CHECK(moving > queries / 2000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": pictures are those of tracing, in every frame, within the planned bytes") {
    for (const ShadowMethod method : equivalent_methods)
        for (uint64_t seed = 500; seed < 530; ++seed) {
            CAPTURE(static_cast<int>(method));
            CAPTURE(seed);
            RoomFrames room(seed, 16, light_counts[seed % 6], method);
            Settings plain = room.settings;
            plain.shadows = ShadowMethod::trace;
            std::vector<unsigned char> block(static_cast<size_t>(renderer.plan(room.scene, room.settings).arena_bytes)),
                plain_block(static_cast<size_t>(renderer.plan(room.scene, plain).arena_bytes));
            const bool lit = room.scene.light_count > 0; // there is nothing to keep without
            CHECK((block.size() > plain_block.size()) == lit);
            FrameCache cache = {}, plain_cache = {};
            Statistics statistics, plain_statistics;
            for (int frame = 0; frame < 3; ++frame) {
                CHECK(picture(room.scene, room.settings, block, statistics, cache) ==
                      picture(room.scene, plain, plain_block, plain_statistics, plain_cache));
                room.change();
            }
            CHECK(statistics.rays.shadow == plain_statistics.rays.shadow);
            CHECK((statistics.bytes.stages[static_cast<uint32_t>(Stage::shadows)] > 0) == lit);
            CHECK(plain_statistics.bytes.stages[static_cast<uint32_t>(Stage::shadows)] == 0);
            const std::vector<float> right = picture(room.scene, plain, plain_block, plain_statistics, plain_cache);
            Settings other = plain;
            other.tree = plain.tree == TreeKind::bvh ? TreeKind::kd : TreeKind::bvh;
            std::vector<unsigned char> other_block(static_cast<size_t>(renderer.plan(room.scene, other).arena_bytes));
            FrameCache other_cache = {};
            CHECK(picture(room.scene, other, other_block, plain_statistics, other_cache) == right);
            for (size_t eighths = 0; eighths < 8; ++eighths) { // too little is said, or it suffices
                FrameCache none = {};
                Arena small(block.data(), block.size() * eighths / 8);
                std::vector<float> rgb(right.size());
                const Status status =
                    renderer.render({room.scene, room.settings, small, statistics, {}, rgb.data(), nullptr, &none});
                CHECK((status == Status::out_of_memory || (status == Status::done && rgb == right)));
                CHECK((status == Status::out_of_memory || eighths > 0));
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": pictures of what moves alone are those of tracing, and of what never moves") {
    for (const ShadowMethod method : equivalent_methods)
        for (const bool moving : {false, true})
            for (const uint64_t seed : {500, 501, 503, 504, 507}) {
                CAPTURE(static_cast<int>(method));
                CAPTURE(moving);
                CAPTURE(seed);
                RoomFrames room(seed, 16, light_counts[seed % 6], method);
                FrameCache cache = {}, plain_cache = {};
                Statistics statistics;
                std::vector<unsigned char> block, plain_block;
                const uint32_t still = room.scene.static_count;
                std::vector<Instance> instances;
                for (int frame = 0; frame < 3; ++frame) {
                    Scene scene = room.scene;
                    if (moving) {
                        scene.triangles += still;
                        scene.static_count = 0;
                        instances.assign(scene.instances, scene.instances + scene.instance_count);
                        for (Instance &instance : instances) instance.first -= still;
                        scene.instances = instances.data();
                    } else {
                        scene.instance_triangle_count = scene.instance_count = scene.deforming_count = 0;
                    }
                    Settings plain = room.settings;
                    plain.shadows = ShadowMethod::trace;
                    block.resize(static_cast<size_t>(renderer.plan(scene, room.settings).arena_bytes));
                    plain_block.resize(static_cast<size_t>(renderer.plan(scene, plain).arena_bytes));
                    const std::vector<float> found = picture(scene, room.settings, block, statistics, cache);
                    CHECK(found == picture(scene, plain, plain_block, statistics, plain_cache));
                    CHECK(std::any_of(found.begin(), found.end(), [&](float x) { return x != found[0]; }));
                    room.change();
                }
            }
}

TEST_CASE(WISP_ARITH_NAME ": the number of lights may change from frame to frame") {
    for (const ShadowMethod method : equivalent_methods) {
        RoomFrames room(3, 16, 16, method);
        Settings plain = room.settings;
        plain.shadows = ShadowMethod::trace;
        std::vector<unsigned char> block(static_cast<size_t>(renderer.plan(room.scene, room.settings).arena_bytes));
        FrameCache cache = {}, plain_cache = {};
        Statistics statistics;
        for (const uint32_t count : {4u, 16u, 1u, 0u, 15u}) {
            room.scene.light_count = count;
            std::vector<unsigned char> plain_block(static_cast<size_t>(renderer.plan(room.scene, plain).arena_bytes));
            plain_cache = {};
            CHECK(picture(room.scene, room.settings, block, statistics, cache) ==
                  picture(room.scene, plain, plain_block, statistics, plain_cache));
        }
    }
}

namespace {

// Lights in planes, at corners, inside and far off; triangles of all sizes, and such that are none.
void fill_degenerately(QueriedRoom &room, uint64_t seed, double size) {
    Sequence next{seed};
    const auto point = [&](double part) {
        const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
        return Double3{x, y, z} * (part * size);
    };
    const uint32_t white = room.material(matte({1, 1, 1})), clear = room.material(glass(1.5));
    room.scene.ray_epsilon = 4e-6 * size;
    const Double3 eye = point(0.5);
    const auto light = [&](const Double3 &at, const Double3 &way) {
        const LightKind kinds[] = {LightKind::constant, LightKind::point, LightKind::spot};
        room.light(kinds[room.lights.size() % 3], at, {1, 1, 1}, way);
    };
    add_floor(room, 0.25 * size, size, white);
    room.add({eye.x, 0, -size}, {eye.x, 0, size}, {eye.x - size, 0.1 * size, 0}, white); // an edge where cells begin
    room.add({eye.x, 0.1 * size, 0}, {eye.x, 0.1 * size, 0.1 * size}, {eye.x + size, 0.2 * size, 0}, white);
    const Double3 box = point(0.5), wide = {0.2 * size, 0.3 * size, 0.1 * size};
    add_box(room, box, wide, white);
    for (int i = 0; i < 60; ++i) {
        const double part = i % 3 == 0 ? 1e-5 : i % 3 == 1 ? 0.1 : 1;
        const Double3 middle = point(0.8), a = middle + point(part), b = middle + point(part), c = middle + point(part);
        room.add(a, b, i % 10 == 5 ? b : i % 10 == 6 ? (a + b) * 0.5 : c, i % 7 == 0 ? clear : white);
    }
    light(eye, {0, 1, 0});
    light(box, {0, -1, 0});                                   // inside of something
    light({0.3 * size, 0.25 * size, -0.2 * size}, {0, 1, 0}); // in the floor
    light({3 * size, 0.25 * size, 0}, {-1, 0, 0});            // in its plane
    light(room.triangles[20].corner[0], {0, 0, 1});
    light(room.triangles[21].corner[1], {0, 0, 1});
    light({size, 40 * size, size * 2}, {0, -1, 0});
    light({-9 * size, size, 7 * size}, {1, 0, -1});
    for (const Double3 &way : {Double3{0, -1, 0}, Double3{1, 0, 0}, Double3{0.6, 0, -0.8}, unit(Double3{1, -1, 1}),
                               unit(Double3{0.3, -0.2, 1e-6}), unit(point(1))})
        room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, way);
    room.build();
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": shadows are those of tracing where lights lie in planes, at corners, inside and far off") {
    for (const ShadowMethod method : equivalent_methods) {
        CAPTURE(static_cast<int>(method));
        uint64_t tested = 0, culled = 0;
        for (uint64_t seed = 0; seed < 24; ++seed) {
            CAPTURE(seed);
            const double sizes[] = {1, 0.01, 200, 16};
            QueriedRoom room;
            fill_degenerately(room, seed, sizes[seed % 4]);
            room.use(method);
            room.query_everywhere(seed + 100, sizes[seed % 4]);
            CHECK(room.wrong == 0);
            CHECK(room.shadowed > room.queries / 10);
            CHECK(room.shadowed < room.queries);
            CHECK(room.statistics.rays.shadow == room.queries);
            tested += room.statistics.shadow.extra_tests;
            culled += room.statistics.rays.shadow_culled;
        }
        if (method != ShadowMethod::voxel) CHECK(tested > 1000);
        if (method != ShadowMethod::cache) CHECK(culled > 1000);
    }
}

} // namespace wisp::WISP_ARITH
