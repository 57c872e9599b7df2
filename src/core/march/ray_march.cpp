// Ray marching through all smokes, with exact densities (S1).
#include "core/march/ray_march.h"

namespace wisp::WISP_ARITH {

namespace {

// What point lights near the step add to what an irradiance map tells (LightPeak), per unit of length.
Color peaks_of_lights(const Medium &medium, const SingleScatterer &lights, const Irradiance &map, const Step &step,
                      const Vec3 &out, const Real *extinctions, Statistics &statistics) {
    Color sum(Real(0));
    const uint32_t brick = brick_at(*map.bricks, cell_at(map.bricks->lattice, step.middle));
    if (brick == no_brick) return sum;
    const Real cell = largest(map.bricks->cell) * Real(map.spacing[brick]);
    for (uint32_t l = 0; l < lights.light_count; ++l) {
        const Light &light = lights.lights[l];
        if (light.kind != LightKind::point || length(step.middle - light.position) > cell * Real(2)) continue;
        const Illumination from = illuminate(light, step.middle, step.begin, step.end);
        Color sigma_s(Real(0)), towards_out(Real(0));
        for (uint32_t i = 0; i < medium.count; ++i) {
            const SmokeVolume &smoke = medium.smokes[i];
            const LightPeak peak_of(smoke.phase);
            sigma_s += smoke.albedo * extinctions[i];
            towards_out += smoke.albedo * (extinctions[i] * peak_of(largest(light.color), largest(from.irradiance),
                                                                    cell, from.direction, out));
        }
        if (!(largest(towards_out) > Real(0))) continue;
        Real lit = Real(1);
        const Real middle = Real(0.5) * step.length;
        if (has(parts::surfaces) && lights.shadows)
            find_lit_parts(*lights.shadows, l, {step.begin, -out}, 1, &middle, &step.length, &lit);
        ++statistics.rays.shadow;
        const Real arriving = exp(-optical_depth(medium, {step.middle, -from.direction}, from.distance)) * lit;
        sum += sigma_s * towards_out * light.color * (arriving / largest(light.color));
    }
    return sum;
}

// Radiance per unit of length along `out` in the middle of the step that was scattered more than once. The ball of a
// photon estimate reaches beyond the smoke: where a smoke's extinction is 0 it scatters nothing, whatever photons are
// near.
Color multiple_scattering(Marcher &marcher, const Step &step, const Vec3 &out, const Real *extinctions) {
    const Vec3 &x = step.middle;
    Color sum(Real(0));
    if (marcher.irradiance)
        return scattered_by_map(*marcher.medium, marcher.lights, *marcher.irradiance, step, out, extinctions,
                                *marcher.statistics);
    if (!marcher.photon_maps) return sum;
    for (uint32_t i = 0; i < marcher.medium->count; ++i) {
        if (!(extinctions[i] > Real(0))) continue;
        const SmokeVolume &smoke = marcher.medium->smokes[i];
        sum += smoke.albedo * estimate_radiance(marcher.photon_maps[i], smoke.phase, x, out, marcher.gather_radius[i],
                                                marcher.gather, *marcher.statistics);
    }
    return sum;
}

} // namespace

void record_lit_parts(const Shadows &shadows, uint32_t light, const Ray &ray, uint32_t count, const Real *middle,
                      const Real *length, Real *lit, PixelRecorder *recorder) {
    const Statistics &statistics = *shadows.statistics;
    if (is_recording(recorder)) recorder->shadow_begin(*recorder, statistics);
    find_lit_parts(shadows, light, ray, count, middle, length, lit);
    if (!is_recording(recorder)) return;
    for (uint32_t l = 0; l < count; ++l) {
        if (!(length[l] > Real(0))) continue;
        recorder->shadow_end(*recorder, l, statistics, lit[l]);
        recorder->shadow_begin(*recorder, statistics);
    }
}

Color emitted_radiance(const Medium &medium, const Real *extinctions) {
    Color sum(Real(0));
    for (uint32_t s = 0; s < medium.count; ++s) {
        const SmokeVolume &smoke = medium.smokes[s];
        sum += (Color(Real(1)) - smoke.albedo) * smoke.emission * extinctions[s];
    }
    return sum;
}

Color single_scattering(const Medium &medium, const SingleScatterer &lights, const Step &step, const Vec3 &out,
                        const Real *extinctions, Statistics &statistics, PixelRecorder *recorder) {
    Color sum(Real(0));
    Real sigma = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i) sigma += extinctions[i];
    const bool bends = lights.depths && bend_at(medium, lights.depths->spacing, step.middle).of_depths;
    for (uint32_t l = 0; l < lights.light_count; ++l) {
        const Illumination light = illuminate(lights.lights[l], step.middle, step.begin, step.end);
        if (!(largest(light.irradiance) > Real(0))) continue;
        Color scattered(Real(0)); // sum of sigma_s p
        for (uint32_t i = 0; i < medium.count; ++i)
            if (extinctions[i] > Real(0))
                scattered +=
                    medium.smokes[i].albedo * (extinctions[i] * mean_phase(lights.lights[l], medium.smokes[i].phase,
                                                                           light.direction, step.begin, step.end, out));
        Real lit = Real(1);
        if (has(parts::surfaces) && lights.shadows && largest(scattered) > Real(0)) {
            const Real middle = Real(0.5) * step.length;
            record_lit_parts(*lights.shadows, l, {step.begin, -out}, 1, &middle, &step.length, &lit, recorder);
        }
        if (!(largest(scattered) > Real(0) && lit > Real(0))) {
            if (is_recording(recorder)) recorder->light(*recorder, {step.number, l, true, light});
            continue;
        }
        const bool exact = !lights.depths || is_dense(*lights.depths, sigma) ||
                           has_peak(*lights.depths, lights.lights[l], step.middle) || bends;
        if (exact) ++statistics.rays.shadow;
        const Real depth = exact ? optical_depth(medium, {step.middle, -light.direction}, light.distance)
                                 : optical_depth_to_light(*lights.depths, l, step.middle);
        const Real transmittance = exp(-depth);
        const Color contribution = scattered * light.irradiance * (transmittance * lit);
        sum += contribution;
        if (is_recording(recorder))
            recorder->light(*recorder, {step.number, l, true, light, depth, transmittance, contribution});
    }
    return sum;
}

