// Surfaces of a scene in the units of the core. Lengths are multiplied by a power of two, so that the static triangles
// reach from about -2048 to 2048 (less where lights or the camera are far away). Positions are relative to the centre
// of the static triangles. Each instance has a space of its own, with a centre and a scale of its own.
#pragma once
#include "host/images/texture.h"
#include "host/prepare/pose.h"
#include "host/scene/scene_file.h"

namespace wisp {

struct PreparedSurfaces {
    // Made once for all frames; reads the textures. `start`: the time of the first frame of the whole animation. Throws
    // InputError as pose.h and texture.h do.
    PreparedSurfaces(const std::string &name, const SceneFile &file, double start);

    // Moves instances and deforming triangles to their places at a time. Throws InputError where one is beyond
    // coordinate_limit.
    void pose(const std::string &name, const SceneFile &file, double time);

    // Sets the surfaces of the core's scene; radiances are multiplied by `dim`.
    void show(Scene &scene, const SceneFile &file, double dim);

    Double3 center;
    double scale, radius; // of a sphere around the static triangles, normalised

  private:
    struct Space { // of an instance: p' = (p - center) * scale
        Double3 center;
        double scale;
    };
    void normalize(Triangle &triangle, const Space &space) const;

    Shapes shapes_; // static and instances' triangles normalised; the rest in the units of the file
    std::vector<Space> spaces_;
    std::vector<Instance> instances_;
    std::vector<Material> materials_;
    std::vector<TexturePyramid> images_;
    std::vector<Texture> textures_;
};

} // namespace wisp
