// Ray marching through all smokes (S1).
#include "wisp/ray_march.h"

namespace wisp::WISP_ARITH {

namespace {

// The march ends where less than 1.2e-7 of what lies behind comes through.
constexpr Real opaque_depth = Real(16);

// (1 - e^-s) / s for s >= 0: 1 at 0, by its series where the quotient would lose digits. (numerics E4)
Real mean_transmittance(Real s) {
    if (s < Real(0x1p-7)) return Real(1) - s * (Real(0.5) - s * (Real(1.0 / 6) - s * Real(1.0 / 24)));
    return -expm1(-s) / s;
}

struct Step {
    Vec3 middle, begin, end;
};

// What the lights send along `out` after one scattering at the step's middle, per unit of length.
Color single_scattering(Marcher &marcher, const Step &step, const Vec3 &out, const Real *extinctions) {
    const Medium &medium = *marcher.medium;
    Color sum(Real(0));
    for (uint32_t l = 0; l < marcher.light_count; ++l) {
        const Illumination light = illuminate(marcher.lights[l], step.middle, step.begin, step.end);
        if (!(largest(light.irradiance) > Real(0))) continue;
        Color scattered(Real(0)); // sum of sigma_s p
        for (uint32_t i = 0; i < medium.count; ++i)
            if (extinctions[i] > Real(0))
                scattered += medium.smokes[i].albedo * (extinctions[i] * medium.smokes[i].phase(light.direction, out));
        if (!(largest(scattered) > Real(0))) continue;
        ++marcher.statistics->rays.shadow;
        const Real depth = optical_depth(medium, {step.middle, -light.direction}, light.distance);
        sum += scattered * light.irradiance * exp(-depth);
    }
    return sum;
}

// What was scattered at least once before and now along `out`, per unit of length. The ball of an estimate reaches
// beyond the smoke; where there is none nothing scatters, whatever photons are near.
Color multiple_scattering(Marcher &marcher, const Vec3 &x, const Vec3 &out, const Real *extinctions) {
    Color sum(Real(0));
    if (!marcher.photon_maps) return sum;
    for (uint32_t i = 0; i < marcher.medium->count; ++i) {
        if (!(extinctions[i] > Real(0))) continue;
        const Smoke &smoke = marcher.medium->smokes[i];
        sum += smoke.albedo * in_scattered(marcher.photon_maps[i], smoke.phase, x, out, marcher.gather_radius[i],
                                           marcher.gather, *marcher.statistics);
    }
    return sum;
}

} // namespace

Color march(Marcher &marcher, const Ray &ray) {
    const Medium &medium = *marcher.medium;
    Real begin = Real(0), end = path_end;
    if (medium.empty() || !clip(medium.bounds, ray, begin, end)) return marcher.background;

    // Distances count from where the ray enters: what a camera far away costs is one rounding of that point.
    const Vec3 entry = ray.origin + ray.direction * begin, out = -ray.direction;
    const Real length = end - begin;
    const int32_t steps = floor_to_int(length / marcher.step) + 1;
    Color radiance(Real(0));
    Real depth = Real(0), lost = Real(0); // what rounding took from the depth so far, as after Kahan
    for (int32_t i = 0; i < steps && depth < opaque_depth; ++i) {
        const Real from = Real(i) * marcher.step, dx = min(marcher.step, length - from);
        if (!(dx > Real(0))) break;
        const Step step = {entry + ray.direction * (from + Real(0.5) * dx), entry + ray.direction * from,
                           entry + ray.direction * (from + dx)};
        ++marcher.statistics->smoke.march_samples;

        Real sigma = Real(0), *extinctions = marcher.extinctions;
        Color source(Real(0)); // of one unit of length
        for (uint32_t s = 0; s < medium.count; ++s) {
            const Smoke &smoke = medium.smokes[s];
            extinctions[s] = extinction(smoke.field, step.middle);
            ++marcher.statistics->smoke.density_evaluations;
            sigma += extinctions[s];
            source += (Color(Real(1)) - smoke.albedo) * smoke.emission * extinctions[s];
        }
        if (sigma > Real(0)) source += single_scattering(marcher, step, out, extinctions);
        source += multiple_scattering(marcher, step.middle, out, extinctions);

        const Real s = sigma * dx;
        radiance += source * (exp(-depth) * mean_transmittance(s) * dx);
        const Real more = s - lost, sum = depth + more;
        lost = (sum - depth) - more;
        depth = sum;
    }
    return radiance + marcher.background * exp(-depth);
}

} // namespace wisp::WISP_ARITH
