// All smokes of a scene together: their bounds, their optical depth, and the nearest of their collisions.
#include "support/built_sparse_grid.h"

using namespace wisp;
using namespace wisp::WISP_ARITH;

TEST_CASE(WISP_ARITH_NAME ": the bounds and the sphere of a medium hold every smoke") {
    const SmokeLists all;
    for (const auto &list : all.lists) {
        const BuiltMedium built(list);
        const Medium &medium = built.medium;
        const double rounding = 1e3 * unit_error;
        for (uint32_t i = 0; i < medium.count; ++i) {
            const Box &box = medium.smokes[i].field.bounds();
            for (int k = 0; k < 3; ++k) {
                CHECK(medium.bounds.low[k] <= box.low[k]);
                CHECK(box.high[k] <= medium.bounds.high[k]);
            }
        }
        for (const SmokeDescription &smoke : list)
            for (uint32_t k = 0; k < smoke.count; ++k) {
                const Vec3 to_particle = vec_of(smoke.particles[k].position) - medium.sphere.center;
                CHECK(at(length(to_particle)) + 2 * smoke.particles[k].h <= at(medium.sphere.radius) + rounding);
            }
    }
}

TEST_CASE(WISP_ARITH_NAME ": optical depths of smokes add, and a photon collides with the nearest") {
    const SmokeLists all;
    const BuiltMedium built(all.lists[1]);
    const Medium &medium = built.medium;
    REQUIRE(medium.count == 2);
    Sequence next{5};
    int first = 0, second = 0;
    for (uint32_t i = 0; i < 2000; ++i) {
        // At particles of the first smoke and at points of the second in turn.
        const Vec3 offset = vec(next() - 0.5, next() - 0.5, next() - 0.5);
        const Vec3 aim = i % 2 ? vec_of(all.apart[i / 2 % all.apart.size()].position) + offset : offset * Real(6);
        const Vec3 direction = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375));
        const Ray ray = {aim - direction * Real(30), direction};
        const Real end = Real(60);
        CHECK(optical_depth(medium, ray, end) == (Real(0) + optical_depth(medium.smokes[0].field, ray, end)) +
                                                     optical_depth(medium.smokes[1].field, ray, end));
        const Event event = photon_event(i, 1);
        const MediumCollision nearest = first_collision(medium, ray, end, event);
        for (uint32_t s = 0; s < 2; ++s) {
            const Collision alone = first_collision(medium.smokes[s].field, ray, end, event);
            if (alone.found) CHECK(at(nearest.distance) <= at(alone.distance) + 1e3 * unit_error);
            if (nearest.found && nearest.smoke == s) CHECK(alone.found);
        }
        first += nearest.found && nearest.smoke == 0 ? 1 : 0;
        second += nearest.found && nearest.smoke == 1 ? 1 : 0;
    }
    CHECK(first > 20);
    CHECK(second > 20);
}

TEST_CASE(WISP_ARITH_NAME ": a medium without memory to be resampled is not ready") {
    const SmokeLists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 1);
        std::vector<unsigned char> memory(built.memory.size());
        Arena enough(memory.data(), memory.size());
        REQUIRE(make_medium(built.scene, 1, enough).ready);
        CHECK(enough.peak() <= enough.size());
        for (int size = 0; size < 64; ++size) {
            Arena arena(memory.data(), enough.peak() * static_cast<size_t>(size) / 64);
            CHECK(!make_medium(built.scene, 1, arena).ready);
        }
    }
}
