// What is likely a mistake of a scene, though it can be rendered: smoke and surfaces that the camera does not see, that
// nothing lights, or that are not there.
#pragma once
#include "host/base/messages.h"
#include "host/prepare/prepare.h"

namespace wisp {

// Of one frame. `name` is the scene's file. There are none where a doubt remains: what is warned of is so.
std::vector<Warning> scene_warnings(const std::string &name, const SceneFile &file, const Options &options,
                                    int64_t frame, const PreparedScene &prepared);

// Whether an opaque triangle, or the box around one, meets the box of all smoke, of which 5 % are left out at each
// side: a floor below the smoke does not.
bool stands_in_smoke(const Scene &scene);

// Whether the picture shows a light behind the smoke, or in it: whether the straight line from the eye to a light is
// within the picture, meets the box around all smoke, and no opaque triangle.
bool shows_light_through_smoke(const PreparedScene &prepared);
// Whether a point light or spot and the eye are in smoke, nearer to each other than `distance`.
bool holds_light_at_eye(const Scene &scene, double distance);

// Optical depths along straight lines through a smoke, each averaged over the width of a support or of a cell: the
// largest of all along the axes, and the mean along the axis on which that is least. 0 where there is nothing.
struct DepthRange {
    double least_mean, largest;
};
DepthRange depths_through(const SmokeDescription &smoke);

} // namespace wisp
