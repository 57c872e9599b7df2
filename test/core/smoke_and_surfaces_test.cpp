// Smoke and surfaces in one picture: how far rays march, what lights smoke, where photons end. Hard case E14.
#include "built_bricks.h"
#include "built_surfaces.h"
#include "compared_pictures.h"
#include "host/double3.h"
#include "wisp/render.h"
#include <cstring>
#include <functional>

namespace wisp::WISP_ARITH {

namespace {

constexpr double pi_ = 3.14159265358979323846;

enum class Way { direct, volume, bricks, elements, reference };
constexpr Way marched[] = {Way::direct, Way::volume, Way::bricks, Way::elements};

Settings settings_of(Way way, int pixels = 1, uint64_t photons = 0) {
    Settings settings = small_settings(pixels);
    settings.depth = 10;
    settings.photons = photons;
    settings.method = way == Way::direct ? Method::direct : way == Way::volume ? Method::volume : Method::map;
    settings.reference = way == Way::reference;
    if (way == Way::volume || way == Way::bricks) settings.density_step = settings.light_step = 1;
    return settings;
}

// Surfaces, lights and smoke.
struct Place : Room {
    const Scene &shown() {
        scene.still_count = static_cast<uint32_t>(triangles.size());
        build();
        scene.smokes = smokes.data();
        scene.smoke_count = static_cast<uint32_t>(smokes.size());
        return scene;
    }
    uint32_t glowing(double red) { return material({{red, red / 2, red / 4}, {0, 0, 0}, {0, 0, 0}, 1, 0, 1}); }
    // Across the axis, its middle on it; `axis` 0, 1, 2.
    void plate(int axis, double at, double half, uint32_t material) {
        const auto corner = [&](double u, double v) {
            return axis == 0 ? Double3{at, u, v} : axis == 1 ? Double3{v, at, u} : Double3{u, v, at};
        };
        add(corner(-half, -half), corner(half, -half), corner(half, half), corner(-half, half), material);
    }
    void closed_box(double half, uint32_t material) {
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {-half, half}) plate(axis, side, half, material);
    }

