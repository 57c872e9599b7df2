// Hard cases F of each arithmetic: the same bits however the work is divided, ranges of numbers, and how far the
// arithmetics differ. hard_cases_host_test.cpp has the others.
#include "host/base/renderers.h"
#include "host/images/picture.h"
#include "support/built_smoke.h"
#include "support/prepared_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <initializer_list>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

const std::vector<LightSource> two_lights = {{LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}},
                                             {LightKind::parallel, {0, 0, 0}, {0, -0.6, -0.8}, 0, {0.5, 0.5, 1}}};

SmokeDescription coloured(const std::vector<Particle> &particles) {
    SmokeDescription smoke = smoke_of(particles);
    smoke.albedo = {0.9, 0.8, 0.7};
    smoke.asymmetry = 0.4;
    return smoke;
}

struct StoredPhoton {
    Vec3 position, direction;
    Color power;
    bool operator==(const StoredPhoton &other) const {
        return position == other.position && direction == other.direction && power == other.power;
    }
};

// The photons of a map in the order in which they were stored.
std::vector<StoredPhoton> stored_photons(const PhotonMap &map) {
    std::vector<StoredPhoton> photons(map.tree.count);
    for (uint32_t slot = 0; slot < map.tree.count; ++slot)
        photons[map.tree.id[slot]] = {Vec3(map.tree.x[slot], map.tree.y[slot], map.tree.z[slot]), map.direction[slot],
                                      map.power[slot]};
    return photons;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case F1: tiles, batches and trees change no bit of picture or photon map") {
    const auto particles = cloud(200, 2.5, 1, 0.6);
    const SmokeDescription smoke = coloured(particles);
    const Scene scene = scene_of(smoke, two_lights);
    Settings settings = small_settings(16);
    settings.photons = 500;
    settings.samples = 2;
    settings.gather = 20;
    const Rendered whole = render_in_memory(scene, settings);
    REQUIRE(whole.status == Status::done);
    CHECK(*std::max_element(whole.rgb.begin(), whole.rgb.end()) > 0);
    for (int tile : {1, 2, 7, 16})
        for (int y = 0; y < 16; y += tile)
            for (int x = 0; x < 16; x += tile) {
                if (tile == 1 && x != y) continue; // pixels of the diagonal are enough
                Settings part = settings;
                part.crop = {x, y, std::min(x + tile, 16), std::min(y + tile, 16)};
                const Rendered picture = render_in_memory(scene, part);
                const int width = part.crop.x1 - x;
                for (int row = y; row < part.crop.y1; ++row)
                    CHECK(std::memcmp(&picture.rgb[size_t((row - y) * width * 3)], &whole.rgb[size_t(row * 16 + x) * 3],
                                      size_t(width) * 3 * sizeof(float)) == 0);
            }

    // Photons of a batch do not depend on the batches after it: the map of one batch is the beginning of the map of
    // more. (photon_sums_test.cpp traces batches apart, in any order.)
    settings.photons = batch_photons;
    const BuiltPhotons one_batch(scene, settings);
    settings.photons = batch_photons + 1000;
    const BuiltPhotons more_batches(scene, settings);
    const std::vector<StoredPhoton> first = stored_photons(one_batch.maps.per_smoke[0]),
                                    stored = stored_photons(more_batches.maps.per_smoke[0]);
    REQUIRE(first.size() == one_batch.statistics.photons.stored);
    REQUIRE(stored.size() == more_batches.statistics.photons.stored);
    REQUIRE(first.size() > 1000);
    REQUIRE(stored.size() > first.size());
    CHECK(std::equal(first.begin(), first.end(), stored.begin()));
    // The first photons of the second batch are none of the first one's.
    CHECK(std::find(first.begin(), first.end(), stored[first.size()]) == first.end());

    // The nearest photons by the tree are those of a search through all of them.
    std::vector<unsigned char> memory(gather_bytes(30) + 64);
    Arena arena(memory.data(), memory.size());
    const PointTree &tree = more_batches.maps.per_smoke[0].tree;
    Gather gather;
    REQUIRE(make_gather(30, arena, gather));
    Sequence next;
    size_t checked = 0;
    for (int i = 0; i < 50; ++i) {
        const double u = next(), v = next(), w = next();
        const Vec3 x = vec(6 * u - 3, 6 * v - 3, 6 * w - 3);
        std::vector<std::pair<Real, uint32_t>> all; // squared distance, id
        for (uint32_t id = 0; id < stored.size(); ++id) {
            const Vec3 d = stored[id].position - x;
            if (dot(d, d) < Real(1)) all.push_back({dot(d, d), id});
        }
        std::sort(all.begin(), all.end());
        if (all.size() > 30) all.resize(30);
        const Nearest found = nearest(tree, x, 30, Real(1), gather.scratch, gather.slot, gather.distance_squared);
        REQUIRE(found.count == all.size());
        std::vector<std::pair<Real, uint32_t>> by_tree;
        for (uint32_t k = 0; k < found.count; ++k)
            by_tree.push_back({gather.distance_squared[k], tree.id[gather.slot[k]]});
        std::sort(by_tree.begin(), by_tree.end());
        CHECK(by_tree == all);
        checked += found.count;
    }
    CHECK(checked > 500);
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case F5: kernels of any smoothing length stay in range, where their plain constants do "
          "not") {
    if constexpr (std::is_same_v<Real, Fixed>) {
        const Fixed spline(15 / (64 * 3.14159265358979)), poly6(315 / (64 * 3.14159265358979));
        const auto constant_of = [](Fixed c, Fixed h) { return c / h / h / h; };
        const auto ninth_power = [](Fixed h) {
            const Fixed cube = h * h * h;
            return cube * cube * cube;
        };
        CHECK(to_double(constant_of(spline, Fixed(3.4e-4))) ==
              doctest::Approx(0.0746038796 / 3.9304e-11).epsilon(1e-6));
        CHECK(to_double(constant_of(poly6, Fixed(9.1e-4))) ==
              doctest::Approx(1.5666814711 / 7.53571e-10).epsilon(1e-6));
        CHECK(constant_of(spline, Fixed(680)).raw() == 1);
        CHECK(constant_of(spline, Fixed(1000)).raw() == 0);
        CHECK(to_double(ninth_power(Fixed(10.8))) == doctest::Approx(1999004627.1).epsilon(1e-6));
        CHECK(ninth_power(Fixed(0.07)).raw() == 0);
        // What leaves the range saturates; this build traps it.
        const auto raw = [](Fixed x) { return x.raw(); };
        CHECK(detail::divide<detail::Wide>(raw(Fixed(1)), 1).raw == INT64_MAX);
        CHECK(detail::divide<detail::Wide>(raw(Fixed(-1)), 1).raw == INT64_MIN);
        CHECK(detail::multiply<detail::Wide>(raw(Fixed(65536)), raw(Fixed(32768))).raw == INT64_MAX);
        CHECK(detail::multiply<detail::Wide>(raw(Fixed(65536)), raw(Fixed(-32769))).raw == INT64_MIN);
#ifdef WISP_TRAP
        CHECK_THROWS(constant_of(spline, Fixed(3.2e-4)));
        CHECK_THROWS(constant_of(poly6, Fixed(8.9e-4)));
        CHECK_THROWS(ninth_power(Fixed(11)));
#endif
    }
    // A scene scaled by a power of two is the same picture: smoothing lengths from 2e-13 to 2e11.
    for (const std::string &kernel : {std::string("spline"), std::string("poly6")}) {
        std::vector<float> expected;
        for (int exponent : {0, -40, -12, 11, 40}) {
            const double size = std::ldexp(1.0, exponent);
            const auto number = [](double x) {
                char text[40];
                std::snprintf(text, sizeof text, " %.17g ", x);
                return std::string(text);
            };
            const std::string scene = "v from 0 0" + number(4 * size) +
                                      "at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 4 4\nb 0.1 0.2 0.3\nlp" +
                                      number(3 * size) + number(3 * size) + number(3 * size) +
                                      number(40 * size * size) + number(20 * size * size) + number(30 * size * size) +
                                      "\nsmoke p.vtk { kernel " + kernel + " radius" + number(0.1875 * size) + "mass" +
                                      number(size * size) + "extinction 0.03125 }";
            Settings settings = small_settings(4);
            settings.photons = 500;
            const PreparedSmoke prepared(scene, size);
            const Rendered picture = render_in_memory(prepared.scene(), settings);
            REQUIRE(picture.status == Status::done);
            if (exponent == 0) expected = picture.rgb;
            CAPTURE(exponent);
            CHECK(picture.rgb[15] != 0.1f);
            CHECK(std::memcmp(picture.rgb.data(), expected.data(), expected.size() * sizeof(float)) == 0);
        }
    }
    // Particles of very different sizes in one scene: each has its own density at its middle.
    for (Kernel kernel : {Kernel::spline, Kernel::poly6})
        for (double h : {1.0, 11.0, 700.0, 4000.0}) {
            const std::vector<Particle> both = {{{-4096, 0, 0}, h, h * h}, {{4096, 0, 0}, 1, 1}};
            const BuiltField built(smoke_of(both, kernel));
            const double constant = 3.14159265358979 * (kernel == Kernel::spline ? 8 / 15.0 : 64 * 8 / 315.0);
            // area W(0), where W(0) = 1 / (constant h^3). In fixed area c / h^2 is rounded before f(0) = 8
            // multiplies it, and 1 / h three times.
            const double found = at(extinction(built.field, vec(-4096, 0, 0))), expected = 1 / (constant * h);
            CAPTURE(h);
            CHECK(std::fabs(found - expected) <
                  (std::is_same_v<Real, Fixed> ? 10 * 0x1p-33 + 3 * h * 0x1p-33 * expected : 1e-6 * expected));
            CHECK(at(extinction(built.field, vec(4096, 0, 0))) == doctest::Approx(1 / constant).epsilon(1e-6));
        }
}

