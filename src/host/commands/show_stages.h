// The stages that `wisp show` draws, and how.
#pragma once
#include "host/commands/single_frame.h"
#include "host/images/picture.h"

namespace wisp {

struct ShowOptions {
    double slice = 0.5;     // where a plane cuts the smoke: 0 nearest to the eye, 1 farthest
    uint32_t light = 0;     // index in the scene
    std::optional<int> row; // of the picture; none: the middle one
};

// One drawing in the making.
struct Drawing {
    const Request &request;
    const ShowOptions &options;
    SingleFrame &frame;
};

struct Shown {
    Picture picture;
    std::string legend; // what the colours mean
};

struct ShownStage {
    const char *name, *what;
    std::vector<std::string> options; // of ShowOptions, those that change the drawing
    Stage needed;                     // of the core: its row of the plan says why there is nothing to draw
    bool of_layers;                   // it is drawn from layers of the picture
    Shown (*draw)(const Drawing &drawing);
};
const std::vector<ShownStage> &shown_stages();

// The smoke's optical depths along the rays through the middles of the pixels, up to the first surface; 0 or NaN: a ray
// meets no smoke. make_plan() has been called, and the plan needs Stage::march.
std::vector<double> optical_depths(const Request &request, SingleFrame &frame);

} // namespace wisp