Color scattered_by_map(const Medium &medium, const SingleScatterer &lights, const Irradiance &map, const Step &step,
                       const Vec3 &out, const Real *extinctions, Statistics &statistics) {
    return scattered_light(map, medium, step.middle, out, extinctions) +
           peaks_of_lights(medium, lights, map, step, out, extinctions, statistics);
}

Real max_exact_step_depth(const Medium &medium) {
    for (uint32_t i = 0; i < medium.count; ++i)
        if (medium.smokes[i].field.is_grid()) return max_step_depth * Real(0.25);
    return max_step_depth;
}

Real next_face(const Medium &medium, const Ray &ray, Real from, Real end) {
    Real next = end;
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!medium.smokes[i].field.is_grid()) continue;
        Ray inside;
        Real entry, length = infinite_distance;
        if (!enter(medium.smokes[i].field.grid, ray, inside, entry, length)) continue;
        const Real exit = entry + length;
        if (entry > from) next = min(next, entry);
        if (exit > from) next = min(next, exit);
    }
    return next;
}

StepLengths step_lengths(const Scene &scene, const Medium &medium, Real lengths) {
    Real coarsest = Real(0);
    bool exact_particles = true;
    for (uint32_t i = 0; i < medium.count; ++i) {
        exact_particles = exact_particles && !medium.smokes[i].field.is_grid() && !medium.smokes[i].field.is_resampled;
        coarsest = max(coarsest, to_real<Real>(scene.smokes[i].largest_h));
    }
    const Real finest = smallest_smoothing_length(scene) * lengths;
    Real longest = finest;
    while (exact_particles && longest > Real(0) && longest * Real(4) <= coarsest * lengths) longest = longest * Real(4);
    return {longest, finest, lengths};
}

namespace {

// Among unlike particles, the length of a segment in smoothing lengths of the finest that meet it.
Real length_among_unlike(const Medium &medium, const Ray &ray, Real from, Real dx) {
    Real inverse_h = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i)
        inverse_h = max(inverse_h, finest_on_segment(medium.smokes[i].field.particles, ray, from, from + dx));
    return dx * inverse_h;
}

} // namespace

int32_t parts_among_unlike(const Medium &medium, const StepLengths &steps, const Ray &ray, Real from, Real dx) {
    if (!(dx > steps.finest * length_rounding)) return 1;
    const Real length = length_among_unlike(medium, ray, from, dx);
    return !(length > steps.lengths * length_rounding)            ? 1
           : length > steps.lengths * (Real(2) * length_rounding) ? 4
                                                                  : 2;
}

bool is_light_near(const Light *lights, uint32_t count, const Ray &ray, Real from, Real to, Real reach) {
    for (uint32_t i = 0; i < count; ++i) {
        if (!has_falloff(lights[i].kind)) continue;
        const Vec3 to_light = lights[i].position - ray.origin;
        const Real nearest = max(from, min(dot(to_light, ray.direction), to));
        if (length(to_light - ray.direction * nearest) < reach) return true;
    }
    return false;
}

int32_t parts_near_lights(const SingleScatterer &lights, const Medium &medium, const StepLengths &steps, const Ray &ray,
                          Real from, Real dx) {
    if (steps.longest == steps.finest)
        return parts_near_lights(lights.lights, lights.light_count, ray, from, dx, steps.finest);
    if (!is_light_near(lights.lights, lights.light_count, ray, from, from + dx, dx)) return 1;
    return length_among_unlike(medium, ray, from, dx) * Real(8) > steps.lengths * length_rounding ? 2 : 1;
}

