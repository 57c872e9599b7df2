// One frame of a scene as `scene_source` compiles it into a program that has no files.
#pragma once
#include "wisp/settings.h"
#include "wisp/wisp.h"

namespace wisp {

struct CompiledScene {
    const char *name; // of the scene's file, and the options that follow it
    int32_t width, height;
    Scene scene;
    Settings settings; // the crop is the whole picture
};

} // namespace wisp