TEST_CASE(WISP_ARITH_NAME ": hard case F7: pictures of the arithmetics differ by at most 1 of 255, and little on the "
                          "whole") {
    // Each arithmetic with the next one: all three pairs.
    const Arithmetic mine = Arithmetic::WISP_ARITH;
    const Arithmetic other = mine == Arithmetic::f32   ? Arithmetic::f64
                             : mine == Arithmetic::f64 ? Arithmetic::fixed
                                                       : Arithmetic::f32;
    const auto particles = cloud(300, 2.5, 1, 0.3);
    const SmokeDescription smoke = coloured(particles);
    Scene scene = scene_of(smoke, two_lights);
    scene.camera = look_at_origin(12, 8, 24);
    scene.background = {0.2, 0.3, 0.5};
    Settings settings = small_settings(24);
    settings.photons = 8000;
    settings.gather = 100;
    const auto shown = [&](Arithmetic arithmetic) {
        std::vector<unsigned char> memory(renderer_of(arithmetic).plan(scene, settings).arena_bytes);
        Arena arena(memory.data(), memory.size());
        Picture picture = {24, 24, std::vector<float>(24 * 24 * 3)};
        Statistics statistics;
        REQUIRE(renderer_of(arithmetic).render({scene, settings, arena, statistics, {}, picture.rgb.data()}) ==
                Status::done);
        return srgb_bytes(picture);
    };
    const Bytes a = shown(mine), b = shown(other);
    int largest_difference = 0, brightest = 0;
    double squares = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const int difference = std::abs(a[i] - b[i]);
        largest_difference = std::max(largest_difference, difference);
        brightest = std::max<int>(brightest, a[i]);
        squares += difference * difference;
    }
    CHECK(brightest > 100);
    CHECK(brightest < 255);
    CHECK(largest_difference <= 1);
    CHECK(std::sqrt(squares / double(a.size())) < 0.2);
}
