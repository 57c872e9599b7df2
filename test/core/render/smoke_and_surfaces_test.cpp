// Smoke and surfaces in one picture: how far rays march, what lights smoke, where photons end. Hard case E14.
#include "support/animated_room.h"
#include "support/built_sparse_grid.h"
#include "support/compared_pictures.h"
#include "support/mixture.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"
#include <cstring>

namespace wisp::WISP_ARITH {

namespace {

enum class Way { direct, volume, bricks, elements, nodes, reference };
constexpr Way marched[] = {Way::direct, Way::volume, Way::bricks, Way::elements, Way::nodes};

Settings settings_of(Way way, int pixels = 1, uint64_t photons = 0) {
    Settings settings = small_settings(pixels);
    settings.depth = 10;
    settings.photons = photons;
    settings.method = way == Way::direct ? Method::direct : way == Way::volume ? Method::volume : Method::map;
    settings.goal = way == Way::reference ? Goal::reference : Goal::picture;
    if (way == Way::volume || way == Way::bricks) settings.density_step = settings.light_step = 1;
    if (way == Way::nodes) {
        settings.deposit = Deposit::nodes;
        settings.irradiance = IrradianceMap::uniform;
        settings.irradiance_step = 1;
    }
    return settings;
}

// Surfaces, lights and smoke.
struct Place : Room {
    const Scene &shown() {
        scene.static_count = static_cast<uint32_t>(triangles.size());
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

    std::vector<SmokeDescription> smokes;
};

// A cube of even smoke from -2 to 2.
constexpr double half_edge = 2;
SmokeDescription fog(double sigma, double cells = 8) {
    return box_smoke({half_edge, half_edge, half_edge}, sigma, cells);
}

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
        for (SmokeDescription &smoke : place.smokes)
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
    constexpr double sigma = 0.4, albedo = 0.0009765625, step = 1.0 / 16, y = 0.4, z = 0.2;
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
            place.smokes = {fog(sigma, 16)};
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
        // A shadow's edge falls somewhere in a step, and is known to a 32nd of it. Two edges of a cone fall somewhere,
        // too.
        const double dx = step * fog(sigma, 16).smallest_h;
        const double edges = light.kind == LightKind::spot ? 2 : 1.0 / 32, bar = 0.5 * edges * dx * half.greatest;
        CHECK(bar < 0.02 * half.sum);
        for (const Way way : marched) {
            CAPTURE(static_cast<int>(way));
            const double shaded = look(opaque, way, from, along, 0, fine).red,
                         open = look(none, way, from, along, 0, fine).red;
            // Depths that are kept between nodes 1/4 apart curve by less than 0.02 of sigma.
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

TEST_CASE(WISP_ARITH_NAME ": light through slits that are narrower than a step") {
    constexpr double sigma = 0.4, albedo = 0.0009765625, y = 0.4, z = 0.2, step = 1;
    const Double3 from = {-6, y, z}, along = {1, 0, 0};
    for (const double width : {0.0625, 0.25})
        for (const double first : {-1.5, -0.03, 0.0, 0.11}) // of three slits, the middle
            for (const bool is_parallel : {false, true}) {
                CAPTURE(width);
                CAPTURE(first);
                Place place;
                place.smokes = {fog(sigma, 4)};
                place.smokes[0].albedo = {albedo, albedo, albedo};
                if (is_parallel)
                    place.light(LightKind::parallel, {}, {512, 512, 512}, unit({0.1, -1, 0.3}));
                else
                    place.light(LightKind::point, {0.5, 9, 0.25}, {40960, 40960, 40960});
                const uint32_t number = place.material(matte({1, 1, 1}));
                double begin = -9;
                for (int i = 0; i < 4; ++i) {
                    const double end = i < 3 ? first + 0.7 * i - width / 2 : 9;
                    place.add({begin, 3, -9}, {end, 3, -9}, {end, 3, 9}, {begin, 3, 9}, number);
                    begin = end + width;
                }
                const LightSource &light = place.lights[0];
                const auto lit = [&](const Double3 &p) {
                    const Double3 way = is_parallel ? light.direction * -1.0 : light.position - p;
                    const double x = p.x + way.x * (3 - p.y) / way.y - first;
                    return std::fabs(x - 0.7 * std::clamp(std::round(x / 0.7), 0.0, 2.0)) < width / 2;
                };
                const Integral slits = scattered_once(sigma, albedo, light, y, z, lit);
                const double dx = step * place.smokes[0].smallest_h;
                CHECK(dx > 3 * width);
                for (const Way way : marched) {
                    CAPTURE(static_cast<int>(way));
                    const double seen =
                        look(place, way, from, along, 0, [](Settings &settings) { settings.step = step; }).red;
                    // Each edge is known to half of a 32nd of a step. Light falls by up to a fifth within a step, and
                    // is that in its middle.
                    CHECK(std::fabs(seen - slits.sum) < 6 * dx / 64 * slits.greatest + 0.1 * slits.sum);
                }
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
            under.lights[0].position.y -= 4 * under.scene.ray_epsilon;
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

struct MapWay {
    Way way;
    Deposit deposit;
};
constexpr MapWay photon_ways[] = {{Way::direct, Deposit::exact},  {Way::volume, Deposit::exact},
                                  {Way::bricks, Deposit::exact},  {Way::elements, Deposit::exact},
                                  {Way::elements, Deposit::path}, {Way::elements, Deposit::kernel},
                                  {Way::nodes, Deposit::nodes}};

std::function<void(Settings &)> with_photons(const MapWay &each, uint64_t photons) {
    return [each, photons](Settings &settings) {
        settings.photons = photons;
        settings.deposit = each.deposit;
    };
}

// What an eye in the middle of the smoke sees of it, away from a light that is up and in front: the sum of three rays.
struct FromWithin {
    double truth, seen, once; // of the reference, with 500,000 photons, without any
};
FromWithin look_from_within(Place &place, Way way) {
    FromWithin found = {0, 0, 0};
    double variance = 0;
    for (const Double3 &along : {Double3{-0.6, -0.48, -0.64}, {-0.48, -0.64, -0.6}, {-0.36, -0.48, -0.8}}) {
        Place widely = place; // its majorants
        const Seen expected = look(widely, Way::reference, {0, 0, 0}, along, 60000);
        found.truth += expected.red;
        variance += expected.error * expected.error;
        found.seen += look(place, way, {0, 0, 0}, along, 0, with_photons({way, Deposit::nodes}, 500000)).red;
        found.once += look(place, way, {0, 0, 0}, along).red;
    }
    CAPTURE(found.seen / found.truth);
    CAPTURE(found.once / found.truth);
    CHECK(std::sqrt(variance) < 0.01 * found.truth);
    return found;
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
                look(place, each.way, {0, 0, 2.4}, {0, 0, -1}, 0, with_photons(each, 1000)).statistics.photons;
            CHECK(n.emitted == 1000);
            CHECK(adds_up(n));
            CHECK(n.escaped == 0);
            CHECK(n.blocked > 100);
            CHECK(n.absorbed > 30);
            CHECK(n.stored > 100);
            // Through walls that light passes they leave.
            place.materials[0].transmission = 0.5;
            const auto out =
                look(place, each.way, {0, 0, 2.4}, {0, 0, -1}, 0, with_photons(each, 1000)).statistics.photons;
            CHECK(out.blocked == 0);
            CHECK(adds_up(out));
            CHECK(out.escaped > 100);
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
    const std::vector<Particle> particles = cloud(900, 1.2, 0.25, 0.015);
    for (const MapWay &each : photon_ways) {
        if (each.way == Way::direct || each.way == Way::volume) continue;
        CAPTURE(static_cast<int>(each.way));
        CAPTURE(static_cast<int>(each.deposit));
        Place place;
        place.smokes = {smoke_of(particles)};
        place.plate(0, 0, 40, place.material(matte({0, 0, 0})));
        place.light(LightKind::point, {-3, 3, 1}, {90, 90, 90});
        const auto seen_at = [&](double x) {
            return look(place, each.way, {x, 0.1, 4}, {0, 0, -1}, 0, with_photons(each, 2000)).red;
        };
        // A particle a support behind the wall is reached before it, and shows as far again. Nodes are not.
        const double clear = each.way == Way::bricks || each.way == Way::nodes ? 0.01 : 1.05;
        CHECK(seen_at(-0.5) > 0);
        CHECK(seen_at(clear) == 0);
        CHECK(seen_at(1.2) == 0);
        const auto truth_at = [&](double x) { return look(place, Way::reference, {x, 0.1, 4}, {0, 0, -1}, 200).red; };
        CHECK(truth_at(0.05) == 0);
        place.materials[0].transmission = 1;
        CHECK(seen_at(clear) > 0);
        CHECK(seen_at(1.2) > 0);
        CHECK(truth_at(0.05) > 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": an eye in smoke that scatters forward sees in each direction what is scattered that way" *
          doctest::test_suite("long")) {
    // It looks away from the light. Around it, what nodes keep towards it goes into all directions.
    for (const auto &[way, g] : {std::pair{Way::bricks, 0.8}, {Way::nodes, 0.57}}) {
        CAPTURE(static_cast<int>(way));
        Place place;
        place.smokes = {fog(0.3, 16)};
        place.smokes[0].asymmetry = g;
        place.light(LightKind::point, {4, 6, 6}, {90, 90, 90});
        const FromWithin found = look_from_within(place, way);
        CHECK(std::fabs(found.seen / found.truth - 1) < 0.07);
        CHECK(found.once < 0.7 * found.truth);
    }
}

TEST_CASE(WISP_ARITH_NAME ": an eye in smoke that scatters hardly forward sees as much light as there is" *
          doctest::test_suite("long")) {
    // It looks away from the light, which falls along the way: read two cells ahead, the smoke is darker.
    Place place;
    place.smokes = {fog(0.75, 16)};
    place.smokes[0].asymmetry = 0.12;
    place.light(LightKind::point, {4, 6, 6}, {90, 30, 30});
    place.light(LightKind::parallel, {0, 0, 0}, {0.1, 0.1, 0.3});
    const FromWithin found = look_from_within(place, Way::bricks);
    CHECK(std::fabs(found.seen / found.truth - 1) < 0.03);
}

TEST_CASE(WISP_ARITH_NAME ": an eye in smoke sees no light from behind a wall that stands closer than nodes do") {
    for (const auto &[way, g] : {std::pair{Way::bricks, 0.8}, {Way::nodes, 0.57}}) {
        CAPTURE(static_cast<int>(way));
        Place place;
        place.smokes = {fog(1)};
        place.smokes[0].asymmetry = g;
        place.plate(2, 0, 40, place.material(matte({0, 0, 0})));
        place.light(LightKind::point, {0.5, 1, -8}, {900, 900, 900});
        const auto seen_along = [&](double z) {
            return look(place, way, {0.1, 0.1, 0.1}, {0, 0, z}, 0, with_photons({way, Deposit::nodes}, 4000)).red;
        };
        CHECK(seen_along(-1) == 0);
        CHECK(seen_along(1) == 0);
        place.materials[0].transmission = 1;
        CHECK(seen_along(-1) > 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a wall stops the light of smoke that glows, with a light in the scene and without any") {
    // On the left of the wall at x = 0 smoke glows, on the right it scatters.
    for (const bool lit : {false, true}) {
        CAPTURE(lit);
        Place place;
        place.smokes = {box_smoke({0.9, 1, 1}, 1, 8), box_smoke({0.9, 1, 1}, 1, 8)};
        place.smokes[0].grid.center = {-1, 0, 0};
        place.smokes[0].emission = {9, 9, 9};
        place.smokes[1].grid.center = {1, 0, 0};
        place.plate(0, 0, 40, place.material(matte({0, 0, 0})));
        if (lit) place.light(LightKind::constant, {-8, 0, 0}, {0.5, 0.5, 0.5});
        const auto seen_at = [&](double x) { return look(place, Way::reference, {x, 0.1, 4}, {0, 0, -1}, 200).red; };
        CHECK(seen_at(-1) > 0);
        CHECK(seen_at(0.5) == 0);
        place.materials[0].transmission = 1;
        CHECK(seen_at(0.5) > 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": light that is shut in leaves nothing in the fog around, how small the walls are") {
    enum Walls { still, placed, deforming };
    for (const Walls walls : {still, placed, deforming})
        for (const double size : {0.1, 0.4, 1.1}) // of a tetrahedron, in cells of 0.25
            for (const int32_t turn : {0, 1, 2}) {
                if (walls != still && turn != 1) continue;
                CAPTURE(static_cast<int>(walls));
                CAPTURE(size);
                CAPTURE(turn);
                Place place;
                place.smokes = {fog(1, 16)};
                const uint32_t material = place.material(matte({0, 0, 0}));
                const Double3 middle = {0.125 * turn, 0.07 * turn, 0.03};
                const double c = std::cos(0.4 * turn), s = std::sin(0.4 * turn);
                const Double3 axis[3] = {{c, s, 0}, {-s, c, 0}, {0, 0, 1}},
                              back[3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
                const auto corner = [&](double x, double y, double z) {
                    const Double3 own = Double3{x, y, z} * size;
                    return walls == placed ? own : middle + axis[0] * own.x + axis[1] * own.y + axis[2] * own.z;
                };
                const Double3 corners[4] = {corner(1, 1, 1), corner(1, -1, -1), corner(-1, 1, -1), corner(-1, -1, 1)};
                for (size_t away = 0; away < 4; ++away)
                    place.add(corners[(away + 1) % 4], corners[(away + 2) % 4], corners[(away + 3) % 4], material);
                place.light(LightKind::point, middle, {9, 9, 9});
                if (walls == placed)
                    place.instances = {{0, 4, {axis[0], axis[1], axis[2]}, middle, {back[0], back[1], back[2]}, true}};
                place.shown();
                Scene scene = place.scene;
                if (walls != still) scene.static_count = 0;
                if (walls == placed) scene.instance_triangle_count = 4;
                if (walls == deforming) scene.deforming_count = 4;
                scene.camera = {{0.1, 0.2, 6}, {-0.3, 0.3, -1}, {0.1, 0, 0}, {0, -0.1, 0}};
                const auto seen = [&] {
                    return sum_of(render_in_memory(scene, settings_of(Way::bricks, 6, 10000)).rgb);
                };
                CHECK(seen() == 0);
                place.materials[0].transmission = 1;
                CHECK(seen() > 0);
            }
}

TEST_CASE(WISP_ARITH_NAME ": fog in the cells that a black wall cuts is as bright as in the reference") {
    constexpr int pixels = 8;
    for (const double wall : {0.0, 0.1}) { // in a plane of nodes; within cells
        CAPTURE(wall);
        Place place;
        place.smokes = {fog(0.8, 24)};
        place.plate(0, wall, 40, place.material(matte({0, 0, 0})));
        place.light(LightKind::point, {-1, 1.5, 0.5}, {9, 9, 9});
        place.shown();
        Scene scene = place.scene;
        // Along the wall, through the cells before it.
        scene.camera = {{wall - 0.12, 0.1, 7}, {-0.012, 0.2, -1}, {0.003, 0, 0}, {0, -0.05, 0}};
        double noise;
        const double truth = sum_of(reference_of(scene, pixels, 400, noise));
        for (const IrradianceMap map : {IrradianceMap::uniform, IrradianceMap::adaptive}) {
            CAPTURE(static_cast<int>(map));
            Settings settings = settings_of(Way::bricks, pixels, 100000);
            settings.irradiance = map;
            // Light falls towards the wall, and the wall's nodes hold means over what is before it: at most 3.4 % too
            // bright.
            CHECK(sum_of(render_in_memory(scene, settings).rgb) == doctest::Approx(truth).epsilon(0.045));
        }
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
            // Beside glass, nodes keep light towards all directions.
            place.smokes[0].asymmetry = each.way == Way::nodes ? 0 : 0.1;
            place.lights.assign(std::begin(outside_lights), std::end(outside_lights));
            if (walls > 0) {
                const uint32_t material = place.material(walls == 1 ? glass(1.5) : matte({1, 1, 1}));
                place.closed_box(1.5, material);
                place.plate(0, 0.25, 1, material);
            }
            const Scene &scene = place.shown();
            Settings settings = settings_of(each.way);
            with_photons(each, 1000)(settings);
            const Plan planned = renderer.plan(scene, settings);
            std::vector<unsigned char> memory(planned.arena_bytes);
            Arena arena(memory.data(), memory.size());
            maps[walls].resize(planned.map_sums);
            PhotonSums sums = {maps[walls].data(), planned.map_sums, 0};
            REQUIRE(trace_batches(scene, settings, all_batches(settings), arena, sums, statistics[walls]) ==
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

namespace {

// Particles with an object among them, a mirror for a floor, and a plate between them and a lamp.
struct Cellar : Place {
    Cellar() : particles(cloud(250, 1.6, 0.5, 0.15)) {
        smokes = {smoke_of(particles)};
        scene.background = {0.125, 0.25, 0.5};
        const uint32_t shining = material({{0.02, 0.02, 0.02}, {0.25, 0.25, 0.25}, {0.5, 0.5, 0.5}, 20, 0, 1});
        const uint32_t red = material(matte({0.8, 0.3, 0.2})), pane = material(glass(1.2));
        plate(1, -1.8, 40, shining);
        const Double3 o = {0.4, -0.3, 0.3};
        const auto tip = [&](int axis, double side) {
            return o + Double3{axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0};
        };
        for (const double x : {-0.8, 0.8})
            for (const double y : {-0.8, 0.8})
                for (const double z : {-0.8, 0.8}) add(tip(0, x), tip(1, y), tip(2, z), red);
        add({-9, 2.5, -9}, {-0.3, 2.5, -9}, {-0.3, 2.5, 9}, {-9, 2.5, 9}, red);
        add({-1.5, -1, 1.5}, {-0.5, -1, 1.5}, {-0.5, 0.5, 1.3}, {-1.5, 0.5, 1.3}, pane);
        light(LightKind::point, {1.5, 6, 2}, {80, 80, 80});
        light(LightKind::spot, {-4, 2, 5}, {60, 60, 40}, unit({4, -2, -5}));
        lights.back().one_minus_cosine = 0.03;
    }
    const Scene &seen(int pixels) {
        shown();
        scene.camera = look_at_origin(12, 6, pixels);
        return scene;
    }
    std::vector<Particle> particles;
};

// As the host chooses for particles.
Settings default_settings(int pixels, uint64_t photons) {
    Settings settings = settings_of(Way::bricks, pixels, photons);
    settings.density_step = 0.55;
    settings.light_step = settings.irradiance_step = settings.step = 1.1;
    settings.irradiance = IrradianceMap::uniform;
    return settings;
}
Settings cellar_settings(Way way, int pixels, uint64_t photons) {
    return way == Way::bricks ? default_settings(pixels, photons) : settings_of(way, pixels, photons);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": pictures of smoke among surfaces are those of the reference") {
    constexpr int pixels = 16;
    Cellar cellar;
    const Scene &scene = cellar.seen(pixels);
    double noise;
    const std::vector<float> truth = reference_of(scene, pixels, 50, noise, 10);
    // Kernels and cells blur what is scattered twice and more, most next to a surface, of which they know nothing: by a
    // tenth of it. Depths that are kept between nodes 1.1 smoothing lengths apart err by 1 %.
    for (const Way way : {Way::bricks, Way::direct, Way::elements}) {
        CAPTURE(static_cast<int>(way));
        Settings settings = cellar_settings(way, pixels, 10000);
        settings.gather = 10; // so near that their ball does not blur either
        const Rendered picture = render_in_memory(scene, settings);
        settings.seed = 2;
        const Rendered other = render_in_memory(scene, settings);
        settings.photons = 0;
        const Rendered once = render_in_memory(scene, settings);
        REQUIRE(picture.status == Status::done);
        const double of_photons = relative_difference(picture.rgb, other.rgb) / std::sqrt(2.0);
        const double both = std::hypot(noise, of_photons);
        const double multiple = 1 - sum_of(once.rgb) / sum_of(truth), bias = 0.1 * multiple + 0.01;
        CHECK(multiple > 0.15);
        CHECK(of_photons < 0.06);
        CHECK(std::fabs(sum_of(picture.rgb) / sum_of(truth) - 1) < 3.5 * noise / pixels + bias);
        CHECK(relative_difference(picture.rgb, truth) < 1.2 * both + bias);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a mirror shows all of the smoke that lies behind the camera") {
    const std::vector<Particle> particles = puff();
    for (const Way way : {Way::bricks, Way::direct, Way::elements}) {
        CAPTURE(static_cast<int>(way));
        Place place;
        place.smokes = {smoke_of(particles)};
        place.lights = {outside_lights[0]};
        place.plate(2, -5, 9, place.material(mirror(1)));
        place.materials[0].shininess = 1000; // no highlight here
        for (const bool maps : {false, true}) {
            if (maps && way == Way::bricks) continue;
            const auto change = [&](Settings &settings) {
                with_photons({way, Deposit::exact}, 2000)(settings);
                if (!maps) return;
                settings.irradiance = IrradianceMap::uniform;
                settings.irradiance_step = 0.5;
            };
            const double reflected = look(place, way, {0.2, 0.1, -4}, {0, 0, -1}, 0, change).red;
            const double straight = look(place, way, {0.2, 0.1, -4}, {0, 0, 1}, 0, change).red;
            const double once = look(place, way, {0.2, 0.1, -4}, {0, 0, 1}, 0).red;
            CHECK(once < 0.9 * straight);
            CHECK(reflected == doctest::Approx(straight).epsilon(1e-5));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": smoke among surfaces is the same in double, within 1e-3") {
    constexpr int pixels = 16;
    Cellar cellar;
    const Scene &scene = cellar.seen(pixels);
    for (const Way way : {Way::bricks, Way::direct, Way::elements}) {
        // Bricks are quick: so many that a photon that decides otherwise is one of many.
        const Settings settings = cellar_settings(way, pixels, way == Way::bricks ? 20000 : 2000);
        std::vector<unsigned char> memory(f64::renderer.plan(scene, settings).arena_bytes);
        Arena arena(memory.data(), memory.size());
        Statistics statistics;
        std::vector<float> exact(pixels * pixels * 3);
        REQUIRE(f64::renderer.render({scene, settings, arena, statistics, {}, exact.data()}) == Status::done);
        CHECK(relative_difference(render_in_memory(scene, settings).rgb, exact) < 1e-3);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": however shadows are found, frames of smoke and surfaces in any order are those of tracing, "
          "and keep to their plan") {
    const std::vector<Particle> particles = cloud(60, 8, 2.5, 4);
    const SmokeDescription smoke = smoke_of(particles);
    constexpr ShadowMethod methods[] = {ShadowMethod::trace, ShadowMethod::cache,       ShadowMethod::exact,
                                        ShadowMethod::voxel, ShadowMethod::lightbuffer, ShadowMethod::lie};
    constexpr int frames = 2;
    uint64_t shadows = 0, culled = 0;
    for (uint64_t seed = 700; seed < 703; ++seed) {
        const Way way = seed % 3 == 0 ? Way::direct : seed % 3 == 1 ? Way::bricks : Way::elements;
        CAPTURE(seed);
        std::vector<Rendered> right;
        for (const ShadowMethod method : methods) {
            CAPTURE(static_cast<int>(method));
            RoomFrames room(seed, 16, 4, method);
            room.scene.smokes = &smoke;
            room.scene.smoke_count = 1;
            Settings settings = cellar_settings(way, room_pixels, 300);
            settings.depth = room.depth;
            settings.shadows = method;
            settings.step = 2;
            settings.light_step = 1;
            std::vector<unsigned char> memory(renderer.plan(room.scene, settings).arena_bytes);
            const auto draw = [&](size_t bytes, FrameCache *kept) {
                return render_in({memory.data(), bytes}, room.scene, settings, kept);
            };
            FrameCache cache = {};
            for (size_t i = 0; i < frames; ++i, room.change()) {
                const Rendered frame = draw(memory.size(), &cache);
                REQUIRE(frame.status == Status::done);
                CHECK(frame.statistics.bytes.arena_peak <= memory.size());
                if (method == ShadowMethod::trace) right.push_back(frame);
                CHECK(same(frame.rgb, right[i].rgb));
                CHECK(frame.statistics.rays.shadow == right[i].statistics.rays.shadow);
                shadows += frame.statistics.rays.shadow;
                culled += frame.statistics.rays.shadow_culled;
                if (i + 1 < frames) continue;
                CHECK(same(draw(memory.size(), nullptr).rgb, frame.rgb)); // alone
                settings.crop = {3, 5, 12, 9};
                const Rendered part = render_in_memory(room.scene, settings);
                for (size_t y = 0; y < 4; ++y)
                    CHECK(std::memcmp(&part.rgb[27 * y], &frame.rgb[3 * (room_pixels * (y + 5) + 3)],
                                      27 * sizeof(float)) == 0);
                settings.crop = {0, 0, room_pixels, room_pixels};
                if (method != ShadowMethod::exact) continue;
                for (const size_t sixths : {0, 2, 4, 5}) { // too little is said, or it suffices
                    const Rendered less = draw(memory.size() * sixths / 6, nullptr);
                    CHECK((less.status == Status::done ? same(less.rgb, frame.rgb) : is_untouched(less)));
                }
            }
        }
    }
    CHECK(shadows > 30000);
    CHECK(culled > 300);
}

TEST_CASE(WISP_ARITH_NAME ": what is kept serves no frame of other settings" * doctest::test_suite("long")) {
    RoomFrames room(760, 16, 4, ShadowMethod::exact);
    std::vector<Particle> particles = cloud(60, 8, 2.5, 4);
    SmokeDescription smoke = smoke_of(particles);
    room.scene.smokes = &smoke;
    room.scene.smoke_count = 1;
    std::vector<Settings> all;
    for (const Way way : marched)
        for (const ShadowMethod method : {ShadowMethod::exact, ShadowMethod::cache, ShadowMethod::lie}) {
            Settings settings = cellar_settings(way, room_pixels, 300);
            settings.depth = room.depth;
            settings.shadows = method;
            settings.tree = all.size() % 2 ? TreeKind::kd : TreeKind::bvh;
            settings.density_step = all.size() % 3 == 1 ? 0.5 : 1;
            settings.light_step = all.size() % 3 == 2 ? 0 : 1;
            if (all.size() % 4 == 3) settings.crop = {2, 3, 7, 6};
            all.push_back(settings);
        }
    uint64_t bytes = 0;
    for (const Settings &settings : all) bytes = std::max(bytes, renderer.plan(room.scene, settings).arena_bytes);
    std::vector<unsigned char> memory(bytes);
    FrameCache cache = {};
    Sequence next{3};
    for (int i = 0; i < 40; ++i) {
        const Settings &settings = all[static_cast<size_t>(next() * static_cast<double>(all.size()))];
        const Rendered alone = render_in_memory(room.scene, settings);
        const Rendered frame = render_in({memory.data(), memory.size()}, room.scene, settings, &cache);
        CHECK(frame.status == Status::done);
        CHECK(same(frame.rgb, alone.rgb));
        cache.same_smoke = true;
    }
}

TEST_CASE(WISP_ARITH_NAME ": smoke that stays the same is built by the first frame for all" *
          doctest::test_suite("long")) {
    for (const Way way : marched) {
        CAPTURE(static_cast<int>(way));
        RoomFrames room(760, 16, 4, ShadowMethod::exact);
        std::vector<Particle> particles = cloud(60, 8, 2.5, 4);
        SmokeDescription smoke = smoke_of(particles);
        room.scene.smokes = &smoke;
        room.scene.smoke_count = 1;
        Settings settings = cellar_settings(way, room_pixels, 300);
        settings.depth = room.depth;
        settings.light_step = 1;
        std::vector<unsigned char> memory(renderer.plan(room.scene, settings).arena_bytes);
        FrameCache cache = {};
        const auto check = [&](bool same_smoke, bool right) {
            cache.same_smoke = same_smoke;
            const Rendered alone = render_in_memory(room.scene, settings);
            const Rendered frame = render_in({memory.data(), memory.size()}, room.scene, settings, &cache);
            REQUIRE(frame.status == Status::done);
            CHECK(same(frame.rgb, alone.rgb) == right);
            // What is found again is not counted again: rays for depths to the lights.
            CHECK((frame.statistics.rays.shadow < alone.statistics.rays.shadow) == same_smoke);
            CHECK(frame.statistics.smoke.particles == alone.statistics.smoke.particles);
            CHECK(frame.statistics.bytes.particle_tree == alone.statistics.bytes.particle_tree);
        };
        check(false, true);
        for (int i = 0; i < 3; ++i) { // surfaces move, and the smoke lies elsewhere in memory
            room.change();
            const std::vector<Particle> moved = particles;
            const SmokeDescription other = smoke_of(moved);
            room.scene.smokes = &other;
            check(true, true);
            room.scene.smokes = &smoke;
        }
        for (Particle &particle : particles) particle.position.x += 0.5;
        smoke = smoke_of(particles);
        check(true, false); // the caller was wrong
        check(false, true);
        room.change();
        check(true, true);
    }
}

TEST_CASE(WISP_ARITH_NAME ": any smoke may follow any other, and nothing is written beyond the arena") {
    std::vector<SmokeDescription> crumbs;
    for (int i = 0; i < 125; ++i) {
        crumbs.push_back(box_smoke({0.25, 0.25, 0.25}, 0.4, 2));
        crumbs.back().grid.center = {i % 5 - 1.5, i / 5 % 5 - 1.5, i / 25 - 1.5};
    }
    // Before two particles far apart the arena holds a large lattice, and little behind them.
    const std::vector<Particle> apart = {{{-4, -4, -4}, 0.03, 4e-4}, {{1, 1, 0}, 0.03, 4e-4}},
                                particles = cloud(60, 2, 1, 0.3);
    const Mixture mixture; // is never resampled
    const std::vector<SmokeDescription> lists[] = {
        {smoke_of(apart)}, crumbs, {fog(0.4)}, {}, {fog(0.2), smoke_of(particles)}, mixture.smokes, {fog(0.4)}, {}};
    for (const Way way : marched)
        for (const bool lit : {false, true}) {
            CAPTURE(static_cast<int>(way));
            CAPTURE(lit);
            const Settings settings = settings_of(way, 4, lit ? 300 : 0);
            Place place;
            place.scene.camera = look_at_origin(12, 8, 4);
            place.scene.background = {1, 0.5, 0.25};
            if (lit) place.light(LightKind::point, {3, 4, 5}, {40, 50, 60});
            const auto show = [&](const std::vector<SmokeDescription> &smokes) -> const Scene & {
                place.smokes = smokes;
                return place.shown();
            };
            uint64_t bytes = 0;
            for (const auto &smokes : lists) bytes = std::max(bytes, renderer.plan(show(smokes), settings).arena_bytes);
            constexpr size_t beyond = 1 << 18;
            constexpr unsigned char mark = 0xa5;
            std::vector<unsigned char> memory(bytes + beyond, mark);
            FrameCache cache = {};
            for (const auto &smokes : lists) {
                CAPTURE(smokes.size());
                const Scene &scene = show(smokes);
                const Rendered frame = render_in({memory.data(), bytes}, scene, settings, &cache),
                               alone = render_in_memory(scene, settings);
                REQUIRE(frame.status == Status::done);
                CHECK(same(frame.rgb, alone.rgb));
                CHECK(frame.statistics.smoke.march_samples == alone.statistics.smoke.march_samples);
                CHECK(std::count(memory.end() - beyond, memory.end(), mark) == beyond);
            }
        }
}

TEST_CASE(WISP_ARITH_NAME
          ": the paper's shadows of surfaces in smoke err where it says so, those in the smoke do not") {
    uint64_t wrong = 0;
    for (uint64_t seed = 720; seed < 726; ++seed) {
        RoomFrames room(seed, 16, 3, ShadowMethod::paper, false);
        const std::vector<Particle> particles = cloud(60, 8, 2.5, 4);
        const SmokeDescription smoke = smoke_of(particles);
        room.scene.smokes = &smoke;
        room.scene.smoke_count = 1;
        Settings settings = cellar_settings(Way::bricks, room_pixels, 0);
        settings.check_shadows = true;
        Settings paper = settings;
        paper.shadows = ShadowMethod::paper;
        std::vector<unsigned char> memory(renderer.plan(room.scene, paper).arena_bytes);
        FrameCache cache = {};
        for (int i = 0; i < 4; ++i, room.change()) {
            const Rendered right = render_in_memory(room.scene, settings);
            const Rendered frame = render_in({memory.data(), memory.size()}, room.scene, paper, &cache);
            REQUIRE(frame.status == Status::done);
            const Statistics &statistics = frame.statistics;
            uint64_t different = 0;
            for (size_t p = 0; p < frame.rgb.size(); p += 3)
                different += std::memcmp(&frame.rgb[p], &right.rgb[p], 3 * sizeof(float)) != 0;
            CHECK(statistics.shadow.checked);
            CHECK(different <= statistics.shadow.wrong_pixels);
            CHECK(statistics.shadow.wrong_pixels < 256);
            wrong += statistics.shadow.wrong_pixels;
        }
    }
    CHECK(wrong > 0);
}

TEST_CASE(WISP_ARITH_NAME ": clusters of many lights above a surface in smoke") {
    constexpr int pixels = 16;
    Cellar cellar;
    cellar.smokes[0].albedo = {0, 0, 0};
    Sequence next{5};
    for (int i = 0; i < 120; ++i) {
        const double x = next(), z = next();
        cellar.light(LightKind::point, {3 * x + 1, 5, 3 * z}, {1, 1, 0.5});
    }
    const Scene &scene = cellar.seen(pixels);
    Settings settings = settings_of(Way::direct, pixels);
    const Rendered all = render_in_memory(scene, settings);
    settings.lights = LightChoice::cuts;
    const Rendered cut = render_in_memory(scene, settings);
    REQUIRE(cut.status == Status::done);
    CHECK(!same(cut.rgb, all.rgb));
    CHECK(relative_difference(cut.rgb, all.rgb) < 0.02); // of a point, and no point errs more
    CHECK(cut.statistics.rays.shadow < all.statistics.rays.shadow * 3 / 4);
}

TEST_CASE(WISP_ARITH_NAME ": what is not there costs nothing") {
    Cellar cellar;
    const Settings settings = default_settings(8, 1000);
    const std::vector<SmokeDescription> smokes = cellar.smokes;
    const SmokeDescription nothing = smoke_of({});
    const auto counts_of = [&](const std::vector<SmokeDescription> &some) {
        cellar.smokes = some;
        const Rendered picture = render_in_memory(cellar.seen(8), settings);
        REQUIRE(picture.status == Status::done);
        return picture;
    };
    // Nothing but surfaces.
    const Rendered bare = counts_of({}), empty = counts_of({nothing}), both = counts_of(smokes);
    CHECK(same(bare.rgb, empty.rgb));
    for (const Rendered *picture : {&bare, &empty}) {
        const Statistics &s = picture->statistics;
        CHECK(s.photons.emitted == 0);
        CHECK(s.smoke.march_samples == 0);
        CHECK(s.smoke.density_evaluations == 0);
        CHECK(s.bytes.particle_tree == 0);
        CHECK(s.rays.shadow > 0);
        CHECK(s.rays.shadow < both.statistics.rays.shadow / 2);
    }
    // Nothing but smoke: no triangle is asked for anything.
    cellar.triangles.clear();
    const Statistics s = counts_of(smokes).statistics;
    CHECK(s.photons.emitted == 1000);
    CHECK(s.photons.blocked == 0);
    CHECK(s.smoke.march_samples > 0);
    CHECK(s.bytes.triangle_trees == 0);
    CHECK(s.bytes.mode_words == 0);
    CHECK(s.shadow.traced.node_visits == 0);
    CHECK(s.rays.reflected + s.rays.refracted == 0);
    CHECK(both.statistics.shadow.traced.node_visits > 0);
    CHECK(both.statistics.photons.blocked > 0);
}

} // namespace wisp::WISP_ARITH
