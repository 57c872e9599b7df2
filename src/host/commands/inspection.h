// The events of one pixel as a tree of rays, in the units of the scene's file, and the tree as text and as JSON.
#pragma once
#include "wisp/pixel_trace.h"
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace wisp {

struct Inspection {
    struct Step {
        TraceEvent::Step step;
        std::vector<TraceEvent::Light> lights;
    };
    struct Ray {
        TraceEvent::Ray ray;
        std::optional<TraceEvent::March> march; // none: the ray enters no smoke
        std::vector<Step> steps;
        TraceEvent::MarchEnd march_end;
        std::optional<TraceEvent::Hit> hit; // none: the ray leaves the scene
        std::vector<TraceEvent::Light> lights;
        TraceEvent::DirectLight direct_light;
        std::vector<std::unique_ptr<Ray>> rays;
        std::vector<TraceEvent::Unsent> unsent;
        TraceEvent::RayEnd end;
    };
    struct Sample {
        TraceEvent::Sample sample;
        std::unique_ptr<Ray> ray;
        TraceEvent::SampleEnd end;
    };
    // What is inspected.
    std::string scene, arithmetic;
    int64_t frame;
    int x, y, width, height;
    std::optional<uint32_t> only; // this sample's rays are shown; else those of all
    // From the core's units to the file's: see PreparedScene and Scene::radiance_exponent.
    Double3 center;
    double scale;
    int radiance_exponent;

    std::vector<Sample> samples;
    TraceEvent::Pixel pixel;

    // What to hand to inspect(): a trace of the pixel x, y whose events are recorded here.
    PixelTrace trace();

  private:
    void record(const TraceEvent &event);
    void add_light(const TraceEvent::Light &light);

    std::vector<Ray *> open_;                // rays that have not ended, each started by the one before it
    std::vector<TraceEvent::Light> pending_; // lights whose step has not been recorded yet
};

std::string inspection_text(const Inspection &inspection);
std::string inspection_json(const Inspection &inspection);

} // namespace wisp
