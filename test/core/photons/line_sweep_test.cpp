// Light gathered along lines against closed forms and against more photons (S4-5).
#include "core/photons/line_sweep.h"
#include "core/photons/irradiance_map.h"
#include "core/photons/spherical_harmonics.h"
#include "support/built_sparse_grid.h"
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// The light at the nodes of a box, gathered along lines towards an eye far away.
struct SweptBox {
    // `photons`: the light that they bring to the first nodes, of which the very first is unknown; none to others.
    SweptBox(const SmokeDescription &box, const std::vector<Light> &lights_, double g_, uint64_t seed_ = 1,
             const std::vector<Color> &photons_ = {})
        : built({box}, 1), lights(lights_), photons(photons_), g(g_), seed(seed_) {
        const uint32_t bricks = built.bricks().count;
        const uint64_t points = uint64_t{bricks} * nodes_of(spacing);
        const uint64_t of_line = std::min<uint64_t>(bricks, places_of_line(built.bricks().lattice.count));
        memory.resize(line_sweep_bytes(bricks, of_line, spacing, g == 0));
        photons.resize(points, Color(Real(0)));
        REQUIRE(sweep(memory.size()));
        // Colours take all of the bytes, grey light more than three eighths.
        const std::vector<Color> whole = radiance;
        const size_t too_little = radiance.back().x == radiance.back().z ? 4 : 8;
        for (size_t part = 0; part < too_little; ++part) CHECK_FALSE(sweep(memory.size() * part / 8));
        radiance = whole;
    }
    bool sweep(size_t bytes, Watch watch = {}) {
        const uint64_t points = photons.size();
        const std::vector<uint32_t> dark(points * harmonic_words, 0); // no flux, no harmonics
        std::vector<Real> clear(uint64_t{built.bricks().count} * nodes_of(1) * lights.size(), Real(0));
        const OpticalDepthGrid depths = {
            &built.medium, lights.data(), static_cast<uint32_t>(lights.size()), &built.bricks(), 1,
            clear.data(),  false};
        const std::unique_ptr<bool[]> known(new bool[points]);
        std::fill(known.get(), known.get() + points, true);
        known[0] = false;
        radiance = photons;
        const LineSweep lines = {&built.medium, &depths, spacing, 0, Phase(real(g)), vec(0, 0, far), 1, seed};
        const LightOfPhotons light = {known.get(), radiance.data(), g == 0 ? nullptr : dark.data(),
                                      g == 0 ? nullptr : dark.data(), 2 * spacing};
        Arena arena(memory.data(), bytes);
        const bool done = sweep_lines(lines, light, arena, watch);
        CHECK(arena.mark() == 0);
        return done;
    }
    static SmokeDescription box(double sigma, const Double3 &albedo, const Double3 &emission) {
        SmokeDescription source = box_smoke({half, half, half}, sigma, 2 * half);
        source.albedo = albedo;
        source.emission = emission;
        return source;
    }
    static constexpr double half = 12, far = 1e4;
    static constexpr int32_t spacing = 2;
    Resampled built;
    std::vector<Light> lights;
    std::vector<Color> photons, radiance;
    double g;
    uint64_t seed;
    std::vector<unsigned char> memory;
};

// It scatters nothing.
struct GlowingBox : SweptBox {
    explicit GlowingBox(double sigma, double g = 0, const Double3 &emission = {1, 0.5, 0.25},
                        const std::vector<Color> &photons = {})
        : SweptBox(box(sigma, {0, 0, 0}, emission), {}, g, 1, photons) {}
};

// The mean over all directions of 1 - e^-depth from a point in the box to its faces, weighted by 4 pi p towards +z.
double mean_glow(double sigma, double g, const double (&p)[3]) {
    const int n = 50;
    double sum = 0;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2 * n; ++j) {
            const double z = (2 * i + 1.0) / n - 1, turn = pi_ * (j + 0.5) / n, r = std::sqrt(1 - z * z);
            const double d[3] = {r * std::cos(turn), r * std::sin(turn), z};
            double way = 1e9;
            for (int a = 0; a < 3; ++a)
                way = std::min(way, (d[a] > 0 ? GlowingBox::half - p[a] : -GlowingBox::half - p[a]) / d[a]);
            const double weight = (1 - g * g) / std::pow(1 + g * g + 2 * g * z, 1.5); // light flies along -d
            sum += weight * (1 - std::exp(-sigma * std::max(way, 0.0)));
        }
    return sum / (2 * n * n);
}

