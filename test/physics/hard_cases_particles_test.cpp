// Hard cases C: particles in degenerate positions, of extreme sizes, and their files.
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/formats/particles.h"
#include "host/images/picture.h"
#include "host/prepare/prepare.h"
#include "host/scene/options.h"
#include "support/built_smoke.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"
#include "wisp/settings.h"
#include <cmath>
#include <cstdio>
#include <cstring>
#include <doctest/doctest.h>
#include <initializer_list>
#include <limits>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

constexpr bool is_f32 = std::is_same_v<Real, float>, is_fixed = std::is_same_v<Real, Fixed>;

const LightSource lamp = {LightKind::point, {5, 6, 4}, {0, 0, 1}, 2, {50, 40, 30}};

Ray along_minus_z(double x, double y) { return {vec(x, y, 100), vec(0, 0, -1)}; }

Scene scene_of(const SmokeDescription &smoke) {
    Scene scene = {};
    scene.camera = look_at_origin(12, 8, 8);
    scene.background = {1, 0.5, 0.25};
    scene.smokes = &smoke;
    scene.smoke_count = 1;
    scene.lights = &lamp;
    scene.light_count = 1;
    return scene;
}

Rendered lit_picture(const SmokeDescription &smoke, uint64_t photons, int pixels = 8) {
    Settings settings = small_settings(pixels);
    settings.photons = photons;
    return render_in_memory(scene_of(smoke), settings);
}

void check_valid(const Rendered &picture) {
    REQUIRE(picture.status == Status::done);
    for (float value : picture.rgb) {
        CHECK(std::isfinite(value));
        CHECK(value >= 0);
    }
}

bool same_bits(const Rendered &a, const Rendered &b) {
    return a.rgb.size() == b.rgb.size() && std::memcmp(a.rgb.data(), b.rgb.data(), a.rgb.size() * sizeof(float)) == 0;
}

// The particles as an ASCII PLY of `type` float or double, moved by `offset`.
void write_ply(const std::string &path, const std::vector<Double3> &points, const char *type, const Double3 &offset) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(points.size()) + "\n";
    for (const char *axis : {"x", "y", "z"}) text += std::string("property ") + type + " " + axis + "\n";
    text += "end_header\n";
    for (const Double3 &p : points) {
        char line[100];
        std::snprintf(line, sizeof line, "%.17g %.17g %.17g\n", p.x + offset.x, p.y + offset.y, p.z + offset.z);
        text += line;
    }
    write_file(path, text);
}

std::string printed(const Double3 &p) {
    char text[100];
    std::snprintf(text, sizeof text, "%.17g %.17g %.17g", p.x, p.y, p.z);
    return text;
}

// A scene file of one smoke, all of whose lengths are `unit` and all of whose places are moved by `offset`.
std::string scene_text(const std::string &particles, double unit, const Double3 &offset, const std::string &kernel,
                       double mass = 1) {
    const auto place = [&](double x, double y, double z) {
        return printed({x * unit + offset.x, y * unit + offset.y, z * unit + offset.z});
    };
    char text[200];
    std::snprintf(text, sizeof text, "%.17g mass %.17g extinction %.17g", unit, mass, 0.5 * unit * unit);
    const double intensity = 60 * unit * unit;
    return "v from " + place(0, 1, 9) + " at " + place(0, 0, 0) +
           " up 0 1 0 angle 40 hither 0.1 resolution 8 8\nb 0.5 0.25 0.125\nlp " + place(5, 6, 4) + " " +
           printed({intensity, intensity, intensity}) + "\nsmoke " + particles + " { kernel " + kernel + " radius " +
           text + " }\n";
}

struct Prepared {
    Rendered picture;
    std::vector<std::string> notes;
    double h; // of the first particle, as the core sees it
};

Prepared render_file(const std::string &text, uint64_t photons) {
    Options options;
    options.arithmetic = is_fixed ? Arithmetic::fixed : is_f32 ? Arithmetic::f32 : Arithmetic::f64;
    PreparedScene prepared;
    prepare_scene("s.aff", parse_scene("s.aff", text), options, 0, prepared);
    Settings settings = small_settings(prepared.width);
    settings.photons = photons;
    return {render_in_memory(prepared.scene, settings), prepared.notes, prepared.particles[0][0].h};
}

