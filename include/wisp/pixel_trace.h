// What a caller may hear of one pixel while it is rendered: its samples, the rays of each with what they meet, the
// lights that shine there, the steps through smoke, and the sums. Plain data, the same for every arithmetic, in the
// units of Scene: the caller who normalised lengths and radiances knows the way back.
//
// A pixel is told as  sample { ray } sample_end ... pixel,
// and a ray as        ray [march light* step* ... march_end] [hit light* lit (ray | unsent)*] ray_end,
// with rays in one another. Lights of a step come before it, but maybe before steps in front of it: `step` tells.
#pragma once
#include "wisp/scene.h"

namespace wisp {

enum class RayKind : uint8_t { camera, reflected, refracted };

// How the shadow towards a light was decided.
enum class ShadowDecision : uint8_t {
    unasked,     // there is no surface, or nothing would come of the light
    known,       // without asking any triangle
    culled_static, // of what never moves; what does was asked
    tried,       // of what never moves a few triangles were asked, one by one; no tree
    traced       // by a ray through a tree
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
        lit,
        unsent,
        ray_end,
        sample_end,
        pixel
    };

    struct Sample {
        uint32_t index;
        double column, row; // in the picture, in pixels
    };
    struct Ray {
        RayKind kind;
        uint32_t level; // 0: of the camera
        Double3 origin, direction;
        Double3 share; // by which what it brings is multiplied
        double weight; // that share of all the rays before, and of the smoke on their way
    };
    struct March {
        double begin, end; // on the ray: where smoke may be
        double step;
        int32_t steps;
    };
    struct Light {
        int32_t step;      // of the march; -1: shines on what the ray has hit
        uint32_t smoke;    // that scatters it, of a step through resampled smoke; else 0
        uint32_t light;    // of the scene
        bool faces;        // it is in front of the surface, and shines there
        Double3 direction; // that light travels in
        double distance;
        Double3 irradiance; // before smoke and shadows; of a cluster with --lights cuts, that of all its lights
        ShadowDecision answer;
        bool blocked;
        uint64_t node_visits, triangle_tests, extra_tests; // that it took to know, as in Statistics
        double optical_depth, transmittance; // of the smoke before the light; 0 and 1 where it was not asked
        Double3 contribution;                // radiance; of a step, per unit of length
    };
    struct Step {
        int32_t step;
        double distance; // of its middle, from the ray's origin
        double length;
        double extinction;
        double optical_depth, transmittance; // of the march before it
        Double3 single, multiple, emission;  // light scattered once, more often, and sent, per unit of length
        Double3 radiance;                    // that arrives
    };
    struct MarchEnd {
        Double3 radiance;
        double optical_depth, transmittance;
    };
    struct Hit {
        double distance;
        uint32_t triangle;            // of the scene
        int32_t instance;                 // that it belongs to, -1: none
        bool still;                   // it never moves
        uint32_t material;            // of the scene
        int32_t texture;              // of the scene, -1: none
        double u, v;                  // weights of corners 1 and 2
        Double3 point, plane, normal; // the triangle's normal and the interpolated one, on the ray's side
        bool entered;                 // from outside
        Double3 texture_color;        // 1 1 1: none
        Double3 ambient;              // radiance
    };
    struct Lit { // the lights together; with --lights cuts the sum of those clusters that were not split
        Double3 radiance;
    };
    struct Unsent { // a ray that is not worth it, or one too many
        RayKind kind;
        Double3 share;
        double weight;
        bool too_deep; // else too light
    };
    struct RayEnd {
        bool hit;      // else it sees the background
        Double3 smoke; // radiance of the smoke on its way
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
        Lit lit;
        Unsent unsent;
        RayEnd ray_end;
        SampleEnd sample_end;
        Pixel pixel;
    };
};

// Hears of the pixel (x, y), if it is in the crop.
struct PixelTrace {
    int32_t x, y;
    void *context;
    void (*heard)(void *context, const TraceEvent &entry);
};

} // namespace wisp