// In smoke so thin that it dims nothing, light of a lamp at y that flies to x along w was scattered once on its way.
// With the distance d of the lamp from the way, and t along it from where it is nearest to the lamp, t = d tan(turn),
//     L(w) = sigma integral of p(lamp to way, w) / (d^2 + t^2) dt = sigma / d integral of p d(turn).
// About the axis from x to the lamp, at the angle a, d = |y - x| sin a and the solid angle is sin a da times that
// around the axis: the integrand has no pole.
double scattered_twice(double sigma, double g, const Double3 &lamp, const Double3 &x) {
    const auto minus = [](const Double3 &a, const Double3 &b) { return Double3{a.x - b.x, a.y - b.y, a.z - b.z}; };
    const auto dot = [](const Double3 &a, const Double3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    const auto phase = [g](double c) { return (1 - g * g) / (4 * pi_ * std::pow(1 + g * g - 2 * g * c, 1.5)); };
    const Double3 to_lamp = minus(lamp, x);
    const double distance = std::sqrt(dot(to_lamp, to_lamp));
    const Double3 axis = {to_lamp.x / distance, to_lamp.y / distance, to_lamp.z / distance};
    const Double3 side = std::fabs(axis.x) < 0.6 ? Double3{1, 0, 0} : Double3{0, 1, 0};
    const double along = dot(side, axis), length = std::sqrt(1 - along * along);
    const Double3 u = {(side.x - along * axis.x) / length, (side.y - along * axis.y) / length,
                       (side.z - along * axis.z) / length};
    const Double3 v = {axis.y * u.z - axis.z * u.y, axis.z * u.x - axis.x * u.z, axis.x * u.y - axis.y * u.x};
    const int angles = 24, around = 48, parts = 12;
    double sum = 0;
    for (int i = 0; i < angles; ++i)
        for (int j = 0; j < around; ++j) {
            const double a = pi_ * (i + 0.5) / angles, b = 2 * pi_ * (j + 0.5) / around;
            const double s = std::sin(a) * std::cos(b), t = std::sin(a) * std::sin(b), c = std::cos(a);
            // From x to where the light comes from.
            const Double3 from = {c * axis.x + s * u.x + t * v.x, c * axis.y + s * u.y + t * v.y,
                                  c * axis.z + s * u.z + t * v.z};
            double way = 1e9;
            for (const auto &[p, d] : {std::pair(x.x, from.x), std::pair(x.y, from.y), std::pair(x.z, from.z)})
                way = std::min(way, (d > 0 ? SweptBox::half - p : -SweptBox::half - p) / d);
            const double nearest = distance * c, d = distance * std::sin(a);
            const double begin = std::atan(-nearest / d), end = std::atan((way - nearest) / d);
            double of_way = 0;
            for (int k = 0; k < parts;
                 ++k) // the lamp's light turns by `turn` from across the way; it flies on along -from
                of_way += phase(-std::sin(begin + (end - begin) * (k + 0.5) / parts)) * (end - begin) / parts;
            const double towards_eye = 4 * pi_ * phase(-from.z);
            sum += towards_eye * of_way;
        }
    return sigma / distance * sum * (pi_ / angles) * (2 * pi_ / around) / (4 * pi_);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": lines bring the light of a glowing box to all its nodes") {
    for (const auto &[sigma, g] : {std::pair(0.01, 0.0), std::pair(0.05, 0.0), std::pair(0.25, 0.0),
                                   std::pair(0.05, 0.5), std::pair(0.05, -0.3)}) {
        CAPTURE(sigma);
        CAPTURE(g);
        GlowingBox lit(sigma, g);
        const SparseGrid &bricks = lit.built.bricks();
        double worst = 0, squares = 0, sum = 0, expected_sum = 0;
        int count = 0;
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < 64; k += 5) { // cells between nodes: the march interpolates
                const Cell c = cell_of_index(4, k);
                const Vec3 low = node_of(bricks, b, {c.x * lit.spacing, c.y * lit.spacing, c.z * lit.spacing});
                const double half = 0.5 * lit.spacing, p[3] = {at(low.x) + half, at(low.y) + half, at(low.z) + half};
                const double farthest = std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
                if (farthest > lit.half - 1.5 * lit.spacing) continue; // tents that reach over a face see less
                Color here(Real(0));
                for (int32_t i = 0; i < 8; ++i) {
                    const Cell node = {c.x + (i & 1), c.y + (i >> 1 & 1), c.z + (i >> 2)};
                    const uint64_t first = uint64_t{b} * nodes_of(lit.spacing);
                    here +=
                        lit.radiance[first + static_cast<uint64_t>((node.z * 5 + node.y) * 5 + node.x)] * real(0.125);
                }
                // Nodes have spacing^2 / 12 times the second derivatives less, so that interpolation is right in the
                // mean. In the middle it is right for a mean of the variance spacing^2 / 12.
                double expected = 0;
                for (int i = 0; i < 8; ++i) {
                    const double reach = lit.spacing / std::sqrt(12);
                    const double q[3] = {p[0] + (i & 1 ? reach : -reach), p[1] + (i & 2 ? reach : -reach),
                                         p[2] + (i & 4 ? reach : -reach)};
                    expected += mean_glow(sigma, g, q) / 8;
                }
                const double error = std::fabs(at(here.x) / expected - 1);
                worst = std::max(worst, error);
                squares += error * error, ++count;
                CHECK(at(here.y) == doctest::Approx(0.5 * at(here.x)).epsilon(1e-4));
                sum += at(here.x), expected_sum += expected;
            }
        // 50 axes, which meet a peak of the phase function by chance. All light is 0.3 to 0.6 % too little: one step of
        // sharpening leaves fourth derivatives, which are large beside a face.
        CHECK(std::sqrt(squares / count) < 0.02);
        CHECK(worst < 0.07);
        CHECK(sum == doctest::Approx(expected_sum).epsilon(0.007));
    }
}

