// The shadow cache: which occluder is tested first, and what that saves.
#include "core/shadows/shadows.h"
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

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
    const auto ask = [&](double x, uint32_t light, uint32_t triangle, bool is_static) {
        const Vec3 from = vec_of({x, 0, 0.5}), way = room.tracer.lights[light].position - from;
        const Real far = length(way);
        return is_shadowed(room.shadows, {{from, way / far},
                                          room.surfaces.ray_epsilon,
                                          far - room.surfaces.ray_epsilon,
                                          light,
                                          triangle,
                                          is_static,
                                          Real(0),
                                          Real(0),
                                          0});
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
