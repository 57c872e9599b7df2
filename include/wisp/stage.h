// The stages of a render, in the order of the table in src/core/render/stages.cpp, which says what each is for.
#pragma once
#include <cstdint>

namespace wisp {

enum class Stage : uint8_t {
    frame_cache, triangle_trees, lights, shadows, light_cuts, shading, // surfaces
    particle_tree, bricks, light_depths, photons, gather, irradiance, sources, // smoke
    majorants, march, camera_rays // the picture
};
constexpr uint32_t stage_count = 16;

} // namespace wisp
