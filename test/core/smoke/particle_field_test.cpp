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

TEST_CASE(WISP_ARITH_NAME ": a distant origin costs no digits of the optical depth") {
    const auto particles = cloud(2000, 5, 1, 0.5);
    const BuiltField built(smoke_of(particles));
    const double near = at(optical_depth(built.field, ray_from(0.25, 0.5, 16, 0, 0, -1), Real(100)));
    const double far = at(optical_depth(built.field, ray_from(0.25, 0.5, 4096, 0, 0, -1), Real(8192)));
    CHECK(far == doctest::Approx(near).epsilon(1e-5));
}