    std::vector<SmokeSource> smokes;
};

// A cube of even smoke from -2 to 2.
constexpr double half_edge = 2;
SmokeSource fog(double sigma, double cells = 8) { return box_smoke({half_edge, half_edge, half_edge}, sigma, cells); }

// What one ray sees, in red, and the standard error of that.
struct Seen {
    double red, error;
    Statistics statistics;
};
Seen look(Place &place, Way way, const Double3 &from, const Double3 &along, uint32_t passes = 4,
          const std::function<void(Settings &)> &change = {}) {
    place.shown();
    Scene scene = place.scene;
    scene.camera = {from, along, {0, 0, 0}, {0, 0, 0}};
    if (way == Way::reference) {
        for (SmokeSource &smoke : place.smokes)
            if (smoke.is_grid()) smoke.smallest_h = smoke.largest_h = 2; // wide majorants: all are equal
        double noise;
        const double red = reference_of(scene, 1, passes, noise, 10)[0];
        return {red, red > 0 ? noise * red : 0, {}};
    }
    Settings settings = settings_of(way);
    if (change) change(settings);
    const Rendered picture = render_in_memory(scene, settings);
    REQUIRE(picture.status == Status::done);
    return {picture.rgb[0], 0, picture.statistics};
}

// Of a sum of some 60 depths of about 0.03, and of its exponential.
constexpr double dimming_error = std::max(1.2e-7, 64 * unit_error); // and of a float

void check_dimmed(Place &place, const Double3 &from, const Double3 &along, double expected) {
    for (const Way way : {Way::direct, Way::volume, Way::bricks, Way::elements, Way::reference}) {
        CAPTURE(static_cast<int>(way));
        CHECK(look(place, way, from, along).red == doctest::Approx(expected).epsilon(dimming_error));
    }
}

// How far it is from a point in the cube of smoke to its surface.
double way_out(const Double3 &p, const Double3 &way) {
    double far = 1e9;
    for (const auto &[x, d] : {std::pair{p.x, way.x}, {p.y, way.y}, {p.z, way.z}})
        if (d != 0) far = std::min(far, ((d < 0 ? -half_edge : half_edge) - x) / d);
    return far;
}

// The light that fog scatters once, evenly, along x from -2 on, where lit(x) says which points have light: its integral
// in double, and the greatest value of what is integrated.
struct Integral {
    double sum, greatest;
};
Integral scattered_once(double sigma, double albedo, const LightSource &light, double y, double z,
                        const std::function<bool(const Double3 &)> &lit) {
    constexpr int steps = 20000;
    constexpr double dx = 2 * half_edge / steps;
    Integral integral = {0, 0};
    for (int i = 0; i < steps; ++i) {
        const Double3 p = {-half_edge + (i + 0.5) * dx, y, z};
        Double3 to_light = light.direction * -1.0;
        double irradiance = light.color.x;
        if (light.kind != LightKind::parallel) {
            to_light = unit(light.position - p);
            const double distance = length(light.position - p);
            if (light.kind != LightKind::constant) irradiance /= distance * distance;
            if (light.kind == LightKind::spot && 1 + dot(to_light, light.direction) > light.one_minus_cosine) continue;
        }
        if (!lit(p)) continue;
        const double value =
            sigma * albedo / (4 * pi_) * irradiance * std::exp(-sigma * (p.x + half_edge + way_out(p, to_light)));
        integral.sum += value * dx;
        integral.greatest = std::max(integral.greatest, value);
    }
    return integral;
}

bool same(const std::vector<float> &a, const std::vector<float> &b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a surface behind smoke is dimmed by Beer and Lambert's law, in mirrors and glass, too") {
    constexpr double sigma = 0.4;
    const Double3 inwards = {0, 0, -1};
    Place behind;
    behind.smokes = {fog(sigma)};
    behind.plate(2, -3, 9, behind.glowing(0.5));
    check_dimmed(behind, {0.1, 0.2, 12}, inwards, 0.5 * std::exp(-4 * sigma));
    check_dimmed(behind, {0, 0, 6}, {0.1, -0.05, -1}, 0.5 * std::exp(-4 * sigma * std::sqrt(1.0125)));
    check_dimmed(behind, {0.1, 0.2, 0.5}, inwards, 0.5 * std::exp(-2.5 * sigma)); // from within
    check_dimmed(behind, {0.1, 0.2, -2.5}, inwards, 0.5);

    // Down to a mirror in the smoke, and up to a ceiling: both ways through it.
    Place mirrored;
    mirrored.smokes = {fog(sigma)};
    mirrored.plate(1, -1, 9, mirrored.material(mirror(0.5)));
    mirrored.plate(1, 6, 20, mirrored.glowing(0.5));
    check_dimmed(mirrored, {-5, 4, 0.3}, {1, -1, 0}, 0.25 * std::exp(-4 * std::sqrt(2.0) * sigma));

    // Smoke in glass is smoke; straight on, glass of any index turns nothing.
    for (const double index : {1.0, 1.5}) {
        Place glazed;
        glazed.smokes = {fog(sigma)};
        glazed.plate(2, -3, 9, glazed.glowing(0.5));
        const uint32_t pane = glazed.material(glass(index));
        glazed.plate(2, 1, 9, pane);
        glazed.plate(2, -1.25, 9, pane);
        check_dimmed(glazed, {0.1, 0.2, 12}, inwards, 0.5 * std::exp(-4 * sigma));
        if (index == 1)
            check_dimmed(glazed, {0, 0, 6}, {0.1, -0.05, -1}, 0.5 * std::exp(-4 * sigma * std::sqrt(1.0125)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": light that comes to a surface through smoke is dimmed by it") {
    constexpr double sigma = 0.4;
    for (const LightKind kind : {LightKind::constant, LightKind::point, LightKind::spot, LightKind::parallel}) {
        CAPTURE(static_cast<int>(kind));
        Place place;
        place.smokes = {fog(sigma)};
        place.plate(2, -3, 9, place.material(matte({0.5, 0.5, 0.5})));
        place.light(kind, {0, 0, 5}, {8, 8, 8});
        // The camera looks along the wall from below the smoke, at its middle.
        const double irradiance = kind == LightKind::point || kind == LightKind::spot ? 8.0 / 64 : 8;
        const double lambert = kind == LightKind::constant ? 0.5 : 0.5 / pi_;
        check_dimmed(place, {0, 0, -2.5}, {0, 0, -1}, irradiance * lambert * std::exp(-4 * sigma));
        place.smokes.clear();
        CHECK(look(place, Way::direct, {0, 0, -2.5}, {0, 0, -1}).red ==
              doctest::Approx(irradiance * lambert).epsilon(dimming_error));
    }
}

TEST_CASE(WISP_ARITH_NAME ": hard case E14: an object in the smoke ends the march, with its own light behind what is "
                          "before it, and nothing of the smoke behind it") {
    constexpr double sigma = 0.4, glow = 0.75, own = 0.5;
    for (const double wall : {0.5, -0.3, -1.9}) {
        Place place;
        place.smokes = {fog(sigma)};
        place.smokes[0].albedo = {0, 0, 0};
        place.smokes[0].emission = {glow, glow, glow};
        place.plate(2, wall, 9, place.glowing(own));
        const auto expected = [&](double way) { return glow + (own - glow) * std::exp(-sigma * way); };
        const auto check = [&](const Double3 &from, const Double3 &along, double way) {
            for (const Way each : marched) {
                CAPTURE(static_cast<int>(each));
                CHECK(look(place, each, from, along).red == doctest::Approx(expected(way)).epsilon(dimming_error));
            }
            const Seen truth = look(place, Way::reference, from, along, 2000);
            CHECK(std::fabs(truth.red - expected(way)) < 4 * truth.error + dimming_error);
        };
        check({0.1, 0.2, 12}, {0, 0, -1}, 2 - wall);
        check({0.1, 0.2, 1}, {0, 0, -1}, 1 - wall);
        check({0.1, 0.2, -12}, {0, 0, 1}, wall + 2); // its back
    }
    // All smoke is behind it: the picture without smoke, to the bit.
    for (const Way way : {Way::direct, Way::volume, Way::bricks, Way::elements, Way::reference}) {
        Place place;
        place.smokes = {fog(sigma)};
        place.smokes[0].emission = {glow, glow, glow};
        place.plate(2, 2.5, 9, place.glowing(own));
        const Seen hidden = look(place, way, {0.1, 0.2, 12}, {0.01, 0, -1});
        place.smokes.clear();
        CHECK(hidden.red == look(place, Way::direct, {0.1, 0.2, 12}, {0.01, 0, -1}).red);
        CHECK(hidden.statistics.smoke.march_samples == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": a plate between a light and smoke shades half of it; one that light passes shades nothing") {
    constexpr double sigma = 0.4, albedo = 0.0009765625, step = 1.0 / 32, y = 0.4, z = 0.2;
    const Double3 from = {-6, y, z}, along = {1, 0, 0};
    const LightSource lights[] = {{LightKind::parallel, {}, {0, -0.96, -0.28}, 2, {512, 512, 512}},
                                  {LightKind::constant, {0.5, 6, 0.25}, {0, -1, 0}, 2, {512, 512, 512}},
                                  {LightKind::point, {0.5, 6, 0.25}, {0, -1, 0}, 2, {8192, 8192, 8192}},
                                  {LightKind::spot, {0.5, 6, 0.25}, {0, -1, 0}, 0.03125, {8192, 8192, 8192}}};
    for (const LightSource &light : lights) {
        CAPTURE(static_cast<int>(light.kind));
        // Above the smoke, at y = 3, over x < 0.
        const auto place_with = [&](const Material &material) {
            Place place;
            place.smokes = {fog(sigma, 32)};
            place.smokes[0].albedo = {albedo, albedo, albedo};
            const uint32_t number = place.material(material);
            place.add({-9, 3, -9}, {0, 3, -9}, {0, 3, 9}, {-9, 3, 9}, number);
            place.lights = {light};
            return place;
        };
        const auto lit = [&](const Double3 &p) { // where the way to the light passes y = 3
            const Double3 way = light.kind == LightKind::parallel ? light.direction * -1.0 : light.position - p;
            return p.x + way.x * (3 - p.y) / way.y > 0;
        };
        const auto fine = [&](Settings &settings) { settings.step = step; };
        const Integral half = scattered_once(sigma, albedo, light, y, z, lit),
                       all = scattered_once(sigma, albedo, light, y, z, [](const Double3 &) { return true; });
        CHECK(half.sum < 0.75 * all.sum);
        Place opaque = place_with(matte({1, 1, 1})), clear = place_with(glass(1)), none = place_with(matte({1, 1, 1}));
        for (Triangle &triangle : none.triangles)
            for (Double3 &corner : triangle.corner) corner.y = -9;
        // A shadow's edge falls somewhere in a step, and is taken to be at an end of it; so does that of a cone, twice.
        const double dx = step * fog(sigma, 32).smallest_h;
        const double edges = light.kind == LightKind::spot ? 3 : 1, bar = 0.5 * edges * dx * half.greatest;
        CHECK(bar < 0.01 * half.sum);
        for (const Way way : marched) {
            CAPTURE(static_cast<int>(way));
            const double shaded = look(opaque, way, from, along, 0, fine).red,
                         open = look(none, way, from, along, 0, fine).red;
            // Depths that are kept between nodes 1/8 apart curve by less than 0.02 of sigma.
            CHECK(std::fabs(shaded - half.sum) < bar + 1e-3 * half.sum);
            CHECK(std::fabs(open - all.sum) < bar + 1e-3 * all.sum);
            CHECK(look(clear, way, from, along, 0, fine).red == open);
        }
        // What is scattered twice is less than the albedo of all.
        const Seen truth = look(opaque, Way::reference, from, along, 2000);
        CHECK(truth.error < 0.05 * half.sum);
        CHECK(std::fabs(truth.red - half.sum) < 4 * truth.error + albedo * all.sum);
        CHECK(look(clear, Way::reference, from, along, 50).red == look(none, Way::reference, from, along, 50).red);
        CHECK(look(clear, Way::reference, from, along, 50).red > 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a lamp on a ceiling lights the smoke below as if that were not there; one under it none "
                          "above") {
    // In the ceiling itself a lamp shines to both sides, as it does for surfaces (hard case E6).
    for (const LightKind kind : {LightKind::constant, LightKind::point, LightKind::spot})
        for (const double height : {3.0, -3.0}) { // of the ceiling: above the smoke, or below it
            CAPTURE(height);
            Place bare;
            bare.smokes = {fog(0.4)};
            bare.light(kind, {0.3, height, 0.2}, {4, 4, 4}, {0, -1, 0});
            if (height < 0)
                bare.light(kind, {0.3, height, 0.2}, {4, 4, 4}, {0, 1, 0}), bare.lights.erase(bare.lights.begin());
            Place roofed = bare;
            roofed.plate(1, height, 9, roofed.material(matte({1, 1, 1})));
            Place under = roofed;
            under.lights[0].position.y -= 4 * under.scene.skin;
            for (const Way way : {Way::direct, Way::volume, Way::bricks, Way::elements, Way::reference}) {
                CAPTURE(static_cast<int>(way));
                const Double3 from = {-6, 0.4, 0.3}, along = {1, 0.01, 0.02};
                const double open = look(bare, way, from, along, 50).red;
                CHECK(open > 0);
                CHECK(look(roofed, way, from, along, 50).red == open);
                const double below = look(under, way, from, along, 50).red;
                if (height < 0)
                    CHECK(below == 0);
                else
                    CHECK(below == doctest::Approx(open).epsilon(0.02));
            }
        }
}

namespace {

bool adds_up(const Statistics::Photons &n) { return n.emitted == n.absorbed + n.escaped + n.blocked + n.capped; }

struct MapWay {
    Way way;
    Deposit deposit;
};
constexpr MapWay photon_ways[] = {{Way::direct, Deposit::exact},  {Way::volume, Deposit::exact},
                                  {Way::bricks, Deposit::exact},  {Way::elements, Deposit::exact},
                                  {Way::elements, Deposit::path}, {Way::elements, Deposit::kernel}};

std::function<void(Settings &)> with_photons(const MapWay &each, uint64_t photons) {
    return [each, photons](Settings &settings) {
        settings.photons = photons;
        settings.deposit = each.deposit;
    };
}

// A puff of particles within 2.2 of the middle, the half of it that `keep` wants.
std::vector<Particle> puff() { return cloud(300, 1.2, 0.5, 0.1); }

const LightSource outside_lights[] = {{LightKind::point, {1, 6, 2}, {0, -1, 0}, 2, {90, 90, 90}},
                                      {LightKind::spot, {-1, 7, 1}, {0, -1, 0}, 0.25, {90, 90, 90}},
                                      {LightKind::parallel, {}, {0, -0.96, -0.28}, 2, {2, 2, 2}},
                                      {LightKind::constant, {0, 6, 0}, {0, -1, 0}, 2, {1, 1, 1}}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": photons in a closed box do not escape, and each ends once") {
    const std::vector<Particle> particles = puff();
    for (const MapWay &each : photon_ways)
        for (const bool glows : {false, true}) {
            CAPTURE(static_cast<int>(each.way));
            Place place;
            place.smokes = {smoke_of(particles)};
            place.closed_box(2.5, place.material(matte({0.5, 0.5, 0.5})));
            if (glows)
                place.smokes[0].emission = {1, 1, 1};
            else
                place.light(LightKind::point, {0.5, 2, 0.5}, {9, 9, 9});
            const Statistics::Photons n =
                look(place, each.way, {0, 0, 2.4}, {0, 0, -1}, 0, with_photons(each, 3000)).statistics.photons;
            CHECK(n.emitted == 3000);
            CHECK(adds_up(n));
            CHECK(n.escaped == 0);
            CHECK(n.blocked > 300);
            CHECK(n.absorbed > 100);
            CHECK(n.stored > 300);
            // Through walls that light passes they leave.
            place.materials[0].transmission = 0.5;
            const auto out =
                look(place, each.way, {0, 0, 2.4}, {0, 0, -1}, 0, with_photons(each, 3000)).statistics.photons;
            CHECK(out.blocked == 0);
            CHECK(adds_up(out));
            CHECK(out.escaped > 300);
        }
}

TEST_CASE(WISP_ARITH_NAME ": a wall between every light and the smoke leaves no photon and no light in it") {
    const std::vector<Particle> particles = puff();
    for (const MapWay &each : photon_ways)
        for (const LightSource &light : outside_lights)
            for (const double wall : {2.5, 5.0}) { // near the smoke; beyond the ball around it, where photons start
                CAPTURE(static_cast<int>(each.way));
                CAPTURE(static_cast<int>(light.kind));
                CAPTURE(wall);
                Place place;
                place.smokes = {smoke_of(particles)};
                place.plate(1, wall, 40, place.material(matte({0.5, 0.5, 0.5})));
                place.lights = {light};
                const Seen dark = look(place, each.way, {0.1, 0.2, 4}, {0, 0, -1}, 0, with_photons(each, 1000));
                const auto &n = dark.statistics.photons;
                CHECK(n.emitted == 1000);
                CHECK(adds_up(n));
                CHECK(n.collisions == 0);
                CHECK(n.stored == 0);
                CHECK(n.absorbed == 0);
                CHECK(n.blocked > 100);
                CHECK(dark.red == 0);
                place.materials[0].transmission = 0.5;
                const Seen lit = look(place, each.way, {0.1, 0.2, 4}, {0, 0, -1}, 0, with_photons(each, 1000));
                CHECK(lit.statistics.photons.stored > 0);
                CHECK(lit.red > 0);
            }
}

TEST_CASE(WISP_ARITH_NAME ": behind a wall in the smoke photons leave nothing, wherever they deposit along their way") {
    // The wall cuts through the smoke at x = 0; the light is on the side of -x, and nothing scatters outside the smoke.
    const std::vector<Particle> particles = puff();
    for (const MapWay &each : photon_ways) {
        if (each.way == Way::direct || each.way == Way::volume) continue;
        CAPTURE(static_cast<int>(each.way));
        CAPTURE(static_cast<int>(each.deposit));
        Place place;
        place.smokes = {smoke_of(particles)};
        place.plate(0, 0, 40, place.material(matte({0, 0, 0})));
        place.light(LightKind::point, {-3, 3, 1}, {90, 90, 90});
        const auto seen_at = [&](double x) {
            return look(place, each.way, {x, 0.1, 4}, {0, 0, -1}, 0, with_photons(each, 4000)).red;
        };
        // A particle behind the wall may reach through it: what lies a support, or a cell, farther has none of that.
        CHECK(seen_at(-0.5) > 0);
        CHECK(seen_at(each.way == Way::bricks ? 0.6 : 1.05) == 0);
        CHECK(seen_at(1.3) == 0);
        place.materials[0].transmission = 1;
        place.materials[0].index = 1;
        CHECK(seen_at(1.05) > 0);
        CHECK(seen_at(1.3) > 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": walls that light passes change no bit of a particle map") {
    const std::vector<Particle> particles = puff();
    for (const MapWay &each : photon_ways) {
        if (each.way == Way::direct || each.way == Way::volume) continue;
        std::vector<int64_t> maps[3];
        Statistics statistics[3];
        for (int walls = 0; walls < 3; ++walls) {
            Place place;
            place.smokes = {smoke_of(particles)};
            place.smokes[0].asymmetry = 0.5;
            place.lights.assign(std::begin(outside_lights), std::end(outside_lights));
            if (walls > 0) {
                const uint32_t material = place.material(walls == 1 ? glass(1.5) : matte({1, 1, 1}));
                place.closed_box(1.5, material);
                place.plate(0, 0.25, 1, material);
            }
            const Scene &scene = place.shown();
            Settings settings = settings_of(each.way);
            with_photons(each, 1000)(settings);
            const Plan planned = plan(scene, settings);
            std::vector<unsigned char> memory(planned.bytes.arena);
            Arena arena(memory.data(), memory.size());
            maps[walls].resize(planned.map_sums);
            MapSums sums = {maps[walls].data(), planned.map_sums, 0};
            REQUIRE(trace_map(scene, settings, all_batches(settings), arena, Observer{}, sums, statistics[walls]) ==
                    Status::done);
            REQUIRE(sums.count > 0);
            maps[walls].resize(sums.count);
        }
        CHECK(maps[0] == maps[1]);
        CHECK(maps[0] != maps[2]);
        CHECK(statistics[0].photons.escaped == statistics[1].photons.escaped);
        CHECK(statistics[1].photons.blocked == 0);
        CHECK(statistics[2].photons.blocked > 0);
    }
}

} // namespace wisp::WISP_ARITH
