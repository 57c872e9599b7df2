// A scene as its file says it: statements `v b l lp ls ld smoke render` in the units of the scene.
#pragma once
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
    };
    struct Transform { // p' = T R S p
        double scale = 1;
        Double3 axis = {0, 0, 1};
        double degrees = 0;
        Double3 translation = {0, 0, 0};
    };
    struct Box {
        Double3 low, high; // low < high
        double density;
    };
    struct Smoke {
        std::string file;         // as found from the working directory; `%04d` = number of the frame
        std::optional<Box> box;   // instead of a file
        std::string where;        // `FILE:LINE: ` of the statement
        std::string of_particles; // the last line that only particles can have, as `FILE:LINE: found 'radius'`
        Kernel kernel = Kernel::spline;
        std::optional<double> radius, mass;
        double extinction = 1;
        Double3 albedo = {0.9, 0.9, 0.9};
        double phase = 0;
        Double3 emission = {0, 0, 0};
        std::optional<Transform> transform;
        int64_t first_frame = 0, frame_step = 1; // frame i shows file first + i * step
    };
    struct Default {
        std::string option, value, where;
    };

    std::optional<View> view;
    Double3 background = {0, 0, 0};
    std::vector<Light> lights;
    std::vector<Smoke> smokes;
    std::vector<Default> defaults; // `render KEY VALUE`
};

// Throws InputError `FILE:LINE: what is wrong, what was expected`. Particle files are not opened.
SceneFile read_scene(const std::string &path);
SceneFile parse_scene(const std::string &path, const std::string &text);

} // namespace wisp
