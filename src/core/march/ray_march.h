// Ray marching (S1): the radiance that arrives along a ray through smoke.
#pragma once
#include "core/march/pixel_recorder.h"
#include "core/numbers/sample_sums.h"
#include "core/photons/irradiance_map.h"
#include "core/shadows/shadows_in_space.h"
#include "core/smoke/transmittance.h"

namespace wisp::WISP_ARITH {

// A stretch of a ray, seen from where it begins: the radiance of the smoke in it, and the fraction of the radiance
// behind it that comes through.
struct Segment {
    Color radiance;
    Real transmittance;
};
inline Segment empty_segment() { return {Color(Real(0)), Real(1)}; }

// The lights that a march samples.
struct SingleScatterer {
    const Light *lights;
    uint32_t light_count;
    const OpticalDepthGrid *depths; // interpolated depths to the lights, or nullptr: each depth is computed exactly
    Shadows *shadows;               // of surfaces; nullptr: there are none
};

// The lengths of steps. Among particles of unlike smoothing lengths, a step is divided where finer ones are in it.
struct StepLengths {
    Real longest, finest; // of any step
    Real lengths;         // of a step, in smoothing lengths of the finest smoke in it
};
// The longest is the finest times the power of 4 that the coarsest particles allow; the finest where not all smoke is
// particles with exact densities.
StepLengths step_lengths(const Scene &scene, const Medium &medium, Real lengths);

// Marches through exact densities. One for the whole picture.
struct Marcher {
    const Medium *medium;
    SingleScatterer lights;
    const PhotonMap *photon_maps; // one a smoke, or nullptr
    const Irradiance *irradiance; // in place of photon maps, or nullptr
    StepLengths steps;
    const Real *gather_radius; // one a smoke
    Real *extinctions;         // workspace, one a smoke
    Gather gather;
    Statistics *statistics;
    Watch watch = {};
};

// A march ends at this optical depth: less than 1.2e-7 of what lies behind comes through.
constexpr Real opaque_depth = Real(16);

// The number of equal parts of a step of depth s, so that no part is deeper than `most`. At most 2^20: a march ends
// long before it has passed so many.
inline int32_t parts_of_step(Real s, Real most) {
    return s > most ? floor_to_int(min(s / most, Real(1 << 20))) + 1 : 1;
}

// The number of equal parts of a step that crosses so many cells, in smoke whose sigma_t, trilinear between nodes, may
// change by `change` over the step's length. The middle of a step would miss a wall that is thinner. What the middles
// of such parts give errs by less than 1/4 of depth each (README).
inline int32_t parts_of_dense_step(Real change, Real cells) {
    return floor_to_int(sqrt(min(change, Real(1 << 16)) * cells)) + 1;
}
// The same for the step of length dx at distance `from` of the ray. 1: it cannot be deeper than opaque_depth.
int32_t parts_between_nodes(const Medium &medium, const Ray &ray, Real from, Real dx);

// The number of equal parts of the step of length dx at distance `from`: 1 if no smoke in it asks for shorter steps,
// else 2 or 4, which may have parts again.
int32_t parts_among_unlike(const Medium &medium, const StepLengths &steps, const Ray &ray, Real from, Real dx);

// Lengths that differ by less count as equal, so that every arithmetic divides the same steps.
constexpr Real length_rounding = Real(1 + 0x1p-10);

// Whether a light that falls off is nearer to the ray's distances `from` to `to` than `reach`.
bool is_light_near(const Light *lights, uint32_t count, const Ray &ray, Real from, Real to, Real reach);

// The number of equal parts of the step of length dx at distance `from`: 2, which may have parts again, if it is longer
// than its distance to a light that falls off, and than 1/8 of a step of length `whole`.
inline int32_t parts_near_lights(const Light *lights, uint32_t count, const Ray &ray, Real from, Real dx, Real whole) {
    return dx * Real(8) > whole * length_rounding && is_light_near(lights, count, ray, from, from + dx, dx) ? 2 : 1;
}
// The same, where `whole` is what the smoke in the step asks for.
int32_t parts_near_lights(const SingleScatterer &lights, const Medium &medium, const StepLengths &steps, const Ray &ray,
                          Real from, Real dx);

constexpr Real any_depth = Real(0x1p30); // parts of steps are not divided again
// A step is divided where its smoke is deeper than this (README).
constexpr Real max_step_depth = Real(0.5);
// The same for exact densities. At hard faces of density grids light changes at once: there steps are shorter.
Real max_exact_step_depth(const Medium &medium);

// The first distance above `from` at which the ray meets a hard face of a density grid, or `end` if that is nearer.
Real next_face(const Medium &medium, const Ray &ray, Real from, Real end);

// Calls visit(from, length, steps) for the parts of the ray's distances 0 to `end` between hard faces, until it returns
// false. Each begins with a new step; the last of its `steps` may be shorter than `step`.
template <class Visit>
void for_each_part_between_faces(const Medium &medium, const Ray &ray, Real end, Real step, Visit &&visit) {
    for (Real from = Real(0); from < end;) {
        const Real face = next_face(medium, ray, from, end), length = face - from;
        if (!visit(from, length, floor_to_int(length / step) + 1)) return;
        from = face;
    }
}

// The optical depth so far. `lost` is what rounding took from the sum, as in Kahan's summation.
struct Depth {
    Real value = Real(0), lost = Real(0);

