#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/base/text.h"
#include "host/prepare/strays.h"
#include "host/prepare/unit.h"

namespace wisp {

namespace {

Unit preferred_unit(const SmokeExtent &all, const PreparedSurfaces *surfaces) {
    return surfaces ? surfaces->own_unit() : unit_of_smoke(all);
}

// The smoke as far as its farthest element.
std::string farthest_of(const std::vector<Particle> &particles, const Double3 &center, double reach) {
    for (size_t i = 0; i < particles.size(); ++i)
        if (const Double3 &p = particles[i].position; largest_component(p - center) == reach)
            return "point " + std::to_string(i) + " is at " + two_digits(p.x) + " " + two_digits(p.y) + " " +
                   two_digits(p.z) + ", " + two_digits(reach);
    return "the smoke reaches " + two_digits(reach);
}

} // namespace

SmokeExtent extent_of_all(const std::vector<SmokeExtent> &smokes) {
    SmokeExtent all;
    for (const SmokeExtent &smoke : smokes) all.add(smoke);
    return all;
}

bool is_wide(const SmokeExtent &all, const PreparedSurfaces *surfaces) {
    if (!all.any()) return false;
    const Unit unit = preferred_unit(all, surfaces);
    return reach_of(all, unit.center) * unit.scale > coordinate_limit;
}

Unit find_unit(const SceneFile &file, const std::vector<SmokeExtent> &smokes,
               const std::vector<std::vector<Particle>> &particles, const PreparedSurfaces *surfaces,
               Arithmetic arithmetic) {
    const SmokeExtent all = extent_of_all(smokes);
    Unit own = preferred_unit(all, surfaces);
    const bool wide = is_wide(all, surfaces);
    // In wide smoke f32 is fine where most of it is.
    if (wide && !surfaces) own.center = middle_of_most(particles).value_or(own.center);
    const double reach = reach_of(all, own.center);
    const double reach_of_surfaces = surfaces ? surfaces->reach() : 0;
    const double scale = scale_of(all, own, surfaces != nullptr, reach_of_surfaces);
    const auto has_surfaces = [&](double of) { return keeps_surfaces(reach_of_surfaces, of); };
    const auto keeps_smoke = [&](double of) { return all.smallest_h * of >= least_h; };
    const auto refuse = [&](auto &&is_of, const std::string &what) {
        for (size_t i = 0; i < smokes.size(); ++i)
            if (smokes[i].any() && is_of(smokes[i])) throw InputError(file.smokes[i].where, what);
    };
    const auto refuse_reach = [&](const std::string &beside, auto &&keeps, const char *otherwise = "") {
        double least = scale;
        while (!keeps(least)) least *= 2;
        for (size_t i = 0; i < smokes.size(); ++i)
            if (smokes[i].any() && reach_of(smokes[i], own.center) == reach)
                throw InputError(file.smokes[i].where,
                                 farthest_of(particles[i], own.center, reach) + " from the middle, too far beside " +
                                     beside + ", expected at most " + two_digits(coordinate_limit / least) + otherwise);
    };
    const bool fixed = arithmetic == Arithmetic::fixed;
    const std::string finest = "a smoothing length of " + two_digits(all.smallest_h);
    if (!has_surfaces(scale)) refuse_reach("surfaces of " + two_digits(reach_of_surfaces), has_surfaces);
    if (!keeps_smoke(scale) && scale < own.scale && (fixed || !surfaces))
        refuse_reach(finest, keeps_smoke, surfaces ? ", or --arith f32" : "");
    if (!fixed || !surfaces) return {own.center, scale};
    const std::string beside = " for fixed point beside surfaces that reach " + two_digits(reach_of_surfaces);
    if (!keeps_smoke(scale))
        refuse([&](const SmokeExtent &smoke) { return smoke.smallest_h == all.smallest_h; },
               finest + " is too fine" + beside + ", expected at least " + two_digits(least_h / scale) +
                   ", or --arith f32");
    if (all.largest_h * scale > most_h)
        refuse([&](const SmokeExtent &smoke) { return smoke.largest_h == all.largest_h; },
               "a smoothing length of " + two_digits(all.largest_h) + " is too coarse" + beside +
                   ", expected at most " + two_digits(most_h / scale) + ", or --arith f32");
    return {own.center, scale};
}

} // namespace wisp
