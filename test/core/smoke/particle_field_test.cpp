// Density, optical depth and collisions of particles against closed forms, brute force and quadrature.
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

Ray ray_from(double x, double y, double z, double dx, double dy, double dz) {
    return {vec(x, y, z), normalize(vec(dx, dy, dz))};
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": density equals the sum over all particles") {
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const auto particles = cloud(3000, 6, 1, 0.7);
        const BuiltField built(smoke_of(particles, kernel));
        Sequence next;
        for (int i = 0; i < 400; ++i) {
            const double x = 14 * next() - 7, y = 14 * next() - 7, z = 14 * next() - 7;
            const Vec3 p = vec(x, y, z);
            const double expected = brute_density(particles, kernel, at(p.x), at(p.y), at(p.z));
            CHECK(std::fabs(at(extinction(built.field, p)) - expected) < 40 * unit_error * (1 + expected));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": optical depth equals quadrature of the density, on any segment") {
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const auto particles = cloud(300, 3, 1, 0.5);
        const BuiltField built(smoke_of(particles, kernel));
        Sequence next;
        for (int i = 0; i < 12; ++i) {
            const double ox = 8 * next() - 4, oy = 8 * next() - 4, oz = 8 * next() - 4;
            const double dx = next() - 0.5, dy = next() - 0.5, dz = next() - 0.5;
            const Ray ray = ray_from(ox, oy, oz, dx, dy, dz);
            const double end = i % 3 == 0 ? 40 : 5 * next();
            double expected = 0;
            const int n = 4000;
            for (int k = 0; k < n; ++k) {
                const double t = std::min(end, 14.0) * (k + 0.5) / n;
                expected += brute_density(particles, kernel, at(ray.origin.x) + t * at(ray.direction.x),
                                          at(ray.origin.y) + t * at(ray.direction.y),
                                          at(ray.origin.z) + t * at(ray.direction.z)) *
                            std::min(end, 14.0) / n;
            }
            CHECK(std::fabs(at(optical_depth(built.field, ray, real(end))) - expected) < 2e-6 + 200 * unit_error);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": particles of unlike smoothing lengths: density, depth, bound and finest equal brute force") {
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const auto particles = unlike_cloud(1000, 1024, 1024, 3e5);
        const BuiltField built(smoke_of(particles, kernel));
        CHECK(built.field.tree.has_radii);
        Sequence next;
        for (int i = 0; i < 300; ++i) {
            // Every other place lies within a particle.
            const Particle &near = particles[static_cast<size_t>(i) * 3];
            const auto place = [&](double middle) {
                return i % 2 == 0 ? middle + (next() - 0.5) * near.h : 2048 * next() - 1024;
            };
            const Vec3 p = vec(place(near.position.x), place(near.position.y), place(near.position.z));
            const double expected = brute_density(particles, kernel, at(p.x), at(p.y), at(p.z));
            const double error = 1000 * unit_error * (1 + expected);
            CHECK(std::fabs(at(extinction(built.field, p)) - expected) < error);
            CHECK(at(majorant(built.field, {p - Vec3(real(0.01)), p + Vec3(real(0.01))})) > expected - error);

            const Ray ray = {p, normalize(vec(next() - 0.5, next() - 0.5, next() - 0.5))};
            const double end = 500 * next(), o[3] = {at(p.x), at(p.y), at(p.z)},
                         d[3] = {at(ray.direction.x), at(ray.direction.y), at(ray.direction.z)};
            double depth = 0, finest = 1e9, margin = 1e9;
            for (const Particle &q : particles) {
                const BuiltField one(smoke_of({q}, kernel));
                depth += at(optical_depth(one.field, ray, real(end)));
                const double c[3] = {q.position.x - o[0], q.position.y - o[1], q.position.z - o[2]};
                const double t = std::clamp(c[0] * d[0] + c[1] * d[1] + c[2] * d[2], 0.0, end);
                const double apart = std::hypot(c[0] - t * d[0], c[1] - t * d[1], c[2] - t * d[2]);
                margin = std::min(margin, std::fabs(apart / (2 * q.h) - 1)); // where rounding may decide
                if (apart < 2 * q.h) finest = std::min(finest, q.h);
            }
            CHECK(std::fabs(at(optical_depth(built.field, ray, real(end))) - depth) < 2000 * unit_error * (1 + depth));
            if (margin > 1e-3)
                CHECK(at(finest_on_segment(built.field, ray, Real(0), real(end))) ==
                      doctest::Approx(finest < 1e9 ? 1 / finest : 0).epsilon(1e-4));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a distant origin costs no digits of the optical depth") {
    const auto particles = cloud(2000, 5, 1, 0.5);
    const BuiltField built(smoke_of(particles));
    const double near = at(optical_depth(built.field, ray_from(0.25, 0.5, 16, 0, 0, -1), Real(100)));
    const double far = at(optical_depth(built.field, ray_from(0.25, 0.5, 4096, 0, 0, -1), Real(8192)));
    CHECK(far == doctest::Approx(near).epsilon(1e-5));
}
