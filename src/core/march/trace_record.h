// How rays tell what they do (journal.h): code that may be heard is a template of what it works with, T or Heard<T>,
// and compiled for both; of T all that is told here is nothing, and costs nothing.
#pragma once
#include "core/shadows/shadows.h"
#include "wisp/pixel_trace.h"

namespace wisp::WISP_ARITH {

template <class T> struct Heard : T { const PixelTrace *journal; };
template <class T> constexpr bool is_heard = false;
template <class T> constexpr bool is_heard<Heard<T>> = true;

inline Double3 told(const Vec3 &v) { return {to_double(v.x), to_double(v.y), to_double(v.z)}; }

#define WISP_TELL(Type, name)                                                                                          \
    inline void tell(const PixelTrace &journal, const TraceEvent::Type &name) {                                         \
        TraceEvent entry = {};                                                                                       \
        entry.kind = TraceEvent::Kind::name;                                                                         \
        entry.name = name;                                                                                             \
        journal.heard(journal.context, entry);                                                                         \
    }
WISP_TELL(Sample, sample)
WISP_TELL(Ray, ray)
WISP_TELL(March, march)
WISP_TELL(Light, light)
WISP_TELL(Step, step)
WISP_TELL(MarchEnd, march_end)
WISP_TELL(Hit, hit)
WISP_TELL(Lit, lit)
WISP_TELL(Unsent, unsent)
WISP_TELL(RayEnd, ray_end)
WISP_TELL(SampleEnd, sample_end)
WISP_TELL(Pixel, pixel)
#undef WISP_TELL

// How the shadow towards a light was decided is what the counters say.
inline void tell_answer(TraceEvent::Light &light, const Statistics &before, const Statistics &after, bool blocked) {
    light.blocked = blocked;
    light.node_visits = after.shadow.traced.node_visits - before.shadow.traced.node_visits;
    light.triangle_tests = after.shadow.traced.triangle_tests - before.shadow.traced.triangle_tests;
    light.extra_tests = after.shadow.extra_tests - before.shadow.extra_tests;
    const bool known = after.rays.shadow_culled > before.rays.shadow_culled,
               culled_static = after.rays.shadow_dynamic_only > before.rays.shadow_dynamic_only;
    light.answer = known                                             ? ShadowDecision::known
                   : culled_static                                     ? ShadowDecision::culled_static
                   : light.extra_tests > 0 && light.node_visits == 0 ? ShadowDecision::tried
                                                                     : ShadowDecision::traced;
}

// A light that may shine somewhere, told when all is known: as the note goes.
template <bool heard> struct LightRecord {
    template <class... Anything> explicit LightRecord(const Anything &...) {}
    template <class Ask> bool is_blocked(const Shadows *, Ask &&ask) { return ask(); }
    void passes(Real, Real) {}
    void gives(const Color &) {}
};
template <> struct LightRecord<true> {
    template <class Teller>
    LightRecord(const Teller &teller, const Statistics &statistics_, uint32_t light, const Illumination &from)
        : journal(*teller.journal), statistics(statistics_) {
        entry.step = -1;
        entry.light = light;
        entry.faces = true;
        entry.direction = told(from.direction);
        entry.distance = to_double(from.distance);
        entry.irradiance = told(from.irradiance);
        entry.transmittance = 1;
    }
    ~LightRecord() { tell(journal, entry); }
    LightRecord(const LightRecord &) = delete;
    LightRecord &operator=(const LightRecord &) = delete;

    // `shadows` are nullptr where nothing casts any.
    template <class Ask> bool is_blocked(const Shadows *shadows, Ask &&ask) {
        const Statistics before = statistics;
        const bool blocked = ask();
        if (shadows) tell_answer(entry, before, statistics, blocked);
        return blocked;
    }
    void passes(Real depth, Real transmittance) {
        entry.optical_depth = to_double(depth);
        entry.transmittance = to_double(transmittance);
    }
    void gives(const Color &contribution) { entry.contribution = told(contribution); }

    const PixelTrace &journal;
    const Statistics &statistics;
    TraceEvent::Light entry = {};
};

} // namespace wisp::WISP_ARITH
