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

// A medium of extinction 1 inside a convex shape, with the functions that `walk` calls.
struct UnitMedium {
    double albedo_, g;
    std::function<bool(const Vec3 &)> inside;
};
struct UnitCollision {
    bool found;
    Real distance;
};
UnitCollision first_collision(const UnitMedium &medium, const Ray &ray, Real, Event event) {
    const Real distance = -wisp::log(unit_open<Real>(draw(event, 0)));
    // A convex shape holds the whole flight, or it leaves.
    return {medium.inside(ray.origin + ray.direction * distance), distance};
}
Color albedo(const UnitMedium &medium, const UnitCollision &) { return Color(real(medium.albedo_)); }
Phase phase(const UnitMedium &medium, const UnitCollision &) { return Phase(real(medium.g)); }

Photon photon_at(const Vec3 &origin, const Vec3 &direction) { return {{origin, direction}, Color(Real(1)), true}; }

Photon isotropic_photon(const Vec3 &origin, uint64_t key) {
    const Event emission = photon_event(key, 0);
    return photon_at(origin, deflect(vec(0, 0, 1), Phase(Real(0)).sample(unit_open<Real>(draw(emission, 1))),
                                     unit_half_open<Real>(draw(emission, 2))));
}

constexpr auto on_no_collision = [](const UnitCollision &, uint32_t, const Photon &) {};

// The exponential integral E1; as far from its pole as positions are rounded.
double e1(double x) { return -std::expint(-std::max(x, 1e-7)); }

// Photons of one row.
class RowWalks {
  public:
    explicit RowWalks(uint64_t row) : row_(row) {}

    // Light enters a slab 0 < z < depth at a cosine; 0: diffusely, from all directions of a side. The fraction that
    // leaves at z <= 0 (`reflected`), or at z >= depth; `diffuse`: of that which was scattered. Of each flight that
    // part counts which would leave without a collision.
    bool slab(double a, double g, double depth, double cosine, bool reflected, bool diffuse, Score &result) const {
        const UnitMedium slab = {a, g, [depth](const Vec3 &x) { return x.z > Real(0) && x.z < real(depth); }};
        return score_photons(
            [&](uint64_t key) {
                const double in = cosine > 0 ? cosine : std::sqrt(at(unit_open<Real>(draw(photon_event(key, 0), 1))));
                double leaves = 0;
                walk(slab, photon_at(vec(0, 0, 0), vec(std::sqrt(1 - in * in), 0, in)), key, on_no_collision,
                     [&](const Photon &photon, Real, uint32_t number) {
                         if (diffuse && number == 0) return;
                         const double z = at(photon.ray.origin.z), towards = at(photon.ray.direction.z);
                         if (reflected ? towards < 0 : towards > 0)
                             leaves += std::exp(-(reflected ? z : depth - z) / std::fabs(towards));
                     });
                return leaves;
            },
            result);
    }
    // Collisions of a photon in an infinite medium, or the squared distance of the last one.
    bool infinite(double c, double g, bool spread, Score &result) const {
        const UnitMedium medium = {c, g, [](const Vec3 &) { return true; }};
        return score_photons(
            [&](uint64_t key) {
                Vec3 last(Real(0));
                double collisions = 0;
                walk(medium, photon_at(vec(0, 0, 0), vec(0, 0, 1)), key,
                     [&](const UnitCollision &, uint32_t, const Photon &p) {
                         last = p.ray.origin;
                         ++collisions;
                     });
                return spread ? at(dot(last, last)) : collisions;
            },
            result);
    }
    // The fluence at distance r from an isotropic source. Of each flight that counts which flights from there in all
    // directions give a sphere of radius r in the mean.
    bool fluence(double c, double r, Score &result) const {
        const UnitMedium medium = {c, 0, [](const Vec3 &) { return true; }};
        return score_photons(
            [&](uint64_t key) {
                double sum = 0;
                walk(medium, isotropic_photon(vec(0, 0, 0), key), key, on_no_collision,
                     [&](const Photon &p, Real, uint32_t number) {
                         const double from = std::max(at(length(p.ray.origin)), 1e-7);
                         sum += number == 0 ? std::exp(-r) / (4 * pi_ * r * r)
                                            : (e1(std::fabs(r - from)) - e1(r + from)) / (8 * pi_ * r * from);
                     });
                return sum;
            },
            result);
    }
    // A ball of radius 5 with a source at its centre or throughout: what leaves of a photon, or its collisions.
    bool ball(double c, bool throughout, bool escapes, Score &result) const {
        const UnitMedium ball = {c, 0, [](const Vec3 &p) { return dot(p, p) < Real(25); }};
        return score_photons(
            [&](uint64_t key) {
                Vec3 start(Real(0));
                if (throughout) {
                    const Event place = photon_event(key, 1u << 30);
                    const double radius = 5 * std::cbrt(at(unit_open<Real>(draw(place, 1))));
                    start = isotropic_photon(start, key ^ 0x5555).ray.direction * real(radius * 0.999999);
                }
                double collisions = 0, leaves = 0;
                walk(
                    ball, isotropic_photon(start, key), key,
                    [&](const UnitCollision &, uint32_t, const Photon &) { ++collisions; },
                    [&](const Photon &p, Real, uint32_t) {
                        const double along = at(dot(p.ray.origin, p.ray.direction));
                        const double rest = 25 - at(dot(p.ray.origin, p.ray.origin));
                        leaves += std::exp(along - std::sqrt(along * along + rest));
                    });
                return escapes ? leaves : collisions;
            },
            result);
    }

