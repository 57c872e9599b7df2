// The radiance estimate of the photon map (S4-2). Hard cases D1 to D12 test its counts, radii and units.
#include "core/photons/photon_map.h"
#include "support/built_smoke.h"
#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <set>

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

TEST_CASE(WISP_ARITH_NAME
          ": each photon of a store that is thinned out is whole: its place, direction, power and smoke") {
    const std::vector<Particle> one = cloud(48, 1, 1, 0.3), another = cloud(30, 1, 0.8, 0.3, 2);
    SmokeDescription smokes[] = {smoke_of(one), smoke_of(another)};
    smokes[0].asymmetry = 0.5;
    smokes[1].asymmetry = -0.3;
    smokes[1].albedo = {0.9, 0.5, 0.7};
    const std::vector<LightSource> lights = {{LightKind::point, {0, 0, 0}, {0, 0, 1}, 2, {1, 0.5, 0.25}},
                                             {LightKind::point, {0.5, 0, 0}, {0, 0, 1}, 2, {0.25, 0.5, 1}}};
    Scene scene = scene_of(smokes[0], lights);
    scene.smokes = smokes;
    scene.smoke_count = 2;
    Settings settings = small_settings(2);
    settings.photons = 3000;
    const PhotonPlan plan = plan_photons(scene, settings);
    REQUIRE(plan.directions);
    REQUIRE(plan.powers);
    using Photon = std::array<double, 9>;
    const auto photons_of = [&](const BuiltPhotons &traced, uint32_t smoke) {
        REQUIRE(traced.maps.status == Status::done);
        const PhotonMap &map = traced.maps.per_smoke[smoke];
        std::multiset<Photon> photons;
        for (uint32_t i = 0; i < map.tree.count; ++i) {
            const Vec3 &to = map.direction[i];
            const Color &power = map.power[i];
            photons.insert({at(map.tree.x[i]), at(map.tree.y[i]), at(map.tree.z[i]), at(to.x), at(to.y), at(to.z),
                            at(power.x), at(power.y), at(power.z)});
        }
        return photons;
    };
    const BuiltPhotons all(scene, settings, plan);
    CHECK(all.statistics.photons.thinning == 0);
    PhotonPlan smaller = plan;
    smaller.capacity = all.statistics.photons.stored / 3;
    const BuiltPhotons thinned(scene, settings, smaller);
    CHECK(thinned.statistics.photons.thinning > 0);
    for (const uint32_t smoke : {0u, 1u}) {
        const std::multiset<Photon> whole = photons_of(all, smoke), part = photons_of(thinned, smoke);
        CHECK(part.size() > 50);
        CHECK(part.size() < whole.size());
        CHECK(std::includes(whole.begin(), whole.end(), part.begin(), part.end()));
    }
}
