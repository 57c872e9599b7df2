// Neighbours and densities at particles, and the error of the density that the host reads from them.
#include "core/smoke/density_statistics.h"
#include "host/prepare/particle_report.h"
#include "support/built_smoke.h"
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

std::vector<DensityStatistics> neighbourhoods_of(const SmokeDescription &source) {
    std::vector<unsigned char> memory(density_statistics_bytes(source.count));
    Arena arena(memory.data(), memory.size());
    std::vector<DensityStatistics> found(source.count);
    REQUIRE(find_density_statistics(source, arena, found.data()));
    return found;
}

double squared_distance(const Double3 &a, const Double3 &b) {
    return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) + (a.z - b.z) * (a.z - b.z);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": the statistics of a particle are sums over all others") {
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        auto particles = cloud(500, 4, 1, 0.7);
        for (size_t i = 0; i < particles.size(); ++i) particles[i].h = 1 + 0.25 * static_cast<double>(i % 4);
        particles.push_back(particles.back()); // two at one position are neighbours
        const auto found = neighbourhoods_of(smoke_of(particles, kernel));
        for (size_t i = 0; i < particles.size(); ++i) {
            std::vector<Particle> others = particles;
            others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
            const Double3 &x = particles[i].position;
            uint32_t count = 0;
            for (const Particle &p : others) count += squared_distance(p.position, x) < 4 * p.h * p.h;
            const double density = brute_density(others, kernel, x.x, x.y, x.z);
            CHECK(found[i].neighbours == count);
            CHECK(std::fabs(found[i].density - density) < 40 * unit_error * (1 + density));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": statistics without memory, and without neighbours") {
    const std::vector<Particle> alone = {{{0, 0, 0}, 1, 0.5}};
    Arena nothing(nullptr, 0);
    DensityStatistics found;
    CHECK(!find_density_statistics(smoke_of(alone), nothing, &found));
    const auto of_alone = neighbourhoods_of(smoke_of(alone));
    CHECK(of_alone[0].neighbours == 0);
    CHECK(of_alone[0].density == 0);
    CHECK(std::isinf(density_error(smoke_of(alone), of_alone)));
}

// Particles drawn evenly: the error is sqrt(int W^2 / (n (int W)^2)), and so is the scatter of the density itself.
TEST_CASE(WISP_ARITH_NAME ": the estimated error of the density is the true one") {
    const double half = 15, n = 60000 / std::pow(2 * half, 3), pi = 3.14159265358979323846;
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const auto particles = cloud(60000, half, 1, 0.01, 7);
        const SmokeDescription smoke = smoke_of(particles, kernel);
        const auto found = neighbourhoods_of(smoke);
        // int W^2 by quadrature, h = 1.
        double square = 0;
        for (int i = 0; i < 2000; ++i) {
            const double r = (i + 0.5) / 1000;
            const double w = kernel == Kernel::spline ? 15 / (64 * pi) * std::pow(2 - r, 3)
                                                      : 315 / (512 * pi) * std::pow(1 - r * r / 4, 3);
            square += 4 * pi * r * r * w * w / 1000;
        }
        const double expected = std::sqrt(square / n);

        // Only particles inside, where no border reduces the density.
        std::vector<Particle> inside;
        std::vector<DensityStatistics> of_inside;
        for (size_t i = 0; i < particles.size(); ++i) {
            const Double3 &x = particles[i].position;
            if (std::max({std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)}) > half - 2) continue;
            inside.push_back(particles[i]);
            of_inside.push_back(found[i]);
        }
        const double estimated = density_error(smoke_of(inside, kernel), of_inside);
        // The number of 75 neighbours is known to half a per cent from 39,000 particles; the error goes with its root.
        CHECK(estimated == doctest::Approx(expected).epsilon(0.01));

        // The points cover at least 2,500 independent volumes of size 1 / int W^2, so the scatter is known to 1.4 %.
        const BuiltField built(smoke);
        Sequence next;
        double sum = 0, squares = 0;
        const int points = 20000;
        const auto coordinate = [&] { return (2 * next() - 1) * (half - 2); };
        for (int i = 0; i < points; ++i) {
            const double x = coordinate(), y = coordinate(), z = coordinate(),
                         density = at(extinction(built.field, vec(x, y, z)));
            sum += density / points;
            squares += density * density / points;
        }
        CHECK(std::sqrt(squares - sum * sum) / sum == doctest::Approx(estimated).epsilon(0.05));
    }
}
