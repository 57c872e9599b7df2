// Free paths in heterogeneous smoke: the depth at a collision is exponential, whatever the profile (N-E3, N-X).
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// Particles on the x axis that a ray crosses within [0, 1], scaled to an optical depth of 2.
std::vector<Particle> blobs(const std::vector<double> &centers, double h) {
    // On the axis one particle has the depth 15 / (8 pi h^2) of its cross-section.
    const double area = 2 / double(centers.size()) * 8 * 3.14159265358979 * h * h / 15;
    std::vector<Particle> particles;
    for (double x : centers) particles.push_back({{x, 0, 0}, h, area});
    return particles;
}

struct Paths {
    double through, mean; // the fraction that passes, the mean position of collisions
};

Paths free_paths(const std::vector<Particle> &particles, int photons) {
    const BuiltField built(smoke_of(particles));
    Paths paths = {0, 0};
    for (int i = 0; i < photons; ++i) {
        const Collision c = first_collision(built.field, {vec(0, 0, 0), vec(1, 0, 0)}, Real(1),
                                            photon_event(uint64_t(i) * 7919 + 1, 1));
        if (c.found)
            paths.mean += at(c.distance);
        else
            paths.through += 1;
    }
    paths.mean /= photons - paths.through;
    paths.through /= photons;
    return paths;
}

// The mean position of a collision on [0, 1], from the optical depth in closed form.
double exact_mean(const std::vector<Particle> &particles) {
    const BuiltField built(smoke_of(particles));
    double mean = 0, before = 1;
    const int n = 4000;
    for (int i = 1; i <= n; ++i) {
        const double through =
            std::exp(-at(optical_depth(built.field, {vec(0, 0, 0), vec(1, 0, 0)}, real(double(i) / n))));
        mean += (before - through) * (i - 0.5) / n;
        before = through;
    }
    return mean / (1 - before);
}

// The paper's rule: a free path of -ln(xi) / sigma_t with the extinction where the photon is.
double local_rule_through(const std::vector<Particle> &particles, int photons) {
    const BuiltField built(smoke_of(particles));
    const double sigma = at(extinction(built.field, vec(0, 0, 0)));
    int through = 0;
    for (int i = 0; i < photons; ++i) {
        const double xi = (draw(photon_event(uint64_t(i), 1), 0) + 0.5) * 0x1p-32;
        if (!(sigma > 0) || -std::log(xi) / sigma > 1) ++through;
    }
    return double(through) / photons;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": free paths follow the exact profile, and the paper's local rule does not") { // N-E3
    const int n = 40000;
    const double exact = std::exp(-2.0), bar = 4 * std::sqrt(exact * (1 - exact) / n);
    struct {
        std::vector<double> centers;
        double h;
    } const rows[] = {{{0.5}, 0.25}, {{0.25, 0.75}, 0.125}};
    for (const auto &row : rows) {
        const auto particles = blobs(row.centers, row.h);
        const Paths paths = free_paths(particles, n);
        const double mean = exact_mean(particles);
        if (row.centers.size() == 1) CHECK(mean == doctest::Approx(0.4315).epsilon(1e-3)); // of one blob (N-E3)
        CHECK(std::fabs(paths.through - exact) < bar);
        CHECK(std::fabs(paths.mean - mean) < 4 * 0.3 / std::sqrt(n * (1 - exact)));
        CHECK(local_rule_through(particles, n) == 1); // it never collides: there is no smoke where the photon starts
    }
}

TEST_CASE(WISP_ARITH_NAME ": the optical depth up to the collision is exponential") {
    // Through a random cloud, from outside and from inside: depth at the collision has the distribution 1 - e^-x, cut
    // at the depth of the whole segment (Kolmogorov-Smirnov).
    const auto particles = cloud(500, 3, 1, 1.5);
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const BuiltField built(smoke_of(particles, kernel));
        for (const Ray &ray : {Ray{vec(-8, 0.5, 0.25), normalize(vec(1, 0.1, -0.05))},
                               Ray{vec(0.5, 1, -1), normalize(vec(0.3, -1, 0.4))}}) {
            const double whole = at(optical_depth(built.field, ray, Real(100)));
            REQUIRE(whole > 1);
            std::vector<double> depths;
            const int n = 8000;
            for (int i = 0; i < n; ++i) {
                const Collision c = first_collision(built.field, ray, Real(100), photon_event(uint64_t(i), 9));
                if (c.found) depths.push_back(at(optical_depth(built.field, ray, c.distance)));
            }
            const double hit = 1 - std::exp(-whole);
            CHECK(std::fabs(double(depths.size()) / n - hit) < 4 * std::sqrt(hit * (1 - hit) / n));
            CHECK(distance_from_exponential(depths, whole) < 1.95); // 0.1 %
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": particles are hit in proportion to their extinction") { // N-X
    // Two particles that overlap.
    const std::vector<Particle> particles = {{{0, 0, 0}, 1, 2}, {{0.5, 0, 0}, 1, 1}};
    const BuiltField built(smoke_of(particles)), alone(smoke_of({particles[0]}));
    const Ray ray = {vec(-5, 0.25, 0), vec(1, 0, 0)};
    double expected = 0, hits = 0, found = 0;
    const int n = 40000;
    for (int i = 0; i < n; ++i) {
        const Collision c = first_collision(built.field, ray, Real(20), photon_event(uint64_t(i) * 31, 2));
        if (!c.found) continue;
        const Vec3 x = ray.origin + ray.direction * c.distance;
        expected += at(extinction(alone.field, x)) / at(extinction(built.field, x));
        hits += built.field.tree.id[c.element] == 0 ? 1 : 0;
        found += 1;
    }
    REQUIRE(found > 1000);
    CHECK(std::fabs(hits - expected) < 4 * std::sqrt(0.25 * found));
}
