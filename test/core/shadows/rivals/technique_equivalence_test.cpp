// Ways to find shadows whose results are those of tracing: every shadow and every picture.
#include "wisp/wisp.h"
#include "support/animated_room.h"
#include "support/shadow_queries.h"
#include "wisp/settings.h"
#include <memory>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t light_counts[] = {0, 1, 3, 15, 16, 40};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": every shadow is that of tracing, in every frame") {
    for (const ShadowMethod method : exact_methods) {
        CAPTURE(static_cast<int>(method));
        uint64_t asked = 0, wrong = 0, shadowed = 0;
        TreeCounts traced = {};
        uint64_t extra = 0, culled = 0, moving = 0;
        for (uint64_t seed = 0; seed < 60; ++seed) {
            const double sizes[] = {1, 16, 1024};
            RoomFrames room(seed, sizes[seed % 3], light_counts[seed % 6], method);
            room.recorded.on_query = [&](const ShadowQuery &query, bool found) {
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
        CHECK(asked > 100000);
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
            const bool lit = room.scene.light_count > 0; // there is nothing to keep without
            CHECK((block.size() > plain_block.size()) == lit);
            FrameCache kept = {}, plain_kept = {};
            Statistics statistics, plain_statistics;
            for (int frame = 0; frame < 3; ++frame) {
                CHECK(picture(room.scene, room.settings, block, statistics, kept) ==
                      picture(room.scene, plain, plain_block, plain_statistics, plain_kept));
                room.change();
            }
            CHECK(statistics.rays.shadow == plain_statistics.rays.shadow);
            CHECK((statistics.bytes.mode_words > 0) == lit);
            CHECK(plain_statistics.bytes.mode_words == 0);
            const std::vector<float> right = picture(room.scene, plain, plain_block, plain_statistics, plain_kept);
            for (size_t eighths = 0; eighths < 8; ++eighths) { // too little is said, or it suffices
                FrameCache none = {};
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
        FrameCache kept = {}, plain_kept = {};
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
    room.shadows.technique = &cache_technique;
    const auto ask = [&](double x, uint32_t light, uint32_t triangle, bool still) {
        const Vec3 from = vec_of({x, 0, 0.5}), way = room.tracer.lights[light].position - from;
        const Real far = length(way);
        return is_shadowed(room.shadows,
                           {{from, way / far}, far - room.surfaces.ray_epsilon, light, triangle, still, Real(0), Real(0), 0});
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

namespace {

// A room whose shadows are asked for one by one.
struct AskedRoom : Room {
    void ask_by(ShadowMethod method) {
        Settings settings = {};
        settings.shadows = method;
        block.resize(static_cast<size_t>(shadow_bytes(scene, settings)));
        Arena arena(block.data(), block.size());
        REQUIRE(make_shadow_memory(scene, settings, arena, shadows.memory));
        shadows.technique = find_technique(method);
        statistics = {};
        asked = shadowed = wrong = 0;
        REQUIRE(begin_frame(shadows, settings, arena));
    }
    void ask(const Vec3 &from, uint32_t light, uint32_t triangle) {
        const Illumination way = illuminate(tracer.lights[light], from, from, from);
        const ShadowQuery query = make_shadow_query(surfaces, from, light, way, triangle, {}, {}, 0);
        TreeCounts unused = {};
        const bool right = is_blocked(surfaces, query.ray, surfaces.ray_epsilon, query.end, triangle, unused);
        ++asked;
        shadowed += right;
        wrong += is_shadowed(shadows, query) != right;
    }
    // Points of every triangle, and everywhere, and of and about the lights.
    void ask_everywhere(uint64_t seed, double size) {
        Sequence next{seed};
        const uint32_t other = scene.static_count; // a triangle that moves
        const auto somewhere = [&](double part) {
            const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
            return Double3{x, y, z} * (part * size);
        };
        for (uint32_t l = 0; l < scene.light_count; ++l) {
            for (uint32_t i = 0; i < scene.static_count; ++i) {
                const Double3 *c = triangles[i].corner;
                for (const double u : {0.0, 0.5, 1.0, next()})
                    for (const double v : {0.0, 0.5, next()})
                        if (u + v <= 1) ask(vec_of(c[0] + (c[1] - c[0]) * u + (c[2] - c[0]) * v), l, i);
                ask(vec_of(c[0] * 1.25 - lights[l].position * 0.25), l, other); // seen behind its corners
            }
            for (int i = 0; i < 100; ++i) {
                ask(vec_of(somewhere(1.25)), l, other);
                ask(vec_of(lights[l].position + somewhere(1e-6)), l, other);
            }
            ask(vec_of(lights[l].position), l, other);
        }
    }

    std::vector<unsigned char> block;
    uint64_t asked = 0, shadowed = 0, wrong = 0;
};

// Lights in planes, at corners, inside and far off; triangles of all sizes, and such that are none.
void fill_awkwardly(AskedRoom &room, uint64_t seed, double size) {
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
    for (const ShadowMethod method : exact_methods) {
        CAPTURE(static_cast<int>(method));
        uint64_t tested = 0, culled = 0;
        for (uint64_t seed = 0; seed < 24; ++seed) {
            CAPTURE(seed);
            const double sizes[] = {1, 0.01, 200, 16};
            AskedRoom room;
            fill_awkwardly(room, seed, sizes[seed % 4]);
            room.ask_by(method);
            room.ask_everywhere(seed + 100, sizes[seed % 4]);
            CHECK(room.wrong == 0);
            CHECK(room.shadowed > room.asked / 10);
            CHECK(room.shadowed < room.asked);
            CHECK(room.statistics.rays.shadow == room.asked);
            tested += room.statistics.shadow.extra_tests;
            culled += room.statistics.rays.shadow_culled;
        }
        if (method != ShadowMethod::voxel) CHECK(tested > 1000);
        if (method != ShadowMethod::cache) CHECK(culled > 1000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": what has no room in the light buffer is traced") {
    for (const bool crowded : {true, false}) { // many triangles in a cell; too many in all
        CAPTURE(crowded);
        AskedRoom room;
        const uint32_t white = room.material(matte({1, 1, 1}));
        Sequence next{7};
        const auto point = [&](double part) {
            const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
            return Double3{x, y, z} * part;
        };
        add_floor(room, -1, 1, white);
        for (int i = 0; i < 700; ++i) {
            if (crowded) {
                const Double3 middle = Double3{0.41, -0.8, 0.33} + point(0.001);
                room.add(middle + point(0.001), middle + point(0.001), middle + point(0.001), white);
            } else {
                const Double3 a = point(1), b = point(1);
                room.add(a, b, a + point(0.02), white);
            }
        }
        room.light(LightKind::constant, {0.01, 0.02, 0.03}, {1, 1, 1});
        room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, unit(Double3{0.4, -0.8, 0.3}));
        room.build();
        room.ask_by(ShadowMethod::lightbuffer);
        room.ask_everywhere(3, 1);
        CHECK(room.wrong == 0);
        CHECK(room.statistics.shadow.traced.node_visits > 1000);
        CHECK(room.statistics.shadow.extra_tests > 1000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the light buffer asks what a light sees through a cell, as far as the point") {
    AskedRoom room;
    room.scene.ray_epsilon = 0.01;
    const uint32_t white = room.material(matte({1, 1, 1}));
    add_floor(room, -1, 2, white);                                                           // 0, 1
    room.add({-0.3, 0.5, 0.3}, {0.3, 0.5, 0.3}, {0.3, 0.5, -0.3}, {-0.3, 0.5, -0.3}, white); // 2, 3
    room.light(LightKind::constant, {0.01, 1, 0.02}, {1, 1, 1});
    room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, {0, -1, 0});
    room.light(LightKind::constant, {0.05, 0.505, 0.06}, {1, 1, 1}); // on 2 and 3, by less than the skin
    room.build();
    room.ask_by(ShadowMethod::lightbuffer);
    const Statistics &statistics = room.statistics;
    const uint64_t &extra = statistics.shadow.extra_tests, &culled = statistics.rays.shadow_culled;
    CHECK(statistics.shadow.proofs.triangle_tests == 0);
    for (const uint32_t light : {0u, 1u}) {
        CAPTURE(light);
        const uint64_t before = statistics.shadow.proofs.triangle_tests;
        room.ask(vec_of({1.7, -1, 1.6}), light, 0); // nothing but the floor is seen there
        CHECK(statistics.shadow.proofs.triangle_tests > before);
        const uint64_t made = statistics.shadow.proofs.triangle_tests;
        CHECK(extra == 0);
        CHECK(culled == 3 * light + 1);
        room.ask(vec_of({0.1, 0.75, 0.15}), light, 4); // all lies behind the point
        CHECK(extra == 0);
        CHECK(culled == 3 * light + 2);
        // Behind a triangle that covers the cell.
        room.ask(vec_of(light == 0 ? Double3{0.39, -1, 0.4} : Double3{0.15, -1, 0.16}), light, 0);
        CHECK(extra == 0);
        CHECK(culled == 3 * light + 3);
        CHECK(statistics.shadow.proofs.triangle_tests == made);
    }
    room.ask(vec_of({0.39, -1, 0.4}), 2, 0);
    CHECK(room.wrong == 0);
    CHECK(room.shadowed == 2);
    CHECK(statistics.shadow.traced.node_visits == 0);
    room.ask(vec_of({0.29, 0, 0.29}), 1, 4); // at an edge of it
    CHECK(extra > 0);
}

} // namespace wisp::WISP_ARITH
