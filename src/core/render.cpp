// The stages of the papers, in order: trees, photons, picture.
#include "wisp/ray_march.h"

namespace wisp::WISP_ARITH {

namespace {

Vec3 vec_of(const Double3 &v) { return Vec3(to_real<Real>(v.x), to_real<Real>(v.y), to_real<Real>(v.z)); }

struct View {
    Vec3 origin, corner, right, down;
};

Ray ray_through(const View &view, Real column, Real row) {
    return {view.origin, normalize(view.corner + view.right * column + view.down * row)};
}

// Sample i of n inside a pixel, the same in every pixel: the centres of a k x k grid when n = k^2, else the first
// points of the R2 sequence (multiples of 1/p and 1/p^2 modulo 1, p^3 = p + 1).
void sample_position(uint32_t i, uint32_t n, Real &u, Real &v) {
    uint32_t k = 1;
    while (k * k < n) ++k;
    if (k * k == n) {
        u = (Real(static_cast<int32_t>(i % k)) + Real(0.5)) / Real(static_cast<int32_t>(k));
        v = (Real(static_cast<int32_t>(i / k)) + Real(0.5)) / Real(static_cast<int32_t>(k));
        return;
    }
    constexpr uint32_t half = 0x80000000u, first = 3242174889u, second = 2447445414u; // 2^32 / p, 2^32 / p^2
    u = unit_half_open<Real>(half + i * first);
    v = unit_half_open<Real>(half + i * second);
}

uint64_t march_bytes(const Scene &scene) {
    return Arena::bytes<Light>(scene.light_count) + 2 * Arena::bytes<Real>(scene.smoke_count);
}

bool make_marcher(const Scene &scene, const Settings &settings, const Medium &medium, const Light *lights, Arena &arena,
                  Marcher &marcher) {
    marcher.medium = &medium;
    marcher.lights = lights;
    marcher.light_count = scene.light_count;
    marcher.background = vec_of(scene.background);
    Real *radius = arena.make<Real>(scene.smoke_count);
    marcher.gather_radius = radius;
    marcher.extinctions = arena.make<Real>(scene.smoke_count);
    if (!marcher.gather_radius || !marcher.extinctions) return false;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const Real h = to_real<Real>(scene.smokes[i].smoothing_length), step = h * to_real<Real>(settings.step);
        radius[i] = h * to_real<Real>(settings.gather_radius);
        marcher.step = i == 0 ? step : min(marcher.step, step);
    }
    return true;
}

Status render_frame(const Scene &scene, const Settings &settings, Marcher &marcher, const Observer &observer,
                    float *rgb) {
    const View view = {vec_of(scene.camera.origin), vec_of(scene.camera.corner), vec_of(scene.camera.right),
                       vec_of(scene.camera.down)};
    const Crop &crop = settings.crop;
    for (int32_t y = crop.y0; y < crop.y1; ++y) {
        const uint64_t row = static_cast<uint64_t>(y - crop.y0);
        if (!observer(Stage::render, row, static_cast<uint64_t>(crop.y1 - crop.y0))) return Status::stopped;
        for (int32_t x = crop.x0; x < crop.x1; ++x) {
            Color sum(Real(0));
            for (uint32_t i = 0; i < settings.samples; ++i) {
                Real u, v;
                sample_position(i, settings.samples, u, v);
                sum += march(marcher, ray_through(view, Real(x) + u, Real(y) + v));
                ++marcher.statistics->rays.primary;
            }
            const Color mean = sum / Real(static_cast<int32_t>(settings.samples));
            *rgb++ = to_float_scaled(mean.x, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.y, scene.radiance_exponent);
            *rgb++ = to_float_scaled(mean.z, scene.radiance_exponent);
        }
    }
    return Status::done;
}

} // namespace

Plan plan(const Scene &scene, const Settings &settings) {
    Plan plan = {};
    for (uint32_t i = 0; i < scene.smoke_count; ++i) plan.smoke |= scene.smokes[i].count > 0;
    const PhotonPlan photons = plan_photons(scene, settings);
    plan.photons = photons.traced;
    plan.photon_directions = photons.directions;
    plan.photon_powers = photons.powers;
    plan.photon_capacity = photons.capacity;
    plan.bytes.particle_tree = medium_bytes(scene);
    plan.bytes.photon_map = photons.bytes;
    plan.bytes.gather = photons.traced ? gather_bytes(settings.gather) : 0;
    plan.bytes.arena = plan.bytes.particle_tree + plan.bytes.photon_map + plan.bytes.gather + march_bytes(scene);
    return plan;
}

Status render(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,
              Statistics &statistics) {
    Marcher marcher = {};
    marcher.statistics = &statistics;
    statistics.bytes.arena_size = arena.size();

    if (!observer(Stage::trees, 0, 1)) return Status::stopped;
    const Medium medium = make_medium(scene, arena);
    Light *lights = arena.make<Light>(scene.light_count);
    if (!medium.ready || !lights || !make_marcher(scene, settings, medium, lights, arena, marcher))
        return Status::out_of_memory;
    for (uint32_t i = 0; i < scene.light_count; ++i) lights[i] = make_light(scene.lights[i]);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) statistics.smoke.particles += scene.smokes[i].count;
    statistics.bytes.particle_tree = arena.mark();

    const PhotonPlan photons = plan_photons(scene, settings);
    if (photons.traced && !make_gather(settings.gather, arena, marcher.gather)) return Status::out_of_memory;
    const PhotonMaps maps =
        trace_photons(medium, lights, scene.light_count, settings, photons, observer, arena, statistics);
    if (maps.status != Status::done) return maps.status;
    marcher.photon_maps = maps.of_smoke;

    const Status status = render_frame(scene, settings, marcher, observer, rgb);
    statistics.bytes.arena_peak = arena.peak();
    return status;
}

} // namespace wisp::WISP_ARITH
