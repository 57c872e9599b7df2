// Places drawn along a ray against their density, and that against what a light beside the ray sends along it.
#include "core/lights/equi_angular.h"
#include "support/built_smoke.h"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// A ray from a light's side to beyond it, and the distances between which places are drawn.
struct Passing {
    Ray ray;
    Vec3 light;
    double begin, end;
    EquiAngular places(double least, double greatest) const {
        return {light, ray, real(begin), real(end), real(least), real(greatest)};
    }
};
Passing passing(Sequence &next) {
    const Vec3 along = normalize(vec(next() - 0.5, next() - 0.5, next() + 0.1)), origin = vec(3, -2, 5);
    const double begin = next(), end = begin + 0.5 + 4 * next();
    // Some lights stand before the part of the ray, some after it.
    const Vec3 light = origin + along * real(6 * next() - 0.5) + vec(0.02 + next(), 0.3 * next(), 0);
    return {{origin, along}, light, begin, end};
}

// f at so many middles of equal parts, summed up.
template <class Function> double integral(const Passing &passing, double from, double to, Function f) {
    constexpr int parts = 4000;
    const double length = (to - from) * (passing.end - passing.begin);
    double sum = 0;
    for (int i = 0; i < parts; ++i)
        sum += f(passing.begin + (from + (to - from) * (i + 0.5) / parts) * (passing.end - passing.begin));
    return sum * length / parts;
}

// Light of 1 / r^2 that is scattered back along the ray at the distance t.
double scattered(const Passing &passing, double g, double t) {
    const Vec3 way = passing.ray.origin + passing.ray.direction * real(t) - passing.light;
    const double x = at(way.x), y = at(way.y), z = at(way.z), r = std::sqrt(x * x + y * y + z * z);
    const Vec3 &d = passing.ray.direction;
    const double cosine = -(x * at(d.x) + y * at(d.y) + z * at(d.z)) / r;
    return (1 - g * g) / (4 * pi_ * std::pow(1 + g * g - 2 * g * cosine, 1.5)) / (r * r);
}

constexpr struct {
    double least, greatest;
} phases[] = {{0, 0}, {0.8, 0.8}, {-0.6, -0.6}, {0, 0.9}, {-0.5, 0.5}, {0.95, 0.95}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": places along a ray come as their density says, whose integral is one") {
    Sequence next{11};
    for (const auto &phase : phases)
        for (int i = 0; i < 8; ++i) {
            CAPTURE(phase.greatest);
            CAPTURE(i);
            const Passing ray = passing(next);
            const EquiAngular places = ray.places(phase.least, phase.greatest);
            constexpr int bins = 8, samples = 4000;
            int found[bins] = {};
            Pcg32 generator(static_cast<uint64_t>(i));
            for (int n = 0; n < samples; ++n) {
                const double t = at(places.sample(generator));
                REQUIRE(t >= ray.begin - 1e-5);
                REQUIRE(t <= ray.end + 1e-5);
                const double part = (t - ray.begin) / (ray.end - ray.begin);
                ++found[std::clamp(static_cast<int>(part * bins), 0, bins - 1)];
            }
            double all = 0;
            for (int bin = 0; bin < bins; ++bin) {
                const double share = integral(ray, double(bin) / bins, double(bin + 1) / bins,
                                              [&](double t) { return at(places.density(real(t))); });
                CHECK(std::fabs(found[bin] - share * samples) < 5 * std::sqrt(samples * share) + 3);
                all += share;
            }
            CHECK(all == doctest::Approx(1).epsilon(2e-3));
        }
}

TEST_CASE(WISP_ARITH_NAME ": what a place stands for varies less than the phase of one smoke, and twice that of two") {
    Sequence next{12};
    for (const auto &phase : phases)
        for (const double g : {phase.least, phase.greatest})
            for (int i = 0; i < 8; ++i) {
                CAPTURE(g);
                const Passing ray = passing(next);
                const EquiAngular places = ray.places(phase.least, phase.greatest);
                const double all = integral(ray, 0, 1, [&](double t) { return scattered(ray, g, t); });
                double most = 0;
                for (int n = 0; n <= 1000; ++n) {
                    const double t = ray.begin + n / 1000.0 * (ray.end - ray.begin);
                    most = std::max(most, scattered(ray, g, t) / at(places.density(real(t))));
                }
                // Poisson's kernel leaves (1 + g^2 - 2 g cos)^-1/2 of the phase function: from 1 / (1 + |g|) to
                // 1 / (1 - |g|). The angle alone would leave the cube of that.
                const double widest = (1 + std::fabs(g)) / (1 - std::fabs(g));
                CHECK(most < (phase.least < phase.greatest ? 2 : 1) * widest * all * 1.01);
            }
}
