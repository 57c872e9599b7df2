// The radiance estimate of the photon map (S4-2). Hard cases D1 to D12 test its counts, radii and units.
#include "core/photons/photon_map.h"
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

TEST_CASE(WISP_ARITH_NAME ": each photon is weighted with the phase function and its power") {
    std::vector<Vec3> points = {vec(0.1, 0, 0), vec(-0.1, 0, 0)};
    const Vec3 directions[] = {vec(1, 0, 0), vec(-1, 0, 0), vec(0, 0, 0), vec(0, 0, 0),
                               vec(0, 0, 0), vec(0, 0, 0),  vec(0, 0, 0), vec(0, 0, 0)};
    std::vector<unsigned char> memory(point_tree_bytes(2) + gather_bytes(10) + 8192);
    Arena arena(memory.data(), memory.size());
    PhotonMap map = {};
    map.tree = build_point_tree(points.data(), 2, arena);
    REQUIRE(map.tree.ready);
    Vec3 slot_directions[2];
    Color powers[2];
    for (uint32_t slot = 0; slot < 2; ++slot) {
        slot_directions[slot] = directions[map.tree.id[slot]];
        powers[slot] =
            map.tree.id[slot] == 0 ? Color(Real(1), Real(0), real(0.5)) : Color(Real(0), Real(1), real(0.25));
    }
    map.direction = slot_directions;
    map.power = powers;
    map.unit.unit = Real(1);
    Gather gather;
    REQUIRE(make_gather(10, arena, gather));
    Statistics statistics;
    const double g = 0.5, volume = 4 * pi_ / 3;
    const double forward = (1 - g * g) / std::pow(1 - g, 3) / (4 * pi_),
                 back = (1 - g * g) / std::pow(1 + g, 3) / (4 * pi_);
    const Color c = estimate_radiance(map, Phase(real(g)), vec(0, 0, 0), vec(1, 0, 0), Real(1), gather, statistics);
    CHECK(at(c.x) == doctest::Approx(forward / volume).epsilon(1e-5));
    CHECK(at(c.y) == doctest::Approx(back / volume).epsilon(1e-5));
    CHECK(at(c.z) == doctest::Approx((0.5 * forward + 0.25 * back) / volume).epsilon(1e-5));
}
