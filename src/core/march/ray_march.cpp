// Ray marching through all smokes (S1).
#include "core/march/ray_march.h"

namespace wisp::WISP_ARITH {

namespace {

// What was scattered at least once before and now along `out`, per unit of length. The ball of an estimate reaches
// beyond the smoke; where there is none nothing scatters, whatever photons are near.
template <class M> Color multiple_scattering(M &marcher, const Vec3 &x, const Vec3 &out, const Real *extinctions) {
    Color sum(Real(0));
    if (marcher.irradiance) return scattered_light(*marcher.irradiance, *marcher.medium, x, out, extinctions);
    if (!marcher.photon_maps) return sum;
    for (uint32_t i = 0; i < marcher.medium->count; ++i) {
        if (!(extinctions[i] > Real(0))) continue;
        const SmokeVolume &smoke = marcher.medium->smokes[i];
        sum += smoke.albedo * estimate_radiance(marcher.photon_maps[i], smoke.phase, x, out, marcher.gather_radius[i],
                                           marcher.gather, *marcher.statistics);
    }
    return sum;
}

// S: a Step, or one that is heard.
template <class S>
Color scattered_once(const Medium &medium, const SingleScatterer &lights, const S &step, const Vec3 &out,
                     const Real *extinctions, Statistics &statistics) {
    Color sum(Real(0));
    for (uint32_t l = 0; l < lights.light_count; ++l) {
        const Illumination light = illuminate(lights.lights[l], step.middle, step.begin, step.end);
        if (!(largest(light.irradiance) > Real(0))) continue;
        LightRecord<is_heard<S>> note(step, statistics, l, light);
        if constexpr (is_heard<S>) note.entry.step = step.number;
        Color scattered(Real(0)); // sum of sigma_s p
        for (uint32_t i = 0; i < medium.count; ++i)
            if (extinctions[i] > Real(0))
                scattered += medium.smokes[i].albedo * (extinctions[i] * medium.smokes[i].phase(light.direction, out));
        const auto is_blocked = [&] { return is_shadowed(lights.shadows, l, step.middle, light); };
        if (!(largest(scattered) > Real(0)) || note.is_blocked(lights.shadows, is_blocked)) continue;
        if (!lights.depths) ++statistics.rays.shadow;
        const Real depth = lights.depths ? optical_depth_to_light(*lights.depths, l, step.middle)
                                         : optical_depth(medium, {step.middle, -light.direction}, light.distance);
        const Real transmittance = exp(-depth);
        const Color contribution = scattered * light.irradiance * transmittance;
        sum += contribution;
        note.passes(depth, transmittance);
        note.gives(contribution);
    }
    return sum;
}

template <class M> Segment march_of(M &marcher, const Ray &ray, Real end) {
    const Medium &medium = *marcher.medium;
    Real begin = Real(0);
    if (medium.empty() || !clip(medium.bounds, ray, begin, end)) return nothing_between();

    // Distances count from where the ray enters: what a camera far away costs is one rounding of that point.
    const Ray inside = {ray.origin + ray.direction * begin, ray.direction};
    const Vec3 out = -ray.direction;
    const Real length = end - begin;
    const int32_t steps = floor_to_int(length / marcher.step) + 1;
    tell_march(marcher, begin, end, steps);
    Color radiance(Real(0));
    Depth depth;
    for (int32_t i = 0; i < steps && depth.value < opaque_depth; ++i) {
        const Real from = Real(i) * marcher.step, dx = min(marcher.step, length - from);
        if (!(dx > Real(0))) break;
        const Step step = step_of(inside, from, dx);
        ++marcher.statistics->smoke.march_samples;

        Real sigma = Real(0), *extinctions = marcher.extinctions;
        Color source(Real(0)); // of one unit of length
        for (uint32_t s = 0; s < medium.count; ++s) {
            const SmokeVolume &smoke = medium.smokes[s];
            extinctions[s] = extinction(smoke.field, step.middle);
            ++marcher.statistics->smoke.density_evaluations;
            sigma += extinctions[s];
            source += (Color(Real(1)) - smoke.albedo) * smoke.emission * extinctions[s];
        }
        const Color emission = source;
        Color single(Real(0));
        if (sigma > Real(0)) source += single = single_scattering(marcher, step, i, out, extinctions);
        const Color multiple = multiple_scattering(marcher, step.middle, out, extinctions);
        source += multiple;

        const Real s = sigma * dx;
        const Color arriving = source * (exp(-depth.value) * mean_transmittance(s) * dx);
        tell_step(marcher, i, begin + from + Real(0.5) * dx, dx, sigma, depth.value, single, multiple, emission,
                  arriving);
        radiance += arriving;
        depth.add(s);
    }
    return tell_end(marcher, depth.value, {radiance, exp(-depth.value)});
}

} // namespace

Color single_scattering(const Medium &medium, const SingleScatterer &lights, const Step &step, const Vec3 &out,
                        const Real *extinctions, Statistics &statistics) {
    return scattered_once(medium, lights, step, out, extinctions, statistics);
}
Color single_scattering(const Medium &medium, const SingleScatterer &lights, const Heard<NumberedStep> &step,
                        const Vec3 &out, const Real *extinctions, Statistics &statistics) {
    return scattered_once(medium, lights, step, out, extinctions, statistics);
}

Segment march(Marcher &marcher, const Ray &ray, Real end) { return march_of(marcher, ray, end); }
Segment march(Heard<Marcher> &marcher, const Ray &ray, Real end) { return march_of(marcher, ray, end); }

} // namespace wisp::WISP_ARITH
