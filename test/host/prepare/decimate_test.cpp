// Which particles are negligible, and where their mass goes.
#include "host/prepare/decimate.h"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;

namespace {

constexpr double pi = 3.14159265358979323846;

// A spline's cross-section for the depth of the line through its middle (N-L).
double area_of(double depth, double h = 1) { return depth * 8 * pi / 15 * h * h; }

// 27 particles about the origin, one to a unit.
std::vector<Particle> block(double depth) {
    std::vector<Particle> particles;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z) particles.push_back({{double(x), double(y), double(z)}, 1, area_of(depth)});
    return particles;
}

const Double3 eye = {0, 0, 30};

std::vector<Removal> removals_of(const std::vector<Particle> &particles, double epsilon,
                                 const std::vector<LightSource> &lights = {}) {
    return find_negligible({particles}, {SmokeDescription{}}, eye, lights, epsilon)[0];
}

bool has(const std::vector<Removal> &removals, uint32_t index) {
    return std::any_of(removals.begin(), removals.end(), [=](const Removal &r) { return r.index == index; });
}

} // namespace

TEST_CASE("thin: strays that hardly show go, and what shows stays") {
    auto particles = block(0.5);
    for (double x : {-15.0, 0.0, 12.0}) particles.push_back({{x, 10, -5}, 1, area_of(0.04)});
    particles.push_back({{5, -10, 0}, 1, area_of(0.06)}); // takes 5.8 % of a ray
    const auto removals = removals_of(particles, 0.05);
    REQUIRE(removals.size() == 3);
    for (uint32_t i = 0; i < 3; ++i) {
        CHECK(removals[i].index == 27 + i);
        CHECK(removals[i].mass_receiver == removals[i].index); // nobody is near
    }
    CHECK(removals_of(particles, 0.06).size() == 4);
    CHECK(removals_of(particles, 0.039).empty()); // 1 - e^-0.04 = 0.0392
}

TEST_CASE("thin: of equal particles strays go first") {
    // One behind the block as the eye sees it, one beside the way of the light to the block.
    auto particles = block(0.04);
    particles.push_back({{0, 0, -20}, 1, area_of(0.04)});
    particles.push_back({{-20, 0, 0.25}, 1, area_of(0.04)});
    std::vector<LightSource> light(1);
    light[0].kind = LightKind::parallel;
    light[0].direction = {1, 0, 0};
    const auto removals = removals_of(particles, 0.05, light);
    CHECK(has(removals, 27));
    CHECK(has(removals, 28));
}

TEST_CASE("thin: what is on one ray adds up") {
    // Three in a row, each alone within the bound, two of them together not.
    const std::vector<Particle> row = {
        {{0, 0, 20}, 1, area_of(0.04)}, {{0, 0, 5}, 1, area_of(0.04)}, {{0, 0, -10}, 1, area_of(0.04)}};
    CHECK(removals_of(row, 0.05).size() == 1);
    CHECK(removals_of(row, 0.09).size() == 2);
    CHECK(removals_of(row, 0.12).size() == 3);
    // Apart for the eye, in a row for a light of each kind.
    const std::vector<Particle> spread = {
        {{-15, 0, 0}, 1, area_of(0.04)}, {{0, 0, 0}, 1, area_of(0.04)}, {{15, 0, 0}, 1, area_of(0.04)}};
    CHECK(removals_of(spread, 0.05).size() == 3);
    for (LightKind kind : {LightKind::point, LightKind::spot, LightKind::constant, LightKind::parallel}) {
        LightSource light = {};
        light.kind = kind;
        light.position = {200, 0, 0};
        light.direction = {-1, 0, 0};
        CHECK(removals_of(spread, 0.05, {light}).size() == 1);
        // From between them, two are never on one ray; the middle one holds the light and stays.
        light.position = {0.5, 0, 0};
        if (kind == LightKind::parallel) continue;
        const auto removals = removals_of(spread, 0.05, {light});
        CHECK(removals.size() == 2);
        CHECK(!has(removals, 1));
    }
    // Blocks share the rays.
    const auto two = find_negligible({{row[0]}, {row[1]}}, {SmokeDescription{}, SmokeDescription{}}, eye, {}, 0.05);
    CHECK(two[0].size() + two[1].size() == 1);
}

TEST_CASE("thin: mass goes to the nearest neighbour that stays") {
    std::vector<Particle> particles = {{{0, 0, 0}, 1, area_of(0.5)},
                                       {{0.5, 0, 0}, 1, area_of(0.01)},
                                       {{1.5, 0, 0}, 1, area_of(0.5)},
                                       {{1.6, 0, 0}, 1, area_of(0.001)}, // nearer to the one before
                                       {{9, 0, 0}, 1, area_of(0.01)}};
    const auto removals = removals_of(particles, 0.05);
    REQUIRE(removals.size() == 3);
    CHECK(removals[0].index == 1);
    CHECK(removals[0].mass_receiver == 0);
    CHECK(removals[1].index == 3);
    CHECK(removals[1].mass_receiver == 2);
    CHECK(removals[2].index == 4);
    CHECK(removals[2].mass_receiver == 4);
    remove_particles(particles, removals);
    REQUIRE(particles.size() == 2);
    CHECK(particles[0].area == doctest::Approx(area_of(0.51)).epsilon(1e-12));
    CHECK(particles[1].area == doctest::Approx(area_of(0.501)).epsilon(1e-12));
}

TEST_CASE("thin: gifts that rays would notice are not made") {
    // The heir is narrow: the same mass is four times as deep there.
    std::vector<Particle> particles = {{{0, 0, 0}, 0.5, area_of(0.5, 0.5)}, {{0.5, 0, 0}, 1, area_of(0.02)}};
    auto removals = removals_of(particles, 0.05);
    REQUIRE(removals.size() == 1);
    CHECK(removals[0].mass_receiver == removals[0].index);
    removals = removals_of(particles, 0.1);
    REQUIRE(removals.size() == 1);
    CHECK(removals[0].mass_receiver == 0);
}

TEST_CASE("thin: nothing, particles without mass, and places that doubles cannot square") {
    CHECK(removals_of({}, 0.5).empty());
    auto particles = block(0.5);
    particles[13].area = 0;
    CHECK(removals_of(particles, 1e-6).size() == 1);
    particles.push_back({{1e200, 0, 0}, 1, 0});
    particles.push_back({{1e60, 0, 0}, 1e-60, 0});
    CHECK(!has(removals_of(particles, 0.5), 27));
    CHECK(has(removals_of(particles, 0.5), 28));
}
