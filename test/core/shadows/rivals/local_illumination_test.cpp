// Local illumination environments: cells are divided until a list is short or a state is proved.
#include "support/queried_room.h"

namespace wisp::WISP_ARITH {

TEST_CASE(WISP_ARITH_NAME ": cells of an octree are divided until their rays need no tree") {
    for (const bool crowded : {false, true}) {
        CAPTURE(crowded);
        QueriedRoom room;
        const uint32_t white = room.material(matte({1, 1, 1}));
        add_floor(room, 0, 2, white);                                          // 0, 1
        room.add({-2, 1, -2}, {-2, 1, 2}, {-0.2, 1, 2}, {-0.2, 1, -2}, white); // 2, 3: over x < 0
        for (int i = 0; crowded && i < 20; ++i) {
            const double x = 1.5 + 0.02 * i;
            room.add({x, 0.5, -1.9}, {x + 0.01, 0.5, -1.9}, {x, 0.5, -1.8}, white);
        }
        room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, {0, -1, 0});
        room.build();
        room.use(ShadowMethod::lie);
        const Statistics &s = room.statistics;
        for (const double x : {-1.23, 1.23}) {
            const uint64_t before = s.shadow.traced.node_visits;
            room.ask(vec_of({x, 0, 0.71}), 0, 0);
            // Four triangles make a list at once; more divide the root, and the next ray looks at a child.
            if (crowded || x < 0) CHECK(s.shadow.traced.node_visits > before);
            for (int i = 0; i < 12; ++i) room.ask(vec_of({x, 0, 0.71}), 0, 0);
            const uint64_t visits = s.shadow.traced.node_visits, extra = s.shadow.extra_tests,
                           culled = s.rays.shadow_culled;
            for (int i = 0; i < 5; ++i) room.ask(vec_of({x, 0, 0.71}), 0, 0);
            CHECK(s.shadow.traced.node_visits == visits);
            CHECK(s.shadow.extra_tests + s.rays.shadow_culled >= extra + culled + 5);
        }
        CHECK(room.wrong == 0);
        CHECK(room.shadowed == 18);
    }
}

} // namespace wisp::WISP_ARITH
