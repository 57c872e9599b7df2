// What a picture is a picture of: files that a later run goes on from are bound to it.
#pragma once
#include "wisp/scene.h"
#include "wisp/settings.h"
#include <string>

namespace wisp {

// SHA-256 of the version, the arithmetic, the scene with its smoke, and the settings that samples of `--reference`
// depend on.
std::string fingerprint_of_samples(const Scene &scene, const Settings &settings, const std::string &arithmetic);

// The same of the photons of a particle map: no camera, picture or background, and nothing that only marching uses.
std::string fingerprint_of_map(const Scene &scene, const Settings &settings, const std::string &arithmetic);

// The same of what the core keeps of smoke from frame to frame: the smokes, the lights, and the steps of what is kept.
std::string fingerprint_of_smoke(const Scene &scene, const Settings &settings, const std::string &arithmetic);

// The same of what never changes from frame to frame: triangles that keep their form, materials, textures.
std::string fingerprint_of_shapes(const Scene &scene);

// The same of a frame's whole picture, width x height, whatever part of it is rendered: everything but the crop.
// `shapes` is fingerprint_of_shapes() of any frame.
std::string fingerprint_of_picture(const Scene &scene, const std::string &shapes, const Settings &settings, int width,
                                int height, const std::string &arithmetic);

} // namespace wisp
