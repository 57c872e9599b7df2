// Surfaces of a scene in the units of the core: lengths multiplied by a power of two, so that the still triangles reach
// from about -2048 to 2048 (from less where lights or the camera are far out), and positions relative to their middle.
// Bodies have spaces of their own that are scaled like the world.
#pragma once
#include "host/images/texture.h"
#include "host/prepare/pose.h"
#include "host/scene/scene_file.h"

namespace wisp {

struct PreparedSurfaces {
    // Once a scene; pictures of textures are read. `start`: the time of the first frame of the whole animation. Throws
    // InputError as pose.h and texture.h do.
    PreparedSurfaces(const std::string &name, const SceneFile &file, double start);

    // Moves bodies and morphs to where they are at a time. Throws InputError where one is far outside.
    void pose(const std::string &name, const SceneFile &file, double time);

    // What the core asks for; radiances are multiplied by `dim`.
    void show(Scene &scene, const SceneFile &file, double dim);

    Double3 center;
    double scale, radius; // normalised: of a sphere around the still triangles

  private:
    struct Space { // of a body: p' = (p - center) * scale
        Double3 center;
        double scale;
    };
    void normalize(Triangle &triangle, const Space &space) const;

    Shapes shapes_; // still triangles and those of bodies normalised, bodies and morphs as posed
    std::vector<Space> spaces_;
    std::vector<Instance> instances_;
    std::vector<Material> materials_;
    std::vector<TexturePyramid> images_;
    std::vector<Texture> textures_;
};

} // namespace wisp
