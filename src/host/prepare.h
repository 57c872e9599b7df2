// From a scene's file to what the core renders: one frame's particles and grids read, transformed,
// normalised and put in order.
#pragma once
#include "host/options.h"
#include "host/scene_file.h"
#include <vector>

namespace wisp {

// A core scene and the memory behind its pointers. Not copied: the scene points into it.
struct PreparedScene {
    PreparedScene() = default;
    PreparedScene(const PreparedScene &) = delete;
    PreparedScene &operator=(const PreparedScene &) = delete;

    Scene scene = {};
    std::vector<LightSource> lights;
    std::vector<SmokeSource> smokes;
    std::vector<std::vector<Particle>> particles;
    std::vector<std::vector<float>> densities; // of grids
    std::vector<std::string> notes;            // what a user may want to know (-v)
    int width = 0, height = 0;
};

// Frame `frame` of the scene at path `name`. Throws InputError for particle files, for a scene without a view, and
// for one that does not fit the arithmetic: then the line says what does not.
void prepare_scene(const std::string &name, const SceneFile &file, const Options &options, int64_t frame,
                   PreparedScene &prepared);

} // namespace wisp