int largest_difference_of_bytes(const Rendered &a, const Rendered &b, int pixels) {
    const Bytes x = srgb_bytes({pixels, pixels, a.rgb}), y = srgb_bytes({pixels, pixels, b.rgb});
    int worst = 0;
    for (size_t i = 0; i < x.size(); ++i) worst = std::max(worst, std::abs(int(x[i]) - int(y[i])));
    return worst;
}

std::vector<Double3> points_of(uint32_t count, double extent) {
    std::vector<Double3> points;
    for (const Particle &p : cloud(count, extent, 1, 1)) points.push_back(p.position);
    return points;
}

std::string error_of_particles(const std::string &text) {
    return refusal_of(
        [&] { parse_particles("p.ply", reinterpret_cast<const unsigned char *>(text.data()), text.size()); });
}

std::string ply(const std::string &row) {
    return "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n"
           "property double mass\nproperty double h\nend_header\n0 0 0 1 1\n" +
           row + "\n";
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": hard case C1: without particles there is no smoke, and the picture is valid") {
    const SmokeDescription empty = smoke_of({});
    const BuiltField built(empty);
    const Ray ray = {vec(0, 0, 0), vec(1, 0, 0)};
    CHECK(extinction(built.field, vec(0, 0, 0)) == Real(0));
    CHECK(wisp::exp(-optical_depth(built.field, ray, Real(10))) == Real(1));
    CHECK(!first_collision(built.field, ray, Real(10), photon_event(1, 1)).found);
    SmokeDescription glowing = empty;
    glowing.emission = {1, 1, 1};
    for (const SmokeDescription &smoke : {empty, glowing}) {
        const Rendered picture = lit_picture(smoke, 2000);
        REQUIRE(picture.status == Status::done);
        for (size_t i = 0; i < picture.rgb.size(); i += 3) {
            CHECK(picture.rgb[i] == 1);
            CHECK(picture.rgb[i + 1] == 0.5f);
            CHECK(picture.rgb[i + 2] == 0.25f);
        }
        CHECK(picture.statistics.photons.collisions == 0);
    }
    Scene nothing = scene_of(empty);
    nothing.smoke_count = 0;
    CHECK(same_bits(render_in_memory(nothing, small_settings(8)), lit_picture(empty, 0)));
}

