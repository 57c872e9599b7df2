// The stages of the work, how far it is, and how it ended.
#pragma once
#include <cstdint>

namespace wisp {

// The stages of a render, in the order of the table in src/core/render/stages.cpp, which says what each is for.
// clang-format off
enum class Stage : uint8_t {
    frame_cache, triangle_trees, lights, shadows, light_cuts, shading,          // surfaces
    particle_tree, bricks, light_depths, photons, gather, irradiance, sources,  // smoke
    majorants, march, layers, camera_rays                                       // the picture
};
// clang-format on
constexpr uint32_t stage_count = 17;

enum class Status : uint8_t {
    done,
    stopped, // by the observer
    out_of_memory,
    overflow,      // more photons than the sums of a particle map are sure to hold
    size_mismatch, // the photon sums are not as many numbers as this scene's particle map has
    missing_part   // Plan::missing
};

// Called as each stage begins (done = 0), and as parts of it are done; with each row of a picture, from the top. False
// stops the work. nullptr: nobody is called.
struct Observer {
    void *context;
    bool (*on_progress)(void *context, Stage stage, uint64_t done, uint64_t total);
    bool (*on_row)(void *context, int32_t y, const float *rgb) = nullptr;

    bool operator()(Stage stage, uint64_t done, uint64_t total) const {
        return !on_progress || on_progress(context, stage, done, total);
    }
};

} // namespace wisp
