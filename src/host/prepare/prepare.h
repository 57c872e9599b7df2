// From a scene's file to what the core renders: one frame's particles and grids read, transformed,
// normalised and put in order.
#pragma once
#include "host/prepare/prepare_surfaces.h"
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
    std::vector<std::vector<float>> densities; // of grids
    std::vector<std::string> notes;            // what a user may want to know (-v)
    std::optional<PreparedSurfaces> surfaces;  // made by the first frame, for all
    int width = 0, height = 0;
    Double3 center = {0, 0, 0}; // p' = (p - center) * scale: from the units of the scene's file to the core's
    double scale = 1;
};

// How many frames the animation has, and when one is. Without a statement `a` all are at time 0.
int64_t frame_count_of(const SceneFile &file, const Options &options);
double time_of(const SceneFile &file, const Options &options, int64_t frame);

// Frame `frame` of the scene at path `name`. `prepared` is empty or holds another frame of the same scene. Throws
// InputError for particle files, for a scene without a view, and for one that does not fit the arithmetic: then the
// line says what does not.
void prepare_scene(const std::string &name, const SceneFile &file, const Options &options, int64_t frame,
                   PreparedScene &prepared);

} // namespace wisp
