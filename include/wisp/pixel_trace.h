// The record of one pixel while it is rendered: its samples, the rays of each sample with what they hit, the lights
// that shine there, the steps through smoke, and the sums. Plain data, the same for every arithmetic. Lengths and
// radiances have the units of Scene: a caller who normalised them knows the way back.
//
// The events of a pixel come in the order  sample { ray } sample_end ... pixel,
// those of a ray in the order              ray [march light* step* ... march_end] [hit light* direct_light
//                                          (ray | unsent)*] ray_end,
// with rays nested in one another. The lights of a step come before the step, but maybe before earlier steps too: the
// number `step` says to which step a light belongs.
#pragma once
#include "wisp/double3.h"
#include "wisp/progress.h"

namespace wisp {

struct Job;

enum class RayKind : uint8_t { camera, reflected, refracted };

// How it was decided whether a light is in shadow.
enum class ShadowDecision : uint8_t {
    none,          // not at all: there is no surface, or the light adds nothing in any case
    culled,        // without testing any triangle
    culled_static, // without testing static triangles; moving ones were tested
    tested,        // by testing a few static triangles, one by one, without a tree
    traced         // by a ray through a tree; of a step, by all rays of it to the light
};

struct TraceEvent {
    enum class Kind : uint8_t {
        sample,
        ray,
        march,
        light,
        step,
        march_end,
        hit,
        direct_light,
        unsent,
        ray_end,
        sample_end,
        pixel
    };

    struct Sample {
        uint32_t index;
        double column, row; // position in the picture, in pixels
    };
    struct Ray {
        RayKind kind;
        uint32_t level; // 0: a camera ray
        Double3 origin, direction;
        Double3 factor; // the ray's radiance is multiplied by this
        double weight;  // product of the largest channels of all factors so far, and of the smoke's transmittances
    };
    struct March {
        double begin, end; // distances on the ray between which there may be smoke
        double step;       // length of a step
        int32_t steps;
    };
    struct Light {
        int32_t step;      // of the march; -1: the light shines on the surface that the ray has hit
        uint32_t smoke;    // in resampled smoke: the smoke that scatters the light; else 0
        uint32_t light;    // index in the scene
        bool faces;        // the light is in front of the surface, and reaches it
        Double3 direction; // in which the light travels
        double distance;
        Double3 irradiance; // before smoke and shadows; with --lights cuts, of all lights of the cluster
        ShadowDecision decision;
        double lit = 1; // the part of the step that no opaque triangle hides from it; of a surface's point 0 or 1
        uint64_t node_visits, triangle_tests, extra_tests; // work of the decision, counted as in Statistics
        double optical_depth, transmittance; // of the smoke in front of the light; 0 and 1 where it was not computed
        Double3 contribution;                // radiance; of a step, radiance per unit of length
    };
    struct Step {
        int32_t step;
        double distance; // from the ray's origin to the step's middle
        double length;
        double extinction;
        double optical_depth, transmittance; // of the march before this step
        Double3 single, multiple, emission;  // scattered once, scattered more often, emitted; per unit of length
        Double3 radiance;                    // what of them arrives at the ray's origin
    };
    struct MarchEnd {
        Double3 radiance;
        double optical_depth, transmittance;
    };
    struct Hit {
        double distance;
        uint32_t triangle; // index in the scene
        int32_t instance;  // that the triangle belongs to; -1: none
        bool is_static;    // the triangle never moves
        uint32_t material; // index in the scene
        int32_t texture;   // index in the scene; -1: none
        double u, v;       // barycentric weights of corners 1 and 2
        Double3 point;
        Double3 plane, normal; // the triangle's normal and the interpolated one, both on the ray's side
        bool entered;          // the ray comes from outside
        Double3 texture_color; // 1 1 1: no texture
        Double3 ambient;       // radiance
    };
    struct DirectLight {
        Double3 radiance; // from all lights; with --lights cuts from the clusters of the final cut
    };
    struct Unsent { // a secondary ray that was not traced
        RayKind kind;
        Double3 factor;
        double weight;
        bool too_deep; // the chain of rays is as long as it may be; false: the weight is too small
    };
    struct RayEnd {
        bool hit;      // a surface; false: the ray sees the background
        Double3 smoke; // radiance of the smoke in front
        double transmittance;
        Double3 behind; // radiance of what is behind the smoke
        Double3 radiance;
    };
    struct SampleEnd {
        uint32_t index;
        Double3 radiance;
    };
    struct Pixel {
        uint32_t samples;
        Double3 mean;   // of the samples
        float value[3]; // in the picture
    };

    Kind kind;
    union {
        Sample sample;
        Ray ray;
        March march;
        Light light;
        Step step;
        MarchEnd march_end;
        Hit hit;
        DirectLight direct_light;
        Unsent unsent;
        RayEnd ray_end;
        SampleEnd sample_end;
        Pixel pixel;
    };
};

// Receives the events of the pixel (x, y), if it is in the crop.
struct PixelTrace {
    int32_t x, y;
    void *context;
    void (*on_event)(void *context, const TraceEvent &event);
};

// Renders as Renderer::render does, and passes the events of one pixel of the crop to `trace`. Pixels before it in the
// crop are rendered first, as shadow techniques learn from them; a crop of the pixel alone is the quickest. A program
// that does not call inspect() does not link what records a pixel.
namespace f32 {
Status inspect(const Job &job, const PixelTrace &trace);
}
namespace f64 {
Status inspect(const Job &job, const PixelTrace &trace);
}
namespace fixed {
Status inspect(const Job &job, const PixelTrace &trace);
}

} // namespace wisp
