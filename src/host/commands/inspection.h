// What `wisp inspect` has heard of a pixel, in the units of the scene's file, as text and as JSON.
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
        std::optional<TraceEvent::March> march; // none: it meets no smoke
        std::vector<Step> steps;
        TraceEvent::MarchEnd march_end;
        std::optional<TraceEvent::Hit> hit; // none: it sees the background
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
    // Of what, for the words around it.
    std::string scene, arithmetic;
    int64_t frame;
    int x, y, width, height;
    std::optional<uint32_t> only; // of the samples; else all
    // How the core's units become the file's.
    Double3 center;
    double scale;
    int radiance_exponent;

    std::vector<Sample> samples;
    TraceEvent::Pixel pixel;

    // Of the pixel x, y: its events are added to this.
    PixelTrace trace();

  private:
    void record(const TraceEvent &event);
    void add_light(const TraceEvent::Light &light);

    std::vector<Ray *> open_;                  // rays in one another that have not ended
    std::vector<TraceEvent::Light> waiting_; // lights of steps that are not told yet
};

std::string inspection_text(const Inspection &inspection);
std::string inspection_json(const Inspection &inspection);

} // namespace wisp