// Photons that are far from the lines do not count, but for how much light they have in all: E is by how much more, and
// N the sum of squares of what each brick has of that.
TEST_CASE(WISP_ARITH_NAME ": lines bring as much light as photons, but for what may be their noise") {
    const Double3 white = {1, 1, 1};
    const GlowingBox dark(0.05, 0, white);
    const SparseGrid &bricks = dark.built.bricks();
    const uint32_t nodes = nodes_of(dark.spacing);
    const auto sum = [&](const std::vector<Color> &light, uint32_t first, uint32_t last) {
        double of_bricks = 0; // each node by how much of what is around it is in the box
        for (uint32_t b = first; b < last; ++b)
            for (uint32_t k = 0; k < nodes; ++k) {
                const Cell c = cell_of_index(nodes_along(dark.spacing), k);
                const Vec3 x = node_of(bricks, b, {c.x * dark.spacing, c.y * dark.spacing, c.z * dark.spacing});
                double weight = 1;
                for (int axis = 0; axis < 3; ++axis)
                    weight *= std::clamp(0.5 + (dark.half - std::fabs(at(x[axis]))) / dark.spacing, 0.0, 1.0);
                of_bricks += weight * at(light[b * nodes + k].x);
            }
        return of_bricks;
    };
    const double lines = sum(dark.radiance, 0, bricks.count);
    double squares = 0; // of the bricks' parts
    for (uint32_t b = 0; b < bricks.count; ++b) squares += std::pow(sum(dark.radiance, b, b + 1) / lines, 2);
    REQUIRE(16 * squares < 0.7);
    REQUIRE(16 * squares > 0.4);
    std::vector<Color> photons(dark.radiance.size());
    for (const double factor : {0.25, 4.0, 10.0}) {
        CAPTURE(factor);
        for (size_t i = 0; i < photons.size(); ++i) photons[i] = dark.radiance[i] * real(factor);
        const GlowingBox lit(0.05, 0, white, photons);
        const double excess = factor - 1;
        CHECK(sum(lit.radiance, 0, bricks.count) / lines ==
              doctest::Approx(1 + excess - 16 * excess * squares).epsilon(0.03));
    }
    // As much more in one brick alone is noise.
    for (size_t i = 0; i < photons.size(); ++i) photons[i] = dark.radiance[i] * Real(i < nodes ? 40 : 1);
    const GlowingBox noisy(0.05, 0, white, photons);
    CHECK(sum(noisy.radiance, 1, bricks.count) / sum(dark.radiance, 1, bricks.count) ==
          doctest::Approx(1).epsilon(0.01));
}

