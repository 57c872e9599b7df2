// Hard cases of the particle map.
#include "built_map.h"
#include "mixture.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr double pi_ = 3.14159265358979323846;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case C13: no power is lost on its way to the particles") {
    const Mixture mixture;
    Settings settings = small_settings(6);
    settings.photons = 3000;
    const TracedMap traced(mixture.scene, settings);
    std::vector<Emitter> room(8);
    Arena arena(room.data(), room.size() * sizeof(Emitter));
    const Emitters emitters = find_emitters(traced.medium, traced.lights.data(), 2, arena);
    int64_t expected[3] = {};
    Statistics counted;
    for_each_photon(settings.seed, 0, settings.photons, [&](uint64_t key) {
        trace_photon(traced.medium, emitters, key, counted,
                     [&](const MediumCollision &, const Photon &, const Color &power) {
                         expected[0] += std::llround(at(power.x) * 0x1p24);
                         expected[1] += std::llround(at(power.y) * 0x1p24);
                         expected[2] += std::llround(at(power.z) * 0x1p24);
                         ++counted.photons.stored;
                     });
        return true;
    });
    int64_t found[3] = {};
    for (uint32_t s = 0; s < 3; ++s) {
        REQUIRE(traced.map.of_smoke[s].channels == 3);
        for (uint32_t i = 0; i < traced.map.of_smoke[s].count * 3; ++i) found[i % 3] += traced.map.of_smoke[s].power[i];
        CHECK((traced.map.of_smoke[s].flux != nullptr) == (mixture.smokes[s].asymmetry != 0));
    }
    CHECK(counted.photons.stored > 1000);
    CHECK(traced.statistics.photons.stored == counted.photons.stored);
    for (int c = 0; c < 3; ++c) CHECK(found[c] == expected[c]);
}

TEST_CASE(WISP_ARITH_NAME ": hard case D6: opposite photons have their power, and no direction") {
    const std::vector<Particle> particles = {{{0, 0, 0}, 1, 2}};
    SmokeSource smoke = smoke_of(particles);
    for (double g : {0.0, 0.7}) {
        smoke.asymmetry = g;
        smoke.albedo = {1, 1, 1};
        const BuiltMedium built({smoke});
        const Scene scene = scene_of(smoke, {});
        int64_t power = int64_t{2} << 24, flux[3] = {0, 0, 0};
        Deposits deposits = {&power, g == 0 ? nullptr : flux, 1, 1};
        const ParticleMap map = {&deposits, Color(Real(1)), {Real(1), 0}};
        PackedSums packed(scene, map);
        CHECK(at(packed.source(scene, built.medium, vec(0, 0, 12)).x) ==
              doctest::Approx(2 / (4 * pi_) / 2).epsilon(1e-6));
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case D7: a direction out of rounding is none, a whole one is Henyey and Greenstein's") {
    const std::vector<Particle> particles = {{{0, 0, 0}, 1, 2}};
    SmokeSource smoke = smoke_of(particles);
    smoke.asymmetry = 0.7;
    smoke.albedo = {1, 1, 1};
    const BuiltMedium built({smoke});
    const Scene scene = scene_of(smoke, {});
    const auto source = [&](int64_t along) { // flux of two photons towards the eye, in units
        int64_t power = int64_t{2} << 24, flux[3] = {0, 0, along};
        Deposits deposits = {&power, flux, 1, 1};
        const ParticleMap map = {&deposits, Color(Real(1)), {Real(1), 0}};
        return at(PackedSums(scene, map).source(scene, built.medium, vec(0, 0, 12)).x);
    };
    const auto p = [](double g) { return (1 + g) / (4 * pi_ * (1 - g) * (1 - g)); }; // forwards
    const int64_t all = int64_t{6} << 24; // |flux| of two photons of R + G + B = 3 in one direction
    CHECK(source(3) == doctest::Approx(1 / (4 * pi_)).epsilon(1e-6));
    CHECK(source(all) == doctest::Approx(p(0.7)).epsilon(1e-5));
    CHECK(source(all / 2) == doctest::Approx(p(0.7 * 256 / 511)).epsilon(1e-5)); // half, in units of an entry
    CHECK(source(all + 4) == doctest::Approx(p(0.7)).epsilon(1e-5));             // rounded up: no g above the medium's
    // Nor when the rounding of an entry makes it longer, in any direction.
    smoke.asymmetry = 0.9995;
    const BuiltMedium peaked({smoke});
    Sequence next{8};
    for (int i = 0; i < 50; ++i) {
        const Vec3 to = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.5));
        int64_t power = int64_t{2} << 24, flux[3];
        for (int c = 0; c < 3; ++c) flux[c] = std::llround(at(to[c]) * static_cast<double>(all));
        Deposits deposits = {&power, flux, 1, 1};
        const ParticleMap map = {&deposits, Color(Real(1)), {Real(1), -20}};
        const double s = at(PackedSums(scene, map).source(scene, peaked.medium, to * Real(12)).x);
        CHECK(s > 0);
        CHECK(s < 1.001 * p(0.9995) * 0x1p-20);
    }
}
