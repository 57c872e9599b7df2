// Surfaces of a scene in the units of the core. Lengths are multiplied by a power of two, so that the static triangles
// reach from about -2048 to 2048 (less where lights, the camera or smoke are far away). Positions are relative to the
// centre of the static triangles. Each instance has a space of its own, with a centre and a scale of its own.
#pragma once
#include "host/images/texture.h"
#include "host/prepare/core_units.h"
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

    // The unit in which the static triangles reach that far, and half their largest edge in the units of the file.
    const Unit &own_unit() const { return own_; }
    double reach() const { return reach_; }
    // Changes to another unit, of the same centre, for the frames from here on.
    void change_unit(const Unit &unit);

    double radius() const { return radius_ * unit_.scale; } // of a sphere around the static triangles

  private:
    Unit own_, unit_;
    double reach_, radius_;

    Shapes shapes_;            // static and instances' triangles normalised; the rest in the units of the file
    std::vector<Unit> spaces_; // of instances
    std::vector<Instance> instances_;
    std::vector<Material> materials_;
    std::vector<TexturePyramid> images_;
    std::vector<Texture> textures_;
};

} // namespace wisp
