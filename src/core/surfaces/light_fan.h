// What opaque triangles hide of a light from a stretch of a ray. The lines from the stretch to the light form a flat
// triangle, the fan. A triangle of a surface that crosses the fan's plane does so in a segment; the lines through the
// segment meet the ray in an interval, which lies in its shadow. So the shadows on a ray are known by their ends, not
// by points that were asked (README, Shadows on a ray).
#pragma once
#include "core/surfaces/surfaces.h"

namespace wisp::WISP_ARITH {

// The points x with dot(normal, x) <= limit.
struct HalfSpace {
    Vec3 normal;
    Real limit;
};

constexpr uint32_t fan_sides = 5; // the two sides of its plane, the ray, the outermost lines

// A point, or a direction, in the fan's plane: along the ray, and from it towards the light.
struct FanPoint {
    Real x, y;
};

struct LightFan {
    Vec3 origin, along, up, across; // of the ray; unit vectors: of the ray, in the plane towards the light, its normal
    bool is_parallel;
    Vec3 light;              // from the origin to it; the unit vector towards a parallel one
    Real light_x, light_y;   // the same in `along` and `up`
    Real epsilon, farthest;  // of make_light_fan(); triangles count up to here in `up`
    Real begin, end;         // of the stretch, as distances on the ray
    FanPoint before, behind; // unit vectors outwards from the lines of `begin` and of `end` to the light
    HalfSpace side[fan_sides];
};

// The fan of the ray's distances `begin` to `end`. `light`: its position, or the unit vector towards a parallel light.
// Of a triangle, what is nearer to the light than `epsilon` does not count, and nothing if its plane is. False: the
// light lies on the ray's line, or within 2^-10 of the way to it. Then there is no plane.
bool make_light_fan(const Ray &ray, Real begin, Real end, bool is_parallel, const Vec3 &light, Real epsilon,
                    LightFan &fan);

// The steps of a ray, with what is hidden of each: bit i stands for part i of shadow_parts equal parts of a step, by
// its middle.
constexpr uint32_t shadow_parts = 32;
struct StepShadows {
    uint32_t count;                   // at most `lanes`
    Real begin[lanes], length[lanes]; // a step of length 0 has all of its bits set from the beginning
    uint32_t hidden[lanes];
};

// Adds what the surfaces' opaque triangles hide. The fan is that of the steps; it is narrowed to those that are not all
// hidden.
void add_shadows(const Surfaces &surfaces, LightFan &fan, StepShadows &steps, TreeCounts &counts);

} // namespace wisp::WISP_ARITH
