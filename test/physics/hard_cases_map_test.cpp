// Hard cases C13, C14, D6 and D7: the particle map.
#include "core/photons/packed_light.h"
#include "support/built_map.h"
#include "support/mixture.h"
#include "wisp/settings.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case C13: deposits have all the power of the photons") {
    const Mixture mixture;
    for (Deposit deposit : {Deposit::exact, Deposit::kernel}) {
        Settings settings = small_settings(6);
        settings.photons = 3000;
        settings.deposit = deposit;
        const TracedMap traced(mixture.scene, settings);
        int64_t expected[3] = {};
        uint64_t stored = 0;
        traced.trace_again(settings, [&](const MediumCollision &, const Photon &, const Color &power) {
            expected[0] += std::llround(at(power.x) * 0x1p24);
            expected[1] += std::llround(at(power.y) * 0x1p24);
            expected[2] += std::llround(at(power.z) * 0x1p24);
            ++stored;
        });
        int64_t found[3] = {};
        for (uint32_t s = 0; s < 3; ++s) {
            const Deposits &deposits = traced.map.per_smoke[s];
            REQUIRE(deposits.channels == 3);
            for (uint32_t i = 0; i < deposits.count * 3; ++i) found[i % 3] += deposits.power[i];
            CHECK((deposits.flux != nullptr) == (mixture.smokes[s].asymmetry != 0));
        }
        CHECK(stored > 1000);
        CHECK(traced.statistics.photons.stored == stored);
        CHECK(traced.statistics.photons.lost == 0);
        for (int c = 0; c < 3; ++c) CHECK(found[c] == expected[c]);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case C14: where all weights are 0 nothing is divided by 0, and the photon is counted as lost") {
    const std::vector<Particle> particles = {{{0, 0, 0}, 1, 2}};
    SmokeDescription smoke = smoke_of(particles, Kernel::poly6);
    smoke.asymmetry = 0.5;
    const BuiltMedium built({smoke});
    const DensityField &field = built.medium.smokes[0].field;
    for (Direction kept : {Direction::flux, Direction::mean}) {
        int64_t power[3] = {}, flux[3] = {};
        const Deposits deposits = {power, flux, 1, 3, kept};
        const auto deposits_at = [&](double x) {
            return deposit_by_kernel(deposits, field, vec(x, 0, 0), Color(Real(1)), vec(1, 0, 0));
        };
        CHECK(!deposits_at(2)); // poly6's own h is the support
        CHECK(!deposits_at(2.5));
        for (int c = 0; c < 3; ++c) CHECK((power[c] == 0 && flux[c] == 0));
        CHECK(deposits_at(1.9)); // however small the weight: the only particle gets all
        for (int c = 0; c < 3; ++c) CHECK(power[c] == int64_t{1} << 24);
        CHECK(flux[0] == int64_t{kept == Direction::mean ? 1 : 3} << 24);
    }

    // A box so dense and so far from 0 that photons collide on its faces. Rounding puts them inside or outside: each
    // photon is deposited whole or counted as lost.
    GridDescription box = {1, 1, 1, nullptr, unit_error < 1e-12 ? 1e13 : 2e9, {8000, 0, 0}, {0.3, 0.3, 0.3}, {}};
    box.axis[0] = {0.6, 0.8, 0};
    box.axis[1] = {-0.8, 0.6, 0};
    box.axis[2] = {0, 0, 1};
    smoke = grid_smoke_of(box);
    const std::vector<LightSource> lights = {{LightKind::point, {7998, 1, 2}, {0, 0, 1}, 2, {40, 40, 40}}};
    const Scene scene = scene_of(smoke, lights);
    Settings settings = small_settings(6);
    settings.photons = 2000;
    settings.deposit = Deposit::kernel;
    const TracedMap traced(scene, settings);
    const auto &photons = traced.statistics.photons;
    REQUIRE(traced.map.per_smoke[0].channels == 1);
    CHECK(photons.stored > 1000);
    CHECK(photons.lost > 0);
    CHECK(traced.map.per_smoke[0].power[0] == static_cast<int64_t>(photons.stored) << 24);
}

