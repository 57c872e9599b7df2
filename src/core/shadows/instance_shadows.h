// Shadows of and on instances, in one frame (C8).
//
// Seen from a light, each instance lies within a rectangle. For a point light the rectangles lie on the sides of a cube
// around it: with the light at 0, a point p is at (p.b / p.a, p.c / p.a) of the side of its largest coordinate a. For a
// parallel light they lie in the plane across the light's largest coordinate. A raster over each side lists the
// rectangles of its steps. A shadow ray is one point there, so it is traced only against the few instances of its step.
//
// The step of a ray lists every instance that the ray may hit:
//   - A ray that may hit an instance has a point in the instance's box (InstanceNode). The margin of that box covers
//     the roundings along the ray.
//   - Let o, d and D be the ray's origin, direction and distance to the light, as rounded. The point o + D d is within
//     8 e D of the light, where e is half a last place of 1; in Fixed within 2^-16. In each case it is within 2^-6,
//     because D is below 2^15.
//   - The point in the box, moved by the same difference, is exactly a multiple of d away from the light. So a box that
//     is wider by `box_margin` = 2^-5 holds a point that the light sees exactly along -d.
//   - On a cube, quotients of the components of d give the place of this point. They are at most 1, with a rounding of
//     2^-22, and a step of the raster is at least 2^-13 long.
//   - In a plane, coordinates are rounded by less than 2^-7, which `box_margin` covers. A step is at least 2^-9 long.
//   - A rectangle is widened by a sixteenth of a step, for the rounding of quotients and of the conversion to steps.
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
    uint8_t rays;                 // queries so far; counted until the blockers are searched

    static constexpr uint8_t not_listed = 255;
    bool is_listed() const { return blocker_count != not_listed; }
};

struct LightRaster {
    Real low[2], steps[2]; // for each coordinate: where the raster begins, and its steps per unit
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

// The entry of the query's instance and light, or nullptr if there is none. Searches the blockers once enough rays have
// asked.
InstanceLight *find_instance_light(InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query);
bool is_blocked_by_listed(const InstanceLight &instance, const Shadows &shadows, const ShadowQuery &query);

// Same answer as the function of this name for Surfaces. `tested` says whether there was anything to test against.
bool is_blocked_by_moving(const InstanceShadows &instances, const Shadows &shadows, const ShadowQuery &query,
                          bool &tested);

} // namespace wisp::WISP_ARITH
