// Density, optical depth and collisions of particles against closed forms, brute force and quadrature.
#include "built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr double pi_ = 3.14159265358979323846;

// The density of all particles in double, from the definition (S3).
double brute_density(const std::vector<Particle> &particles, Kernel kernel, double x, double y, double z) {
    double sum = 0;
    for (const Particle &p : particles) {
        const double dx = p.position.x - x, dy = p.position.y - y, dz = p.position.z - z;
        const double r = std::sqrt(dx * dx + dy * dy + dz * dz), h = p.h;
        if (r >= 2 * h) continue;
        if (kernel == Kernel::spline)
            sum += p.area * 15 / (pi_ * std::pow(4 * h, 3)) * std::pow(2 - r / h, 3);
        else
            sum += p.area * 315 / (64 * pi_ * std::pow(2 * h, 3)) * std::pow(1 - r * r / (4 * h * h), 3);
    }
    return sum;
}

Ray ray_from(double x, double y, double z, double dx, double dy, double dz) {
    return {vec(x, y, z), normalize(vec(dx, dy, dz))};
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": one particle has the closed optical depth") { // C2
    for (double offset : {0.0, 1.0, 1.5, 1.9, 2.0}) {
        const std::vector<Particle> one = {{{0, 0, 0}, 1, 1}};
        const BuiltField built(smoke_of(one));
        const double expected[] = {0.5968310366, 0.1040963072, 0.01072717215, 4.223088e-5, 0};
        const int i = offset == 0 ? 0 : offset == 1 ? 1 : offset == 1.5 ? 2 : offset == 1.9 ? 3 : 4;
        const double depth = at(optical_depth(built.field, ray_from(offset, 0, -5, 0, 0, 1), Real(10)));
        CHECK(std::fabs(depth - expected[i]) < 1e-10 + 20 * unit_error);
    }
    // poly6 over the same support of 2 H: 9 / (2 pi h^2), h = 2
    const std::vector<Particle> one = {{{0, 0, 0}, 1, 1}};
    const BuiltField built(smoke_of(one, Kernel::poly6));
    CHECK(at(optical_depth(built.field, ray_from(0, 0, -5, 0, 0, 1), Real(10))) ==
          doctest::Approx(9 / (2 * pi_ * 4)).epsilon(1e-6));
}

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

TEST_CASE(WISP_ARITH_NAME ": density is the same to the bit when every leaf is visited") { // C8
    const auto particles = cloud(1000, 4, 1, 0.7);
    const BuiltField built(smoke_of(particles));
    ParticleField everywhere = built.field;
    everywhere.support = Real(100); // no leaf is culled: adds zeros alone
    Sequence next;
    for (int i = 0; i < 300; ++i) {
        const double x = 10 * next() - 5, y = 10 * next() - 5, z = 10 * next() - 5;
        CHECK(extinction(built.field, vec(x, y, z)) == extinction(everywhere, vec(x, y, z)));
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

TEST_CASE(WISP_ARITH_NAME ": optical depth over a plane is the whole cross-section") { // C15
    const auto particles = cloud(400, 3, 1, 0.25);
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const BuiltField built(smoke_of(particles, kernel));
        const int n = 256;
        const double width = 12;
        double sum = 0;
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < n; ++k)
                sum += at(optical_depth(
                    built.field, ray_from(((i + 0.5) / n - 0.5) * width, ((k + 0.5) / n - 0.5) * width, 9, 0, 0, -1),
                    Real(100)));
        CHECK(sum * width * width / (n * n) == doctest::Approx(400 * 0.25).epsilon(1e-3));
    }
}

TEST_CASE(WISP_ARITH_NAME ": coincident particles are one particle of their mass") { // C3
    const std::vector<Particle> many(1024, Particle{{0.5, 0.25, 0}, 1, 0x1p-10}), one = {{{0.5, 0.25, 0}, 1, 1}};
    const BuiltField a(smoke_of(many)), b(smoke_of(one));
    for (double x : {0.5, 0.7, 1.5, 2.4})
        CHECK(at(extinction(a.field, vec(x, 0.25, 0.1))) == doctest::Approx(at(extinction(b.field, vec(x, 0.25, 0.1))))
                                                                .epsilon(std::is_same_v<Real, Fixed> ? 1e-5 : 1e-6));
}

TEST_CASE(WISP_ARITH_NAME ": particles of several sizes are all found") { // C12
    std::vector<Particle> particles = cloud(200, 5, 1, 0.3);
    particles.push_back({{0, 0, 0}, 64, 500});
    particles.push_back({{3, 3, 3}, 8, 20});
    sort_canonically(particles);
    const BuiltField built(smoke_of(particles));
    Sequence next;
    for (int i = 0; i < 100; ++i) {
        const double x = 60 * next() - 30, y = 60 * next() - 30, z = 60 * next() - 30;
        const double expected = brute_density(particles, Kernel::spline, x, y, z);
        CHECK(at(extinction(built.field, vec(x, y, z))) == doctest::Approx(expected).epsilon(1e-5).scale(1e-3));
    }
}

TEST_CASE(WISP_ARITH_NAME ": an empty field is empty") { // C1
    const BuiltField built(smoke_of({}));
    CHECK(built.field.ready);
    CHECK(extinction(built.field, vec(0, 0, 0)) == Real(0));
    CHECK(optical_depth(built.field, ray_from(0, 0, 0, 1, 0, 0), Real(10)) == Real(0));
    CHECK(!first_collision(built.field, ray_from(0, 0, 0, 1, 0, 0), Real(10), photon_event(1, 1)).found);
}

TEST_CASE(WISP_ARITH_NAME ": rays along the walls of a box, and from inside, meet it") { // E7
    const Box box = {vec(-1, -1, -1), vec(1, 1, 1)};
    const auto length_inside = [&](const Ray &ray) {
        Real begin = Real(0), end = Real(100);
        return clip(box, ray, begin, end) ? at(end - begin) : 0.0;
    };
    CHECK(length_inside(ray_from(0, 0, -5, 0, 0, 1)) == 2);
    CHECK(length_inside(ray_from(1, 0, -5, 0, 0, 1)) == 2);
    CHECK(length_inside(ray_from(-1, 1, -5, 0, 0, 1)) == 2);
    CHECK(length_inside({vec(1, 0, -5), Vec3(-Real(0), Real(0), Real(1))}) == 2);
    CHECK(length_inside(ray_from(1.01, 0, -5, 0, 0, 1)) == 0);
    CHECK(length_inside(ray_from(0, 0, 0, 1, 0, 0)) == 1);
    CHECK(length_inside(ray_from(0, 0, 5, 0, 0, 1)) == 0);
    CHECK(length_inside(ray_from(5, 5, 5, -1, -1, -1)) == doctest::Approx(2 * std::sqrt(3.0)));
}
