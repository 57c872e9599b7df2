// The memory of the technique `exact`, open to tests.
#pragma once
#include "core/shadows/proved_shadows.h"
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

struct ProvedMemory {
    // With the room for a picture of 512 x 512 pixels.
    explicit ProvedMemory(const Scene &scene) {
        const Settings settings = small_settings(512);
        kept.resize(exact_technique.bytes(scene, settings));
        frame.resize(kept.size());
        Arena arena(kept.data(), kept.size());
        proved = static_cast<ProvedShadows *>(exact_technique.make(scene, settings, arena, {}));
        REQUIRE(proved);
    }
    // The room's shadows ask it from now on, in a new frame.
    void begin(Room &room) {
        room.shadows.technique = &exact_technique;
        room.shadows.memory = proved;
        Arena arena(frame.data(), frame.size());
        REQUIRE(begin_frame(room.shadows, {}, arena));
    }
    std::vector<unsigned char> kept, frame;
    ProvedShadows *proved;
};

} // namespace wisp::WISP_ARITH