TEST_CASE(WISP_ARITH_NAME ": hard case C2: one particle has the optical depth of the closed form") {
    const BuiltField spline(smoke_of({{{0, 0, 0}, 1, 1}}));
    const double offsets[] = {0, 1, 1.5, 1.9, 2};
    const double depths[] = {0.5968310366, 0.1040963072, 0.01072717215, 4.223088e-5, 0};
    for (int i = 0; i < 5; ++i) {
        const double depth = at(optical_depth(spline.field, along_minus_z(offsets[i], 0), Real(200)));
        CAPTURE(offsets[i]);
        CHECK(std::fabs(depth - depths[i]) < 1e-10 + 20 * unit_error);
    }
    CHECK(optical_depth(spline.field, along_minus_z(2, 0), Real(200)) == Real(0));
    // poly6 over the same support of 2 H: 9 / (2 pi h^2) (1 - b^2 / h^2)^(7/2), h = 2
    const BuiltField poly6(smoke_of({{{0, 0, 0}, 1, 1}}, Kernel::poly6));
    for (double offset : offsets) {
        const double c = 1 - offset * offset / 4;
        CHECK(std::fabs(at(optical_depth(poly6.field, along_minus_z(offset, 0), Real(200))) -
                        9 / (8 * pi_) * std::pow(c, 3.5)) < 10 * unit_error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case C3: coincident particles look like one particle of their mass") {
    for (uint32_t count : {1000u, 1024u, 100000u}) {
        const std::vector<Particle> many(count, Particle{{0.5, 0.25, 0}, 1, 2.0 / count}),
            one = {{{0.5, 0.25, 0}, 1, 2}};
        const BuiltField a(smoke_of(many)), b(smoke_of(one));
        // Fixed rounds a particle's scale, which the kernel multiplies by up to 8, and the product. Float adds
        // count / 8 equal terms in each lane; the bound of such a sum is count / 8 roundings (measured: 1.2e-4 for
        // 1e5).
        const double own = is_fixed ? count * 5 * 0x1p-32 : 0;
        const double bar = is_f32 && count > 1024 ? count / 8 * 0x1p-24 : 1e-6;
        CAPTURE(count);
        CHECK(at(extinction(a.field, vec(0.5, 0.25, 0))) == doctest::Approx(2 * 15 / (8 * pi_)).epsilon(bar + own));
        for (double x : {0.7, 1.5, 2.4}) {
            const double expected = at(extinction(b.field, vec(x, 0.25, 0.1)));
            CHECK(std::fabs(at(extinction(a.field, vec(x, 0.25, 0.1))) - expected) < bar * expected + own);
        }
        const int pixels = count > 1024 ? 2 : 4;
        const Rendered x = lit_picture(smoke_of(many), 0, pixels), y = lit_picture(smoke_of(one), 0, pixels);
        for (size_t i = 0; i < x.rgb.size(); ++i)
            CHECK(std::fabs(x.rgb[i] - y.rgb[i]) <= (bar + 16 * own) * y.rgb[i]); // the depth is up to four units
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case C4: particles in a plane, on a line, and two alone have the right density, depth and picture") {
    std::vector<Particle> plane, line;
    for (const Particle &p : cloud(200, 3, 1, 0.3)) {
        plane.push_back({{p.position.x, p.position.y, 0.5}, p.h, p.area});
        line.push_back({{-1, p.position.y, 0.5}, p.h, p.area});
    }
    const std::vector<Particle> two = {{{-1, 0, 0}, 1, 1}, {{1, 0, 0}, 1, 1}},
                                along_z = {{{0, 0, -1}, 1, 1}, {{0, 0, 1}, 1, 1}};
    for (std::vector<Particle> particles : {plane, line, two, along_z})
        for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
            sort_canonically(particles);
            const SmokeDescription smoke = smoke_of(particles, kernel);
            const BuiltField built(smoke);
            Sequence next;
            for (int i = 0; i < 100; ++i) {
                const Vec3 x = vec(8 * next() - 4, 8 * next() - 4, i % 2 ? 0.5 : 8 * next() - 4);
                const double expected = brute_density(particles, kernel, at(x.x), at(x.y), at(x.z));
                CHECK(std::fabs(at(extinction(built.field, x)) - expected) < 40 * unit_error * (1 + expected));
            }
            // Through the whole plane, edge on.
            double whole = 0;
            for (const Particle &p : particles) {
                const BuiltField alone(smoke_of({p}, kernel));
                whole += at(optical_depth(alone.field, {vec(-1, -9, 0.5), vec(0, 1, 0)}, Real(18)));
            }
            CHECK(at(optical_depth(built.field, {vec(-1, -9, 0.5), vec(0, 1, 0)}, Real(18))) ==
                  doctest::Approx(whole).epsilon(100 * unit_error));
            const Rendered picture = lit_picture(smoke, 2000);
            check_valid(picture);
            CHECK(picture.statistics.photons.collisions > 0);
        }
}

TEST_CASE(WISP_ARITH_NAME ": hard case C5: kernels of any width have the right value at their centre") {
    // poly6's own h is 2 H. W(0) = 315 / (64 pi) h^-3: h^9 would be 0, subnormal or infinite in float.
    for (double h : {1e-5, 5e-5, 1e-6, 2e4}) {
        if (is_fixed) break; // below and above the range: the host brings every scene to H in [1, 2), see below
        const BuiltField built(smoke_of({{{0, 0, 0}, h / 2, 1}}, Kernel::poly6));
        const double expected = 315 / (64 * pi_) / (h * h * h);
        CAPTURE(h);
        CHECK(at(extinction(built.field, vec(0, 0, 0))) == doctest::Approx(expected).epsilon(1e-6));
        if (h == 1e-5) CHECK(expected == doctest::Approx(1.567e15).epsilon(3e-4));
        if (h == 1e-6) CHECK(expected == doctest::Approx(1.567e18).epsilon(3e-4));
    }
    // The same scene, smaller or larger by a power of two, gives the same bits.
    const TemporaryFolder folder;
    const auto points = points_of(100, 2);
    for (const char *kernel : {"poly6", "spline"}) {
        write_ply(folder.file("p.ply"), points, "double", {0, 0, 0});
        const Prepared whole = render_file(scene_text(folder.file("p.ply"), 1, {0, 0, 0}, kernel), 1000);
        check_valid(whole.picture);
        CHECK(whole.picture.statistics.photons.stored > 0);
        for (int exponent : {-17, -20, -60, 14}) {
            const double unit = std::ldexp(1.0, exponent);
            std::vector<Double3> scaled = points;
            for (Double3 &p : scaled) p = {p.x * unit, p.y * unit, p.z * unit};
            write_ply(folder.file("q.ply"), scaled, "double", {0, 0, 0});
            const Prepared small = render_file(scene_text(folder.file("q.ply"), unit, {0, 0, 0}, kernel), 1000);
            CAPTURE(exponent);
            CHECK(small.h == 1);
            CHECK(same_bits(whole.picture, small.picture));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case C6: a scene far inside every support has constant density") {
    // Size 1 and h = 1e6, in the units of the core: a scene of size 2^-20, h = 1. In float and double as written too.
    for (double unit : {0x1p-20, 1.0}) {
        if (is_fixed && unit == 1) break; // 1 / h^2 has no digits: the host brings h to [1, 2)
        const double h = unit == 1 ? 0x1p20 : 1, area = h * h * h;
        for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
            const auto particles = cloud(200, 0.5 * unit, h, area);
            const BuiltField built(smoke_of(particles, kernel));
            double low = 1e300, high = 0;
            Sequence next;
            for (int i = 0; i < 300; ++i) {
                const double x = next() - 0.5, y = next() - 0.5, z = next() - 0.5;
                const double density = at(extinction(built.field, vec(x * unit, y * unit, z * unit)));
                low = std::min(low, density);
                high = std::max(high, density);
            }
            const double peak = 200 * (kernel == Kernel::spline ? 15 / (8 * pi_) : 315 / (64 * pi_ * 8));
            CHECK(high - low <= 1e-6 * peak);
            // The spline falls by 1.5 q from its centre, with q up to 1.7e-6 / 2; 25 sums in each lane are rounded.
            CHECK(std::fabs(high - peak) <= (1.5 * 1.7e-6 + 30 * unit_error) * peak);
            const SmokeDescription smoke = smoke_of(particles, kernel);
            if (unit != 1) check_valid(lit_picture(smoke, 500, 4));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case C7: density is 0 at and beyond 2 h, and never negative") {
    for (Kernel kernel : {Kernel::spline, Kernel::poly6})
        for (int k = 0; k < 1000; ++k) {
            const double h = at(real(1 + k * 0x1.06p-10));
            const BuiltField built(smoke_of({{{0, 0, 0}, h, 1}}, kernel));
            const auto density = [&](double r) { return extinction(built.field, vec(r, 0, 0)); };
            CAPTURE(h);
            CHECK(density(2 * h * (1 - 0x1p-23)) >= Real(0));
            CHECK(density(2 * h * (1 + 0x1p-23)) == Real(0));
            // At 2 h itself 1 / h is rounded, unless it is a power of two, and squared: q is 2 within two units.
            CHECK(density(2 * h) >= Real(0));
            CHECK(at(density(2 * h)) <= (k == 0 ? 0 : std::pow(4 * unit_error, 3)));
            if (k % 20) continue;
            for (int i = -60; i <= 60; ++i) {
                const double r = 2 * h + i * 0x1p-24;
                CHECK(density(r) >= Real(0));
                CHECK(extinction(built.field, vec(r * 0.6, r * 0.8, 0)) >= Real(0)); // computed |x|
                CHECK(optical_depth(built.field, along_minus_z(r, 0), Real(200)) >= Real(0));
            }
        }
}

TEST_CASE(WISP_ARITH_NAME
          ": hard case C8: on cell boundaries and at -0 density is the sum over all particles, to the bit") {
    // A lattice, so that particles, boundaries of leaves and supports coincide; some coordinates are tiny.
    std::vector<Particle> lattice;
    for (int x = -4; x <= 4; ++x)
        for (int y = -4; y <= 4; ++y)
            for (int z = -4; z <= 4; ++z)
                lattice.push_back({{x * 0.5, y == 0 ? -0.0 : y * 0.5, z == 0 ? -1e-30 : z * 0.5}, 0.5, 0.3});
    sort_canonically(lattice);
    for (const auto &particles : {lattice, cloud(1000, 4, 1, 0.7)})
        for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
            const SmokeDescription source = smoke_of(particles, kernel);
            SmokeDescription wide = source;
            wide.largest_h = 50; // no leaf is culled: the sum gets more terms, all 0
            const BuiltField built(source), everywhere(wide);
            const auto check = [&](double x, double y, double z) {
                const Vec3 p = vec(x, y, z);
                const Real density = extinction(built.field, p);
                CHECK(density == extinction(everywhere.field, p));
                const double expected = brute_density(particles, kernel, at(p.x), at(p.y), at(p.z));
                CHECK(std::fabs(at(density) - expected) < 40 * unit_error * (1 + expected));
            };
            for (double x : {-3.0, -2.5, -1.0, -1e-30, -0.0, 0.0, 0.25, 1.0, 2.0, 3.0})
                for (double y : {-3.0, -0.5, -0.0, 0.0, 2.5}) check(x, y, x);
            Sequence next;
            for (int i = 0; i < 100; ++i) {
                const double x = 10 * next() - 5, y = 10 * next() - 5, z = 10 * next() - 5;
                check(x, y, z);
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": hard case C9: bad particles are refused with their line; mass 0 contributes nothing") {
    const struct {
        const char *row, *error;
    } bad[] = {
        {"nan 0 0 1 1", "x of point 1 is nan, expected a finite number"},
        {"0 inf 0 1 1", "y of point 1 is inf, expected a finite number"},
        {"0 0 -inf 1 1", "z of point 1 is -inf, expected a finite number"},
        {"0 0 0 -1 1", "mass of point 1 is -1, expected 0 or more"},
        {"0 0 0 nan 1", "mass of point 1 is nan, expected a finite number"},
        {"0 0 0 1 0", "smoothing length of point 1 is 0, expected more than 0"},
        {"0 0 0 1 -2", "smoothing length of point 1 is -2, expected more than 0"},
        {"0 0 0 1 inf", "smoothing length of point 1 is inf, expected a finite number"},
    };
    for (const auto &c : bad) CHECK(error_of_particles(ply(c.row)) == std::string("p.ply:11: ") + c.error);
    CHECK(error_of_particles(ply("0 0 0 0 1")) == "no error");
    for (const char *line : {"radius 0", "radius -1", "radius nan", "mass -1", "mass inf"}) {
        std::string error = "no error";
        try {
            parse_scene("s.aff", std::string("smoke p.ply {\n ") + line + " }");
        } catch (const InputError &e) {
            error = e.what();
        }
        CAPTURE(line);
        CHECK(error.substr(0, 8) == "s.aff:2:");
    }

    std::vector<Particle> particles = cloud(3, 1, 1, 0.7);
    const BuiltField without(smoke_of(particles));
    particles.push_back({{2, 2, 2}, 1, 0}); // the last in order
    const BuiltField with(smoke_of(particles)), alone(smoke_of({{{0, 0, 0}, 1, 0}}));
    CHECK(extinction(alone.field, vec(0, 0, 0)) == Real(0));
    CHECK(!first_collision(alone.field, along_minus_z(0, 0), Real(200), photon_event(1, 1)).found);
    for (double x : {0.0, 0.5, 1.5, 2.0})
        CHECK(extinction(with.field, vec(x, x, x)) == extinction(without.field, vec(x, x, x)));
}

TEST_CASE(WISP_ARITH_NAME ": hard case C10: the order of 27,601 particles in the file changes no bit") {
    const TemporaryFolder folder;
    std::vector<Double3> points = points_of(27601, 2);
    points[5] = points[4]; // coincident ones too
    const auto render_shuffled = [&](uint64_t seed) {
        Sequence next{seed};
        for (size_t i = points.size() - 1; seed > 0 && i > 0; --i)
            std::swap(points[i], points[static_cast<size_t>(next() * static_cast<double>(i + 1))]);
        write_ply(folder.file("p.ply"), points, "float", {0, 0, 0});
        return render_file(scene_text(folder.file("p.ply"), 1, {0, 0, 0}, "spline", 0.005), 300).picture;
    };
    const Rendered first = render_shuffled(0);
    check_valid(first);
    CHECK(first.statistics.photons.stored > 50);
    for (uint64_t seed : {1u, 2u}) {
        const Rendered other = render_shuffled(seed);
        CHECK(same_bits(first, other));
        CHECK(first.statistics.photons.collisions == other.statistics.photons.collisions);
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case C11: a scene far from the origin gives the picture of the scene at the origin") {
    const TemporaryFolder folder;
    const auto points = points_of(200, 2);
    const auto render_at = [&](double offset, const char *type) {
        const Double3 to = {offset, -offset, offset};
        write_ply(folder.file("p.ply"), points, type, to);
        return render_file(scene_text(folder.file("p.ply"), 1, to, "spline"), 0);
    };
    const Prepared here = render_at(0, "double");
    check_valid(here.picture);
    for (double offset : {1e3, 1e5, 1e6, 1e7}) {
        const Prepared there = render_at(offset, "double");
        CAPTURE(offset);
        CHECK(largest_difference_of_bytes(here.picture, there.picture, 8) <= 1);
    }
    // Float positions at 1e6 are multiples of 1/16: with h = 1/16 the user gets a note.
    const double small = 0.0625;
    std::vector<Double3> fine = points;
    for (Double3 &p : fine) p = {p.x * small, p.y * small, p.z * small};
    const auto notes_at = [&](double offset) {
        write_ply(folder.file("q.ply"), fine, "float", {offset, 0, 0});
        std::string all;
        for (const std::string &note :
             render_file(scene_text(folder.file("q.ply"), small, {offset, 0, 0}, "spline"), 0).notes)
            all += note;
        return all;
    };
    CHECK(notes_at(1e6).find("positions are coarser") != std::string::npos);
    CHECK(notes_at(0) == "");
}

TEST_CASE(WISP_ARITH_NAME ": hard case C12: particles are found whose smoothing lengths differ 1e4 times") {
    // Fixed holds a ratio of 4096; the host refuses 1e4 there.
    for (double large : {64.0, is_fixed ? 4000 : 1e4})
        for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
            const double area = large == 64 ? 500 : 1e9;
            std::vector<Particle> particles = cloud(200, 5, 1, 0.3);
            particles.push_back({{1, 2, 3}, large, area});
            particles.push_back({{3, 3, 3}, 8, 20});
            sort_canonically(particles);
            const BuiltField built(smoke_of(particles, kernel));
            // In fixed 1 / h^2 of the large one (h = 2 H for poly6) is rounded by half a unit. Its kernel f(q^2)
            // changes by that fraction of q^2 f', which is at most 1.8 (spline) or 0.45 (poly6), times area C / h^3.
            const double h = kernel == Kernel::spline ? large : 2 * large,
                         steepest = kernel == Kernel::spline ? 15 / (64 * pi_) * 1.8 : 315 / (64 * pi_) * 0.45;
            const double loss = is_fixed ? steepest * area / (h * h * h) * (h * h * 0x1p-33) : 0;
            Sequence next;
            for (int i = 0; i < 200; ++i) {
                const double size = i % 2 ? 12 : large; // among the small ones, and where only the large one is
                const Vec3 x = vec(size * (next() - 0.5), size * (next() - 0.5), size * (next() - 0.5));
                const double expected = brute_density(particles, kernel, at(x.x), at(x.y), at(x.z));
                CHECK(std::fabs(at(extinction(built.field, x)) - expected) < 1e-5 * expected + 1e-8 + loss);
            }
        }
    // A file with such particles is rendered or, in fixed, refused.
    const TemporaryFolder folder;
    const std::string text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
                             "float z\nproperty double h\nend_header\n0 0 0 1e4\n1 1 1 1\n";
    write_file(folder.file("h.ply"), text);
    std::string scene = scene_text(folder.file("h.ply"), 1, {0, 0, 0}, "spline");
    scene.erase(scene.find("radius 1 "), 8);
    scene.replace(scene.find("8 8"), 3, "1 1"); // 80,000 steps a pixel
    std::string error = "no error";
    try {
        check_valid(render_file(scene, 0).picture);
    } catch (const InputError &e) {
        error = e.what();
    }
    CAPTURE(error);
    CHECK(error.find(is_fixed ? "for fixed point, expected a scene that fits" : "no error") != std::string::npos);
}

TEST_CASE(WISP_ARITH_NAME ": hard case C15: optical depth integrated over a plane is C_ext times the mass") {
    const auto particles = cloud(100, 3, 1, 0.25);
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const BuiltField built(smoke_of(particles, kernel));
        const int n = 512;
        const double width = 12;
        double sum = 0;
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < n; ++k)
                sum += at(optical_depth(built.field,
                                        along_minus_z(((i + 0.5) / n - 0.5) * width, ((k + 0.5) / n - 0.5) * width),
                                        Real(200)));
        CHECK(sum * width * width / (n * n) == doctest::Approx(100 * 0.25).epsilon(1e-3));
    }
}