TEST_CASE(WISP_ARITH_NAME ": lines stop wherever they are told to, and ask no more") {
    struct Asked {
        uint32_t calls, stop_after;
    };
    constexpr uint32_t phases = std::is_same_v<Real, float> ? 8 : 1;
    for (const double g : {0.0, 0.4}) {
        CAPTURE(g);
        GlowingBox box(0.05, g);
        const std::vector<Color> whole = box.radiance;
        // The first question comes after `left` units of work, all others at the same distances from it.
        const auto sweep = [&](uint32_t left, uint32_t stop_after) {
            Asked asked = {0, stop_after};
            Work work = {{&asked, [](void *context, Stage, uint64_t, uint64_t) {
                              Asked &to = *static_cast<Asked *>(context);
                              return ++to.calls != to.stop_after;
                          }}};
            work.left = left;
            CHECK(box.sweep(box.memory.size(), Watch(work)) == (stop_after == 0));
            return asked.calls;
        };
        for (uint32_t phase = 0; phase < phases; ++phase) {
            const uint32_t left = (phase << 15) / phases, calls = sweep(left, 0);
            CHECK(box.radiance == whole);
            CHECK(calls > 10);
            for (uint32_t k = 1; k <= calls; ++k) CHECK(sweep(left, k) == k);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": grey light has the bits of each channel of coloured light") {
    for (const double g : {0.0, 0.5}) {
        CAPTURE(g);
        const GlowingBox grey(0.1, g, {1, 1, 1}), with_hue(0.1, g, {1, 1, 1}, {vec(0, 0, 0.5)});
        REQUIRE(grey.radiance.size() == with_hue.radiance.size());
        CHECK(with_hue.radiance[0].x != with_hue.radiance[0].z);
        size_t lit = 0;
        for (size_t i = 1; i < grey.radiance.size(); ++i) {
            const Cell at = cell_of_index(nodes_along(GlowingBox::spacing), static_cast<uint32_t>(i));
            if (std::max({at.x, at.y, at.z}) < 2) continue; // sharpened beside the first node, which has a hue
            const Color &one = grey.radiance[i], &three = with_hue.radiance[i];
            CHECK((one.x == three.x && one.y == three.y && one.z == three.z));
            lit += one.x > Real(0) ? 1 : 0;
        }
        CHECK(lit > 1000);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a node has the same light in every brick that holds it, to the bit") {
    GlowingBox lit(0.1);
    const SparseGrid &bricks = lit.built.bricks();
    const int32_t n = nodes_along(lit.spacing);
    uint32_t shared = 0;
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes_of(lit.spacing); ++k)
            for_each_holder(bricks, bricks.position[b], cell_of_index(n, k), n, [&](uint32_t other, uint32_t there) {
                const Color &here = lit.radiance[uint64_t{b} * nodes_of(lit.spacing) + k];
                const Color &same = lit.radiance[uint64_t{other} * nodes_of(lit.spacing) + there];
                CHECK((here.x == same.x && here.y == same.y && here.z == same.z));
                shared += other != b ? 1 : 0;
            });
    CHECK(shared > 1000);
}

TEST_CASE(WISP_ARITH_NAME ": lines err by half of what few photons do, and by less than many" *
          doctest::test_suite("long")) {
    for (const double g : {0.0, 0.5}) {
        CAPTURE(g);
        LitSmoke lit(cloud(1500, 12, 2, 1.5));
        lit.light({LightKind::parallel, {}, {0.6, 0, -0.8}, 2, {1, 1, 1}});
        lit.smoke.asymmetry = g;
        const Vec3 eye = vec(10, 20, 90);
        const auto maps = [&](uint64_t photons, uint64_t seed, int32_t spacing) {
            Settings settings = brick_settings(8, 0.5, photons);
            settings.seed = seed;
            TracedFluence traced(lit.scene, settings, spacing);
            std::vector<std::vector<double>> values;
            for (const OpticalDepthGrid *swept : {static_cast<const OpticalDepthGrid *>(nullptr),
                                                  static_cast<const OpticalDepthGrid *>(&traced.depths)}) {
                std::vector<unsigned char> memory(
                    irradiance_bytes(lit.scene, traced.count, spacing, g != 0, true, g != 0, swept ? traced.count : 0));
                Arena arena(memory.data(), memory.size());
                const Irradiance map =
                    make_irradiance(traced.medium, traced.deposits, {swept, eye, 1, seed}, Real(0), arena);
                REQUIRE(map.ready);
                values.emplace_back();
                for (uint32_t b = 0; b < traced.medium.bricks->count; ++b) // in the middle of the smoke
                    if (length(low_of(*traced.medium.bricks, b) + traced.medium.bricks->lattice.edge * Real(0.5)) <
                        Real(16))
                        for (int i = 0; i < 27; ++i) {
                            const Vec3 in_brick = vec(1 + 3 * (i % 3), 1 + 3 * (i / 3 % 3), 1 + 3 * (i / 9));
                            const Vec3 x = low_of(*traced.medium.bricks, b) + in_brick * traced.medium.bricks->cell;
                            const Real one = Real(1);
                            values.back().push_back(
                                at(scattered_light(map, traced.medium, x, normalize(eye - x), &one).x));
                        }
            }
            return values;
        };
        const auto error = [](const std::vector<double> &of, const std::vector<double> &truth) {
            double sum = 0, all = 0;
            for (size_t i = 0; i < truth.size(); ++i) {
                sum += (of[i] - truth[i]) * (of[i] - truth[i]);
                all += truth[i] * truth[i];
            }
            return std::sqrt(sum / all);
        };
        // Between nodes half as far apart there is half the blur. Photons know whence light comes by few moments, so
        // for other phases lines have to tell.
        const auto truth = maps(600000, 9, 1)[g == 0 ? 0 : 1];
        REQUIRE(truth.size() > 500);
        const auto few = maps(4096, 1, 2), many = maps(200000, 1, 2);
        CHECK(error(few[0], truth) > 0.2);
        CHECK(error(few[1], truth) < (g == 0 ? 0.4 : 0.5) * error(few[0], truth));
        CHECK(error(many[1], truth) < (g == 0 ? 0.8 : 0.7) * error(many[0], truth));
        // Nodes without smoke have the flux of their neighbours: without it photons err by 0.19 where g is 0.5.
        CHECK(error(many[0], truth) < (g == 0 ? 0.11 : 0.16));
    }
}

// Most of what is scattered twice in a thin layer flies nearly along it, where there are few lines: they miss a fifth.
TEST_CASE(WISP_ARITH_NAME ": lines bring as much light to a thin layer as photons do") {
    SmokeDescription layer = box_smoke({20, 20, 1.0 / 64}, 1, 1); // 1/32 deep
    layer.smallest_h = layer.largest_h = 1;
    layer.albedo = {1, 1, 1};
    std::vector<SmokeDescription> smokes = {layer};
    Scene scene = {};
    scene.smokes = smokes.data();
    scene.smoke_count = 1;
    scene.lights = sun_along_z.data();
    scene.light_count = 1;
    const double step = 0.55;
    TracedFluence traced(scene, brick_settings(8, step, 1000000), 2);
    double light[2];
    for (const bool swept : {false, true}) {
        std::vector<unsigned char> memory(
            irradiance_bytes(scene, traced.count, 2, false, true, false, swept ? traced.count : 0));
        Arena arena(memory.data(), memory.size());
        const Irradiance map = make_irradiance(
            traced.medium, traced.deposits, {swept ? &traced.depths : nullptr, vec(0, 0, 1e3), 2, 1}, Real(0), arena);
        REQUIRE(map.ready);
        light[swept] = 0;
        const Real one = Real(1);
        for (double x = -15; x < 15; x += 0.25)
            for (double y = -15; y < 15; y += 0.25)
                light[swept] += at(scattered_light(map, traced.medium, vec(x, y, 0), vec(0, 0, 1), &one).x);
    }
    CHECK(light[0] > 0);
    // The rest is that lines miss more in the middle than at the rim.
    CHECK(light[1] == doctest::Approx(light[0]).epsilon(0.07));
}

// Light of two beams, whose shares change from x to x. Nodes that no line counts for keep the light of photons.
TEST_CASE(WISP_ARITH_NAME ": the light of photons is turned from each node to an eye that is near") {
    const int32_t spacing = 2, coarse = 2 * spacing;
    const Resampled built({SweptBox::box(0.1, {0, 0, 0}, {1, 1, 1})}, 1);
    const SparseGrid &bricks = built.bricks();
    const uint32_t nodes = nodes_of(spacing);
    const uint64_t points = uint64_t{bricks.count} * nodes;
    const Vec3 first = vec(0.6, 0, -0.8), second = vec(0, 0.8, 0.6), eye = vec(3, 40, 5);
    const SphericalHarmonics of_first = harmonics_of(first), of_second = harmonics_of(second);
    const auto share_at = [](const Vec3 &x) { return (at(x.x) + at(x.y) / 2 + 30) / 75; };
    std::vector<uint32_t> flux, harmonics;
    for (uint32_t b = 0; b < bricks.count; ++b) {
        for (uint32_t k = 0; k < nodes; ++k) {
            const Cell node = cell_of_index(nodes_along(spacing), k);
            const Real t = real(share_at(node_of(bricks, b, {node.x * spacing, node.y * spacing, node.z * spacing})));
            flux.push_back(pack_flux(first * t + second * (Real(1) - t)));
        }
        for (uint32_t k = 0; k < nodes_of(coarse); ++k) {
            const Cell node = cell_of_index(nodes_along(coarse), k);
            const Real t = real(share_at(node_of(bricks, b, {node.x * coarse, node.y * coarse, node.z * coarse})));
            for (uint32_t i = 0; i < harmonic_count; i += 3) {
                const auto mean = [&](uint32_t j) {
                    return of_first.value[i + j] * t + of_second.value[i + j] * (Real(1) - t);
                };
                harmonics.push_back(pack_flux({mean(0), mean(1), mean(2)}));
            }
        }
    }
    const Phase phase(real(0.5));
    const OpticalDepthGrid depths = {&built.medium, nullptr, 0, &bricks, 1, nullptr, false};
    const std::unique_ptr<bool[]> known(new bool[points]());
    std::vector<Color> radiance(points, Color(real(0.25), real(0.5), real(1)));
    std::vector<unsigned char> memory(
        line_sweep_bytes(bricks.count, places_of_line(bricks.lattice.count), spacing, false));
    Arena arena(memory.data(), memory.size());
    REQUIRE(sweep_lines({&built.medium, &depths, spacing, 0, phase, eye, 1, 1},
                        {known.get(), radiance.data(), flux.data(), harmonics.data(), coarse}, arena));
    double least = 9, most = 0;
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes; ++k) {
            const Cell node = cell_of_index(nodes_along(spacing), k);
            const Vec3 x = node_of(bricks, b, {node.x * spacing, node.y * spacing, node.z * spacing});
            const Vec3 out = normalize(eye - x);
            const double t = share_at(x), cosine[2] = {at(dot(first, out)), at(dot(second, out))};
            const Vec3 mean = first * real(t) + second * real(1 - t);
            // Orders 2 and 3 of each beam, by Legendre's polynomials; 1 and 4 on as of a lobe about the flux.
            const auto orders = [](double c, double g) {
                return 5 * g * g * (1.5 * c * c - 0.5) + 7 * g * g * g * (2.5 * c * c * c - 1.5 * c);
            };
            const double size = at(length(mean)), along = at(dot(mean, out)) / size;
            const double lobe = (1 - 0.25 * size * size) / std::pow(1 + 0.25 * size * size - size * along, 1.5);
            const double expected =
                lobe - orders(along, 0.5 * size) + t * orders(cosine[0], 0.5) + (1 - t) * orders(cosine[1], 0.5);
            const Color &found = radiance[uint64_t{b} * nodes + k];
            CHECK(std::fabs(at(found.z) - std::max(expected, 0.0)) < 0.02);
            CHECK(at(found.x) == doctest::Approx(0.25 * at(found.z)).epsilon(1e-4));
            least = std::min(least, expected), most = std::max(most, expected);
        }
    CHECK(most > 4 * least);
}

TEST_CASE(WISP_ARITH_NAME ": lines bring the light of a lamp in the smoke") {
    // Without its box, sigma pi / (16 distance).
    CHECK(scattered_twice(1e-3, 0, {0, 0, 0}, {0.01, 0.02, 0.01}) ==
          doctest::Approx(1e-3 * pi_ / 16 / std::sqrt(6e-4)).epsilon(0.002));
    for (const double g : {0.0, -0.4, 0.3})
        for (const Double3 &lamp : {Double3{1.1, -0.3, 0.7}, Double3{11.2, 10.9, 0.2}}) {
            CAPTURE(g);
            CAPTURE(lamp.x);
            const double sigma = 1e-4, power = 1e4;
            const Light light = make_light({LightKind::point, lamp, {0, 0, 0}, 0, {power, power, power}});
            const SweptBox lit(SweptBox::box(sigma, {1, 1, 1}, {0, 0, 0}), {light}, g);
            const SparseGrid &bricks = lit.built.bricks();
            double squares = 0, sum = 0, expected_sum = 0;
            int count = 0;
            for (uint32_t b = 0; b < bricks.count; ++b)
                for (uint32_t k = 0; k < nodes_of(lit.spacing); k += 7) {
                    const Cell c = cell_of_index(nodes_along(lit.spacing), k);
                    const Vec3 node = node_of(bricks, b, {c.x * lit.spacing, c.y * lit.spacing, c.z * lit.spacing});
                    const Double3 x = {at(node.x), at(node.y), at(node.z)};
                    const double inside = lit.half - std::max({std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)});
                    const double away = std::hypot(x.x - lamp.x, x.y - lamp.y, x.z - lamp.z);
                    if (inside < 2 * lit.spacing || away < 2 * lit.spacing) continue;
                    const double expected = power * scattered_twice(sigma, g, lamp, x);
                    const double found = at(lit.radiance[uint64_t{b} * nodes_of(lit.spacing) + k].x);
                    squares += (found / expected - 1) * (found / expected - 1), ++count;
                    sum += found, expected_sum += expected;
                }
            REQUIRE(count > 50);
            // Few lines cross the smoke next to the lamp: what errs there by 24 to 45 % counts little beside the
            // photons. It would be up to 93 % if light were not a mean across the smoke that a line stands for.
            CHECK(std::sqrt(squares / count) < 0.5);
            CHECK(sum == doctest::Approx(expected_sum).epsilon(0.05));
        }
}