TEST_CASE(WISP_ARITH_NAME ": hard case D6: two opposite photons have the sum of their power and no mean direction") {
    const std::vector<Particle> particles = {{{0, 0, 0}, 1, 2}};
    SmokeDescription smoke = smoke_of(particles);
    for (double g : {0.0, 0.7}) {
        smoke.asymmetry = g;
        smoke.albedo = {1, 1, 1};
        const BuiltMedium built({smoke});
        const Scene scene = scene_of(smoke, {});
        for (Direction kept : {Direction::flux, Direction::mean}) {
            int64_t power = 0, flux[3] = {};
            Deposits deposits = {&power, g == 0 ? nullptr : flux, 1, 1, kept};
            const Vec3 directions[] = {normalize(vec(0.3, -0.7, 1)), -normalize(vec(0.3, -0.7, 1))};
            for (const Vec3 &direction : directions)
                CHECK(
                    deposit_by_kernel(deposits, built.medium.smokes[0].field, vec(1, 0, 0), Color(Real(1)), direction));
            CHECK(power == int64_t{2} << 24);
            const ParticleMap map = {&deposits, Color(Real(1)), {Real(1), 0}};
            PackedSums packed(scene, map);
            CHECK(at(packed.source(scene, built.medium, vec(0, 0, 12)).x) ==
                  doctest::Approx(2 / (4 * pi_) / 2).epsilon(1e-6));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D7: flux from rounding alone counts as isotropic, full flux as Henyey-Greenstein with g") {
    const std::vector<Particle> particles = {{{0, 0, 0}, 1, 2}};
    SmokeDescription smoke = smoke_of(particles);
    smoke.asymmetry = 0.7;
    smoke.albedo = {1, 1, 1};
    const BuiltMedium built({smoke});
    const Scene scene = scene_of(smoke, {});
    Direction kept = Direction::flux;
    const auto source = [&](int64_t along) { // the flux of two photons towards the eye, in units
        int64_t power = int64_t{2} << 24, flux[3] = {0, 0, along};
        Deposits deposits = {&power, flux, 1, 1, kept};
        const ParticleMap map = {&deposits, Color(Real(1)), {Real(1), 0}};
        return at(PackedSums(scene, map).source(scene, built.medium, vec(0, 0, 12)).x);
    };
    const auto p = [](double g) { return (1 + g) / (4 * pi_ * (1 - g) * (1 - g)); }; // forwards
    const int64_t all = int64_t{6} << 24; // |flux| of two photons of R + G + B = 3 in one direction
    CHECK(source(3) == doctest::Approx(1 / (4 * pi_)).epsilon(1e-6));
    CHECK(source(all) == doctest::Approx(p(0.7)).epsilon(1e-5));
    CHECK(source(all / 2) == doctest::Approx(p(0.7 * 256 / 511)).epsilon(1e-5)); // half, in units of an entry
    CHECK(source(all + 4) == doctest::Approx(p(0.7)).epsilon(1e-5));             // rounded up: no g above the medium's
    kept = Direction::mean;                                                      // of two directions
    CHECK(source(3) == doctest::Approx(1 / (4 * pi_)).epsilon(1e-6));
    for (int64_t along : {all / 3, all / 5, all / 600}) CHECK(source(along) == doctest::Approx(p(0.7)).epsilon(1e-5));
    CHECK(source(-all / 5) == doctest::Approx(1.7 * 0.3 / (4 * pi_ * std::pow(1.7, 3))).epsilon(1e-5));
    // The same in any direction, where rounding of a packed entry makes the flux longer.
    smoke.asymmetry = 0.9995;
    const BuiltMedium peaked({smoke});
    Sequence next{8};
    for (int i = 0; i < 50; ++i) {
        const Vec3 to = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.5));
        int64_t power = int64_t{2} << 24, flux[3];
        for (int c = 0; c < 3; ++c) flux[c] = std::llround(at(to[c]) * static_cast<double>(all));
        Deposits deposits = {&power, flux, 1, 1, Direction::flux};
        const ParticleMap map = {&deposits, Color(Real(1)), {Real(1), -20}};
        const double s = at(PackedSums(scene, map).source(scene, peaked.medium, to * Real(12)).x);
        CHECK(s > 0);
        CHECK(s < 1.001 * p(0.9995) * 0x1p-20);

        // A mean direction has the full g, even where rounding made its entry shorter.
        const Vec3 entry = normalize(unpack_flux(pack_flux(to)));
        Deposits mean = {&power, flux, 1, 1, Direction::mean};
        CHECK(at(PackedSums(scene, {&mean, Color(Real(1)), {Real(1), -20}})
                     .source(scene, peaked.medium, entry * Real(12))
                     .x) == doctest::Approx(p(0.9995) * 0x1p-20).epsilon(0.01));
    }
}
