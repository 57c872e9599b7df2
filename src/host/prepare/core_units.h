// From the units of a scene to those of the core, as wisp/scene.h asks for them: lengths and radiances are multiplied
// by powers of two, so that only subtractions of the centre round, in double. Plain data in, plain data out: no heap,
// no files, no exceptions. The C interface (src/c_api) prepares scenes by the same functions.
#pragma once
#include "host/base/double3_algebra.h"
#include "host/base/renderers.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include <algorithm>
#include <cstddef>

namespace wisp {

struct Unit { // p' = (p - center) * scale, where scale is a power of two
    Double3 center;
    double scale;
};

// A box of points.
struct Extent {
    Double3 low = {1e300, 1e300, 1e300}, high = {-1e300, -1e300, -1e300};

    void add(const Double3 &p) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    void add(const Triangle *triangles, uint32_t count) {
        for (uint32_t i = 0; i < count; ++i)
            for (const Double3 &corner : triangles[i].corner) add(corner);
    }
    bool any() const { return low.x <= high.x; }
    Double3 middle() const { return (low + high) * 0.5; }
};

// How far a smoke reaches (the centres of its particles, or a grid), and its smoothing lengths, in one unit.
struct SmokeExtent {
    Double3 low, high;
    double smallest_h = 0, largest_h; // smallest_h = 0: it is empty

    bool any() const { return smallest_h > 0; }
    void add(const Double3 &x, double h) {
        if (!any()) {
            *this = {x, x, h, h};
            return;
        }
        low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
        high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
        smallest_h = std::min(smallest_h, h);
        largest_h = std::max(largest_h, h);
    }
    void add(const SmokeExtent &other) {
        if (!other.any()) return;
        add(other.low, other.smallest_h);
        add(other.high, other.largest_h);
    }
};

// ---- Smoke

void sort_canonically(Particle *begin, Particle *end);

// The unit of --step for a grid: the shortest edge of its cells. For a box: a twentieth of its shortest edge.
double step_length(const GridDescription &grid);

// Half the edges of the axis-aligned box around a rotated grid.
Double3 aligned_half(const GridDescription &grid);

// Of a smoke's particles and grid.
SmokeExtent extent_of(const Particle *particles, size_t count, const SmokeDescription &smoke);

// Scales one smoke, and sums up its area and range of smoothing lengths. A grid's largest density becomes 1 to 2, so
// that fixed point keeps the digits of every sample. `densities` are those of the grid, or nullptr.
void normalize(SmokeDescription &source, Particle *particles, size_t count, float *densities, const Unit &unit);

// ---- The unit

// Beside the unit: the least and the largest smoothing length that fixed point holds, the largest of them beside
// surfaces; the least surfaces. Without surfaces the least smoothing length holds in every arithmetic, because a light
// comes no nearer than 2^-10.
constexpr double least_h = 0x1p-4, most_h = 0x1p7, least_size = 0x1p-4;

// Whether surfaces that reach so far, in the units of the scene, are large enough at a scale. 0: there are none, or one
// point.
inline bool keeps_surfaces(double reach, double scale) { return reach == 0 || reach * scale >= least_size; }

// The unit in which the smallest smoothing length is 1 to 2, in the middle of the smoke.
Unit unit_of_smoke(const SmokeExtent &all);

// The unit of surfaces that reach so far from `center`, the size of a component. They reach 2^10 to 2^11 in it. Where
// lights, the camera or what moves are more than four times as far away (`farthest`), they reach less, down to 2^4.
Unit unit_of_surfaces(const Double3 &center, double reach, double farthest);

// The largest distance (of a component) of an Extent or a SmokeExtent from a point.
template <class Box> double reach_of(const Box &extent, const Double3 &center) {
    return std::max(largest_component(extent.low - center), largest_component(extent.high - center));
}

// The scale for smoke in the unit that it, or the surfaces beside it, would have: smaller where the smoke is finer or
// coarser than that unit has room for, or reaches beyond coordinate_limit. `surfaces`: how far they reach, in the units
// of the scene; 0: there are none, or one point.
double scale_of(const SmokeExtent &all, const Unit &own, bool beside_surfaces, double surfaces);

// ---- The camera and lights

// A view as in scene files: `angle` in degrees is between the centres of the first and the last row; of a single row,
// its height.
Camera make_camera(const Double3 &from, const Double3 &at, const Double3 &upward, double angle, int width, int height,
                   const Unit &space);

// `degrees`: of a spot, the whole angle of its cone.
LightSource make_light(LightKind kind, const Double3 &position, const Double3 &direction, double degrees,
                       const Double3 &color, const Unit &space);

// The radius around everything that lights are to be measured in; `surfaces` that of a sphere about them in the core's
// unit, if there are any.
double radius_of(const SmokeExtent &smoke, bool beside_surfaces, double surfaces, const Unit &unit);

// Whether smoke shines by itself: smoke emits where it absorbs, which is nowhere if its albedo is 1.
inline bool glows(const Double3 &emission, const Double3 &albedo) {
    return (emission.x > 0 && albedo.x < 1) || (emission.y > 0 && albedo.y < 1) || (emission.z > 0 && albedo.z < 1);
}

// Multiplies all radiances of the scene by a power of two, which it returns, so that the brightest is about 1. `lights`
// and `smokes` are those of the scene; `ambient`: nullptr without surfaces.
double dim_radiances(Scene &scene, LightSource *lights, SmokeDescription *smokes, const Double3 *ambient,
                     double radius);

// ---- Surfaces

inline Double3 transformed_vector(const Instance &instance, const Double3 &v) {
    return instance.axis[0] * v.x + instance.axis[1] * v.y + instance.axis[2] * v.z;
}
inline Double3 transformed_point(const Instance &instance, const Double3 &p) {
    return transformed_vector(instance, p) + instance.origin;
}

void normalize(Triangle &triangle, const Unit &space);

// Of length 1 where all three have a length, else that of the plane.
void set_normals(Triangle &triangle, const Double3 (&normals)[3]);

// The unit of an instance's own space; `own`: of its triangles there. The instance is where it is in the units of the
// scene, whose surfaces have the unit `world`.
Unit space_of(const Instance &instance, const Extent &own, const Unit &world);

// Whether a matrix of these columns has an inverse.
bool has_inverse(const Double3 (&axis)[3]);

// From a space of its own and the world in the units of the scene to both in the core's; the way back is found.
void normalize(Instance &instance, const Unit &space, const Unit &world);

// `ambient`: the scene's light; `dim` as dim_radiances() returns it.
Material make_material(const Material &of_scene, const Double3 &ambient, double dim);

// Rays from a surface hit nothing nearer than this; `radius` of a sphere about the still triangles.
inline double ray_epsilon_of(double radius) { return 2 * radius * 1e-6; }

// ---- What no arithmetic can hold

// What is beyond the range of the arithmetic, and in which smoke; nullptr: nothing is.
struct RangeFault {
    const char *what = nullptr;
    int64_t smoke = -1; // -1: none, it is of the scene as a whole
};

// Numbers of a prepared scene beyond the range of float, or of fixed point, which ends at 2^31.
RangeFault find_range_fault(const Scene &scene, Arithmetic arithmetic, double gather_radius, LightChoice lights);

} // namespace wisp
