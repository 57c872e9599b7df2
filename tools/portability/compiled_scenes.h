// The scenes that are compiled into a program: WISP_SCENES is X(NAME) of each, see fixtures/compiled_scenes.txt.
#pragma once
#include "portability/compiled_scene.h"

namespace wisp {

#define X(name) extern const CompiledScene scene_##name;
WISP_SCENES
#undef X

#define X(name) &scene_##name,
constexpr const CompiledScene *scenes[] = {WISP_SCENES};
#undef X
constexpr int scene_count = sizeof scenes / sizeof *scenes;

} // namespace wisp