  private:
    template <class OfPhoton> bool score_photons(OfPhoton of_photon, Score &result) const {
        return score_until(
            100,
            [&](int64_t i) { return of_photon((row_ * 1000003 + static_cast<uint64_t>(i) + 1) * 0x9e3779b97f4a7c15u); },
            result);
    }
    uint64_t row_;
};

// Measures a row's value by photon walks. False where they cannot: the row is of another kind, or too few photons
// count.
bool measure(const Row &row, uint64_t number, Score &result) {
    double c, g, x;
    char word[16] = "";
    int end = 0;
    const char *id = row.id.c_str();
    const auto whole = [&] { return end > 0 && id[end] == 0; };
    const RowWalks walks(number);
    if (too_dark(row)) return false;
    if (std::sscanf(id, "slab_a%lf_g%lf_t%lf_U%15s%n", &c, &g, &x, word, &end) == 4 && whole()) {
        const std::string way = word; // R1 T1 Td1 R(.5) T(.5) RU TU
        const double cosine = way.back() == '1' ? 1 : way.back() == ')' ? 0.5 : 0;
        return walks.slab(c, g, x, cosine, way[0] == 'R', way[1] == 'd', result);
    }
    if (std::sscanf(id, "semi_c%lf_UR(%lf)%n", &c, &x, &end) == 2 && whole())
        return walks.slab(c, 0, 1e5, x, true, false, result);
    if (std::sscanf(id, "semi_c%lf_URU%n", &c, &end) == 1 && whole())
        return walks.slab(c, 0, 1e5, 0, true, false, result);
    if (std::sscanf(id, "inf_c%lf_g%lf_%5[r2ncol]%n", &c, &g, word, &end) == 3 && whole())
        return walks.infinite(c, g, std::strcmp(word, "r2") == 0, result);
    if (std::sscanf(id, "inf_c%lf_r%lf%n", &c, &x, &end) == 2 && whole()) return walks.fluence(c, x, result);
    if (std::sscanf(id, "sph_R5_c%lf_%4[Pesccoll]_%3[unictr]%n", &c, word, word + 8, &end) == 3 && whole())
        return walks.ball(c, std::strcmp(word + 8, "uni") == 0, word[0] == 'P', result);
    return false;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": walks reproduce published transport values" * doctest::test_suite("long")) {
    const std::vector<Row> rows = transport_rows();
    TransportTable table("photons_" WISP_ARITH_NAME);
    for (const Row &row : rows) {
        Score result;
        if (measure(row, uint64_t(&row - rows.data()), result)) table.add(row.id, row.value, result);
    }
    table.finish(60);
}
