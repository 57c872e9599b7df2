// Ray marching (S1): the radiance that reaches the eye through smoke.
#pragma once
#include "core/lights/optical_depth_grid.h"
#include "core/march/trace_record.h"
#include "core/photons/irradiance_map.h"
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

// What comes out of a stretch of a ray, seen from where it begins: what the smoke in it sends, and which part of what
// lies behind.
struct Segment {
    Color radiance;
    Real transmittance;
};
inline Segment nothing_between() { return {Color(Real(0)), Real(1)}; }

// How a camera ray begins, and any ray ends, where it is heard.
template <class T> void tell_camera_ray(const T &heard, const Ray &ray) {
    tell(*heard.journal, TraceEvent::Ray{RayKind::camera, 0, told(ray.origin), told(ray.direction), {1, 1, 1}, 1});
}
template <class T>
void tell_ray_end(const T &teller, bool hit, const Segment &smoke, const Color &behind, const Color &radiance) {
    if constexpr (is_heard<T>)
        tell(*teller.journal, TraceEvent::RayEnd{hit, told(smoke.radiance), to_double(smoke.transmittance),
                                                   told(behind), told(radiance)});
}

// The lights as a march asks them.
struct SingleScatterer {
    const Light *lights;
    uint32_t light_count;
    const OpticalDepthGrid *depths; // kept depths, or nullptr: every depth is found exactly
    Shadows *shadows;          // of surfaces; nullptr: there are none
};

// All that a ray asks of the scene; one for the whole picture.
struct Marcher {
    const Medium *medium;
    SingleScatterer lights;
    const PhotonMap *photon_maps; // one a smoke, or nullptr
    const Irradiance *irradiance; // instead of those, or nullptr
    Real step;                    // length of a step
    const Real *gather_radius;    // one a smoke
    Real *extinctions;            // workspace, one a smoke
    Gather gather;
    Statistics *statistics;
};

// The march ends where less than 1.2e-7 of what lies behind comes through.
constexpr Real opaque_depth = Real(16);

// (1 - e^-s) / s for s >= 0: 1 at 0, by its series where the quotient would lose digits. (numerics E4)
inline Real mean_transmittance(Real s) {
    if (s < Real(0x1p-7)) return Real(1) - s * (Real(0.5) - s * (Real(1.0 / 6) - s * Real(1.0 / 24)));
    return -expm1(-s) / s;
}

// The optical depth so far; `lost` is what rounding took from it, as after Kahan.
struct Depth {
    Real value = Real(0), lost = Real(0);

    void add(Real s) {
        const Real more = s - lost, sum = value + more;
        lost = (sum - value) - more;
        value = sum;
    }
};

struct Step {
    Vec3 middle, begin, end;
};
// One that is heard: the number of the step with it.
struct NumberedStep : Step {
    int32_t number;
};
inline Step step_of(const Ray &ray, Real from, Real dx) {
    return {ray.origin + ray.direction * (from + Real(0.5) * dx), ray.origin + ray.direction * from,
            ray.origin + ray.direction * (from + dx)};
}

// What the lights send along `out` after one scattering at the step's middle, per unit of length; the smokes have
// these extinctions there.
Color single_scattering(const Medium &medium, const SingleScatterer &lights, const Step &step, const Vec3 &out,
                        const Real *extinctions, Statistics &statistics);
Color single_scattering(const Medium &medium, const SingleScatterer &lights, const Heard<NumberedStep> &step,
                        const Vec3 &out, const Real *extinctions, Statistics &statistics);
// The same of a marcher's.
template <class M>
Color single_scattering(const M &marcher, const Step &step, int32_t number, const Vec3 &out, const Real *extinctions) {
    if constexpr (is_heard<M>)
        return single_scattering(*marcher.medium, marcher.lights, Heard<NumberedStep>{{step, number}, marcher.journal},
                                 out, extinctions, *marcher.statistics);
    else
        return single_scattering(*marcher.medium, marcher.lights, step, out, extinctions, *marcher.statistics);
}

// What a march tells where it is heard: where it may meet smoke, its steps in smoke, and what came of them.
template <class M> void tell_march(const M &marcher, Real begin, Real end, int32_t steps) {
    if constexpr (is_heard<M>)
        tell(*marcher.journal, TraceEvent::March{to_double(begin), to_double(end), to_double(marcher.step), steps});
}
template <class M>
void tell_step(const M &marcher, int32_t number, Real distance, Real dx, Real sigma, Real depth, const Color &single,
               const Color &multiple, const Color &emission, const Color &radiance) {
    if constexpr (is_heard<M>)
        if (sigma > Real(0))
            tell(*marcher.journal, TraceEvent::Step{number, to_double(distance), to_double(dx), to_double(sigma),
                                                      to_double(depth), to_double(exp(-depth)), told(single),
                                                      told(multiple), told(emission), told(radiance)});
}
template <class M> Segment tell_end(const M &marcher, Real depth, const Segment &through) {
    if constexpr (is_heard<M>)
        tell(*marcher.journal,
             TraceEvent::MarchEnd{told(through.radiance), to_double(depth), to_double(through.transmittance)});
    return through;
}

// What comes along the ray from distances 0 to `end`: emission, single scattering from every light, multiple scattering
// from the photon maps. Extinction and the lights are sampled in the middle of each step,
// within which they count as constant: their integral over the step is exact for any depth (S1, numerics E4).
Segment march(Marcher &marcher, const Ray &ray, Real end);
Segment march(Heard<Marcher> &marcher, const Ray &ray, Real end);

} // namespace wisp::WISP_ARITH
