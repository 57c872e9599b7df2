// Photon walks against published transport values (transport.csv): infinite and half-infinite media, slabs and a ball.
// Each row has photons of its own.
#include "core/photons/photon_walk.h"
#include "physics/transport_rows.h"
#include "support/built_smoke.h"
#include <cstring>
#include <functional>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// A medium of extinction 1 inside a convex shape, with the functions that `walk` calls. `exit` is a point behind the
// boundary, where the last photon left.
struct UnitMedium {
    double albedo_, g;
    std::function<bool(const Vec3 &)> inside;
    mutable Vec3 exit = Vec3(Real(0));
};
struct UnitCollision {
    bool found;
    Real distance;
};
UnitCollision first_collision(const UnitMedium &medium, const Ray &ray, Real, Event event) {
    const Real distance = -wisp::log(unit_open<Real>(draw(event, 0)));
    const Vec3 end = ray.origin + ray.direction * distance;
    const bool found = medium.inside(end); // a convex shape holds the whole flight
    if (!found) medium.exit = end;
    return {found, distance};
}
Color albedo(const UnitMedium &medium, const UnitCollision &) { return Color(real(medium.albedo_)); }
Phase phase(const UnitMedium &medium, const UnitCollision &) { return Phase(real(medium.g)); }

uint64_t key_of(uint64_t row, uint64_t i) { return (row * 1000003 + i + 1) * 0x9e3779b97f4a7c15u; }

Photon photon_at(const Vec3 &origin, const Vec3 &direction) { return {{origin, direction}, Color(Real(1)), true}; }

Photon isotropic_photon(const Vec3 &origin, uint64_t key) {
    const Event emission = photon_event(key, 0);
    return photon_at(origin, deflect(vec(0, 0, 1), Phase(Real(0)).sample(unit_open<Real>(draw(emission, 1))),
                                     unit_half_open<Real>(draw(emission, 2))));
}

Score score_photons(uint64_t row, int photons, const std::function<double(uint64_t)> &of_photon) {
    return score(photons, [&](int i) { return of_photon(key_of(row, uint64_t(i))); });
}

// Light enters a slab 0 < z < depth at a cosine. The fraction that leaves at z <= 0 (`reflected`), or at z >= depth.
Score half_space(uint64_t row, double a, double g, double depth, double cosine, bool reflected) {
    UnitMedium slab = {a, g, [depth](const Vec3 &x) { return x.z > Real(0) && x.z < real(depth); }};
    const Vec3 direction = vec(std::sqrt(1 - cosine * cosine), 0, cosine);
    return score_photons(row, 6000, [&](uint64_t key) {
        const PathEnd ending =
            walk(slab, photon_at(vec(0, 0, 0), direction), key, [](const UnitCollision &, uint32_t, const Photon &) {});
        return ending == PathEnd::escaped && (slab.exit.z <= Real(0)) == reflected ? 1.0 : 0.0;
    });
}

// Measures a row's value by photon walks. False where they cannot: the row is of another kind, or too few photons
// count.
bool measure(const Row &row, uint64_t seed, Score &result) {
    double c, g, x;
    char word[16] = "";
    int end = 0;
    const char *id = row.id.c_str();
    const auto whole = [&] { return end > 0 && id[end] == 0; };
    if (std::sscanf(id, "slab_a%lf_g%lf_t%lf_U%2[RT1]%n", &c, &g, &x, word, &end) == 4 && whole()) {
        result = half_space(seed, c, g, x, 1, word[0] == 'R');
        return row.value > 1e-3;
    }
    if (std::sscanf(id, "slab_a%lf_g%lf_t%lf_U%1[RT](.5)%n", &c, &g, &x, word, &end) == 4 && whole()) {
        result = half_space(seed, c, g, x, 0.5, word[0] == 'R');
        return row.value > 1e-3;
    }
    if (std::sscanf(id, "semi_c%lf_UR(%lf)%n", &c, &x, &end) == 2 && whole()) {
        result = half_space(seed, c, 0, 1e5, x, true);
        return true;
    }
    const UnitMedium infinite = {c, 0, [](const Vec3 &) { return true; }};
    if (std::sscanf(id, "inf_c%lf_g%lf_%5[r2ncol]%n", &c, &g, word, &end) == 3 && whole()) {
        const UnitMedium medium = {c, g, infinite.inside};
        const bool spread = std::strcmp(word, "r2") == 0;
        result = score_photons(seed, c > 0.98 ? 3000 : 10000, [&](uint64_t key) {
            Vec3 last(Real(0));
            double collisions = 0;
            walk(medium, photon_at(vec(0, 0, 0), vec(0, 0, 1)), key,
                 [&](const UnitCollision &, uint32_t, const Photon &p) {
                     last = p.ray.origin;
                     ++collisions;
                 });
            return spread ? at(dot(last, last)) : collisions;
        });
        return true;
    }
    if (std::sscanf(id, "inf_c%lf_r%lf%n", &c, &x, &end) == 2 && whole()) {
        // Collisions in a shell of +-4 %, each weighted so that a fluence like 1 / r^2 has no bias.
        const UnitMedium medium = {c, 0, infinite.inside};
        const double low = 0.96 * x, high = 1.04 * x, width = high - low;
        const int photons = c > 0.98 ? 4000 : 20000;
        if (row.value * 4 * pi_ * x * x * width * photons < 100) return false; // too few would fall there
        result = score_photons(seed, photons, [&](uint64_t key) {
            double sum = 0;
            walk(medium, isotropic_photon(vec(0, 0, 0), key), key,
                 [&](const UnitCollision &, uint32_t, const Photon &p) {
                     const double r2 = at(dot(p.ray.origin, p.ray.origin));
                     if (r2 >= low * low && r2 < high * high) sum += 1 / (4 * pi_ * x * x * width);
                 });
            return sum;
        });
        return true;
    }
    if (std::sscanf(id, "sph_R5_c%lf_%4[Pesccoll]_%3[unictr]%n", &c, word, word + 8, &end) == 3 && whole()) {
        const UnitMedium ball = {c, 0, [](const Vec3 &p) { return dot(p, p) < Real(25); }};
        const bool uniform = std::strcmp(word + 8, "uni") == 0, escapes = word[0] == 'P';
        result = score_photons(seed, c > 0.98 ? 4000 : 10000, [&](uint64_t key) {
            Vec3 start(Real(0));
            if (uniform) {
                const Event place = photon_event(key, 1u << 30);
                const double radius = 5 * std::cbrt(at(unit_open<Real>(draw(place, 1))));
                start = isotropic_photon(start, key ^ 0x5555).ray.direction * real(radius * 0.999999);
            }
            double collisions = 0;
            const PathEnd ending = walk(ball, isotropic_photon(start, key), key,
                                        [&](const UnitCollision &, uint32_t, const Photon &) { ++collisions; });
            return escapes ? (ending == PathEnd::escaped ? 1.0 : 0.0) : collisions;
        });
        return true;
    }
    return false;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": walks reproduce published transport values") {
    const std::vector<Row> rows = transport_rows();
    TransportTable table("photons_" WISP_ARITH_NAME);
    for (const Row &row : rows) {
        Score result;
        if (measure(row, uint64_t(&row - rows.data()), result)) table.add(row.id, row.value, result);
    }
    table.finish(60);
}
