// From a scene file to the core's Scene: one frame's particles, grids, surfaces, lights and camera, in the core's units
// and order.
#pragma once
#include "host/base/messages.h"
#include "host/formats/volume.h"
#include "host/prepare/prepare_surfaces.h"
#include "host/prepare/unit.h"
#include "host/scene/options.h"
#include "host/scene/scene_file.h"
#include <vector>

namespace wisp {

// A core scene and the memory behind its pointers. Not copied: the scene points into it.
struct PreparedScene {
    PreparedScene() = default;
    PreparedScene(const PreparedScene &) = delete;
    PreparedScene &operator=(const PreparedScene &) = delete;

    Scene scene = {};
    std::vector<LightSource> lights;
    std::vector<SmokeDescription> smokes;
    std::vector<std::vector<Particle>> particles;
    std::vector<Volume> volumes; // the samples of grids
    std::vector<std::string> notes;            // for --verbose
    std::vector<Warning> warnings;             // of what was left out
    std::optional<PreparedSurfaces> surfaces;  // made by the first frame, used by all
    int width = 0, height = 0;
    Double3 center = {0, 0, 0}; // p' = (p - center) * scale: from the units of the scene's file to the core's
    double scale = 1;
};

// How far each smoke reaches, in the units that `prepared` is in.
std::vector<SmokeExtent> extents_of(const PreparedScene &prepared);

// The number of frames of the animation, and the time of a frame. Without a statement `a` every frame is at time 0.
int64_t frame_count_of(const SceneFile &file, const Options &options);
double time_of(const SceneFile &file, const Options &options, int64_t frame);

// Makes frame `frame` of the scene at path `name`. `prepared` is empty or holds another frame of the same scene. Throws
// InputError for a file that cannot be read, for a scene without a view, and for a number beyond the range of the
// arithmetic.
void prepare_scene(const std::string &name, const SceneFile &file, const Options &options, int64_t frame,
                   PreparedScene &prepared);

} // namespace wisp
