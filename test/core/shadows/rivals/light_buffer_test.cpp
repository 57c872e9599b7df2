// The light buffer: lists, covered cells, and what has no list.
#include "support/queried_room.h"
#include "support/shadow_queries.h"

namespace wisp::WISP_ARITH {

TEST_CASE(WISP_ARITH_NAME ": what has no room in the light buffer is traced") {
    for (const bool crowded : {true, false}) { // many triangles in a cell; too many in all
        CAPTURE(crowded);
        QueriedRoom room;
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
        room.use(ShadowMethod::lightbuffer);
        room.query_everywhere(3, 1);
        CHECK(room.wrong == 0);
        CHECK(room.statistics.shadow.traced.node_visits > 1000);
        CHECK(room.statistics.shadow.extra_tests > 1000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the light buffer asks what a light sees through a cell, as far as the point") {
    QueriedRoom room;
    room.scene.ray_epsilon = 0.01;
    const uint32_t white = room.material(matte({1, 1, 1}));
    add_floor(room, -1, 2, white);                                                           // 0, 1
    room.add({-0.3, 0.5, 0.3}, {0.3, 0.5, 0.3}, {0.3, 0.5, -0.3}, {-0.3, 0.5, -0.3}, white); // 2, 3
    room.light(LightKind::constant, {0.01, 1, 0.02}, {1, 1, 1});
    room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, {0, -1, 0});
    room.light(LightKind::constant, {0.05, 0.505, 0.06}, {1, 1, 1}); // on 2 and 3, by less than the skin
    room.build();
    room.use(ShadowMethod::lightbuffer);
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
