// What is told of a pixel: its sums are the picture's bits, its parts are sums of theirs, and closed forms hold.
#include "support/built_surfaces.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"
#include <cmath>
#include <cstring>

namespace wisp::WISP_ARITH {

namespace {

using Kind = TraceEvent::Kind;

constexpr int pixels = 6;
constexpr double plate_height = 2.5, plate_half = 1.2;

// A ray with what was told of it, and whether its parts add up.
struct ToldRay {
    TraceEvent::Ray ray = {};
    bool marched = false;
    TraceEvent::March march = {};
    std::vector<TraceEvent::Step> steps;
    std::vector<TraceEvent::Light> in_steps;
    TraceEvent::MarchEnd march_end = {};
    std::vector<TraceEvent::Hit> hit;
    std::vector<TraceEvent::Light> lights;
    TraceEvent::Lit lit = {};
    std::vector<ToldRay> rays;
    TraceEvent::RayEnd end = {};
};

struct Listener {
    std::vector<TraceEvent> entries;
    PixelTrace journal(int x, int y) {
        return {x, y, this,
                [](void *self, const TraceEvent &entry) { static_cast<Listener *>(self)->entries.push_back(entry); }};
    }
};

// The ray whose entry is `at`; `at` is then behind its last one.
ToldRay read_ray(const std::vector<TraceEvent> &entries, size_t &at) {
    ToldRay told;
    REQUIRE(entries[at].kind == Kind::ray);
    told.ray = entries[at++].ray;
    for (;; ++at) {
        REQUIRE(at < entries.size());
        const TraceEvent &entry = entries[at];
        switch (entry.kind) {
        case Kind::march:
            CHECK(!told.marched);
            told.marched = true;
            told.march = entry.march;
            break;
        case Kind::step: told.steps.push_back(entry.step); break;
        case Kind::light: (entry.light.step < 0 ? told.lights : told.in_steps).push_back(entry.light); break;
        case Kind::march_end: told.march_end = entry.march_end; break;
        case Kind::hit: told.hit.push_back(entry.hit); break;
        case Kind::lit: told.lit = entry.lit; break;
        case Kind::unsent: break;
        case Kind::ray:
            told.rays.push_back(read_ray(entries, at));
            --at;
            break;
        case Kind::ray_end:
            told.end = entry.ray_end;
            ++at;
            return told;
        default: REQUIRE(false);
        }
    }
}

// Exact: what is told are numbers of the arithmetic.
Vec3 back(const Double3 &v) { return vec_of(v); }
bool same(const Vec3 &a, const Double3 &b) { return at(a.x) == b.x && at(a.y) == b.y && at(a.z) == b.z; }

// Smoke between a mirroring floor and a plate, beside a pane of glass, under lights of every kind.
struct Scenery : Room {
    explicit Scenery(bool surfaces_ = true, bool glows = true) : particles(cloud(150, 1.2, 0.5, 0.1)) {
        const uint32_t floor = material({{0.1, 0.1, 0.1}, {0.6, 0.5, 0.4}, {0.3, 0.3, 0.3}, 8, 0, 1}),
                       single_channel = material(matte({0.5, 0.5, 0.5})),
                       pane = material({{0, 0, 0}, {0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, 20, 0.7, 1.5});
        scene.background = {0.25, 0.5, 0.125};
        if (surfaces_) {
            add_floor(*this, -2, 9, floor);
            add_floor(*this, plate_height, plate_half, single_channel);
            add({-1.5, -2, 2}, {1.5, -2, 2}, {1.5, 1, 2}, {-1.5, 1, 2}, pane);
        }
        light(LightKind::point, {1, 5, 1}, {20, 20, 15});
        light(LightKind::spot, {-3, 6, 0}, {30, 20, 40}, Double3{0.447213595499958, -0.894427190999916, 0});
        lights.back().one_minus_cosine = 0.2;
        light(LightKind::parallel, {}, {0.5, 0.25, 0.75}, {0, -0.8, -0.6});
        light(LightKind::constant, {0, 8, 0.5}, {0.25, 0.5, 0.5});
        build();
        smokes = {smoke_of(particles)};
        smokes[0].asymmetry = 0.3;
        if (glows) smokes[0].emission = {0.5, 0.25, 0.125};
        scene.smokes = smokes.data();
        scene.smoke_count = 1;
        const double step = 1.0 / pixels;
        scene.camera = {{0.3, 0.6, 7}, {-0.5, 0.45, -1}, {step, 0, 0}, {0, -step, 0}};
    }
    std::vector<Particle> particles;
    std::vector<SmokeDescription> smokes;
};

struct Way {
    Method method;
    bool resampled;
    IrradianceMap irradiance;
    Estimate estimate = Estimate::kernel;
};
constexpr Way ways[] = {
    {Method::direct, false, IrradianceMap::none},    {Method::direct, false, IrradianceMap::uniform},
    {Method::volume, true, IrradianceMap::adaptive}, {Method::map, true, IrradianceMap::uniform},
    {Method::map, true, IrradianceMap::adaptive},    {Method::map, false, IrradianceMap::none},
    {Method::map, false, IrradianceMap::uniform},    {Method::map, false, IrradianceMap::none, Estimate::knn}};

Settings settings_of(const Way &way, ShadowMethod shadows = ShadowMethod::exact, uint32_t samples = 2) {
    Settings settings = small_settings(pixels);
    settings.samples = samples;
    settings.photons = 1000;
    settings.depth = 4;
    settings.shadows = shadows;
    settings.method = way.method;
    settings.irradiance = way.irradiance;
    settings.estimate = way.estimate;
    settings.irradiance_step = 1;
    if (way.resampled) settings.density_step = settings.light_step = 1;
    return settings;
}

std::vector<float> heard_picture(const Scene &scene, const Settings &settings, const PixelTrace *journal) {
    std::vector<unsigned char> memory(plan(scene, settings).bytes.arena);
    Arena arena(memory.data(), memory.size());
    const Crop &crop = settings.crop;
    std::vector<float> rgb(static_cast<size_t>((crop.x1 - crop.x0) * (crop.y1 - crop.y0) * 3));
    Statistics statistics;
    REQUIRE(render(scene, settings, arena, Observer{}, rgb.data(), statistics, nullptr, nullptr, journal) ==
            Status::done);
    return rgb;
}

// All rays of a sample, each before those that it sends.
template <class Visit> void for_each_ray(const ToldRay &told, Visit &&visit) {
    visit(told);
    for (const ToldRay &next : told.rays) for_each_ray(next, visit);
}

// The pixel's rays, a tree for each sample; its entries are in order, and what it is is what they add up to.
std::vector<ToldRay> read_pixel(const Scene &scene, const Settings &settings, const Listener &listener,
                                const float *rgb) {
    const auto &entries = listener.entries;
    std::vector<ToldRay> rays;
    Color sum(Real(0));
    size_t at_entry = 0;
    for (uint32_t i = 0; i < settings.samples; ++i) {
        REQUIRE(entries[at_entry].kind == Kind::sample);
        CHECK(entries[at_entry++].sample.index == i);
        rays.push_back(read_ray(entries, at_entry));
        CHECK(rays.back().ray.kind == RayKind::camera);
        REQUIRE(entries[at_entry].kind == Kind::sample_end);
        const Color seen = back(entries[at_entry++].sample_end.radiance);
        CHECK(same(seen, rays.back().end.radiance));
        sum += seen;
    }
    REQUIRE(at_entry + 1 == entries.size());
    const TraceEvent::Pixel &pixel = entries[at_entry].pixel;
    CHECK(entries[at_entry].kind == Kind::pixel);
    CHECK(pixel.samples == settings.samples);
    const Color mean = sum / Real(static_cast<int32_t>(settings.samples));
    CHECK(same(mean, pixel.mean));
    CHECK(to_float_scaled(mean.x, scene.radiance_exponent) == pixel.value[0]);
    CHECK(std::memcmp(pixel.value, rgb, sizeof pixel.value) == 0);
    return rays;
}

// A ray is the sum of its parts, in the order in which the core adds them: to the bit.
void check_sums(const ToldRay &told, const Color &background) {
    const Real through = real(told.end.transmittance);
    CHECK(same(back(told.end.smoke) + back(told.end.behind) * through, told.end.radiance));
    CHECK(told.end.hit == (told.hit.size() == 1));
    if (told.marched) {
        CHECK(same(back(told.march_end.radiance), told.end.smoke));
        CHECK(told.march_end.transmittance == told.end.transmittance);
    } else {
        CHECK(told.end.transmittance == 1);
    }
    if (!told.end.hit) {
        CHECK(same(background, told.end.behind));
        CHECK(told.lights.empty());
        CHECK(told.rays.empty());
        return;
    }
    Color lit(Real(0));
    for (const TraceEvent::Light &light : told.lights) lit += back(light.contribution);
    CHECK(same(lit, told.lit.radiance));
    Color sum = back(told.hit[0].ambient) + lit;
    for (const ToldRay &next : told.rays) {
        CHECK(next.ray.level == told.ray.level + 1);
        sum += back(next.ray.share) * back(next.end.radiance);
    }
    CHECK(same(sum, told.end.behind));
}

// Of eight and more numbers added in another order, and of exponentials that are right to some last places.
double error_of(size_t count, double largest) {
    const bool is_fixed = std::is_same_v<Real, Fixed>;
    return static_cast<double>(count + 16) * unit_error * (is_fixed ? std::max(largest, 1.0) : largest);
}

void check_march(const ToldRay &told, uint32_t light_count) {
    if (!told.marched) {
        CHECK(told.steps.empty());
        return;
    }
    double depth = 0, radiance = 0;
    size_t next = 0;
    for (const TraceEvent::Step &step : told.steps) {
        CHECK(step.step >= 0);
        CHECK(step.step < told.march.steps);
        CHECK(step.distance > told.march.begin - 1e-5);
        CHECK(step.distance < told.march.end + 1e-5);
        CHECK(step.length > 0);
        CHECK(step.extinction > 0);
        const size_t terms = told.steps.size();
        CHECK(std::fabs(step.optical_depth - depth) <= error_of(terms, depth));
        CHECK(std::fabs(step.transmittance - std::exp(-depth)) <= error_of(terms, 1));
        const double s = step.extinction * step.length, source = step.single.x + step.multiple.x + step.emission.x;
        // E4: the source over the step, dimmed by what is before it. For small s the mean is a series, whose first
        // term left out is below 0.125^6 / 5040 of it.
        const double arrives = source * std::exp(-depth) * -std::expm1(-s) / s * step.length;
        CHECK(std::fabs(step.radiance.x - arrives) <=
              error_of(terms, 4 * (std::fabs(source) + 1) * step.length) + 7.6e-10 * arrives);
        depth += s;
        radiance += step.radiance.x;
        // Its lights, once each.
        double single = 0;
        uint32_t lights = 0;
        for (const TraceEvent::Light &light : told.in_steps)
            if (light.step == step.step) {
                single += light.contribution.x;
                ++lights;
                CHECK(std::fabs(light.transmittance - std::exp(-light.optical_depth)) <= error_of(0, 1));
                CHECK((!light.blocked || light.contribution.x == 0));
            }
        CHECK(lights <= light_count);
        CHECK(std::fabs(single - step.single.x) <= error_of(light_count, single));
        next += lights;
    }
    CHECK(next == told.in_steps.size()); // all belong to a step
    const double count = static_cast<double>(told.steps.size());
    CHECK(std::fabs(told.march_end.optical_depth - depth) <= error_of(told.steps.size(), depth));
    CHECK(std::fabs(told.march_end.transmittance - std::exp(-depth)) <= error_of(told.steps.size(), 1));
    CHECK(std::fabs(told.march_end.radiance.x - radiance) <= error_of(static_cast<size_t>(count), radiance));
}

// Whether the plate is between a point and a light, whither `way` leads, `distance` off; empty near its edge, or its
// plane.
enum class Plate { beside, before, unsure };
Plate find_plate(const Double3 &from, const Double3 &way, double distance) {
    const double t = (plate_height - from.y) / way.y;
    if (std::fabs(from.y - plate_height) < 1e-2) return Plate::unsure;
    if (!(t > 0 && t < distance)) return Plate::beside;
    const double off = std::max(std::fabs(from.x + way.x * t), std::fabs(from.z + way.z * t)) - plate_half;
    return off < -1e-3 ? Plate::before : off > 1e-3 ? Plate::beside : Plate::unsure;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a pixel's told sum is its value in the picture, to the bit, and so are the sums in it") {
    for (const bool surfaces : {false, true})
        for (const Way &way : ways) {
            CAPTURE(surfaces);
            CAPTURE(static_cast<int>(&way - ways));
            Scenery scenery(surfaces, way.method != Method::map || surfaces);
            if (surfaces && !way.resampled && way.irradiance == IrradianceMap::none) scenery.smokes[0].asymmetry = 0;
            Settings settings = settings_of(way);
            const std::vector<float> picture = heard_picture(scenery.scene, settings, nullptr);
            size_t steps = 0, hits = 0, sent = 0;
            bool multiple = false;
            for (int y = 0; y < pixels; ++y)
                for (int x = y % 2; x < pixels; x += 2) {
                    CAPTURE(x);
                    CAPTURE(y);
                    settings.crop = {x, y, x + 1, y + 1};
                    Listener listener;
                    const PixelTrace journal = listener.journal(x, y);
                    const std::vector<float> alone = heard_picture(scenery.scene, settings, &journal);
                    const float *rgb = picture.data() + 3 * (y * pixels + x);
                    CHECK(std::memcmp(alone.data(), rgb, 3 * sizeof *rgb) == 0);
                    for (const ToldRay &ray : read_pixel(scenery.scene, settings, listener, rgb))
                        for_each_ray(ray, [&](const ToldRay &told) {
                            check_sums(told, vec_of(scenery.scene.background));
                            check_march(told, scenery.scene.light_count);
                            steps += told.steps.size();
                            hits += told.hit.size();
                            sent += told.rays.size();
                            for (const TraceEvent::Step &step : told.steps) multiple |= step.multiple.x > 0;
                        });
                }
            CHECK(steps > 50);
            CHECK(multiple);
            CHECK((hits > 20) == surfaces);
            CHECK((sent > 20) == surfaces);
        }
}

TEST_CASE(WISP_ARITH_NAME ": a pixel of surfaces alone is told, too; others, and none, are not") {
    Scenery scenery;
    scenery.scene.smoke_count = 0;
    Settings settings = settings_of(ways[0]);
    const std::vector<float> picture = heard_picture(scenery.scene, settings, nullptr);
    for (const int place : {0, 7, 20, 35}) { // in the whole picture
        Listener listener;
        const PixelTrace journal = listener.journal(place % pixels, place / pixels);
        CHECK(heard_picture(scenery.scene, settings, &journal) == picture);
        for (const ToldRay &ray : read_pixel(scenery.scene, settings, listener, picture.data() + 3 * place))
            for_each_ray(ray, [&](const ToldRay &told) {
                CHECK(!told.marched);
                check_sums(told, vec_of(scenery.scene.background));
            });
    }
    Listener listener;
    const PixelTrace outside = listener.journal(pixels, 0);
    CHECK(heard_picture(scenery.scene, settings, &outside) == picture);
    CHECK(listener.entries.empty());
}

TEST_CASE(WISP_ARITH_NAME ": told shadows are those of a plate that is in the way, however they are decided") {
    for (const ShadowMethod method : {ShadowMethod::trace, ShadowMethod::cache, ShadowMethod::exact,
                                      ShadowMethod::voxel, ShadowMethod::lightbuffer, ShadowMethod::lie})
        for (const Way &way : {ways[0], ways[3], ways[6]}) {
            CAPTURE(static_cast<int>(method));
            Scenery scenery;
            scenery.smokes[0].asymmetry = 0;
            Settings settings = settings_of(way, method, 9);
            size_t blocked[2] = {0, 0}, lit[2] = {0, 0}, answers[5] = {};
            for (const int place : {14, 15, 20, 21, 26, 27, 33}) {
                Listener listener;
                const PixelTrace journal = listener.journal(place % pixels, place / pixels);
                const std::vector<float> picture = heard_picture(scenery.scene, settings, &journal);
                for (const ToldRay &ray : read_pixel(scenery.scene, settings, listener, picture.data() + 3 * place))
                    for_each_ray(ray, [&](const ToldRay &told) {
                        const auto check = [&](const TraceEvent::Light &light, const Double3 &from, bool in_smoke) {
                            ++answers[static_cast<int>(light.answer)];
                            if (light.answer == ShadowDecision::unasked) {
                                CHECK(!light.blocked);
                                return;
                            }
                            const Double3 way_back = {-light.direction.x, -light.direction.y, -light.direction.z};
                            const Plate plate = find_plate(from, way_back, light.distance);
                            if (plate == Plate::unsure) return;
                            CHECK(light.blocked == (plate == Plate::before));
                            ++(light.blocked ? blocked : lit)[in_smoke];
                        };
                        for (const TraceEvent::Light &light : told.lights) check(light, told.hit[0].point, false);
                        for (const TraceEvent::Light &light : told.in_steps)
                            for (const TraceEvent::Step &step : told.steps)
                                if (step.step == light.step) {
                                    const Double3 &o = told.ray.origin, &d = told.ray.direction;
                                    const double t = step.distance;
                                    check(light, {o.x + d.x * t, o.y + d.y * t, o.z + d.z * t}, true);
                                }
                    });
            }
            for (const bool in_smoke : {false, true}) {
                CHECK(blocked[in_smoke] > 10);
                CHECK(lit[in_smoke] > 10);
            }
            const auto count = [&answers](ShadowDecision answer) { return answers[static_cast<int>(answer)]; };
            // What this scene makes of each method.
            const bool proves = method == ShadowMethod::exact || method == ShadowMethod::voxel,
                       lists = method == ShadowMethod::lightbuffer || method == ShadowMethod::lie;
            CHECK((count(ShadowDecision::known) > 0) == (proves || method == ShadowMethod::lightbuffer));
            CHECK((count(ShadowDecision::traced) > 0) == !lists);
            CHECK((count(ShadowDecision::tried) > 0) ==
                  (lists || method == ShadowMethod::cache || method == ShadowMethod::exact));
            CHECK(count(ShadowDecision::culled_static) == 0); // nothing moves
        }
}

TEST_CASE(WISP_ARITH_NAME ": what is told of a hit and of the smoke before its light has its closed form") {
    Scenery scenery(true, false);
    SmokeDescription fog = {};
    fog.grid = {1, 1, 1, nullptr, 0.25, {0, 0, 0}, {8, 1, 8}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    scenery.smokes = {grid_smoke_of(fog.grid)};
    scenery.scene.smokes = scenery.smokes.data();
    Settings settings = settings_of(ways[0]);
    settings.photons = 0;
    size_t checked = 0;
    for (int place = 0; place < pixels * pixels; ++place) {
        Listener listener;
        const PixelTrace journal = listener.journal(place % pixels, place / pixels);
        settings.crop = {place % pixels, place / pixels, place % pixels + 1, place / pixels + 1};
        const std::vector<float> rgb = heard_picture(scenery.scene, settings, &journal);
        for (const ToldRay &ray : read_pixel(scenery.scene, settings, listener, rgb.data()))
            for (const TraceEvent::Hit &hit : ray.hit) {
                const Double3 &o = ray.ray.origin, &d = ray.ray.direction;
                CHECK(std::fabs(o.y + d.y * hit.distance - hit.point.y) < 1e-5);
                CHECK(std::fabs(o.x + d.x * hit.distance - hit.point.x) < 1e-5);
                if (hit.triangle > 1) continue;
                CHECK(std::fabs(hit.point.y + 2) < 1e-6); // the floor
                CHECK(hit.material == 0);
                CHECK(hit.instance == -1);
                CHECK(hit.still);
                CHECK(hit.plane.y == 1);
                for (const TraceEvent::Light &light : ray.lights) {
                    if (light.answer == ShadowDecision::unasked || light.blocked) continue;
                    // Fog of height 2, from 1 to 3 above the floor.
                    const Double3 &l = light.direction;
                    const double way = 2 / -l.y, up = 3 / -l.y; // in the fog, to its top
                    const double farthest = std::max({std::fabs(hit.point.x), std::fabs(hit.point.x - l.x * up),
                                                      std::fabs(hit.point.z), std::fabs(hit.point.z - l.z * up)});
                    if (farthest > 8) continue;
                    CHECK(light.optical_depth == doctest::Approx(0.25 * way).epsilon(1e-5));
                    CHECK(light.transmittance == doctest::Approx(std::exp(-0.25 * way)).epsilon(1e-5));
                    ++checked;
                }
            }
    }
    CHECK(checked > 10);
}

} // namespace wisp::WISP_ARITH
