// What a caller sees of the work as it goes on, and how the work ended.
#pragma once
#include <cstdint>

namespace wisp {

enum class Stage : uint8_t { trees, photons, irradiance, render };

enum class Status : uint8_t {
    done,
    stopped,
    out_of_memory,
    overflow,  // more photons than the sums of a particle map are sure to hold
    size_mismatch // of another number than this scene's particle map has
};

// Hears of the work as it goes: once as a stage begins (done = 0), then as parts of it are done. Returning false
// stops the work. It may look at a clock; the core does not.
struct Observer {
    void *context;
    bool (*heard)(void *context, Stage stage, uint64_t done, uint64_t total);

    bool operator()(Stage stage, uint64_t done, uint64_t total) const {
        return !heard || heard(context, stage, done, total);
    }
};

} // namespace wisp
