// How rays tell what they do (journal.h): code that may be heard is a template of what it works with, T or Heard<T>,
// and compiled for both; of T all that is told here is nothing, and costs nothing.
#pragma once
#include "core/shadows/shadows.h"
#include "wisp/pixel_trace.h"

namespace wisp::WISP_ARITH {

template <class T> struct Heard : T { const Journal *journal; };
template <class T> constexpr bool is_heard = false;
template <class T> constexpr bool is_heard<Heard<T>> = true;

inline Double3 told(const Vec3 &v) { return {to_double(v.x), to_double(v.y), to_double(v.z)}; }

#define WISP_TELL(Type, name)                                                                                          \
    inline void tell(const Journal &journal, const JournalEntry::Type &name) {                                         \
        JournalEntry entry = {};                                                                                       \
        entry.kind = JournalEntry::Kind::name;                                                                         \
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
inline void tell_answer(JournalEntry::Light &light, const Statistics &before, const Statistics &after, bool blocked) {
    light.blocked = blocked;
    light.node_visits = after.shadow.traced.node_visits - before.shadow.traced.node_visits;
    light.triangle_tests = after.shadow.traced.triangle_tests - before.shadow.traced.triangle_tests;
    light.extra_tests = after.shadow.extra_tests - before.shadow.extra_tests;
    const bool known = after.rays.shadow_culled > before.rays.shadow_culled,
               known_still = after.rays.shadow_dynamic_only > before.rays.shadow_dynamic_only;
    light.answer = known                                             ? ShadowAnswer::known
                   : known_still                                     ? ShadowAnswer::known_still
                   : light.extra_tests > 0 && light.node_visits == 0 ? ShadowAnswer::tried
                                                                     : ShadowAnswer::traced;
}

// A light that may shine somewhere, told when all is known: as the note goes.
template <bool heard> struct LightNote {
    template <class... Anything> explicit LightNote(const Anything &...) {}
    template <class Ask> bool is_blocked(const Shadows *, Ask &&ask) { return ask(); }
    void passes(Real, Real) {}
    void gives(const Color &) {}
};
template <> struct LightNote<true> {
    template <class Teller>
    LightNote(const Teller &teller, const Statistics &statistics_, uint32_t light, const Illumination &from)
        : journal(*teller.journal), statistics(statistics_) {
        entry.step = -1;
        entry.light = light;
        entry.faces = true;
        entry.direction = told(from.direction);
        entry.distance = to_double(from.distance);
        entry.irradiance = told(from.irradiance);
        entry.transmittance = 1;
    }
    ~LightNote() { tell(journal, entry); }
    LightNote(const LightNote &) = delete;
    LightNote &operator=(const LightNote &) = delete;

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

    const Journal &journal;
    const Statistics &statistics;
    JournalEntry::Light entry = {};
};

} // namespace wisp::WISP_ARITH
