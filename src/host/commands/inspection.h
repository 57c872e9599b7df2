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
        JournalEntry::Step step;
        std::vector<JournalEntry::Light> lights;
    };
    struct Ray {
        JournalEntry::Ray ray;
        std::optional<JournalEntry::March> march; // none: it meets no smoke
        std::vector<Step> steps;
        JournalEntry::MarchEnd march_end;
        std::optional<JournalEntry::Hit> hit; // none: it sees the background
        std::vector<JournalEntry::Light> lights;
        JournalEntry::Lit lit;
        std::vector<std::unique_ptr<Ray>> rays;
        std::vector<JournalEntry::Unsent> unsent;
        JournalEntry::RayEnd end;
    };
    struct Sample {
        JournalEntry::Sample sample;
        std::unique_ptr<Ray> ray;
        JournalEntry::SampleEnd end;
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
    JournalEntry::Pixel pixel;

    // Of the pixel x, y, to be heard by this.
    Journal journal();

  private:
    void hear(const JournalEntry &entry);
    void keep(const JournalEntry::Light &light);

    std::vector<Ray *> open_;                  // rays in one another that have not ended
    std::vector<JournalEntry::Light> waiting_; // lights of steps that are not told yet
};

std::string inspection_text(const Inspection &inspection);
std::string inspection_json(const Inspection &inspection);

} // namespace wisp
