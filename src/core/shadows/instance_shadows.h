// Shadows of and on bodies, in one frame.
//
// Seen from a light, each body lies within a rectangle: on the sides of a cube around the light, where a point p, the
// light being 0, is at (p.b / p.a, p.c / p.a) of the side that its largest coordinate a tells; of a parallel light in
// the plane across its largest coordinate. The rectangles of a side are kept in a raster, so that a shadow ray, which
// is a point there, is asked of the few bodies around it.
//
// A ray that may hit a body has a point in its box (InstanceNode), whose margin covers what is rounded along the ray. Let
// the ray lead to a distance D from o along d, as rounded; the light is within 8 e D of that, e being half a last
// place, and in Fixed 2^-16: in any case within 2^-6, D being below 2^15. Moved by that, the point is a multiple of d
// away from the light. So in a box that is wider by `beside` = 2^-5 there is a point that the light sees exactly along
// -d, and the quotients of d are where it is, but for a rounding of 2^-22 of what is at most 1. A raster has steps of
// 2^-13 at least there, and of 2^-9 in a plane, where coordinates are rounded by less than 2^-7, which `beside` covers:
// so a rectangle is widened by a sixteenth of a step for the quotients and the way to the raster.
//
// The still triangles that may stand between a body and a light, if they are few, are found by the shaft (shaft.h) of
// its box, when some rays have asked; its later rays are asked of these alone.
#pragma once
#include "core/shadows/shadows.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t max_listed = 8;

struct InstanceLight {
    uint32_t blocker[max_listed];
    uint8_t blocker_count; // or not_known
    uint8_t rays;          // asked so far, until it has been looked for blockers

    static constexpr uint8_t not_known = 255;
    bool known() const { return blocker_count != not_known; }
};

struct LightRaster {
    Real low[2], steps[2]; // of the first coordinate and the second: where it begins, steps in a unit
    uint32_t side;         // steps; 0: there is no body
    uint32_t *starts;      // side * side + 1: where the bodies of each begin
};

struct InstanceShadows {
    bool ready;           // false: the arena was too small
    LightRaster *rasters; // six for each of the first lights
    uint32_t raster_lights;
    uint32_t *groups;     // of bodies, raster after raster, step after step
    InstanceLight *lights;    // by light, then body
    uint32_t light_count; // that have room for all bodies
};

uint64_t instance_shadow_bytes(const Scene &scene);
InstanceShadows make_instance_shadows(const Shadows &shadows, Arena &arena);

// What is known of the body of a query and its light; nullptr: nothing ever. Looks for blockers when it is time.
InstanceLight *find_instance_light(InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query);
bool is_blocked_by_listed(const InstanceLight &instance, const Shadows &shadows, const ShadowQuery &query);

// As of Surfaces; `asked` says whether anything had to be asked for it.
bool is_blocked_by_moving(const InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query, bool &asked);

} // namespace wisp::WISP_ARITH