// So pictures of several seeds tell what lines err by next to a lamp, where few come by.
TEST_CASE(WISP_ARITH_NAME ": lines of another seed lie elsewhere, and the mean of several errs by less than one") {
    const double sigma = 1e-4, power = 1e4;
    const Double3 lamp = {1.1, -0.3, 0.7};
    const Light light = make_light({LightKind::point, lamp, {0, 0, 0}, 0, {power, power, power}});
    constexpr int seeds = 6;
    std::vector<std::unique_ptr<SweptBox>> lit;
    for (int seed = 1; seed <= seeds; ++seed)
        lit.emplace_back(new SweptBox(SweptBox::box(sigma, {1, 1, 1}, {0, 0, 0}), {light}, 0, seed));
    const SparseGrid &bricks = lit[0]->built.bricks();
    double of_one = 0, of_mean = 0;
    int count = 0;
    for (uint32_t b = 0; b < bricks.count; ++b)
        for (uint32_t k = 0; k < nodes_of(SweptBox::spacing); ++k) {
            const int32_t spacing = SweptBox::spacing;
            const Cell c = cell_of_index(nodes_along(spacing), k);
            const Vec3 node = node_of(bricks, b, {c.x * spacing, c.y * spacing, c.z * spacing});
            const Double3 x = {at(node.x), at(node.y), at(node.z)};
            const double away = std::hypot(x.x - lamp.x, x.y - lamp.y, x.z - lamp.z);
            if (away < 2 * spacing || away > 4 * spacing) continue;
            const double expected = power * scattered_twice(sigma, 0, lamp, x);
            double mean = 0;
            for (const auto &box : lit) {
                const double error = at(box->radiance[uint64_t{b} * nodes_of(spacing) + k].x) / expected - 1;
                of_one += error * error / seeds;
                mean += error / seeds;
            }
            of_mean += mean * mean;
            ++count;
        }
    REQUIRE(count > 50);
    CHECK(of_mean < 0.5 * of_one);
}

TEST_CASE(WISP_ARITH_NAME ": lines pay where at least one place in 32 holds a brick") {
    CHECK(suits_lines(32, 1));
    CHECK_FALSE(suits_lines(33, 1));
    CHECK_FALSE(suits_lines(uint64_t{1} << 40, 1000));
}