int32_t parts_between_nodes(const Medium &medium, const Ray &ray, Real from, Real dx) {
    int32_t parts = 1;
    for (uint32_t i = 0; i < medium.count; ++i) {
        const DensityField &field = medium.smokes[i].field;
        if (!field.is_grid() && !field.is_resampled) continue;
        const Real largest = field.is_resampled ? field.resampled.largest : field.grid.largest;
        if (!(largest * dx > opaque_depth)) continue;
        const Vec3 a = ray.origin + ray.direction * from, b = a + ray.direction * dx;
        const Real depth = majorant(field, {min(a, b), max(a, b)}) * dx;
        if (!(depth > opaque_depth)) continue;
        const Vec3 &cell = field.is_resampled ? field.resampled.bricks->cell : field.grid.between.edge;
        const Real cells = dx / min(cell.x, min(cell.y, cell.z)) * Real(1.73205081); // along all axes together, at most
        parts = max(parts, parts_of_dense_step(depth, cells));
    }
    return parts;
}

namespace {

constexpr uint32_t units_of_step = 128; // of work, and for each light as much

// Adds the step of length dx at distance `from` of the ray. `begin` is where that ray starts, for the record. A step
// that is deeper than `most` is added in equal parts.
void add_step(Marcher &marcher, const Ray &ray, Real begin, Real from, Real dx, Real most, MarchProgress &so_far,
              PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    const auto divide = [&](int32_t parts, Real most_of_part) {
        const Real part = dx / Real(parts);
        for (int32_t i = 0; i < parts && !so_far.opaque(); ++i)
            add_step(marcher, ray, begin, from + Real(i) * part, part, most_of_part, so_far, recorder);
    };
    if (most < any_depth) {
        const int32_t parts = max(
            max(parts_among_unlike(medium, marcher.steps, ray, from, dx), parts_between_nodes(medium, ray, from, dx)),
            parts_near_lights(marcher.lights, medium, marcher.steps, ray, from, dx));
        if (parts > 1) return divide(parts, most);
    }
    const Vec3 out = -ray.direction;
    const int32_t number = so_far.number++;
    const Step step = make_step(ray, number, from, dx);
    ++marcher.statistics->smoke.march_samples;
    if (!marcher.watch.go_on(units_of_step * (1 + marcher.lights.light_count))) return;

    Real sigma = Real(0), *extinctions = marcher.extinctions;
    for (uint32_t s = 0; s < medium.count; ++s) {
        extinctions[s] = extinction(medium.smokes[s].field, step.middle);
        ++marcher.statistics->smoke.density_evaluations;
        sigma += extinctions[s];
    }
    const Real s = sigma * dx;
    if (most < any_depth && sigma > Real(0)) {
        const int32_t parts = parts_of_step(max(sigma, bend_at(medium, 1, step.middle).densest) * dx, most);
        if (parts > 1) return divide(parts, any_depth);
    }
    const Color emission = emitted_radiance(medium, extinctions);
    Color source = emission, single(Real(0)); // per unit of length
    if (sigma > Real(0))
        source += single =
            single_scattering(medium, marcher.lights, step, out, extinctions, *marcher.statistics, recorder);
    const Color multiple = multiple_scattering(marcher, step, out, extinctions);
    source += multiple;

    const Real weight = exp(-so_far.depth.value) * mean_transmittance(s) * dx;
    const Color arriving = source * weight;
    if (marcher.irradiance) so_far.again += all_channels(multiple) * weight;
    if (is_recording(recorder) && sigma > Real(0))
        recorder->step(*recorder, {number, begin + from + Real(0.5) * dx, dx, sigma, so_far.depth.value, single,
                                   multiple, emission, arriving});
    so_far.radiance += arriving;
    so_far.depth.add(s);
}

} // namespace

Segment march(Marcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    Real begin = Real(0);
    if (medium.empty() || !clip(medium.bounds, ray, begin, end)) return empty_segment();

    // Distances count from where the ray enters the smoke: a camera far away costs one rounding, of that point.
    const Ray inside = {ray.origin + ray.direction * begin, ray.direction};
    const Real length = end - begin, longest = marcher.steps.longest;
    if (is_recording(recorder)) recorder->march(*recorder, begin, end, longest, floor_to_int(length / longest) + 1);
    const Real most = max_exact_step_depth(medium);
    MarchProgress so_far;
    for_each_part_between_faces(medium, inside, length, longest, [&](Real from, Real part, int32_t steps) {
        for (int32_t i = 0; i < steps && !so_far.opaque(); ++i) {
            const Real covered = Real(i) * longest, dx = min(longest, part - covered);
            if (!(dx > Real(0))) break;
            add_step(marcher, inside, begin, from + covered, dx, most, so_far, recorder);
        }
        return !so_far.opaque();
    });
    return so_far.finish(marcher.irradiance, *marcher.statistics, recorder);
}

} // namespace wisp::WISP_ARITH
