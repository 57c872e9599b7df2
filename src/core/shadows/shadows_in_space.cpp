#include "core/shadows/shadows_in_space.h"
#include "core/surfaces/light_fan.h"

namespace wisp::WISP_ARITH {

void find_lit_parts(const Shadows &shadows, uint32_t light, const Ray &ray, uint32_t count, const Real *middle,
                    const Real *length, Real *lit) {
    const Light &source = shadows.lights[light];
    StepShadows steps;
    steps.count = count;
    uint32_t asked = 0;
    Real begin = infinite_distance, end = Real(0);
    for (uint32_t i = 0; i < count; ++i) {
        steps.begin[i] = middle[i] - Real(0.5) * length[i];
        steps.length[i] = length[i];
        steps.hidden[i] = ~0u;
        lit[i] = Real(1);
        if (!(length[i] > Real(0))) continue;
        steps.hidden[i] = 0;
        begin = min(begin, steps.begin[i]);
        end = max(end, steps.begin[i] + length[i]);
        ++asked;
    }
    if (asked == 0) return;
    const bool is_parallel = source.kind == LightKind::parallel;
    LightFan fan;
    if (make_light_fan(ray, begin, end, is_parallel, is_parallel ? -source.direction : source.position,
                       shadows.surfaces->ray_epsilon, fan)) {
        shadows.statistics->rays.shadow += asked;
        add_shadows(*shadows.surfaces, fan, steps, shadows.statistics->shadow.traced);
        for (uint32_t i = 0; i < count; ++i)
            lit[i] = Real(static_cast<int32_t>(shadow_parts) - __builtin_popcount(steps.hidden[i])) *
                     Real(1.0 / shadow_parts);
        return;
    }
    for (uint32_t i = 0; i < count; ++i) { // towards the light or away from it: by a ray from the middle
        if (!(length[i] > Real(0))) continue;
        const Vec3 x = ray.origin + ray.direction * middle[i];
        ++shadows.statistics->rays.shadow;
        if (is_blocked_in_space(*shadows.surfaces, x, illuminate(source, x, x, x), shadows.statistics->shadow.traced))
            lit[i] = Real(0);
    }
}

} // namespace wisp::WISP_ARITH
