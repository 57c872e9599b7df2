// Voxel occlusion testing: when a voxel's state saves a ray.
#include "support/queried_room.h"

namespace wisp::WISP_ARITH {

TEST_CASE(WISP_ARITH_NAME ": a voxel that is proved lit or shadowed needs no ray from the second query on") {
    QueriedRoom room;
    const uint32_t white = room.material(matte({1, 1, 1}));
    room.add({-6, 0, -6}, {6, 0, -6}, {0, 0, 6}, white);                   // 0
    room.add({-2, 1, -2}, {-2, 1, 2}, {-0.2, 1, 2}, {-0.2, 1, -2}, white); // 1, 2: over x < 0
    room.light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, {0, -1, 0});
    room.build();
    room.use(ShadowMethod::voxel);
    const uint64_t &culled = room.statistics.rays.shadow_culled, &visits = room.statistics.shadow.traced.node_visits;
    const auto ask = [&](double x, double z, uint32_t triangle) {
        const uint64_t before[] = {culled, visits};
        room.ask(vec_of({x, 0, z}), 0, triangle);
        return culled == before[0] + 1 && visits == before[1];
    };
    CHECK(!ask(-1.23, 0.71, 0)); // nothing is known
    CHECK(ask(-1.23, 0.71, 0));  // all of the voxel is in shadow
    const uint32_t moving = room.scene.static_count;
    CHECK(ask(-1.23, 0.71, moving));
    CHECK(!ask(1.23, 0.71, 0));
    CHECK(ask(1.23, 0.71, 0));            // only the floor's own triangle may block rays
    CHECK(!ask(1.23, 0.71, moving)); // it is not that triangle
    CHECK(!ask(-0.2, 0.71, 0));
    CHECK(!ask(-0.2, 0.71, 0)); // the shadow's edge: always traced
    CHECK(!ask(9, 0.71, 0));
    CHECK(!ask(9, 0.71, 0)); // beside the grid
    CHECK(room.wrong == 0);
    CHECK(room.shadowed >= 3);
}

} // namespace wisp::WISP_ARITH
