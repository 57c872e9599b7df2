// Records pixels: one, event by event (wisp/pixel_trace.h), or what all consist of (core/render/layers.h). The marches
// and the shading hold a pointer to a recorder, nullptr for every other pixel, and hand it what they compute in the
// numbers of their arithmetic.
//
// The functions of a recorder are reached through its pointers alone. make_recorder() names those of one pixel, in a
// unit of its own: a program that does not inspect pixels does not link them.
#pragma once
#include "core/geometry/ray.h"
#include "core/lights/light.h"
#include "core/smoke/sparse_grid_lanes.h"
#include "wisp/pixel_trace.h"
#include "wisp/statistics.h"

namespace wisp::WISP_ARITH {

// As TraceEvent's members of the same names.
struct LightRecord {
    int32_t step;
    uint32_t light;
    bool faces;
    Illumination from;
    Real optical_depth = Real(0), transmittance = Real(1);
    Color contribution = Color(Real(0));
};
struct StepRecord {
    int32_t step;
    Real distance, length, extinction, optical_depth;
    Color single, multiple, emission, radiance;
};
struct RayEndRecord {
    bool hit;
    Color smoke;
    Real transmittance;
    Color behind, radiance;
    uint64_t node_visits; // of triangle trees, to find what the ray hits
};
struct HitRecord {
    Real distance;
    uint32_t triangle;
    int32_t instance;
    bool is_static;
    uint32_t material;
    int32_t texture;
    Real u, v;
    Vec3 point, plane, normal;
    bool entered;
    Color texture_color, ambient;
};

// The same of `lanes` steps of a march through resampled smoke. They are copies: an array of lanes that a pointer leads
// to would not stay in a register. They stand in the recorder, as the march has no room on a small stack.
struct LaneLightRecord { // one light, scattered by one smoke
    uint32_t light, smoke;
    const Light *source;
    Color color;  // the light's, divided by its largest channel
    Color albedo; // the smoke's
    int32_t step[lanes];
    Vec3 middle[lanes];        // of the steps
    Vec3 direction[lanes];     // in which the light travels
    Real irradiance[lanes];    // of the light's largest channel, before smoke
    Real optical_depth[lanes]; // interpolated: it may be below 0
    Real extinction[lanes];    // of the smoke; 0: the lane is not recorded
    Real scattered[lanes];     // of the light's largest channel: phase function times what arrives
};
struct LaneSourceRecord { // what one smoke sends
    Real extinction[lanes];
    LaneColor single, multiple; // radiance times phase function, without the factors albedo and extinction
    Color albedo, emission;     // `emission` per unit of optical depth
};
struct LaneStepRecord { // the steps; their sources went to lane_sources() before
    int32_t step[lanes];
    Real distance[lanes], length[lanes], extinction[lanes], optical_depth[lanes];
    LaneColor radiance;
};

struct PixelRecorder {
    PixelTrace trace;
    bool every_pixel; // not that of `trace` alone

    void (*sample)(PixelRecorder &, uint32_t index, Real column, Real row);
    void (*sample_end)(PixelRecorder &, uint32_t index, Color radiance);
    void (*pixel)(PixelRecorder &, uint32_t samples, Color mean, const float *value);
    void (*ray)(PixelRecorder &, RayKind, uint32_t level, const Ray &, Color factor, Real weight);
    void (*ray_end)(PixelRecorder &, const RayEndRecord &);
    void (*unsent)(PixelRecorder &, RayKind, Color factor, Real weight, bool too_deep);
    void (*hit)(PixelRecorder &, const HitRecord &);
    void (*direct_light)(PixelRecorder &, Color radiance);
    void (*march)(PixelRecorder &, Real begin, Real end, Real step, int32_t steps);
    void (*march_end)(PixelRecorder &, Color radiance, Real optical_depth, Real transmittance);
    void (*step)(PixelRecorder &, const StepRecord &);
    void (*light)(PixelRecorder &, const LightRecord &);
    // Before and after shadows are found. The counters that this has raised say how it was decided.
    void (*shadow_begin)(PixelRecorder &, const Statistics &);
    void (*shadow_end)(PixelRecorder &, uint32_t lane, const Statistics &, Real lit);
    // A group of steps: its lights, what its smokes send, and what arrives.
    void (*lanes_begin)(PixelRecorder &);
    void (*lane_lights)(PixelRecorder &); // those of lane_light, and so on
    void (*lane_sources)(PixelRecorder &);
    void (*lane_steps)(PixelRecorder &);
    LaneLightRecord lane_light;
    LaneSourceRecord lane_source;
    LaneStepRecord lane_step;

    // State between calls: by lane, the shadow of the light that is recorded next; the counters before a shadow query;
    // the sources of all smokes so far.
    TraceEvent::Light shadow[lanes];
    Statistics before;
    LaneColor single, multiple, emission;
};

PixelRecorder make_recorder(const PixelTrace &trace);

// What lanes_begin, lane_sources and lane_steps do for any recorder: step() is told of each lane.
void begin_lanes(PixelRecorder &);
void add_lane_sources(PixelRecorder &);
void end_lanes(PixelRecorder &);

// Whether a pixel is recorded: hardly ever.
inline bool is_recording(const PixelRecorder *recorder) { return __builtin_expect(recorder != nullptr, false); }

// The answer of query(), whether a light is in shadow: it is recorded with the next light.
template <class Query> bool record_shadow(PixelRecorder *recorder, const Statistics &statistics, Query &&query) {
    if (is_recording(recorder)) recorder->shadow_begin(*recorder, statistics);
    const bool blocked = query();
    if (is_recording(recorder)) recorder->shadow_end(*recorder, 0, statistics, blocked ? Real(0) : Real(1));
    return blocked;
}

} // namespace wisp::WISP_ARITH
