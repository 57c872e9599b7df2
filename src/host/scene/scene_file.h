// A scene file with the files that it includes: NFF and AFF, and statements of our own. Everything is in the units of
// the scene.
#pragma once
#include "host/scene/scene_graph.h"
#include "host/scene/scene_tokens.h"
#include "wisp/scene.h"
#include <optional>
#include <string>
#include <vector>

namespace wisp {

struct SceneFile {
    struct View {
        Double3 from, at, up;
        double angle; // degrees, from the centre of the top pixel row to the centre of the bottom one
        int width, height;
    };
    struct Light {
        LightKind kind;
        Double3 position, direction;
        double degrees; // a spot's full cone angle
        Double3 color;
        std::string name = {}; // of `la`: the motion of this name adds to the position
    };
    struct Animation { // frame i is at start + i (end - start) / (frames - 1)
        double start, end;
        int64_t frames;
    };
    struct Box {
        Double3 low, high; // low < high
        double density;
    };
    struct SmokeVolume {
        std::string file;       // as found from the working directory; `%04d` = number of the frame
        std::optional<Box> box; // instead of a file
        std::string grid;       // of the grids in the file; empty: `density`, or the only one
        std::string where;      // `FILE:LINE` of the statement
        struct {
            std::string where, key; // empty: none
        } of_particles;             // the last line that only particles can have
        Kernel kernel = Kernel::spline;
        std::optional<double> radius, mass;
        bool chosen_radius = false, chosen_mass = false; // for what the file of the first frame leaves out
        std::optional<double> extinction; // 1, where the mass is known
        Double3 albedo = {0.9, 0.9, 0.9};
        double phase = 0;
        Double3 emission = {0, 0, 0};
        // The space of the file or box; -1: the world. All nodes around it are `xs` of one scale above 0.
        int32_t node = -1;
        int64_t first_frame = 0, frame_step = 1; // frame i shows file first + i * step

        std::string path(int64_t frame) const; // of the file
    };
    struct Default {
        std::string option, value, where;
    };

    std::optional<View> view;
    Double3 background = {0, 0, 0}, ambient = {1, 1, 1};
    std::optional<Animation> animation;
    std::vector<Light> lights; // in the space of the world
    std::vector<SmokeVolume> smokes;
    SceneGraph graph;
    std::vector<Default> defaults;     // `render KEY VALUE`
    std::vector<std::string> included; // the files of `i` that were read
};

// Throws InputError `FILE:LINE: what is wrong, what was expected`. Included files are read; particles, grids and
// textures are not.
SceneFile read_scene(const std::string &path);
SceneFile parse_scene(const std::string &path, const std::string &text, const FileReader &read = read_plain_file,
                      const SceneLimits &limits = {});

} // namespace wisp
