// Shadows of and on instances, in one frame (C8).
//
// Seen from a light, each instance lies within a rectangle. For a point light the rectangles lie on the sides of a cube
// around it: with the light at 0, a point p is at (p.b / p.a, p.c / p.a) of the side of its largest coordinate a. For a
// parallel light they lie in the plane across the light's largest coordinate. A raster over each side lists the
// rectangles of its steps. A shadow ray is one point there, so it is traced only against the few instances of its step.
//
// A ray that may hit an instance has a point in the instance's box (InstanceNode), whose margin covers roundings along
// the ray. Let the ray lead to a distance D from o along d, as rounded. The light is within 8 e D of that point, e
// being half a last place of 1, in Fixed within 2^-16; in any case within 2^-6, because D is below 2^15. Moved by that,
// the point is a multiple of d away from the light. So a box that is wider by `box_margin` = 2^-5 holds a point that
// the light sees exactly along -d. The quotients of d say where it is, but for a rounding of 2^-22 of what is at
// most 1. A raster has steps of 2^-13 at least on a cube, and of 2^-9 in a plane, where coordinates are rounded by less
// than 2^-7, which `box_margin` covers. So a rectangle is widened by a sixteenth of a step for the quotients and the
// way to the raster.
//
// Static triangles that may stand between an instance and a light are found by the shaft of its box (box_shaft.h), once
// some rays have asked. If they are few, later rays are tested against these alone.
#pragma once
#include "core/shadows/shadow_query.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t max_listed = 8; // blockers

// What is known of an instance and a light.
struct InstanceLight {
    uint32_t blocker[max_listed]; // static triangles
    uint8_t blocker_count;        // or not_listed
    uint8_t rays;                 // queries so far, until blockers are looked for

    static constexpr uint8_t not_listed = 255;
    bool is_listed() const { return blocker_count != not_listed; }
};

struct LightRaster {
    Real low[2], steps[2]; // of both coordinates: where the raster begins, its steps in a unit
    uint32_t side;         // in steps; 0: no instance is seen there
    uint32_t *starts;      // side * side + 1: where the instances of each step begin
};

struct InstanceShadows {
    bool ready;           // false: the arena was too small
    LightRaster *rasters; // six for each of the first `raster_lights` lights
    uint32_t raster_lights;
    uint32_t *groups;      // leaves of Surfaces::groups, raster after raster, step after step
    InstanceLight *lights; // [light][instance]
    uint32_t light_count;  // of the lights that have room for all instances
};

uint64_t instance_shadow_bytes(const Scene &scene);
InstanceShadows make_instance_shadows(const Shadows &shadows, Arena &arena);

// What is known of the query's instance and light; nullptr: nothing is kept. Looks for blockers when it is time.
InstanceLight *find_instance_light(InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query);
bool is_blocked_by_listed(const InstanceLight &instance, const Shadows &shadows, const ShadowQuery &query);

// As that of Surfaces; `tested` says whether there was anything to test the ray against.
bool is_blocked_by_moving(const InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query,
                          bool &tested);

} // namespace wisp::WISP_ARITH
