// The record of a pixel: its sums are the picture's bits, each part is the sum of its own parts, and closed forms hold.
#include "host/base/double3_algebra.h"
#include "support/smoky_room.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"
#include <cmath>
#include <cstring>

namespace wisp::WISP_ARITH {

namespace {

using Kind = TraceEvent::Kind;

// A ray with its events.
struct RecordedRay {
    TraceEvent::Ray ray = {};
    bool marched = false;
    TraceEvent::March march = {};
    std::vector<TraceEvent::Step> steps;
    std::vector<TraceEvent::Light> in_steps;
    TraceEvent::MarchEnd march_end = {};
    std::vector<TraceEvent::Hit> hit;
    std::vector<TraceEvent::Light> lights;
    TraceEvent::DirectLight direct_light = {};
    std::vector<RecordedRay> rays;
    TraceEvent::RayEnd end = {};
};

struct EventList {
    std::vector<TraceEvent> list;
    PixelTrace trace(int x, int y) {
        return {x, y, this,
                [](void *self, const TraceEvent &event) { static_cast<EventList *>(self)->list.push_back(event); }};
    }
};

// The ray whose event is `at`; `at` is then behind its last one.
RecordedRay read_ray(const std::vector<TraceEvent> &events, size_t &at) {
    RecordedRay recorded;
    REQUIRE(events[at].kind == Kind::ray);
    recorded.ray = events[at++].ray;
    for (;; ++at) {
        REQUIRE(at < events.size());
        const TraceEvent &event = events[at];
        switch (event.kind) {
        case Kind::march:
            CHECK(!recorded.marched);
            recorded.marched = true;
            recorded.march = event.march;
            break;
        case Kind::step: recorded.steps.push_back(event.step); break;
        case Kind::light: (event.light.step < 0 ? recorded.lights : recorded.in_steps).push_back(event.light); break;
        case Kind::march_end: recorded.march_end = event.march_end; break;
        case Kind::hit: recorded.hit.push_back(event.hit); break;
        case Kind::direct_light: recorded.direct_light = event.direct_light; break;
        case Kind::unsent: break;
        case Kind::ray:
            recorded.rays.push_back(read_ray(events, at));
            --at;
            break;
        case Kind::ray_end:
            recorded.end = event.ray_end;
            ++at;
            return recorded;
        default: REQUIRE(false);
        }
    }
}

// Exact: a record holds numbers of the arithmetic.
Vec3 back(const Double3 &v) { return vec_of(v); }
bool same(const Vec3 &a, const Double3 &b) { return at(a.x) == b.x && at(a.y) == b.y && at(a.z) == b.z; }

std::vector<float> traced_picture(const Scene &scene, const Settings &settings, const PixelTrace *trace) {
    std::vector<unsigned char> memory(renderer.plan(scene, settings).arena_bytes);
    Arena arena(memory.data(), memory.size());
    const Crop &crop = settings.crop;
    std::vector<float> rgb(static_cast<size_t>(crop.width() * crop.height() * 3));
    Statistics statistics;
    const Job job = {scene, settings, arena, statistics, {}, rgb.data()};
    REQUIRE((trace ? inspect(job, *trace) : renderer.render(job)) == Status::done);
    return rgb;
}

// All rays of a sample, each before those that it sends.
template <class Visit> void for_each_ray(const RecordedRay &recorded, Visit &&visit) {
    visit(recorded);
    for (const RecordedRay &next : recorded.rays) for_each_ray(next, visit);
}

// The pixel's rays, a tree for each sample; its events are in order, and what it is is what they add up to.
std::vector<RecordedRay> read_pixel(const Scene &scene, const Settings &settings, const EventList &recorded,
                                    const float *rgb) {
    const auto &events = recorded.list;
    std::vector<RecordedRay> rays;
    Color sum(Real(0));
    size_t at_event = 0;
    for (uint32_t i = 0; i < settings.samples; ++i) {
        REQUIRE(events[at_event].kind == Kind::sample);
        CHECK(events[at_event++].sample.index == i);
        rays.push_back(read_ray(events, at_event));
        CHECK(rays.back().ray.kind == RayKind::camera);
        REQUIRE(events[at_event].kind == Kind::sample_end);
        const Color seen = back(events[at_event++].sample_end.radiance);
        CHECK(same(seen, rays.back().end.radiance));
        sum += seen;
    }
    REQUIRE(at_event + 1 == events.size());
    const TraceEvent::Pixel &pixel = events[at_event].pixel;
    CHECK(events[at_event].kind == Kind::pixel);
    CHECK(pixel.samples == settings.samples);
    const Color mean = sum / Real(static_cast<int32_t>(settings.samples));
    CHECK(same(mean, pixel.mean));
    CHECK(to_float_scaled(mean.x, scene.radiance_exponent) == pixel.value[0]);
    CHECK(std::memcmp(pixel.value, rgb, sizeof pixel.value) == 0);
    return rays;
}

// A ray is the sum of its parts, in the order in which the core adds them: to the bit.
void check_sums(const RecordedRay &recorded, const Color &background) {
    const Real through = real(recorded.end.transmittance);
    CHECK(same(back(recorded.end.smoke) + back(recorded.end.behind) * through, recorded.end.radiance));
    CHECK(recorded.end.hit == (recorded.hit.size() == 1));
    if (recorded.marched) {
        CHECK(same(back(recorded.march_end.radiance), recorded.end.smoke));
        CHECK(recorded.march_end.transmittance == recorded.end.transmittance);
    } else {
        CHECK(recorded.end.transmittance == 1);
    }
    if (!recorded.end.hit) {
        CHECK(same(background, recorded.end.behind));
        CHECK(recorded.lights.empty());
        CHECK(recorded.rays.empty());
        return;
    }
    Color lit(Real(0));
    for (const TraceEvent::Light &light : recorded.lights) lit += back(light.contribution);
    CHECK(same(lit, recorded.direct_light.radiance));
    Color sum = back(recorded.hit[0].ambient) + lit;
    for (const RecordedRay &next : recorded.rays) {
        CHECK(next.ray.level == recorded.ray.level + 1);
        sum += back(next.ray.factor) * back(next.end.radiance);
    }
    CHECK(same(sum, recorded.end.behind));
}

// Of eight and more numbers added in another order, and of exponentials that are right to some last places.
double error_of(size_t count, double largest) {
    const bool is_fixed = std::is_same_v<Real, Fixed>;
    return static_cast<double>(count + 16) * unit_error * (is_fixed ? std::max(largest, 1.0) : largest);
}

void check_march(const RecordedRay &recorded, uint32_t light_count) {
    if (!recorded.marched) {
        CHECK(recorded.steps.empty());
        return;
    }
    double depth = 0, radiance = 0;
    size_t next = 0;
    int32_t last = -1;
    for (const TraceEvent::Step &step : recorded.steps) {
        CHECK(step.step > last); // parts of steps have numbers of their own
        last = step.step;
        CHECK(step.distance > recorded.march.begin - 1e-5);
        CHECK(step.distance < recorded.march.end + 1e-5);
        CHECK(step.length > 0);
        CHECK(step.extinction > 0);
        const size_t terms = recorded.steps.size();
        CHECK(std::fabs(step.optical_depth - depth) <= error_of(terms, depth));
        CHECK(std::fabs(step.transmittance - std::exp(-depth)) <= error_of(terms, 1));
        const double s = step.extinction * step.length, source = step.single.x + step.multiple.x + step.emission.x;
        // N-E4: the source over the step, dimmed by what is before it. For small s the mean is a series, whose first
        // term left out is below 0.125^6 / 5040, and the mean is 0.94 and more.
        const double arrives = source * std::exp(-depth) * -std::expm1(-s) / s * step.length;
        CHECK(std::fabs(step.radiance.x - arrives) <=
              error_of(terms, 4 * (std::fabs(source) + 1) * step.length) + 8.1e-10 * arrives);
        depth += s;
        radiance += step.radiance.x;
        // Its lights, once each.
        double single = 0;
        uint32_t lights = 0;
        for (const TraceEvent::Light &light : recorded.in_steps)
            if (light.step == step.step) {
                single += light.contribution.x;
                ++lights;
                CHECK(std::fabs(light.transmittance - std::exp(-light.optical_depth)) <= error_of(0, 1));
                CHECK((light.lit > 0 || light.contribution.x == 0));
            }
        CHECK(lights <= light_count);
        CHECK(std::fabs(single - step.single.x) <= error_of(light_count, single));
        next += lights;
    }
    CHECK(next == recorded.in_steps.size()); // all belong to a step
    const double count = static_cast<double>(recorded.steps.size());
    CHECK(std::fabs(recorded.march_end.optical_depth - depth) <= error_of(recorded.steps.size(), depth));
    CHECK(std::fabs(recorded.march_end.transmittance - std::exp(-depth)) <= error_of(recorded.steps.size(), 1));
    CHECK(std::fabs(recorded.march_end.radiance.x - radiance) <= error_of(static_cast<size_t>(count), radiance));
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

TEST_CASE(WISP_ARITH_NAME
          ": a pixel's recorded sum is its value in the picture, to the bit, and so are the sums in it") {
    for (const bool surfaces : {false, true})
        for (const Way &way : ways) {
            CAPTURE(surfaces);
            CAPTURE(static_cast<int>(&way - ways));
            Scenery scenery(surfaces, way.method != Method::map || surfaces);
            if (surfaces && !way.resampled && way.irradiance == IrradianceMap::none) scenery.smokes[0].asymmetry = 0;
            Settings settings = settings_of(way);
            const std::vector<float> picture = traced_picture(scenery.scene, settings, nullptr);
            size_t steps = 0, hits = 0, sent = 0;
            bool multiple = false;
            for (int y = 0; y < pixels; ++y)
                for (int x = y % 2; x < pixels; x += 2) {
                    CAPTURE(x);
                    CAPTURE(y);
                    settings.crop = {x, y, x + 1, y + 1};
                    EventList events;
                    const PixelTrace trace = events.trace(x, y);
                    const std::vector<float> alone = traced_picture(scenery.scene, settings, &trace);
                    const float *rgb = picture.data() + 3 * (y * pixels + x);
                    CHECK(std::memcmp(alone.data(), rgb, 3 * sizeof *rgb) == 0);
                    for (const RecordedRay &ray : read_pixel(scenery.scene, settings, events, rgb))
                        for_each_ray(ray, [&](const RecordedRay &recorded) {
                            check_sums(recorded, vec_of(scenery.scene.background));
                            check_march(recorded, scenery.scene.light_count);
                            steps += recorded.steps.size();
                            hits += recorded.hit.size();
                            sent += recorded.rays.size();
                            for (const TraceEvent::Step &step : recorded.steps) multiple |= step.multiple.x > 0;
                        });
                }
            CHECK(steps > 50);
            CHECK(multiple);
            CHECK((hits > 20) == surfaces);
            CHECK((sent > 20) == surfaces);
        }
}

TEST_CASE(WISP_ARITH_NAME ": a pixel of surfaces alone is recorded, too; others, and none, are not") {
    Scenery scenery;
    scenery.scene.smoke_count = 0;
    Settings settings = settings_of(ways[0]);
    const std::vector<float> picture = traced_picture(scenery.scene, settings, nullptr);
    for (const int place : {0, 7, 20, 35}) { // in the whole picture
        EventList events;
        const PixelTrace trace = events.trace(place % pixels, place / pixels);
        CHECK(traced_picture(scenery.scene, settings, &trace) == picture);
        for (const RecordedRay &ray : read_pixel(scenery.scene, settings, events, picture.data() + 3 * place))
            for_each_ray(ray, [&](const RecordedRay &recorded) {
                CHECK(!recorded.marched);
                check_sums(recorded, vec_of(scenery.scene.background));
            });
    }
    EventList events;
    const PixelTrace outside = events.trace(pixels, 0);
    CHECK(traced_picture(scenery.scene, settings, &outside) == picture);
    CHECK(events.list.empty());
}

TEST_CASE(WISP_ARITH_NAME ": recorded shadows are those of a plate that is in the way, however they are decided") {
    for (const ShadowMethod method : {ShadowMethod::trace, ShadowMethod::cache, ShadowMethod::exact,
                                      ShadowMethod::voxel, ShadowMethod::lightbuffer, ShadowMethod::lie})
        for (const Way &way : {ways[0], ways[3], ways[6]}) {
            CAPTURE(static_cast<int>(method));
            Scenery scenery;
            scenery.smokes[0].asymmetry = 0;
            Settings settings = settings_of(way, method, 9);
            size_t blocked[2] = {0, 0}, lit[2] = {0, 0}, partly = 0, decisions[5] = {};
            for (const int place : {14, 15, 20, 21, 26, 27, 33}) {
                EventList events;
                const PixelTrace trace = events.trace(place % pixels, place / pixels);
                const std::vector<float> picture = traced_picture(scenery.scene, settings, &trace);
                for (const RecordedRay &ray : read_pixel(scenery.scene, settings, events, picture.data() + 3 * place))
                    for_each_ray(ray, [&](const RecordedRay &recorded) {
                        // `length`: of the step along the ray around `from`; 0: the light shines on a surface.
                        const auto check = [&](const TraceEvent::Light &light, const Double3 &from, double length) {
                            const bool in_smoke = length > 0;
                            if (!in_smoke) ++decisions[static_cast<int>(light.decision)];
                            if (light.decision == ShadowDecision::none) {
                                CHECK(light.lit == 1);
                                return;
                            }
                            if (in_smoke) CHECK(light.decision == ShadowDecision::traced);
                            const Double3 &d = recorded.ray.direction;
                            const Double3 source = from - light.direction * light.distance;
                            const double parts = in_smoke ? 256 : 1;
                            double least = 0, most = 0; // of the part that is lit
                            for (double part = 0.5; part < parts; ++part) {
                                const double t = (part / parts - 0.5) * length;
                                const Double3 x = from + d * t;
                                const Plate plate = find_plate(x, unit(source - x), wisp::length(source - x));
                                if (plate == Plate::beside) least += 1 / parts;
                                if (plate != Plate::before) most += 1 / parts;
                            }
                            // Two edges, each to a part.
                            const double slack = in_smoke ? 0.0625 : 0;
                            CHECK(light.lit >= least - slack);
                            CHECK(light.lit <= most + slack);
                            ++(light.lit == 0 ? blocked : lit)[in_smoke];
                            partly += light.lit > 0 && light.lit < 1;
                        };
                        for (const TraceEvent::Light &light : recorded.lights) check(light, recorded.hit[0].point, 0);
                        for (const TraceEvent::Light &light : recorded.in_steps)
                            for (const TraceEvent::Step &step : recorded.steps)
                                if (step.step == light.step) {
                                    const Double3 &o = recorded.ray.origin, &d = recorded.ray.direction;
                                    const double t = step.distance;
                                    check(light, {o.x + d.x * t, o.y + d.y * t, o.z + d.z * t}, step.length);
                                }
                    });
            }
            for (const bool in_smoke : {false, true}) {
                CHECK(blocked[in_smoke] > 10);
                CHECK(lit[in_smoke] > 10);
            }
            CHECK(partly > 5);
            const auto count = [&decisions](ShadowDecision decision) { return decisions[static_cast<int>(decision)]; };
            // What this scene makes of each method.
            const bool lists = method == ShadowMethod::lightbuffer || method == ShadowMethod::lie;
            CHECK((count(ShadowDecision::culled) > 0) ==
                  (method == ShadowMethod::exact || method == ShadowMethod::lightbuffer));
            CHECK((count(ShadowDecision::traced) > 0) == !lists);
            CHECK((count(ShadowDecision::tested) > 0) ==
                  (lists || method == ShadowMethod::cache || method == ShadowMethod::exact));
            CHECK(count(ShadowDecision::culled_static) == 0); // nothing moves
        }
}

TEST_CASE(WISP_ARITH_NAME ": a recorded hit, and the smoke in front of its lights, have their closed form") {
    Scenery scenery(true, false);
    SmokeDescription fog = {};
    fog.grid = {1, 1, 1, nullptr, 0.25, {0, 0, 0}, {8, 1, 8}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    scenery.smokes = {grid_smoke_of(fog.grid)};
    scenery.scene.smokes = scenery.smokes.data();
    Settings settings = settings_of(ways[0]);
    settings.photons = 0;
    size_t checked = 0;
    for (int place = 0; place < pixels * pixels; ++place) {
        EventList events;
        const PixelTrace trace = events.trace(place % pixels, place / pixels);
        settings.crop = {place % pixels, place / pixels, place % pixels + 1, place / pixels + 1};
        const std::vector<float> rgb = traced_picture(scenery.scene, settings, &trace);
        for (const RecordedRay &ray : read_pixel(scenery.scene, settings, events, rgb.data()))
            for (const TraceEvent::Hit &hit : ray.hit) {
                const Double3 &o = ray.ray.origin, &d = ray.ray.direction;
                CHECK(std::fabs(o.y + d.y * hit.distance - hit.point.y) < 1e-5);
                CHECK(std::fabs(o.x + d.x * hit.distance - hit.point.x) < 1e-5);
                if (hit.triangle > 1) continue;
                CHECK(std::fabs(hit.point.y + 2) < 1e-6); // the floor
                CHECK(hit.material == 0);
                CHECK(hit.instance == -1);
                CHECK(hit.is_static);
                CHECK(hit.plane.y == 1);
                for (const TraceEvent::Light &light : ray.lights) {
                    if (light.decision == ShadowDecision::none || light.lit == 0) continue;
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