    void add(Real s) {
        const Real more = s - lost, sum = value + more;
        lost = (sum - value) - more;
        value = sum;
    }
};

// What a march has gathered so far.
struct MarchProgress {
    Color radiance = Color(Real(0));
    Depth depth;
    Color straight = Color(Real(0)); // of that depth, what only scatters straight on (GridMarcher)
    Real again = Real(0);            // of the radiance, all channels: what was scattered more than once
    int32_t number = 0;              // of the next step, for the record

    bool opaque() const { return !(depth.value - largest(straight) < opaque_depth); }
    // What the march has seen, with light of that map or nullptr; the recorder is told that it ends.
    Segment finish(const Irradiance *map, Statistics &statistics, PixelRecorder *recorder) const {
        const Segment seen = {radiance, exp(-depth.value)};
        if (has(parts::any_photons) && map) add(statistics.photons.variance, again * map->variance);
        if (is_recording(recorder)) recorder->march_end(*recorder, seen.radiance, depth.value, seen.transmittance);
        return seen;
    }
};

struct Step {
    int32_t number;
    Real length;
    Vec3 middle, begin, end;
};
// The step of length dx that begins at distance `from`.
inline Step make_step(const Ray &ray, int32_t number, Real from, Real dx) {
    return {number, dx, ray.origin + ray.direction * (from + Real(0.5) * dx), ray.origin + ray.direction * from,
            ray.origin + ray.direction * (from + dx)};
}

// find_lit_parts() of surfaces, which are there: each is recorded with the lane's next light, the work with that of the
// first.
void record_lit_parts(const Shadows &shadows, uint32_t light, const Ray &ray, uint32_t count, const Real *middle,
                      const Real *length, Real *lit, PixelRecorder *recorder);

// Radiance per unit of length that smokes of these extinctions emit (S1): sum of sigma_a L_e.
Color emitted_radiance(const Medium &medium, const Real *extinctions);

// Radiance per unit of length along `out` from one scattering at the step's middle, where the smokes have these
// extinctions: the sum over all lights. The inverse square of the distance to a light is its mean over the step.
Color single_scattering(const Medium &medium, const SingleScatterer &lights, const Step &step, const Vec3 &out,
                        const Real *extinctions, Statistics &statistics, PixelRecorder *recorder);
// The same of light that was scattered more than once: what the map tells, and peaks around point lights.
Color scattered_by_map(const Medium &medium, const SingleScatterer &lights, const Irradiance &map, const Step &step,
                       const Vec3 &out, const Real *extinctions, Statistics &statistics);

// Light around a point light that was scattered twice, as far as nodes blur it (README, Around a point light).
struct LightPeak {
    Real turns; // C of the README
    Phase wide;

    explicit LightPeak(const Phase &phase)
        : turns(Real(1) + Real(1.46740110) * (Real(1) - phase.asymmetry()) / (Real(1) + phase.asymmetry())),
          wide(phase.asymmetry() / turns) {}
    // What is scattered along `out` per unit of length, relative to sigma_s^2, where a light of that intensity gives
    // that irradiance and travels along `in`. `cell`: the distance between nodes.
    Real operator()(Real intensity, Real irradiance, Real cell, const Vec3 &in, const Vec3 &out) const {
        if (!(irradiance > Real(0))) return Real(0);
        const Real distance = sqrt(intensity / irradiance), blurred = Real(1) - distance / (cell * Real(1.41421356));
        return blurred > Real(0) ? irradiance * (turns * distance * blurred * blurred * wide(in, out)) : Real(0);
    }
};

// What arrives along the ray from distances 0 to `end`: emission, single scattering from every light, multiple
// scattering from the photon maps or the irradiance map. Extinction and light are sampled in the middle of each step
// and count as constant within it. The integral over such a step is exact for any depth of it (S1, N-E4).
Segment march(Marcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder);

} // namespace wisp::WISP_ARITH
