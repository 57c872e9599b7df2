// Fingerprints: SHA-256 of everything that a result depends on. A file that a later run reads carries the fingerprint
// of what it was made from, and is refused where that is another.
#pragma once
#include "wisp/scene.h"
#include "wisp/settings.h"
#include <string>

namespace wisp {

// Of the samples of `--reference`: the version, the arithmetic, the scene with its smoke, the crop, and the settings
// that samples depend on.
std::string fingerprint_of_samples(const Scene &scene, const Settings &settings, const std::string &arithmetic);

// Of the sums of a particle map: no picture or background, and nothing that only the march uses; of the camera only its
// place, and that only where the sums are of light towards it (Plan::Directions::to_eye).
std::string fingerprint_of_map(const Scene &scene, const Settings &settings, bool to_eye,
                               const std::string &arithmetic);

// Of the smoke structures that the core keeps from frame to frame: the smokes, the lights, and the spacings of the
// grids.
std::string fingerprint_of_smoke(const Scene &scene, const Settings &settings, const std::string &arithmetic);

// Of what is the same in every frame: the static triangles, those of instances in their own space, materials, textures.
std::string fingerprint_of_shapes(const Scene &scene);

// Of a frame's whole picture, width x height, whatever crop of it is rendered: everything but the crop.
// `shapes` is fingerprint_of_shapes() of any frame.
std::string fingerprint_of_picture(const Scene &scene, const std::string &shapes, const Settings &settings, int width,
                                   int height, const std::string &arithmetic);

} // namespace wisp
